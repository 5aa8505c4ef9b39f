"""A decision table of a DMN file as columns: inputs are conditions, outputs and annotations are data, the first output the asset.

A rule is a row. The hit policy becomes the table's policy. What a cell cannot say is kept as `= TEXT`, which no type reads, and is
told with its rule and column. A document type, and with it bombs and external entities, is refused before anything is parsed.

Source: OMG, Decision Model and Notation 1.3 to 1.5; `bpmn-io/dmn-js` for what editors write.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

from contextdb.columns import TextColumn
from contextdb.conditions import Condition
from contextdb.domains import BOOL, NUMBER, Domain
from contextdb.errors import Fault, Place, TableError, in_quotes, nearest, shown, some
from contextdb.exchange.encodings import decoded
from contextdb.exchange.feel import cell_of, string_of, value_of
from contextdb.exchange.reading import Reading, Remark, capped, listed
from contextdb.schema import Schema, TableSettings
from contextdb.source import name_faults

POLICIES: dict[str, Any] = {"UNIQUE": "unique", "FIRST": "first", "PRIORITY": "priority", "ANY": "collect", "COLLECT": "collect"}
PRIORITY = "Priority"
"""The column that holds what DMN tells by the order of the output's values."""
_LETTERS = {"U": "UNIQUE", "F": "FIRST", "P": "PRIORITY", "A": "ANY", "C": "COLLECT", "R": "RULE ORDER", "O": "OUTPUT ORDER"}
_VERSIONS = {"20151101": "1.1", "20180521": "1.2", "20191111": "1.3", "20211108": "1.4", "20230324": "1.5"}
_TYPE = re.compile(r"<!(?:DOCTYPE|ENTITY)", re.IGNORECASE)
_NAME = re.compile(r"[^\W\d][\w ]*(?:\.[^\W\d][\w ]*)*")
_STRINGS = re.compile(r'\s*"(?:[^"\\]|\\.)*"\s*(?:,\s*"(?:[^"\\]|\\.)*"\s*)*', re.DOTALL)
_STRING = re.compile(r'"(?:[^"\\]|\\.)*"', re.DOTALL)
_ACCEPTED = "a DMN file with a decision table"

Element = ElementTree.Element


@dataclass(frozen=True)
class _Column:
    """A column of the decision table: its name, what its type is called, the values it may have, and the texts of its entries."""

    name: str
    kind: str
    values: tuple[str, ...]
    entries: Sequence[str]


def read_dmn(raw: bytes, file: str, decision: str | None = None) -> Reading:
    """Read a decision table.

    Parameters
    ----------
    decision : str, optional
        The name or the id of the decision; default: the only one with a table.

    Raises
    ------
    TableError
        The file is no DMN, is broken, declares a document type, or has several tables of which none is named.
    """
    root = _parsed(raw, file)
    element, name = _chosen(root, decision, file)
    rules = _children(element, "rule")
    inputs = [_input(one, at, rules) for at, one in enumerate(_children(element, "input"))]
    outputs = [_output(one, at, rules, name) for at, one in enumerate(_children(element, "output"))]
    notes = [_annotation(one, at, rules) for at, one in enumerate(_children(element, "annotation"))] + _descriptions(rules)
    if not outputs:
        raise TableError(Fault("the decision table has no output.", "an output, which names the asset", place=Place(file)))
    policy, policy_remarks = _policy(element)
    if policy == "priority" and any(one.values for one in outputs[1:]):
        policy_remarks.append(
            Remark("the order of the first output's values gives the priorities; that of others is not kept.", is_loss=True)
        )
    conditions, lost = _conditions(inputs)
    data, lost_values = _data([*outputs, *notes])
    columns = [data[0], *conditions, *data[1:], *_priority(policy, outputs[0], data[0])]
    faults = [fault.at(Place(file)) for fault in name_faults([column.name for column in columns])]
    if faults:
        raise TableError(*faults)
    plain = tuple(column.name for column in data[1:])
    settings = TableSettings(name, asset=data[0].name, outputs=plain, policy=policy, priority=_priority_name(columns, policy))
    schema = Schema(conditions=_declared(inputs), tables={name: settings})
    remarks = (*_version(root), *policy_remarks, *_expressions(element), *capped([*lost, *lost_values], "such entries"))
    return Reading(tuple(columns), "dmn", remarks, schema, outputs=plain)


# ---- the document


def _parsed(raw: bytes, file: str) -> Element:
    text, _ = decoded(raw, file)
    if _TYPE.search(text):
        raise TableError(
            Fault("the file declares a document type or entities, which no DMN file does.", _ACCEPTED, place=Place(file))
        )
    try:
        root = ElementTree.fromstring(re.sub(r"^\s*<\?xml[^>]*\?>", "", text))
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        line = error.position[0] if isinstance(error, ElementTree.ParseError) else None
        raise TableError(
            Fault(f"this is no XML that can be read: {shown(str(error))}.", _ACCEPTED, place=Place(file, line))
        ) from None
    if _tag(root) != "definitions":
        raise TableError(Fault(f"this is no DMN: its root is <{shown(_tag(root))}>.", _ACCEPTED, place=Place(file)))
    return root


def _chosen(root: Element, wanted: str | None, file: str) -> tuple[Element, str]:
    """The decision table that is asked for, and its decision's name."""
    found = [
        (one, table) for one in root.iter() if _tag(one) == "decision" for table in one.iter() if _tag(table) == "decisionTable"
    ]
    names = [one.get("name") or one.get("id") or "decision" for one, _ in found]
    if wanted is not None:
        for (one, table), name in zip(found, names, strict=True):
            if wanted in (name, one.get("id")):
                return table, name
        near = nearest(wanted, names)
        fault = Fault(
            f"there is no decision table {in_quotes(wanted)}.", some(names) or "none", in_quotes(near) if near else "", Place(file)
        )
        raise TableError(fault)
    if not found:
        raise TableError(Fault("the file has no decision table.", _ACCEPTED, place=Place(file)))
    if len(found) > 1:
        said = f"the file has {len(found)} decision tables: {listed(names)}."
        raise TableError(Fault(said, "one of them", f"to name it: --sheet {in_quotes(names[0])}", Place(file)))
    return found[0][1], names[0]


def _version(root: Element) -> tuple[Remark, ...]:
    space = root.tag.partition("}")[0].lstrip("{")
    version = next((name for date, name in _VERSIONS.items() if date in space), None)
    return () if version else (Remark(f"the version of DMN is not known, {in_quotes(space)}; it is read as 1.3 to 1.5."),)


def _tag(element: Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _children(element: Element, tag: str) -> list[Element]:
    return [child for child in element if _tag(child) == tag]


def _text(element: Element | None) -> str:
    """The text of the <text> in an element."""
    found = next((child for child in element if _tag(child) == "text"), None) if element is not None else None
    return (found.text or "").strip() if found is not None else ""


def _entries(rules: Sequence[Element], tag: str, at: int) -> list[str]:
    entries = (_children(rule, tag) for rule in rules)
    return [_text(found[at]) if at < len(found) else "" for found in entries]


# ---- columns


def _input(element: Element, at: int, rules: Sequence[Element]) -> _Column:
    expression = next(iter(_children(element, "inputExpression")), None)
    said, label = _text(expression), (element.get("label") or "").strip()
    name = said if _NAME.fullmatch(said) else label or said or f"input {at + 1}"
    kind = _type(expression) if expression is not None else ""
    values = _text(next(iter(_children(element, "inputValues")), None))
    return _Column(name, kind, (values,) if values else (), _entries(rules, "inputEntry", at))


def _output(element: Element, at: int, rules: Sequence[Element], decision: str) -> _Column:
    name = element.get("name") or element.get("label") or (decision if at == 0 else f"output {at + 1}")
    values = _text(next(iter(_children(element, "outputValues")), None))
    found = tuple(string_of(literal) for literal in _STRING.findall(values))
    return _Column(name, _type(element), found, _entries(rules, "outputEntry", at))


def _type(element: Element) -> str:
    """The name of the type of an expression, without its prefix: feel:string is string."""
    return (element.get("typeRef") or "").rpartition(":")[2].lower()


def _annotation(element: Element, at: int, rules: Sequence[Element]) -> _Column:
    texts = _entries(rules, "annotationEntry", at)
    return _Column(element.get("name") or f"annotation {at + 1}", "annotation", (), texts)


def _descriptions(rules: Sequence[Element]) -> list[_Column]:
    """The descriptions of the rules, which some editors write in place of annotations, where there are any."""
    texts = [next(((one.text or "").strip() for one in _children(rule, "description")), "") for rule in rules]
    return [_Column("description", "annotation", (), texts)] if any(texts) else []


def _conditions(inputs: Sequence[_Column]) -> tuple[list[TextColumn], list[Remark]]:
    columns, lost = [], []
    for one in inputs:
        texts = []
        for rule, entry in enumerate(one.entries, 1):
            cell = cell_of(entry)
            if cell is None:
                lost.append(
                    Remark(f"{in_quotes(entry)} is no test that a cell can say; it is kept as text.", _place(rule, one.name), True)
                )
            texts.append(f"= {entry}" if cell is None else cell)
        columns.append(TextColumn.of(one.name, texts))
    return columns, lost


def _data(outputs: Sequence[_Column]) -> tuple[list[TextColumn], list[Remark]]:
    columns, lost = [], []
    for one in outputs:
        texts = []
        for rule, entry in enumerate(one.entries, 1):
            value = entry if one.kind == "annotation" else value_of(entry)
            if value is None:
                lost.append(Remark(f"{in_quotes(entry)} is an expression; it is kept as text.", _place(rule, one.name), True))
            texts.append(entry if value is None else value)
        columns.append(TextColumn.of(one.name, texts))
    return columns, lost


def _place(rule: int, column: str) -> str:
    return f"rule {rule}, column {in_quotes(column)}"


def _expressions(element: Element) -> list[Remark]:
    """Inputs that are worked out of others: the game must give such a fact itself."""
    remarks = []
    for one in _children(element, "input"):
        said, label = _text(next(iter(_children(one, "inputExpression")), None)), one.get("label")
        if said and not _NAME.fullmatch(said) and said != label:
            told = f"{in_quotes(said)} is an expression; as a column it is a fact that the game gives."
            remarks.append(Remark(told, f"input {in_quotes(label or said)}", True))
    return remarks


def _declared(inputs: Sequence[_Column]) -> dict[str, Condition]:
    """The conditions whose type the file tells for certain; others are judged by their cells."""
    domains = {one.name: _domain(one) for one in inputs}
    return {name: Condition(name, domain) for name, domain in domains.items() if domain is not None}


def _domain(one: _Column) -> Domain | None:
    if one.kind == "boolean":
        return BOOL
    if one.kind in ("number", "double", "decimal"):
        return NUMBER
    if one.kind in ("integer", "long"):
        return Domain("int")
    if one.values and _STRINGS.fullmatch(one.values[0]):
        return Domain("enum", tuple(dict.fromkeys(string_of(literal) for literal in _STRING.findall(one.values[0]))))
    return None


# ---- the hit policy


def _policy(element: Element) -> tuple[Any, list[Remark]]:
    said = (element.get("hitPolicy") or "UNIQUE").upper().strip()
    said = _LETTERS.get(said, said)
    policy = POLICIES.get(said, "collect")
    remarks = [Remark(f"the hit policy {said} becomes the policy {in_quotes(policy)}.")]
    if said not in POLICIES:
        order = {
            "RULE ORDER": "all valid rows come, in the order of the table",
            "OUTPUT ORDER": "the order of the outputs is not kept",
        }
        remarks = [
            Remark(f"the hit policy {said} becomes {in_quotes(policy)}: {order.get(said, 'it is not known')}.", is_loss=True)
        ]
    if aggregation := element.get("aggregation"):
        remarks.append(Remark(f"the aggregation {in_quotes(aggregation)} is not kept: assets are not added up.", is_loss=True))
    return policy, remarks


def _priority(policy: str, output: _Column, asset: TextColumn) -> list[TextColumn]:
    """The order of the output's values as a column of priorities, the first value the highest."""
    if policy != "priority" or not output.values:
        return []
    rank = {value: len(output.values) - at for at, value in enumerate(output.values)}
    return [TextColumn.of(PRIORITY, (str(rank.get(text, 0)) for text in asset.to_list()))]


def _priority_name(columns: Sequence[TextColumn], policy: str) -> str | None:
    return PRIORITY if policy == "priority" and columns[-1].name == PRIORITY else None
