"""Who may play each role in the test row: a small sheet of actors for each role, edited with the keys of the grid."""

from __future__ import annotations

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Static

from contextdb.errors import ContextDBError, plural
from contextdb.tables.table import Table

from ..clipboard import Clipboard
from ..model.teams import NAME, Teams, TeamSheet, teams_path
from ..widgets.choice_line import ChoiceLine
from .sheet_dialog import SheetDialog, SmallGrid

ABOUT = "One actor a row, one fact a column. A row of the table is valid when its roles can be filled by different actors."


class ActorsDialog(SheetDialog[Teams]):
    """The actors of a table's roles. Leaving offers them."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "save", "Save", priority=True),
        Binding("alt+right,ctrl+pagedown", "turn(1)", "Next role", show=False, priority=True),
        Binding("alt+left,ctrl+pageup", "turn(-1)", "Role before", show=False, priority=True),
        Binding("alt+x", "clear", "No actors", priority=True),
    ]
    DEFAULT_CSS = "ActorsDialog ChoiceLine { margin: 1 0 0 0; padding: 0 1; }"
    title_text = "Actors"
    keys_text = "Tab right · Enter down · Esc apply"

    def __init__(self, table: Table, teams: Teams, clipboard: Clipboard) -> None:
        super().__init__()
        self.table, self.teams, self.clipboard = table, teams, clipboard
        self.role = next(iter(teams.sheets))

    @property
    def sheet(self) -> TeamSheet:
        """The actors of the role that is seen."""
        return self.teams.sheets[self.role]

    def compose_body(self) -> ComposeResult:
        """What this is, the roles, the actors, what is wrong, what can be done."""
        yield Static(ABOUT, classes="sheet--about")
        yield ChoiceLine((), id="actors-roles")
        yield SmallGrid(self.sheet)
        yield Static(classes="sheet--message")
        yield Static(classes="sheet--keys")

    def on_mount(self) -> None:
        keys = [("save", "Ctrl+S Save")] * (teams_path(self.table) is not None)
        keys += [("turn(1)", "Alt+→ Next role")] * (len(self.teams.sheets) > 1)
        keys += [("clear", "Alt+X No actors"), ("done", "Esc Done")]
        self.show_keys(keys)
        self.grid.focus()
        self.show_sheet()

    def show_sheet(self, message: str = "") -> None:
        """Show the actors, and what is wrong with them."""
        sheets = self.teams.sheets
        labels = [f"{role} {len(sheet.texts)}" for role, sheet in sheets.items()]
        self.query_one(ChoiceLine).show(labels, list(sheets).index(self.role))
        faults = self.teams.faults
        more = f" ({plural(len(faults) - 1, 'fault')} more)" if len(faults) > 1 else ""
        super().show_sheet(f"! {faults[0]}{more}" if faults else message)

    # ---- roles

    def action_turn(self, by: int) -> None:
        roles = list(self.teams.sheets)
        self._turn_to(roles[(roles.index(self.role) + by) % len(roles)])

    @on(ChoiceLine.Picked)
    def _picked(self, event: ChoiceLine.Picked) -> None:
        event.stop()
        self._turn_to(list(self.teams.sheets)[event.index])

    def _turn_to(self, role: str) -> None:
        if self.editor is None:
            self.role = role
            self.grid.open(self.sheet)
            self.grid.focus()
            self.show_sheet()

    def action_clear(self) -> None:
        """Offer nobody: Ctrl+Z undoes it."""
        for sheet in self.teams.sheets.values():
            sheet.select(lambda selection, shape: selection.everything())
            sheet.delete_rows()
        self.show_sheet("Nobody is offered.")

    def action_save(self) -> None:
        path = teams_path(self.table)
        if path is None:
            return
        try:
            self.teams.save(path)
        except ContextDBError as error:
            self.show_sheet(f"! {error}")
        else:
            self.show_sheet(f"Saved {path.name}.")

    @on(SmallGrid.Left)
    def action_done(self) -> None:
        self.dismiss(self.teams)

    def action_cancel(self) -> None:
        """Esc outside the grid: the same."""
        self.action_done()

    def is_fact(self, column: int) -> bool:
        """All but the names of the actors."""
        return self.sheet.table.columns[column].name != NAME
