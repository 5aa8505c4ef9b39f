"""Why rows are not valid in the test row's context: cell by cell, with the cell that would mend each.

The reasons for a row are those of `contextdb query --explain`, and two more that an editor meets: cells that cannot be
read, and rows that are disabled. Of a valid row they tell whether it is picked, in the words of `contextdb.compiled.pick`. For a
role with actors the fact is the actor who plays it, or the one whose fact is in the way.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from contextdb.cells.words import says_any
from contextdb.compiled.explain import mended
from contextdb.edits.edits import check_cell
from contextdb.errors import some
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.table import Table

from .query_row import QueryRow

NEEDED = "(needed)"
"""The text for the cell of a role that is not filled."""
State = Literal["fails", "unreadable", "disabled", "open", "holds", "not given"]
"""Of a cell that is open it is not known whether it holds: its rule lacks a fact, or it accepts some values of a set only."""


@dataclass(frozen=True, slots=True)
class CellWhy:
    """One cell of one row against its fact."""

    row: int
    """The row of the file, from 0."""
    column: str
    cell: str
    fact: str
    """Empty where the fact is not requested."""
    state: State
    mend: str | None = None
    """The cell with which the row would pass; None where there is nothing to mend, or no telling."""

    is_of_rule: bool = False
    """The cell is the row's own rule; the fact names the facts that it needs, where it is open, or says with which it fails."""

    is_cast: bool = False
    """The fact is the actor who plays the role of the condition."""

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
    doubt: str = ""
    """Why the row only may be valid: "may be valid: its rule needs target"."""
    standing: str = ""
    """Of a valid row: "picked, chance 40 %", "outranked by B (priority 5)"."""
    is_picked: bool = False
    """It is valid, and the policy may pick it."""

    @property
    def is_valid(self) -> bool:
        return self.n_wrong == 0

    @property
    def n_wrong(self) -> int:
        """How many of its cells keep it from being valid."""
        return sum(cell.is_wrong for cell in self.cells)


def why_row(query: QueryRow, table: Table, row: int) -> RowWhy:
    """Every condition of one row: those that fail first, then in the order of the table; a disabled row's switch before all."""
    fails = query.failing([row])[0].tolist()
    cells = [*_switch(table, row), *_rule(query, table, row), *_behind(query, table, row), *_roles(query, row)]
    cells += [_cell(query, c, row, wrong) for c, wrong in zip(table.conditions, fails, strict=True)]
    cells.sort(key=lambda cell: (not cell.is_wrong, cell.state != "open"))
    asset, is_picked = table.text(row, table.asset_column), bool(query.picked >> row & 1)
    return RowWhy(row, asset, tuple(cells), query.doubt(row), query.standing(row), is_picked)


def nearest_rows(query: QueryRow, table: Table, most: int = 20) -> list[RowWhy]:
    """The rows nearest to valid, each with the cells that keep it from being so."""
    rows = [why_row(query, table, row.row) for row in query.nearest(most)]
    return [RowWhy(why.row, why.asset, tuple(cell for cell in why.cells if cell.is_wrong)) for why in rows]


def _cell(query: QueryRow, column: ConditionColumn, row: int, fails: bool) -> CellWhy:
    condition, text, code = column.condition, column.texts[row], int(column.texts.codes[row])
    if query.role_of(condition.name) is not None:
        return _cast_cell(query, column, row)
    fact = query.facts.get(condition.name)
    fact_text = query.fact_text(condition)
    if code in column.faults:
        return CellWhy(row, condition.name, text, fact_text, "unreadable")
    if fact is None:
        lacking = query.lacking([condition.name]) if query.is_computed(condition.name) else ()
        return CellWhy(row, condition.name, text, f"needs {some(lacking)}" if lacking else "", "not given")
    if not fails:
        state: State = "holds" if query.accepts_every(condition.name, row) else "open"
        return CellWhy(row, condition.name, text, fact_text, state)
    return CellWhy(row, condition.name, text, fact_text, "fails", mended(text, fact, condition.domain))


def _cast_cell(query: QueryRow, column: ConditionColumn, row: int) -> CellWhy:
    """A cell on a role with actors."""
    name, text = column.condition.name, column.texts[row]
    if int(column.texts.codes[row]) in column.faults:
        return CellWhy(row, name, text, "", "unreadable")
    failure = next((f for f in query.failures(row) if f.condition == name), None)
    if failure is not None:
        return CellWhy(row, name, text, failure.fact, "fails", failure.mend)
    actor = query.casting(row).get(query.role_of(name) or "")
    if actor is None:
        return CellWhy(row, name, text, "", "not given")
    return CellWhy(row, name, text, actor, "holds", is_cast=True)


def _roles(query: QueryRow, row: int) -> Iterator[CellWhy]:
    """The roles that nobody is left for."""
    for failure in query.failures(row):
        if failure.cell == NEEDED:
            yield CellWhy(row, failure.condition, failure.cell, failure.fact, "fails")


def _rule(query: QueryRow, table: Table, row: int) -> Iterator[CellWhy]:
    name = table.settings.when
    if name is not None and table.when is not None and not says_any(text := table.text(row, name)):
        is_unread = check_cell(table, name, text) is not None
        lacking, failure = query.open_facts(row), next((f for f in query.failures(row) if f.condition == name), None)
        state: State = "fails" if query.excluded_by_rule([row])[0] else "holds" if lacking is None else "open"
        state = "unreadable" if is_unread else "not given" if query.is_empty else state
        lacking_text = some(lacking) if lacking else failure.fact if failure is not None else ""
        yield CellWhy(row, name, text, lacking_text, state, is_of_rule=True)


def _behind(query: QueryRow, table: Table, row: int) -> Iterator[CellWhy]:
    """The table that the row refers to."""
    if (inside := query.inside(row)) is not None:
        is_wrong = inside.fault is not None or inside.n_valid == 0
        state: State = "fails" if is_wrong else "not given" if inside.n_valid is None else "holds"
        yield CellWhy(row, table.asset_column, table.text(row, table.asset_column), f"{inside.text}", state)


def _switch(table: Table, row: int) -> Iterator[CellWhy]:
    enabled = table.settings.enabled
    if enabled is not None and not table.enabled[row]:
        yield CellWhy(row, enabled, table.text(row, enabled), "", "disabled", "True")
