"""Two tables under one set of conditions, so that their contexts are the same; for `contextdb.checks.effects`.

A condition is as the table after declares it, else as the one before does. Where no table declares values or bounds, every table
made here has rows that are switched off and hold all texts of both, so that contexts are the same whichever rows are requested.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.facts import cell
from contextdb.cells.grammar import format_cell, parse_cell
from contextdb.cells.sets import Cell, NumberSet, ValueSet
from contextdb.columns import TextColumn
from contextdb.compiled.table import CompiledTable
from contextdb.errors import Fault, Place, TableError, in_quotes
from contextdb.schema.settings import Schema, TableSettings
from contextdb.tables.table import EitherTable, Table

Cells = dict[str, str]
"""A box: condition to cell; what is left away is not restricted."""
Piece = tuple[EitherTable, Sequence[int] | NDArray[np.int64]] | list[Cells]
"""Rows of a table, by number, or boxes."""
Rows = Sequence[Piece]
MOST_SPAN = 100
KEPT = ("priority", "weight")


@dataclass(frozen=True, eq=False)
class Shared:
    """The conditions of two tables."""

    before: EitherTable
    after: EitherTable
    conditions: dict[str, Condition]
    schema: Schema
    asset: str
    enabled: str
    """Names of columns, which no condition has."""

    def column(self, table: EitherTable, name: str) -> TextColumn:
        """A column of a table; empty cells where it has none."""
        match = next((c for c in table.columns if c.name == name), None)
        return match or TextColumn(name, ("",), np.zeros(table.n_rows, np.int32))

    def table(self, rows: Rows) -> EitherTable:
        """A table of these rows and boxes, under the conditions of both; rows that are switched off come last."""
        n_rows = sum(len(piece) if isinstance(piece, list) else len(piece[1]) for piece in rows)
        span = self._span
        n_span = max(map(len, span.values()), default=0)
        texts = {name: [*self._texts(rows, name), *_padded(span.get(name, ()), n_span)] for name in self.conditions}
        texts |= {name: [*self._texts(rows, name), *[""] * n_span] for name in self._jobs}
        texts[self.asset] = [f"row {i}" for i in range(n_rows + n_span)]
        texts[self.enabled] = [*self._enabled(rows), *["False"] * n_span]
        columns = [TextColumn.of(name, texts[name]) for name in (self.asset, self.enabled, *self.conditions, *self._jobs)]
        return Table.build(self.after.name, columns, self.schema, self._settings)

    def boxes(self, table: EitherTable, rows: Sequence[int]) -> list[Cells]:
        """What rows of a table hold, as boxes of cells; each once."""
        columns = [(name, self.column(table, name)) for name in self.conditions]
        rows_of_cells = ({name: column[row] for name, column in columns} for row in rows)
        closed = ({name: text for name, text in cells.items() if not self._is_open(name, text)} for cells in rows_of_cells)
        return list({tuple(cells.items()): cells for cells in closed}.values())

    def _is_open(self, name: str, text: str) -> bool:
        """Whether a cell accepts everything; a soft one does."""
        read = parse_cell(text, self.conditions[name].domain)
        return read.is_any or read.is_soft

    def compiled(self, table: EitherTable) -> CompiledTable:
        """A whole table under these conditions, nothing computed."""
        plain = {name: replace(c, expr=None) for name, c in self.conditions.items()}
        own = replace(self, conditions=plain, schema=replace(self.schema, conditions=plain))
        return own.table([(table, range(table.n_rows))]).compile()

    def meeting(self, compiled: CompiledTable, cells: Cells) -> NDArray[np.int64]:
        """The rows that are valid somewhere in a box, or nearly so."""
        return compiled.query({name: cell(text) for name, text in cells.items()}, unknown="any").indices

    @cached_property
    def _jobs(self) -> dict[str, str]:
        """The columns of priorities and weights, by name, that any of the tables has."""
        names = {c.name for table in (self.before, self.after) for c in table.columns}
        wanted = {getattr(self.after.settings, job): job for job in KEPT}
        return {name: job for name, job in wanted.items() if name in names}

    @cached_property
    def _settings(self) -> TableSettings:
        was = self.after.settings
        jobs = {job: name for name, job in self._jobs.items()}
        return TableSettings(
            was.name,
            asset=self.asset,
            enabled=self.enabled,
            priority=jobs.get("priority"),
            weight=jobs.get("weight"),
            policy=was.policy,
            assume=was.assume,
        )

    @cached_property
    def _span(self) -> dict[str, list[str]]:
        """Of the conditions whose values or bounds nobody declares, texts that name all of them."""
        loose = [condition for condition in self.conditions.values() if _is_loose(condition.domain)]
        return {c.name: _spanning(self._all_texts(c.name), c.domain) for c in loose}

    def _all_texts(self, name: str) -> list[str]:
        return sorted({text for table in (self.before, self.after) for text in self.column(table, name).texts})

    def _texts(self, rows: Rows, name: str) -> Iterator[str]:
        for piece in rows:
            if isinstance(piece, list):
                yield from (box.get(name, "") for box in piece)
            else:
                column = self.column(piece[0], name)
                yield from (column[row] for row in piece[1])

    def _enabled(self, rows: Rows) -> Iterator[str]:
        for piece in rows:
            yield from ["True"] * len(piece) if isinstance(piece, list) else (str(bool(piece[0].enabled[r])) for r in piece[1])


def shared_space(before: EitherTable, after: EitherTable) -> Shared:
    """The conditions of two tables together. Raises TableError where cells cannot be read, or a column is of another type before
    than after."""
    if faults := [fault for table in (before, after) for fault in table.faults]:
        raise TableError(*faults)
    conditions = dict(_conditions(before, after))
    names = {*conditions, *(c.name for table in (before, after) for c in table.columns)}
    schema = replace(after.schema, conditions={**before.schema.conditions, **after.schema.conditions, **conditions})
    return Shared(before, after, conditions, schema, _free("asset", names), _free("enabled", names))


def _conditions(before: EitherTable, after: EitherTable) -> Iterator[tuple[str, Condition]]:
    old, new = ({c.condition.name: c.condition for c in table.conditions} for table in (before, after))
    for name in [*new, *(name for name in old if name not in new)]:
        if name not in old or name not in new:
            yield name, (new if name in new else old)[name]
            continue
        one, other = old[name], new[name]
        kinds = [c.domain.kind for c in (one, other)]
        if one.is_declared and other.is_declared and kinds[0] != kinds[1]:
            problem = f"{in_quotes(name)} is of the type {kinds[0]} before and of the type {kinds[1]} after."
            raise TableError(Fault(problem, place=Place(str(after.path) if after.path else None)))
        known = other if other.is_declared or not one.is_declared else one
        yield name, replace(known, domain=_widened(known.domain, one.domain)) if one.is_declared else known


def _widened(domain: Domain, other: Domain) -> Domain:
    """A domain with the values that another one declares too."""
    if domain.values is None or other.values is None:
        return domain
    return replace(domain, values=(*domain.values, *(v for v in other.values if v not in domain.known)))


def _is_loose(domain: Domain) -> bool:
    if domain.type.is_bounded:
        return not (np.isfinite(domain.minimum) and np.isfinite(domain.maximum))
    return not domain.type.is_numeric and domain.everything is None


def _spanning(texts: Sequence[str], domain: Domain) -> list[str]:
    """Few texts with the same values or bounds as many."""
    sets = [cell.accepts for cell in (parse_cell(text, domain) for text in texts)]
    if domain.type.is_numeric:
        ends = [end for each in sets if isinstance(each, NumberSet) for span in each.spans for end in span if np.isfinite(end)]
        return [domain.type.spelling.write(end) for end in sorted({min(ends), max(ends)})] if ends else []
    if domain.type.is_tags:
        return list(texts[:MOST_SPAN])
    values = frozenset(value for accepted in sets if isinstance(accepted, ValueSet) for value in accepted.values)
    return [format_cell(Cell(ValueSet(values)), domain)] if values else []


def _free(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "_"
    return name


def _padded(texts: Sequence[str], n: int) -> list[str]:
    return [*texts, *[""] * (n - len(texts))]
