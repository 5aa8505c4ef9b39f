"""Why rows are not valid in the test row's context: cell by cell, with the cell that would mend each.

What is said of a row is what `contextdb query --explain` says, with two reasons more that an editor meets: cells that cannot be
read, and rows that are disabled.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from contextdb.explain import describe_fact, mended
from contextdb.table import ConditionColumn, Table
from tui.model.query_row import QueryRow

State = Literal["fails", "unreadable", "disabled", "holds", "not asked"]


@dataclass(frozen=True, slots=True)
class CellWhy:
    """One cell of one row against its fact."""

    row: int
    """The row of the file, from 0."""
    column: str
    cell: str
    fact: str
    """Empty where the fact is not asked for."""
    state: State
    mend: str | None = None
    """The cell with which the row would pass; None where there is nothing to mend, or no telling."""

    @property
    def is_wrong(self) -> bool:
        """Whether the cell keeps the row from being valid."""
        return self.state in ("fails", "unreadable", "disabled")


@dataclass(frozen=True, slots=True)
class RowWhy:
    """One row against the context."""

    row: int
    asset: str
    cells: tuple[CellWhy, ...]

    @property
    def is_valid(self) -> bool:
        """Whether the row is valid."""
        return self.n_wrong == 0

    @property
    def n_wrong(self) -> int:
        """How many of its cells keep it from being valid."""
        return sum(cell.is_wrong for cell in self.cells)


def why_row(query: QueryRow, table: Table, row: int) -> RowWhy:
    """Every condition of one row: those that fail first, then in the order of the table; a disabled row's switch before all."""
    fails = query.failing([row])[0].tolist()
    cells = [*_switch(table, row), *(_cell(query, c, row, wrong) for c, wrong in zip(table.conditions, fails, strict=True))]
    return RowWhy(row, table.text(row, table.asset_column), tuple(sorted(cells, key=lambda cell: not cell.is_wrong)))


def nearest_rows(query: QueryRow, table: Table, most: int = 20) -> list[RowWhy]:
    """The rows nearest to valid, each with the cells that keep it from being so."""
    found = [why_row(query, table, row.row) for row in query.nearest(most)]
    return [RowWhy(why.row, why.asset, tuple(cell for cell in why.cells if cell.is_wrong)) for why in found]


def _cell(query: QueryRow, column: ConditionColumn, row: int, fails: bool) -> CellWhy:
    condition, text, code = column.condition, column.texts[row], int(column.texts.codes[row])
    fact = query.facts.get(condition.name)
    unit = f" {condition.unit}" if condition.unit and fact is not None else ""
    said = "" if fact is None else describe_fact(fact, condition) + unit
    if code in column.faults:
        return CellWhy(row, condition.name, text, said, "unreadable")
    if fact is None:
        return CellWhy(row, condition.name, text, said, "not asked")
    if not fails:
        return CellWhy(row, condition.name, text, said, "holds")
    return CellWhy(row, condition.name, text, said, "fails", mended(text, fact, condition.domain))


def _switch(table: Table, row: int) -> Iterator[CellWhy]:
    enabled = table.settings.enabled
    if enabled is not None and not table.enabled[row]:
        yield CellWhy(row, enabled, table.text(row, enabled), "", "disabled", "True")
