"""The dialog of a sheet of columns: types, units, bounds, values, weights and expressions of all columns of a table at once."""

from __future__ import annotations

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Static

from contextdb.tables.changes import Edit
from contextdb.tables.table import Table

from ..clipboard import Clipboard
from ..model.column_sheet import NAME, ColumnSheet, Wrong
from .sheet_dialog import SheetDialog, SmallGrid

ABOUT = "One column a row. A new row is a new column; one that is declared, with an Expression, is a derived fact."


class ColumnSheetDialog(SheetDialog[Edit]):
    """What contextdb.toml says of the columns. Leaving gives the edit of all that was changed."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "done", "Apply", priority=True),
        Binding("alt+x", "discard", "Discard", priority=True),
    ]
    DEFAULT_CSS = "ColumnSheetDialog > #dialog { max-width: 200; }"
    title_text = "Sheet of columns"
    keys_text = "Tab right · Enter down · Esc apply"

    def __init__(self, table: Table, column: int, clipboard: Clipboard) -> None:
        super().__init__()
        self.columns, self.clipboard = ColumnSheet(table), clipboard
        self.columns.go(column, 0)

    @property
    def sheet(self) -> ColumnSheet:
        return self.columns

    def compose_body(self) -> ComposeResult:
        """What this is, the columns, what is wrong, what can be done."""
        yield Static(ABOUT, classes="sheet--about")
        yield SmallGrid(self.sheet)
        yield Static(classes="sheet--message")
        yield Static(classes="sheet--keys")

    def on_mount(self) -> None:
        self.show_keys([("done", "Ctrl+S Apply"), ("discard", "Alt+X Discard")])
        self.grid.focus()
        self.show_sheet()

    @on(SmallGrid.Left)
    def action_done(self) -> None:
        """Give the edit back, unless a cell is wrong: then go there and say why."""
        if self.editor is not None:
            return
        try:
            edit = self.sheet.edit()
        except Wrong as wrong:
            names = [column.name for column in self.sheet.table.columns]
            self.sheet.go(wrong.row, names.index(wrong.column))
            where = "" if wrong.column == NAME else f"{self.sheet.text(wrong.row, 0)}, {wrong.column}: "
            self.show_sheet(f"! {where}{wrong.text}")
            self.grid.show_cursor()
            return
        self.dismiss(edit if edit.changes else None)

    def action_discard(self) -> None:
        self.dismiss(None)

    def action_cancel(self) -> None:
        """Esc outside the grid."""
        self.action_done()
