"""The dialog before a save: which moments play something else since the last one. Enter loads one into the test row."""

from __future__ import annotations

from pathlib import Path

from textual import on
from textual.app import ComposeResult
from textual.content import Content
from textual.widgets import Static

from contextdb.errors import ContextDBError
from contextdb.tables.table import Table

from ..messages import SetContext
from ..model.changed_moments import Changes, changed_moments
from ..widgets.line_list import LineList, ListColumn
from .dialog import Dialog


class ChangesDialog(Dialog[SetContext]):
    """The moments that change, before and after."""

    DEFAULT_CSS = """
    ChangesDialog {
        & > #dialog { width: 120; }
        & LineList { height: auto; max-height: 70vh; margin: 1 0 0 0; }
    }
    """
    title_text = "What changes since the last save"
    keys_text = "↑↓ choose · Enter to the test row · Esc close"

    def __init__(self, before: Table, after: Table, folder: Path) -> None:
        """`before` is the table as it was saved, `folder` where recordings are."""
        super().__init__()
        self._tables, self._folder = (before, after), folder
        self.changes = Changes((), "")

    def compose_body(self) -> ComposeResult:
        """How many, and each with what may play before and after."""
        yield Static(id="changes-summary")
        columns = [ListColumn("Moment", 20, 2, is_name=True), ListColumn("Before", 16, 1), ListColumn("After", 16, 1)]
        yield LineList(columns, empty="No moment changes.")

    def on_mount(self) -> None:
        try:
            self.changes = changed_moments(*self._tables, self._folder)
        except ContextDBError as error:
            self.changes = Changes((), str(error))
        self.query_one("#changes-summary", Static).update(Content(self.changes.summary))
        moments = self.changes.moments
        self.query_one(LineList).show(len(moments), lambda at: (moments[at].where, moments[at].before, moments[at].after))
        self.query_one(LineList).focus()

    @on(LineList.Chosen)
    def _chosen(self, event: LineList.Chosen) -> None:
        event.stop()
        moment = self.changes.moments[event.index]
        self.dismiss(SetContext(moment.facts, moment.where))
