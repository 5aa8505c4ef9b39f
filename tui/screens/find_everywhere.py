"""The dialog that finds a text in all tables of the folder: each place on a line, Enter goes there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import ClassVar

import numpy as np
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Input, Static

from contextdb.errors import ContextDBError, plural
from contextdb.tables.project import load_table
from contextdb.tables.table import Table

from ..model.find import Search, find
from ..model.layout import cut_middle
from ..model.workspace import Workspace
from ..widgets.cursor_lines import FIRST_LAST, UP_DOWN
from ..widgets.line_list import LineList, ListCell, ListColumn
from ..widgets.list_filter import ListFilter
from .dialog import Dialog

MOST = 1000
"""So many places are listed."""


@dataclass(frozen=True)
class FoundCell:
    """A cell with the text: its table, its row of the file from 0, its column, and what stands there."""

    table: str
    row: int
    column: str
    text: str


class FindEverywhere(Dialog[FoundCell]):
    """Find in all tables."""

    BINDINGS: ClassVar[list[BindingType]] = [
        *UP_DOWN,
        *FIRST_LAST,
        Binding("pagedown", "move(10)", "Page down", show=False),
        Binding("pageup", "move(-10)", "Page up", show=False),
    ]
    DEFAULT_CSS = """
    FindEverywhere {
        & > #dialog { width: 110; height: 92%; }
        & > #dialog > #dialog-body { height: 1fr; }
        & LineList { height: 1fr; margin: 1 0; }
        & #found-message { height: 1; color: $text-muted; }
    }
    """
    title_text = "Find in all tables"
    keys_text = "↑↓ choose · Enter go there · Esc close"

    def __init__(self, workspace: Workspace, first: str) -> None:
        """`first`: the table that is looked through first."""
        super().__init__()
        self.workspace = workspace
        self.names = [first, *(name for name in workspace.files if name != first)]
        self.matches: list[FoundCell] = []
        self._read: dict[str, Table | None] = {}

    def compose_body(self) -> ComposeResult:
        """The text, its places, how many there are."""
        yield ListFilter(compact=True, placeholder="a text; upper and lower case are the same")
        columns = [
            ListColumn("Table", 14, is_name=True),
            ListColumn("Row", 5, 0, True),
            ListColumn("Column", 12, 1, is_name=True),
            ListColumn("Text", 20, 3),
        ]
        yield LineList(columns, empty="No match.")
        yield Static(id="found-message")

    def on_mount(self) -> None:
        self.query_one(Input).focus()
        self._show("")

    @on(Input.Changed)
    def _typed(self, event: Input.Changed) -> None:
        event.stop()
        self._show(event.value)

    def _show(self, text: str) -> None:
        self.matches = list(islice(self._places(Search(text)), MOST)) if text.strip() else []
        self.query_one(LineList).show(len(self.matches), self._line, 0)
        n_tables = len({one.table for one in self.matches})
        more = "at least " if len(self.matches) == MOST else ""
        unread = [name for name, table in self._read.items() if table is None]
        count = f"{more}{plural(len(self.matches), 'cell')} in {plural(n_tables, 'table')}" if self.matches else ""
        self.query_one("#found-message", Static).update(f"{count}{f' · not read: {unread[0]}' if unread else ''}")

    def _line(self, at: int) -> Sequence[ListCell]:
        one = self.matches[at]
        return one.table, f"{one.row + 1:,}", (one.column, "muted"), partial(cut_middle, one.text)

    def _places(self, search: Search) -> Iterator[FoundCell]:
        for name in self.names:
            table = self._table(name)
            if table is None:
                continue
            columns = [c.name for c in table.columns]
            for row, column in np.argwhere(find(table, search, np.arange(table.n_rows), columns)).tolist():
                yield FoundCell(name, row, columns[column], table.columns[column][row])

    def _table(self, name: str) -> Table | None:
        """A table as it is edited, else as it is in its file; None for one that cannot be read."""
        if name in self.workspace.sessions:
            return self.workspace.sessions[name].sheet.table
        if name not in self._read:
            try:
                self._read[name] = load_table(self.workspace.files[name], strict=False)
            except ContextDBError:
                self._read[name] = None
        return self._read[name]

    def action_move(self, by: int) -> None:
        self.query_one(LineList).action_move(by)

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        event.stop()
        if self.matches:
            self.dismiss(self.matches[self.query_one(LineList).index])

    @on(LineList.Chosen)
    def _chosen(self, event: LineList.Chosen) -> None:
        event.stop()
        self.dismiss(self.matches[event.index])
