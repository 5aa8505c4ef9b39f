"""The dialog of what git knows of the cursor's cell and row: who, when, why, and the row then beside the row now."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Static

from contextdb.errors import ContextDBError
from contextdb.tables.table import Table

from ..model.row_history import RowHistory, RowVersion, row_history
from ..widgets.choice_line import ChoiceLine
from ..widgets.line_list import LineList, ListCell, ListColumn
from .dialog import Dialog

READING = "Reading the commits …"
NARROW = 110


class RowHistoryDialog(Dialog[None]):
    """A row and its cell through the commits."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("tab", "turn", "Turn the page", show=False)]
    DEFAULT_CSS = """
    RowHistoryDialog {
        & > #dialog { width: 140; height: 92%; }
        & > #dialog > #dialog-body { height: 1fr; }
        & ChoiceLine { padding: 0 1; margin: 0 0 1 0; }
        & #history-versions { height: 1fr; }
        & #history-cells { height: 1fr; border-top: solid $panel; }
        & #history-note { height: auto; color: $text-muted; padding: 0 1; }
    }
    """
    keys_text = "↑↓ choose · Tab cell or row · Esc close"

    def __init__(self, table: Table, row: int, column: str) -> None:
        super().__init__()
        self._table, self._row, self._column = table, row, column
        self.title_text = f"History of row {row + 1:,}, {table.text(row, table.asset_column)}, from git"
        self.history: RowHistory | None = None
        self.is_of_cell = True

    def compose_body(self) -> ComposeResult:
        """Whether of the cell or of the row, the versions, and the two of one beside each other."""
        yield ChoiceLine(())
        yield LineList(
            [ListColumn("When", 16), ListColumn("Who", 8, 1), ListColumn("What", 12, 1), ListColumn("Why", 16, 4)],
            empty=READING,
            id="history-versions",
        )
        yield LineList(
            [
                ListColumn("", 1),
                ListColumn("Column", 10, 1, is_name=True),
                ListColumn("Before", 8, 1),
                ListColumn("After", 8, 1),
                ListColumn("Now", 8, 1),
            ],
            empty="",
            id="history-cells",
        )
        yield Static(id="history-note", markup=False)

    def on_mount(self) -> None:
        self.query_one("#history-versions", LineList).focus()
        self._show()
        self.read()

    @work(thread=True)
    def read(self) -> None:
        """Ask git."""
        try:
            history, problem = row_history(self._table, self._row), ""
        except ContextDBError as error:
            history, problem = RowHistory(()), str(error.faults[0])
        self.app.call_from_thread(self._take, history, problem)

    def _take(self, history: RowHistory, problem: str) -> None:
        self.history = history
        self.is_of_cell = bool(history.of_cell(self._column).versions)
        self.query_one("#history-note", Static).update(_sentence(history.note))
        self.query_one("#history-versions", LineList).say_empty(_sentence(problem) or "No commit changed it.")
        self._show()

    @property
    def versions(self) -> Sequence[RowVersion]:
        """Those of the page that is seen."""
        if self.history is None:
            return ()
        return (self.history.of_cell(self._column) if self.is_of_cell else self.history).versions

    def _show(self) -> None:
        versions = self.versions
        self.query_one(ChoiceLine).show([f"This cell: {self._column}", "The whole row"], 0 if self.is_of_cell else 1)
        listed = self.query_one("#history-versions", LineList)
        column = self._column if self.is_of_cell else None
        listed.show(
            len(versions),
            lambda at: (versions[at].when, versions[at].who, (versions[at].text(column), "strong"), versions[at].message),
        )

    @on(LineList.Moved)
    def _moved(self, event: LineList.Moved) -> None:
        event.stop()
        if event.list.id != "history-versions":
            return
        versions, cells = self.versions, self.query_one("#history-cells", LineList)
        if not versions or event.index < 0:
            cells.show(0, lambda at: ())
            return
        version, now = versions[event.index], {column.name: column[self._row] for column in self._table.columns}
        changed = version.changed
        names = [*changed, *(name for name in {**now, **(version.cells or {}), **(version.before or {})} if name not in changed)]

        def line(at: int) -> Sequence[ListCell]:
            name = names[at]
            tone = "warning" if name in changed else "muted"
            texts = ((of or {}).get(name, "") or "–" for of in (version.before, version.cells, now))
            return ["×" if name in changed else "", *((text, tone) for text in (name, *texts))]

        cells.show(len(names), line)

    def action_turn(self) -> None:
        """The cell, or the whole row."""
        self.is_of_cell = not self.is_of_cell
        self._show()

    @on(ChoiceLine.Picked)
    def _picked(self, event: ChoiceLine.Picked) -> None:
        event.stop()
        if self.is_of_cell != (event.index == 0):
            self.action_turn()


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"
