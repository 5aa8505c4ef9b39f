"""What a table assumes of its contexts, read for coverage: its `assume`, and that derived facts are what they are computed as.

What boxes can tell is left out of the space, exactly. The rest is left to a `Drawer`: it draws contexts that can happen, so that
shares are estimates.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from contextdb.cells.arguments import require_kind, require_many
from contextdb.cells.conditions import Condition
from contextdb.compiled.data import CompiledData
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.covering.draw import Drawer
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.ruled import RuledTable, without_rules
from contextdb.covering.space import CellBox, Space, WeightsOf, comparable_rows, require_comparable, used_factors
from contextdb.expressions import Assumptions, Derivation, Expression
from contextdb.expressions.assume import WANTS, read_assumptions
from contextdb.expressions.expression import read_expression
from contextdb.expressions.tokens import ExpressionError, written_name
from contextdb.schema.settings import derivation_of
from contextdb.tables.data import TableData
from contextdb.tables.table import EitherTable

Size = Literal["comparable", "cut", "any"]


@dataclass(frozen=True, eq=False)
class Opened:
    """A table ready to be measured."""

    compiled: CompiledData
    table: EitherTable | None
    """None where a compiled table was given: it has no lines and no assumptions."""
    space: Space
    drawer: Drawer | None
    assumptions: tuple[str, ...] = ()
    """What was taken into account, as contextdb.toml has it."""
    sampled: tuple[str, ...] = ()
    """What of it only samples know."""
    ruled: RuledTable | None = None
    """What the rules of the table have become; None where a compiled table was given."""


def opened(
    table: EitherTable | CompiledTable,
    impossible: Sequence[CellBox] = (),
    weights: WeightsOf | None = None,
    assume: bool = True,
    progress: Progress = SILENT,
    size: Size = "comparable",
) -> Opened:
    """A table with its space; see `contextdb.covering.coverage` for the arguments and what is raised.

    A table whose rows are too many to be compared is refused, or cut to those that can be, or left whole, by `size`.
    """
    require_kind(table, (TableData, CompiledTable), "table", "a Table, or a CompiledTable")
    if isinstance(table, CompiledTable):
        data = data_of(table)
        data.refuse_rules("what they leave is worked out from the table itself")
        return Opened(data, None, _space(data, impossible, weights, progress, size), None)
    ruled = without_rules(table.flat())
    table = ruled.table
    compiled = data_of(table.compile())
    impossible = list(require_many(impossible, "impossible", "a list of mappings of conditions to cells"))
    if not assume and not ruled.rules:
        return Opened(compiled, table, _space(compiled, impossible, weights, progress, size), None, ruled=ruled)
    assumed = assumptions_of(table if assume else replace(table, settings=replace(table.settings, assume=())))
    nothing: list[CellBox] = [{}] if assumed.contradictions else []  # a box without cells: no context can happen
    space = _space(compiled, [*impossible, *assumed.boxes, *nothing], weights, progress, size)
    texts = tuple(expression.text for expression in assumed.expressions)
    restricted = _restricted(space)
    drawn = [c for c in not_boxed(table, assumed) if c.name in restricted]
    named = [c.name for expression in assumed.unboxed for c in expression.conditions]
    derivation = derivation_of(table.schema, [*(c.name for c in compiled.conditions), *named])
    unboxed = _that_matter(assumed.unboxed, derivation, restricted)
    if not drawn and not unboxed:
        return Opened(compiled, table, space, None, texts, ruled=ruled)
    names = (c.name if c.name in ruled.rules else f"{c.name} = {c.expr}" for c in drawn)
    sampled = (*names, *(expression.text for expression in unboxed))
    return Opened(compiled, table, space, Drawer(space, derivation, unboxed), texts, sampled, ruled)


def _space(
    compiled: CompiledData, impossible: Sequence[CellBox], weights: WeightsOf | None, progress: Progress, size: Size
) -> Space:
    if size != "cut":
        require_comparable(compiled, size == "any")
    return Space.of(compiled, impossible, weights, progress, comparable_rows(compiled) if size == "cut" else None)


def _restricted(space: Space) -> set[str]:
    """The conditions that some row, or some context that cannot happen, restricts."""
    used = set(used_factors(space.boxes + space.impossible, space.full))
    return {c.name for c, factors in zip(space.conditions, space.of_condition, strict=True) if used.intersection(factors)}


def _that_matter(unboxed: Sequence[Expression], derivation: Derivation | None, restricted: Iterable[str]) -> tuple[Expression, ...]:
    """The assumptions that have to do with what rows restrict, if only through others; the rest changes no share."""
    linked = _with_inputs(restricted, derivation)
    left, names = list(unboxed), set[str]()
    while near := [e for e in left if not linked.isdisjoint(_with_inputs(e.names, derivation))]:
        left = [e for e in left if e not in near]
        names |= {e.text for e in near}
        linked |= _with_inputs((name for e in near for name in e.names), derivation)
    return tuple(e for e in unboxed if e.text in names)


def _with_inputs(names: Iterable[str], derivation: Derivation | None) -> set[str]:
    """Some facts, and those that they are computed from."""
    own = set(names)
    return own if derivation is None else own | {n for step in derivation.only(own).steps for n in step.expression.names}


def not_boxed(table: EitherTable, assumed: Assumptions) -> Iterator[Condition]:
    """The derived conditions of a table that no boxes over its conditions tell."""
    names = {column.condition.name for column in table.conditions}
    texts = {e.text for e in assumed.derived if all(box.keys() <= names for box in e.as_boxes(False) or ())}
    for column in table.conditions:
        condition = column.condition
        if condition.expr and f"{written_name(condition.name)} == ({condition.expr})" not in texts:
            yield condition


def assumptions_of(table: TableData) -> Assumptions:
    """The assumptions of a table, as its settings in contextdb.toml say, and what its derived bools imply. Raises ExpressionError
    where an assumption names what is neither a condition of the table nor declared."""
    conditions = [column.condition for column in table.conditions]
    assumed = read_assumptions(table.settings.assume, conditions, table.schema.conditions)
    derived = [_definition(c, table.schema.conditions) for c in conditions if c.expr and c.domain.type.is_truth]
    return replace(assumed, derived=tuple(e for e in derived if e is not None and e.as_boxes(False) is not None))


def _definition(condition: Condition, declared: Mapping[str, Condition]) -> Expression | None:
    """That a derived bool is what it is computed as; None where that is too long or too deep to be written."""
    try:
        return read_expression(f"{written_name(condition.name)} == ({condition.expr})", declared, WANTS)
    except ExpressionError:
        return None
