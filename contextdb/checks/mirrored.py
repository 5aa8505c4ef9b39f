"""What a check says of tables whose assets are played mirrored too: how facts change in the mirror, where nobody declared it.

inferred-mirror     angles, negated because that is what angles do in a mirror
undeclared-mirror   a condition with names of both sides that says nothing of a mirror, or changes places
                    with a condition that the table does not ask for, so that its facts stay as they are
uneven-mirror       a negated number whose min is not the opposite of its max; whoever plays it
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator

from contextdb.cells.conditions import Condition
from contextdb.cells.mirroring import SIDES, partner_of, sided_pairs, way_of
from contextdb.cells.sets import Cell, TagSet, ValueSet
from contextdb.cells.words import format_number
from contextdb.errors import some
from contextdb.files.toml_text import as_toml
from contextdb.findings import Finding
from contextdb.schema.settings import derivation_of
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import TableData, known_conditions
from contextdb.tables.nesting.links import reached


def check_mirroring(table: TableData) -> Iterator[Finding]:
    """What is to be said of one table."""
    conditions = _queried(table)
    for condition in conditions.values():
        if _is_uneven(condition):
            yield Finding("uneven-mirror", "warning", _uneven(condition), table.name, _file(table), column=condition.name)
    databases = _mirroring_databases(table)
    if not databases:
        return
    by = f"the database{'s' if len(databases) > 1 else ''} {some(databases)}"
    inferred = [c.name for c in conditions.values() if c.mirror is None and way_of(c) == "negate"]
    if inferred:
        message = f"{some(inferred)} {'is' if len(inferred) == 1 else 'are'} negated for mirrored clips of {by}, as angles are."
        yield Finding("inferred-mirror", "info", message, table.name, _file(table))
    columns = {c.condition.name: c for c in table.conditions}
    for condition in conditions.values():
        if (partner := partner_of(condition)) is not None and partner not in conditions:
            message = f"{partner} is not a column, so this fact stays as it is for mirrored clips of {by}."
            message += f" Try a column {partner}, Any in each row."
            yield Finding("undeclared-mirror", "info", message, table.name, _file(table), column=condition.name)
        pairs = _sides(condition, columns.get(condition.name)) or _other_sides(condition, conditions)
        if condition.mirror is None and condition.expr is None and pairs:
            message = f"no mirror is declared, so its facts stay as they are for mirrored clips of {by}."
            message += f' Try mirror = {as_toml(pairs)}, or "none".'
            yield Finding("undeclared-mirror", "info", message, table.name, _file(table), column=condition.name)


def _queried(table: TableData) -> dict[str, Condition]:
    """The conditions whose facts the table is queried with: its columns, those of rules, and the inputs of derived ones."""
    conditions = {c.condition.name: c.condition for c in table.conditions}
    if table.when is not None:
        known = known_conditions(table)
        conditions |= {name: known[name] for name in table.when.names if name in known}
    derivation = derivation_of(table.schema, conditions)
    return conditions | {c.name: c for c in (derivation.inputs if derivation is not None else ())}


def _mirroring_databases(table: TableData) -> list[str]:
    """The databases that play assets of the table mirrored: its own, and those of tables that it is in."""
    around = table.around or {}
    names = []
    for name, part in table.schema.databases.items():
        owner = part.get("table")
        if part.get("mirror") is True and isinstance(owner, str):
            outer = around.get(owner)
            if owner == table.name or (outer is not None and table.name in reached(outer, around)):
                names.append(name)
    return names


def _sides(condition: Condition, column: ConditionColumn | None) -> dict[str, str]:
    """The pairs of names of a condition that differ by their side alone."""
    if not condition.domain.type.is_swapped:
        return {}
    if condition.domain.values is not None or column is None:
        return sided_pairs(condition.domain.values or ())
    return sided_pairs(sorted({name for cell in column.cells for name in _names(cell)}))


def _other_sides(condition: Condition, conditions: Collection[str]) -> dict[str, str]:
    """The sides by which the name of a condition without names differs from another's."""
    if condition.domain.type.is_swapped or condition.domain.type.is_circular:
        return {}
    return next(
        ({a: b} for a, b in SIDES for one, other in ((a, b), (b, a)) if _is_other(condition.name, one, other, conditions)), {}
    )


def _is_other(name: str, one: str, other: str, conditions: Collection[str]) -> bool:
    return one in name and name.replace(one, other) in conditions


def _names(cell: Cell) -> frozenset[str]:
    accepts = cell.accepts
    if isinstance(accepts, TagSet):
        return accepts.needs | accepts.bans
    return frozenset(map(str, accepts.values)) if isinstance(accepts, ValueSet) else frozenset()


def _is_uneven(condition: Condition) -> bool:
    domain = condition.domain
    return condition.mirror == "negate" and domain.type.is_bounded and domain.minimum != -domain.maximum


def _uneven(condition: Condition) -> str:
    bounds = {"min": condition.domain.minimum, "max": condition.domain.maximum}
    low, high = (f"{key} {format_number(b)}" if math.isfinite(b) else f"no {key}" for key, b in bounds.items())
    return f'mirror = "negate", with {low} and {high}: the mirrored facts are outside the bounds.'


def _file(table: TableData) -> str | None:
    return str(table.path) if table.path else None
