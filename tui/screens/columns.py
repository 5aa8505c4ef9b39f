"""The dialog Columns: every column with its type and what it holds; go to one, hide, fold and freeze."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from rich.cells import cell_len
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType

from ..model.displayed_table import DisplayedTable
from ..model.visible_columns import VisibleColumns
from ..widgets.line_list import LineList, ListCell, ListColumn
from .dialog import Dialog

WIDEST = 40
"""A column's name takes so many cells at most."""


@dataclass(frozen=True)
class ColumnsAnswer:
    """Which columns are to be seen, and the one to go to."""

    columns: VisibleColumns
    column: str | None = None
    wants_sheet: bool = False
    """All of them are to be displayed as a sheet, to change what they are."""


class ColumnsDialog(Dialog[ColumnsAnswer]):
    """Every column, one a line."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "hide", "Hide", show=False),
        Binding("g", "fold", "Fold", show=False),
        Binding("f", "freeze", "Freeze", show=False),
        Binding("e", "sheet", "Edit", show=False),
    ]
    DEFAULT_CSS = """
    ColumnsDialog {
        & > #dialog { width: 110; }
        & LineList { height: auto; max-height: 72vh; }
    }
    """
    title_text = "Columns"
    keys_text = "Enter go · Space hide · G fold · F freeze · E edit all · Esc close"

    def __init__(self, sheet: DisplayedTable) -> None:
        super().__init__()
        self.sheet = sheet
        self.columns = sheet.visible_columns
        self.names = [column.name for column in sheet.table.columns]

    def compose_body(self) -> ComposeResult:
        columns = [ListColumn("Type", 16), ListColumn("Texts", 5, 0, True), ListColumn("Unread", 6, 0, True), ListColumn("", 10, 1)]
        width = min(max(map(cell_len, self.names)), WIDEST)
        yield LineList([ListColumn("", 1), ListColumn("Column", width), *columns])

    def on_mount(self) -> None:
        """Stand on the column of the cursor."""
        lines = self.query_one(LineList)
        lines.show(len(self.names), self._line, self.sheet.selection.column)
        lines.focus()

    def _line(self, at: int) -> Sequence[ListCell]:
        header, condition, texts = self.sheet.header(at), self.sheet.condition(at), self.sheet.table.columns[at]
        is_hidden = self.columns.are_hidden(self.names, self.sheet.table.asset_column)[at]
        is_frozen = at < self.columns.n_frozen(self.names, self.sheet.table.asset_column)
        counts = np.bincount(texts.codes, minlength=len(texts.texts))  # texts that were mended stay among them, in no row
        n_wrong = sum(int(counts[code]) for code in condition.faults) if condition is not None else 0
        tone = "muted" if is_hidden else ""
        kind = f"{header.kind} · {header.unit}" if header.unit else header.kind
        sign = "–" if is_hidden else "▐" if is_frozen else ""
        about = condition.condition.description if condition is not None else ""
        wrong: ListCell = (f"{n_wrong:,}", "error") if n_wrong else ""
        return sign, (header.name, tone), (kind, "muted"), f"{np.count_nonzero(counts):,}", wrong, (about, "muted")

    @property
    def _here(self) -> str:
        return self.names[self.query_one(LineList).index]

    def _show(self, columns: VisibleColumns) -> None:
        self.columns = columns
        self.query_one(LineList).refresh()

    def action_hide(self) -> None:
        """Hide a column, or show it again."""
        names, asset = self.names, self.sheet.table.asset_column
        is_hidden = self.columns.are_hidden(names, asset)[names.index(self._here)]
        self._show(self.columns.revealed(self._here) if is_hidden else self.columns.turned(self._here))
        self.query_one(LineList).action_move(1)

    def action_fold(self) -> None:
        self._show(self.columns.folded_at(self._here))

    def action_freeze(self) -> None:
        """Freeze up to a column; only the assets where that is so."""
        self._show(replace(self.columns, frozen=None if self.columns.frozen == self._here else self._here))

    def action_sheet(self) -> None:
        """Change what the columns are."""
        self.dismiss(ColumnsAnswer(self.columns, self._here, wants_sheet=True))

    @on(LineList.Chosen)
    def _chosen(self) -> None:
        self.dismiss(ColumnsAnswer(self.columns, self._here))

    def action_cancel(self) -> None:
        """Take what was hidden, and stay."""
        self.dismiss(ColumnsAnswer(self.columns))
