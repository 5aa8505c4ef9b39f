"""A table with the rows of its inner tables in place of those that refer to them: the table that is compiled and measured.

Cells of one condition in the tables of a way must all hold; a row is enabled when every row of its way is. Columns of slots and
rules add up, of other outputs the innermost cell that is not empty counts. Nothing here touches the disk.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from contextdb import bitmask
from contextdb.cells.conditions import Condition
from contextdb.cells.outputs import SLOT_COLUMNS
from contextdb.columns import TextColumn
from contextdb.compiled.outputs import Outputs
from contextdb.compiled.table import CompiledTable
from contextdb.compiled.ways import Ways, WayTable
from contextdb.errors import Fault, Place, TableError, in_quotes
from contextdb.schema.settings import Schema, TableSettings
from contextdb.tables.compiling import compile_table
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import TableData, picking_of
from contextdb.tables.nesting.expansion import (
    NO_ROWS,
    Expansion,
    FlatColumn,
    declared_of,
    expand,
    flat_outputs,
    free_name,
    outputs_of,
    paths_and_leaves,
    rules_of,
)
from contextdb.tables.nesting.links import Neighbours, require_sound
from contextdb.tables.plain_columns import PlainColumns

Sources = Mapping[str, list[tuple[int, ConditionColumn]]]


@dataclass(frozen=True, eq=False, repr=False)
class FlatTable(TableData):
    """A table with its inner tables' rows; get one from `Table.flat()`. Its assets are paths, its row numbers those of matches."""

    expansion: Expansion = NO_ROWS
    leaves: tuple[str, ...] = ()
    """The asset of each row without its path."""
    switched_off: int = 0
    """Rows that are not enabled whatever their tables say, as bits."""

    @cached_property
    def _ways(self) -> Ways:
        """The way of each row, as a compiled table keeps it."""
        made_of = self.expansion
        layers = tuple(column.layers if isinstance(column, FlatColumn) else None for column in self.conditions)
        whens = [(n, t.when.texts) for n, t in enumerate(made_of.tables) if t.when is not None and any(t.when.rules)]
        rules = made_of.layers(whens) if whens else None
        tables = tuple(map(_way_table, made_of.names, made_of.tables))
        return Ways(tables, made_of.numbers, made_of.rows, self.leaves, layers, rules)

    @cached_property
    def faults(self) -> list[Fault]:
        """Nothing: the tables it is made of report what cannot be read."""
        return []

    @cached_property
    def _plain(self) -> PlainColumns:
        plain = _plain(self.expansion)
        off = bitmask.unpack(bitmask.from_int(self.switched_off, self.n_rows), self.n_rows)
        return replace(plain, enabled=plain.enabled & ~off)

    @cached_property
    def outputs(self) -> Outputs:
        """The outputs of all tables, to be read by flat row."""
        return flat_outputs(self.expansion, {c.name: c for c in self.columns if c.name in SLOT_COLUMNS})

    def place(self, row: int, column: str | None = None) -> Place:
        """Where the innermost row of a way stands; with a column, the innermost that has it."""
        steps = self._steps(row)
        having = [(t, r) for t, r in steps if column is None or any(c.name == column for c in t.columns)]
        table, inner = (having or steps)[-1]
        return table.place(inner, column)

    def places(self, row: int) -> list[Place]:
        """Where the rows of a way stand, outermost first."""
        return [table.place(inner) for table, inner in self._steps(row)]

    def _steps(self, row: int) -> list[tuple[TableData, int]]:
        numbers, rows = (of[:, row].tolist() for of in (self.expansion.numbers, self.expansion.rows))
        return [(self.expansion.tables[n], r) for n, r in zip(numbers, rows, strict=True) if n >= 0]

    def flat(self) -> FlatTable:
        return self

    def compile(self) -> CompiledTable:
        """Compile into masks, as `Table.compile`."""
        return CompiledTable(compile_table(self))


def _way_table(name: str, table: TableData) -> WayTable:
    file = str(table.path) if table.path else None
    settings = table.settings
    weights = table.row_weights
    return WayTable(name, file, settings.policy, table.priorities, weights, None, table, settings.when, picking_of(table))


def flatten(table: TableData, tables: Mapping[str, TableData]) -> FlatTable:
    """The flat table of a table whose inner tables are among some others. Raises TableError for inner tables that are missing or
    cannot be read, cycles, conditions of unlike types, or too many rows; with every fault."""
    last = tables.last if isinstance(tables, Neighbours) and isinstance(tables.last, FlatTable) else None
    expansion = _expansion(require_sound(table, tables), last)
    sources = _sources(expansion)
    conditions = _conditions(expansion, sources)
    columns = tuple(_column(expansion, conditions[name], layers, last) for name, layers in sources.items())
    taken = set(sources)
    asset, leaves = _assets(expansion, free_name(table.asset_column, taken), last)
    declared_of(expansion)
    outputs = outputs_of(expansion, taken)
    rules = rules_of(expansion, taken)
    settings = replace(
        TableSettings(table.settings.name, table.settings.file),
        asset=asset.name,
        outputs=tuple(c.name for c in outputs),
        fallback=table.settings.fallback,
        policy=table.settings.policy,
        assume=table.settings.assume,
        expected=table.settings.expected,
        owner=table.settings.owner,
        when=rules.name if rules else None,
    )
    texts = (asset, *outputs, *([rules] if rules else []), *(c.texts for c in columns))
    flat = FlatTable(
        name=table.name,
        settings=settings,
        columns=texts,
        conditions=columns,
        schema=_schema(expansion),
        path=table.path,
        origin=np.arange(expansion.n_rows),
        expansion=expansion,
        leaves=leaves,
    )
    if flat.when is not None and (unread := [_together(f).at(flat.place(row)) for row, f in flat.when.faulty_rows()]):
        raise TableError(*unread)
    if isinstance(tables, Neighbours):
        tables.last = flat
    return flat


def _together(fault: Fault) -> Fault:
    """A fault of the rules of a way, each of which can be read alone."""
    return replace(fault, found=f"the rules of this row and of those that refer to its table, combined: {fault.found}")


def _expansion(tables: Mapping[str, TableData], last: FlatTable | None) -> Expansion:
    """The flat rows; those of the last time where no asset cell has changed since."""
    was = last.expansion if last is not None else None
    if was is None or was.names != tuple(tables):
        return expand(tables)
    pairs = zip(was.tables, tables.values(), strict=True)
    is_same = all(old.text_column(old.asset_column) is new.text_column(new.asset_column) for old, new in pairs)
    return replace(was, tables=tuple(tables.values())) if is_same else expand(tables)


def _sources(expansion: Expansion) -> Sources:
    """For each condition of any of the tables its columns, with the numbers of the tables."""
    sources: dict[str, list[tuple[int, ConditionColumn]]] = {}
    for number, table in enumerate(expansion.tables):
        for column in table.conditions:
            sources.setdefault(column.condition.name, []).append((number, column))
    return sources


def _conditions(expansion: Expansion, sources: Sources) -> dict[str, Condition]:
    """The condition of each name; a column of Any alone, whose type is a guess, is of any type."""
    chosen: dict[str, Condition] = {}
    faults: list[Fault] = []
    for name, columns in sources.items():
        saying = [(n, c) for n, c in columns if c.condition.is_declared or not all(cell.is_any for cell in c.cells)]
        first, column = (saying or columns)[0]
        chosen[name] = column.condition
        faults += [
            _unlike(expansion, first, number, name, column.condition, other.condition)
            for number, other in saying
            if other.condition.domain != column.condition.domain
        ]
    if faults:
        raise TableError(*faults)
    return chosen


def _unlike(expansion: Expansion, first: int, number: int, name: str, one: Condition, other: Condition) -> Fault:
    here, there = (
        str(t.path) if t.path else f"the table {in_quotes(expansion.names[n])}" for n, t in _two(expansion, number, first)
    )
    is_kind = one.domain.kind != other.domain.kind
    problem = (
        f"is of type {other.domain.kind} here and of type {one.domain.kind}" if is_kind else "has other values or bounds here than"
    )
    place = Place(here, None, name)
    mend = "" if one.is_declared and other.is_declared else f"to declare it in contextdb.toml: [conditions.{name}]"
    accepted = "one type in all tables that contain each other"
    return Fault(f"the condition {problem} in {there}.", accepted, mend, place, "unlike-conditions")


def _two(expansion: Expansion, *numbers: int) -> list[tuple[int, TableData]]:
    return [(n, expansion.tables[n]) for n in numbers]


def _column(
    expansion: Expansion, condition: Condition, sources: list[tuple[int, ConditionColumn]], last: FlatTable | None
) -> FlatColumn:
    """A condition's column; that of the last time where nothing in it has changed."""
    is_same_rows = last is not None and last.expansion.rows is expansion.rows
    for known in last.conditions if last is not None and is_same_rows else ():
        if isinstance(known, FlatColumn) and known.condition == condition and _are_same(known.sources, sources):
            return known
    return FlatColumn.made(expansion, condition, sources)


def _are_same(some: Sequence[tuple[int, ConditionColumn]], others: Sequence[tuple[int, ConditionColumn]]) -> bool:
    return len(some) == len(others) and all(n == m and a is b for (n, a), (m, b) in zip(some, others, strict=True))


def _assets(expansion: Expansion, name: str, last: FlatTable | None) -> tuple[TextColumn, tuple[str, ...]]:
    """The assets of all rows; those of the last time where no row has changed since."""
    if last is not None and last.expansion.rows is expansion.rows:
        return last.text_column(last.asset_column).renamed(name), last.leaves
    return paths_and_leaves(expansion, name)


def _schema(expansion: Expansion) -> Schema:
    """What is declared for the tables: by the outer one's project, and for those of other projects by theirs."""
    outer = expansion.tables[0].schema
    more = [t.schema.conditions for t in expansion.tables[1:] if t.schema is not outer]
    if not more:
        return outer
    return replace(outer, conditions={**{n: c for known in reversed(more) for n, c in known.items()}, **outer.conditions})


def _plain(expansion: Expansion) -> PlainColumns:
    """Enabled where all of a way are; the outer row's priority; the product of the weights."""
    n_rows = expansion.n_rows
    enabled, weights = np.ones(n_rows, np.bool_), np.ones(n_rows)
    for number, table in enumerate(expansion.tables):
        for numbers, rows in zip(expansion.numbers, expansion.rows, strict=True):
            here = numbers == number
            enabled[here] &= table.enabled[rows[here]]
            weights[here] *= table.row_weights[rows[here]]
    return PlainColumns(enabled, expansion.tables[0].priorities[expansion.rows[0]], weights, ())
