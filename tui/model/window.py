"""The part of a sheet that is on the screen, read once and then painted line by line."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from contextdb.cells.sets import Cell
from contextdb.tables.condition_column import ConditionColumn

from .alignment import indented
from .displayed_table import DisplayedTable

Kind = Literal["text", "any", "inherited", "failing", "fault"]
"""How a cell is meant: it accepts everything; it is that of the base; it does not accept its fact; it cannot be read."""

MARKS: dict[Kind, str] = {"text": " ", "any": " ", "inherited": " ", "failing": "×", "fault": "!"}
"""What is before the text of a cell, so that no colour is needed to tell them apart."""


PICKED, VALID, MAY_BE = "◉", "●", "◐"
"""What is next to a valid row: the policy may pick it; it picks others; it is not known whether the row is valid."""
PLAYS = "▶"
"""Stands before that sign where a game that is followed has picked the row."""


@dataclass(frozen=True, slots=True)
class WindowRow:
    """A row on the screen: what the gutter says of it."""

    number: int
    """Its place in the file, from 1."""
    is_enabled: bool
    is_valid: bool
    """For a test row that asks for something."""
    is_undecided: bool = False
    """It only may be valid."""
    is_picked: bool = False
    """It is valid, and the table's policy may pick it."""
    n_failing: int = 0
    """How many of its cells do not accept their fact."""
    is_played: bool = False
    """A game that is followed has picked it."""
    standing: str = ""
    """The chance that it is picked, or what outranks it; empty where it is not valid."""

    @property
    def mark(self) -> str:
        """The sign in the gutter."""
        if self.is_valid:
            return MAY_BE if self.is_undecided else PICKED if self.is_picked else VALID
        return " " if self.is_enabled else "–"


class Window:
    """Rows `top` up to `top + n_rows` of a sheet's view."""

    def __init__(self, sheet: DisplayedTable, top: int, n_rows: int, before: Window | None = None) -> None:
        self.top = top
        self._rows = rows = sheet.view.rows[top : top + n_rows]
        self._conditions: dict[int, tuple[ConditionColumn, list[tuple[str, Kind]]]] = {}
        """The cells of conditions as they are without facts."""
        if before is not None and np.array_equal(before._rows, rows):  # a column that no edit touched is the same one
            self._conditions = before._conditions
        self.n_rows = len(rows)
        self._sheet = sheet
        is_asked = not sheet.query.is_empty
        self._failing = sheet.failing(top, top + n_rows) if is_asked else None
        enabled = sheet.enabled[rows]
        self.rows = [WindowRow(r + 1, e, False) for r, e in zip(rows.tolist(), enabled.tolist(), strict=True)]
        if is_asked:
            query = sheet.query
            counts = self._failing.sum(axis=1).tolist() if self._failing is not None else [0] * self.n_rows
            row_marks = zip(self.rows, query.marks(rows), counts, strict=True)
            self.rows = [WindowRow(r.number, r.is_enabled, *marks, count) for r, marks, count in row_marks]
            self.rows = [replace(r, standing=query.brief(r.number - 1)) if r.is_valid else r for r in self.rows]
        if sheet.played is not None:
            self.rows = [replace(r, is_played=True) if r.number - 1 == sheet.played else r for r in self.rows]
        self._notes = [sheet.notes(row) for row in rows.tolist()] if sheet.query.has_notes else []
        self._texts: dict[int, list[tuple[str, Kind]]] = {}
        """All cells as they are without facts."""
        self._columns: dict[int, list[tuple[str, Kind]]] = {}

    def holds(self, row: int) -> bool:
        """Whether a row of the view is in it."""
        return self.top <= row < self.top + self.n_rows

    def row(self, row: int) -> WindowRow:
        return self.rows[row - self.top]

    def failing(self, row: int) -> list[int]:
        """The columns whose cells in a row of the view do not accept their fact."""
        return [] if self._failing is None else np.flatnonzero(self._failing[row - self.top]).tolist()

    def again(self) -> Window:
        """The same rows read for the facts that are queried now; the texts of cells are those that were read."""
        window = Window(self._sheet, self.top, self.n_rows)
        window._texts = self._texts
        return window

    def changed_since(self, before: Window) -> list[int]:
        """The rows of the view that look otherwise than before, of the same rows."""
        same = [a == b for a, b in zip(self.rows, before.rows, strict=True)]
        if self._failing is not None and before._failing is not None:
            differ = (self._failing != before._failing).any(axis=1).tolist()
            same = [s and not d for s, d in zip(same, differ, strict=True)]
        elif (self._failing is None) != (before._failing is None):
            same = [False] * self.n_rows
        if self._notes or before._notes:
            notes = zip(self._notes or [{}] * self.n_rows, before._notes or [{}] * self.n_rows, strict=True)
            same = [s and a == b for s, (a, b) in zip(same, notes, strict=True)]
        return [self.top + at for at, is_same in enumerate(same) if not is_same]

    def began_to_fail(self, before: Window) -> frozenset[tuple[int, int]]:
        """The cells that fail now and did not before: rows of the view, and columns."""
        if self._failing is None or before._failing is None:
            return frozenset()
        rows, columns = np.nonzero(self._failing & ~before._failing)
        return frozenset(zip((rows + self.top).tolist(), columns.tolist(), strict=True))

    def cell(self, row: int, column: int) -> tuple[str, Kind]:
        """The text of a cell, and how it is meant."""
        if column not in self._columns:
            self._columns[column] = self._read(column)
        return self._columns[column][row - self.top]

    def notes(self, row: int) -> dict[int, str]:
        """What is at the right of cells of a row, by column."""
        return self._notes[row - self.top] if self._notes else {}

    def note(self, row: int, column: int) -> str | None:
        """What is at the right of a cell."""
        return self._notes[row - self.top].get(column) if self._notes else None

    def _read(self, column: int) -> list[tuple[str, Kind]]:
        if column not in self._texts:
            self._texts[column] = self._with_inherited(column, self._read_texts(column))
        cells, condition = self._texts[column], self._sheet.condition(column)
        is_rule = self._sheet.table.columns[column].name == self._sheet.table.settings.when
        if self._failing is None or (condition is None and not is_rule):
            return cells
        fails = self._failing[:, column].tolist()
        return [(text, "failing") if f and kind != "fault" else (text, kind) for (text, kind), f in zip(cells, fails, strict=True)]

    def _with_inherited(self, column: int, cells: list[tuple[str, Kind]]) -> list[tuple[str, Kind]]:
        """The cells of a column with those of the base where they say nothing."""
        texts = self._sheet.inherited_texts(column)
        if texts is None:
            return cells
        of_base = [texts[row] for row in self._rows.tolist()]
        return [
            cell if cell[0].strip() or not text.strip() else (text, "inherited") for cell, text in zip(cells, of_base, strict=True)
        ]

    def _read_texts(self, column: int) -> list[tuple[str, Kind]]:
        condition = self._sheet.condition(column)
        if condition is None:
            return self._read_column(column, None)
        known = self._conditions.get(column)
        if known is None or known[0] is not condition:
            known = self._conditions[column] = condition, self._read_column(column, condition)
        return known[1]

    def _read_column(self, column: int, condition: ConditionColumn | None) -> list[tuple[str, Kind]]:
        texts = self._sheet.table.columns[column]
        codes = texts.codes[self._rows].tolist()
        kinds = {code: self._kind(column, condition, code) for code in set(codes)}
        indent = self._sheet.indent(column)
        texts_of_codes = {code: indented(texts.texts[code], indent) for code in kinds} if indent else texts.texts
        cells = [(texts_of_codes[code], kinds[code]) for code in codes]
        if condition is None and self._sheet.missing_output(column) is not None:
            is_missing = [self._sheet.is_missing(int(row), column) for row in self._rows]
            cells = [(text, "fault" if wrong else kind) for (text, kind), wrong in zip(cells, is_missing, strict=True)]
        return cells

    def _kind(self, column: int, condition: ConditionColumn | None, code: int) -> Kind:
        if condition is None:
            text = self._sheet.table.columns[column].texts[code]
            return "fault" if self._sheet.text_fault(column, text) is not None else "text"
        if code in condition.faults:
            return "fault"
        cell: Cell = condition.cells[code]
        return "any" if cell.is_any else "text"
