"""A table as a DMN 1.3 decision table: conditions are inputs, the asset the first output, other columns further outputs.

An output of type bool, int, number or enum has its FEEL type, and an empty cell of it the default. What unary tests cannot say is
reported with its place: a row that can never match or is disabled is left out, a soft cell excludes nothing, a column of tags
becomes an annotation.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from xml.sax.saxutils import escape

from contextdb.cells.domains import NUMBER, Domain
from contextdb.cells.output_types import OutputValue
from contextdb.cells.outputs import Output
from contextdb.console import printable
from contextdb.errors import Fault, Place, TableError, in_quotes, row_name
from contextdb.exchange.feel import feel_number, feel_type, literal, unary_tests
from contextdb.exchange.reading import Remark, capped
from contextdb.schema.policies import POLICIES
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import output_columns_of, require_readable
from contextdb.tables.table import Table

NAMESPACE = "https://www.omg.org/spec/DMN/20191111/MODEL/"
_HEAD = '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>'
_NEVER = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff\ud800-\udfff]")
"""Characters that XML cannot hold."""


def write_dmn(table: Table) -> tuple[bytes, tuple[Remark, ...]]:
    """The DMN file of a table, and what could not be said in it. Raises TableError for cells that cannot be read, or texts that XML
    cannot hold."""
    require_readable(table)
    _require_xml(table)
    inputs = [column for column in table.conditions if not column.condition.domain.type.is_tags]
    tags = [column for column in table.conditions if column.condition.domain.type.is_tags]
    rows, remarks = _rows(table, inputs)
    outputs = [table.asset_column, *(name for name in _plain(table) if name != table.asset_column)]
    parts = [
        *(_input(column) for column in inputs),
        *(_output(at, name, table) for at, name in enumerate(outputs, 1)),
        *(f'<annotation name="{_attribute(column.condition.name)}"/>' for column in tags),
        *(_rule(table, row, inputs, outputs, tags) for row in rows),
    ]
    body = "\n      ".join(parts)
    hit_policy = (*POLICIES[table.settings.policy].dmn, "COLLECT")[0]
    text = (
        f'{_HEAD}\n<definitions xmlns="{NAMESPACE}" id="definitions" name="{_attribute(table.name)}" namespace="contextdb">\n'
        f'  <decision id="decision" name="{_attribute(table.name)}">\n'
        f'    <decisionTable id="table" hitPolicy="{hit_policy}">\n      {body}\n'
        "    </decisionTable>\n  </decision>\n</definitions>\n"
    )
    if match := _NEVER.search(text):
        problem = f"contextdb.toml declares a text with {in_quotes(match[0])}, a character that XML cannot hold."
        raise TableError(Fault(problem, "text without it"))
    return text.encode(), (*remarks, *_about(table, tags))


def _require_xml(table: Table) -> None:
    for column in table.columns:
        for text in (column.name, *column.texts):
            if _NEVER.search(text):
                problem = f"{in_quotes(text)} has a character that XML cannot hold."
                raise TableError(Fault(problem, "text without it", place=Place(column=printable(column.name))))


def _plain(table: Table) -> list[str]:
    """The columns that are not conditions; the enabled one shows in which rows are written."""
    conditions = {column.condition.name for column in table.conditions}
    return [c.name for c in table.columns if c.name not in conditions and c.name != table.settings.enabled]


def _rows(table: Table, inputs: Sequence[ConditionColumn]) -> tuple[list[int], tuple[Remark, ...]]:
    """The rows that become rules, and what is lost of others."""
    rows, remarks = [], []
    for row in range(table.n_rows):
        place = f"{row_name(row)}, {in_quotes(table.assets[row])}"
        empty = next((c.condition.name for c in inputs if c.cell(row).is_empty and not c.cell(row).is_soft), None)
        if not table.enabled[row] or empty is not None:
            why = "it is disabled" if empty is None else f"its cell of {in_quotes(empty)} accepts nothing"
            remarks.append(Remark(f"left out: {why}.", place, True, n_left_out=1))
            continue
        rows.append(row)
        remarks += [
            Remark(f"{in_quotes(c.texts[row])} becomes -: DMN has {why}.", f"{place}, column {in_quotes(c.condition.name)}", True)
            for c in inputs
            if unary_tests(c.cell(row), c.condition.domain) is None
            for why in ("no penalties" if c.cell(row).is_soft else "no infinite numbers",)
        ]
    return rows, capped(remarks, "losses")


def _attribute(text: str) -> str:
    """A text inside the quotes of an attribute."""
    return escape(text, {'"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"})


def _input(column: ConditionColumn) -> str:
    name, domain = _attribute(column.condition.name), column.condition.domain
    values = ",".join(map(literal, domain.values)) if domain.values else _bounds(domain)
    allowed = f"<inputValues><text>{_attribute(values)}</text></inputValues>" if values else ""
    expression = f'<inputExpression typeRef="{feel_type(domain.type)}"><text>{name}</text></inputExpression>'
    return f'<input label="{name}">{expression}{allowed}</input>'


def _bounds(domain: Domain) -> str:
    """The bounds of numbers as a unary test; nothing where there are none."""
    low, high = (None if math.isinf(end) else feel_number(end, domain.type) for end in (domain.minimum, domain.maximum))
    if low is None or high is None:
        return f">= {low}" if low is not None else f"<= {high}" if high is not None else ""
    return f"[{low}..{high}]"


def _output(number: int, name: str, table: Table) -> str:
    output = table.settings.output(name) or Output(name)
    values = ",".join(map(literal, output.values)) or _bounds(replace(NUMBER, minimum=output.minimum, maximum=output.maximum))
    allowed = f"<outputValues><text>{_attribute(values)}</text></outputValues>" if values and not output.type.has_size else ""
    default = literal(table.settings.fallback or "") if name == table.asset_column else _fallback(table, output)
    entry = f"<defaultOutputEntry><text>{_attribute(default)}</text></defaultOutputEntry>" if default not in ("", '""') else ""
    is_number = output.type.is_numeric and not output.type.has_size
    kind = "number" if is_number else "boolean" if output.type.choices else "string"
    return f'<output id="output_{number}" name="{_attribute(name)}" typeRef="{kind}">{allowed}{entry}</output>'


def _fallback(table: Table, output: Output) -> str:
    """What an output is where no rule holds, as far as the table's fallback says it."""
    value = dict(table.settings.fallback_outputs).get(output.name, output.default)
    return "" if value is None or not table.settings.fallback else _value(output, value)


def _entry(table: Table, row: int, name: str) -> str:
    """A cell that is no condition; empty, which means null, where it gives no value."""
    text, output = table.text(row, name), table.settings.output(name)
    if output is None:
        return literal(text)
    return "" if not text.strip() and output.needs_cell else _value(output, output.read(text, wants_mend=False))


def _value(output: Output, value: OutputValue) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float) and math.isinf(value):
        return ""
    return output.written(value) if isinstance(value, (int, float)) else literal(output.written(value))


def _rule(
    table: Table, row: int, inputs: Sequence[ConditionColumn], outputs: Sequence[str], tags: Sequence[ConditionColumn]
) -> str:
    entries = [("inputEntry", unary_tests(column.cell(row), column.condition.domain) or "-") for column in inputs]
    entries += [("outputEntry", _entry(table, row, name)) for name in outputs]
    entries += [("annotationEntry", column.texts[row]) for column in tags]
    return f"<rule>{''.join(f'<{tag}><text>{_attribute(text)}</text></{tag}>' for tag, text in entries)}</rule>"


def _about(table: Table, tags: Sequence[ConditionColumn]) -> Iterator[Remark]:
    """What DMN has no words for in the whole table."""
    for column in tags:
        message = "tags become an annotation, which excludes nothing: DMN has no tests of sets."
        yield Remark(message, f"column {in_quotes(column.condition.name)}", True)
    if any(column.condition.domain.type.is_circular for column in table.conditions):
        yield Remark("angles are written from -180 to 180; give the decision angles in this range.")
    if not POLICIES[table.settings.policy].dmn:
        message = f"the policy {in_quotes(table.settings.policy)} becomes COLLECT: DMN has none that prefers such rows."
        yield Remark(message, is_loss=True)
    for job in ("once", "cooldown_s", "cooldown_turns"):
        if name := getattr(table.settings, job):
            yield Remark("becomes an output: a decision does not remember what was picked.", f"column {in_quotes(name)}", True)
    yield from _about_outputs(table)
    if table.settings.policy == "priority":
        yield Remark("the priorities are an output; DMN orders by the list of output values instead.", is_loss=True)
    if table.settings.when:
        message = "its rules become an output, which excludes nothing: a cell of a decision table looks at one fact."
        yield Remark(message, f"column {in_quotes(table.settings.when)}", True)
    if table.settings.assume:
        yield Remark("assume is not kept: a decision table has no equivalent.", is_loss=True)


def _about_outputs(table: Table) -> Iterator[Remark]:
    """What FEEL has no words for in the types and values of outputs."""
    for column in output_columns_of(table):
        kind, place = column.output.type, f"column {in_quotes(column.output.name)}"
        if kind.has_size:
            yield Remark("lists of numbers become texts.", place, True)
        elif kind.is_whole:
            yield Remark("whole numbers become numbers: FEEL has one type for both.", place, True)
        if any(isinstance(value, float) and math.isinf(value) for value in column.values):
            yield Remark("infinite numbers become empty: FEEL has none.", place, True)
