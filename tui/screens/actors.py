"""Who may play each role in the test row: a small sheet of actors for each role, edited with the keys of the grid."""

from __future__ import annotations

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.geometry import Size
from textual.message import Message
from textual.widgets import Static

from contextdb.errors import ContextDBError, plural
from contextdb.tables.table import Table
from tui.clipboard import Clipboard
from tui.messages import Edited, Told
from tui.model.teams import NAME, Teams, TeamSheet, teams_path
from tui.screens.dialog import Dialog
from tui.widgets.cell_editor import CellEditor
from tui.widgets.choice_line import ChoiceLine
from tui.widgets.grid import Grid

ABOUT = "One actor a row, one fact a column. A row of the table is valid when its roles can be filled by different actors."


class TeamGrid(Grid):
    """The actors of one role."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("tab", "move(0, 1, False)", show=False),
        Binding("shift+tab", "move(0, -1, False)", show=False),
    ]
    has_test_row: ClassVar[bool] = False
    has_new_row: ClassVar[bool] = False

    class Left(Message):
        """Esc was pressed with one cell selected."""

    def action_leave(self) -> None:
        """Back to one cell; from one cell out of the dialog."""
        if self.sheet.block.n_cells > 1:
            super().action_leave()
        else:
            self.post_message(self.Left())


class ActorsDialog(Dialog[Teams]):
    """The actors of a table's roles. Leaving offers them."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "save", "Save", priority=True),
        Binding("alt+right,ctrl+pagedown", "turn(1)", "Next role", show=False, priority=True),
        Binding("alt+left,ctrl+pageup", "turn(-1)", "Role before", show=False, priority=True),
        Binding("alt+x", "clear", "No actors", priority=True),
    ]
    DEFAULT_CSS = """
    ActorsDialog {
        & > #dialog { width: 96%; max-width: 150; height: 92%; padding: 0 1; }
        & > #dialog > #dialog-body { height: 1fr; }
        & #actors-about { height: auto; max-height: 3; padding: 0 1; color: $text-muted; }
        & ChoiceLine { margin: 1 0 0 0; padding: 0 1; }
        & TeamGrid { height: 1fr; margin: 1 0; }
        & #actors-said { height: auto; max-height: 4; padding: 0 1; }
        & #actors-keys { height: auto; max-height: 2; padding: 0 1; color: $text-muted; }
    }
    """
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

    @property
    def grid(self) -> TeamGrid:
        """The grid of them."""
        return self.query_one(TeamGrid)

    @property
    def editor(self) -> CellEditor | None:
        """The editor that is open over a fact."""
        return next(iter(self.query(CellEditor)), None)

    def compose_body(self) -> ComposeResult:
        """What this is, the roles, the actors, what is wrong, what can be done."""
        yield Static(ABOUT, id="actors-about")
        yield ChoiceLine((), id="actors-roles")
        yield TeamGrid(self.sheet)
        yield Static(id="actors-said")
        yield Static(id="actors-keys")

    def on_mount(self) -> None:
        """Show the first role."""
        keys = [("screen.save", "Ctrl+S Save")] * (teams_path(self.table) is not None)
        keys += [("screen.turn(1)", "Alt+→ Next role")] * (len(self.teams.sheets) > 1)
        keys += [("screen.clear", "Alt+X No actors"), ("screen.done", "Esc Done")]
        said = "   ".join(f"[@click={action}]{label}[/]" for action, label in keys)
        self.query_one("#actors-keys", Static).update(Content.from_markup(said))
        self.grid.focus()
        self._show()

    def _show(self, said: str = "") -> None:
        sheets = self.teams.sheets
        labels = [f"{role} {len(sheet.texts)}" for role, sheet in sheets.items()]
        self.query_one(ChoiceLine).show(labels, list(sheets).index(self.role))
        self.sheet.with_room()
        self.grid.changed()
        faults = self.teams.faults
        more = f" ({plural(len(faults) - 1, 'fault')} more)" if len(faults) > 1 else ""
        self.query_one("#actors-said", Static).update(Content(f"! {faults[0]}{more}" if faults else said))

    # ---- roles

    def action_turn(self, by: int) -> None:
        """The role beside."""
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
            self._show()

    def action_clear(self) -> None:
        """Offer nobody: Ctrl+Z undoes it."""
        for sheet in self.teams.sheets.values():
            sheet.select(lambda selection, shape: selection.everything())
            sheet.delete_rows()
        self._show("Nobody is offered.")

    def action_save(self) -> None:
        """Write the teams to their file."""
        path = teams_path(self.table)
        if path is None:
            return
        try:
            self.teams.save(path)
        except ContextDBError as error:
            self._show(f"! {error}")
        else:
            self._show(f"Saved {path.name}.")

    @on(TeamGrid.Left)
    def action_done(self) -> None:
        """Give the teams back."""
        self.dismiss(self.teams)

    def action_cancel(self) -> None:
        """Esc outside the grid: the same."""
        self.action_done()

    # ---- what the grid asks for

    @on(Grid.EditWanted)
    def _open_editor(self, event: Grid.EditWanted) -> None:
        event.stop()
        if self.editor is not None:
            return
        sheet, (_, column) = self.sheet, self.sheet.cursor
        texts, kind = sheet.table.columns[column], sheet.header(column).kind
        known = sorted({text for text in texts.to_list() if text})
        editor = CellEditor(
            sheet.of_column(column),
            kind,
            event.text,
            check=lambda text: sheet.fault_of(column, text),
            known=known,
            is_fact=texts.name != NAME,
            is_typing=event.is_typing,
            open_list=event.opens_list,
        )
        self.query_one("#dialog-body").mount(editor)
        self._place_editor()
        editor.focus()

    def on_resize(self) -> None:
        self.call_after_refresh(self._place_editor)

    def _place_editor(self) -> None:
        if self.editor is not None:
            self.editor.place(self.grid.cell_region(), Size(self.size.width, self.size.height))

    @on(CellEditor.Committed)
    def _commit(self, event: CellEditor.Committed) -> None:
        event.stop()
        if event.is_fill:
            self.sheet.fill(event.text)
        elif fault := self.sheet.type_text(event.text):
            if self.editor is not None:
                self.editor.refuse(fault)
            return
        self._close_editor()
        self.sheet.with_room()
        row, column = self.sheet.cursor
        if event.down > 0 and column == len(self.sheet.table.columns) - 1 and self.sheet.block.n_cells == 1:
            self.sheet.go(row + 1, 0)  # the next actor
        elif not event.is_fill:
            self.sheet.select(lambda s, shape: s.next_cell(event.down, event.right, shape))
        self._show()

    @on(CellEditor.Cancelled)
    def _cancelled(self, event: CellEditor.Cancelled) -> None:
        event.stop()
        self._close_editor()

    def _close_editor(self) -> None:
        if self.editor is not None:
            self.editor.remove()
        self.grid.focus()

    @on(Grid.CopyWanted)
    def _copy(self, event: Grid.CopyWanted) -> None:
        event.stop()
        self._show(self.clipboard.copy(event.text) or "Copied.")

    @on(Grid.PasteWanted)
    def _paste(self, event: Grid.PasteWanted) -> None:
        event.stop()
        self.grid.paste(self.clipboard.paste())

    @on(Edited)
    def _edited(self, event: Edited) -> None:
        event.stop()
        done = event.done
        self._show(" ".join([f"{done.name}." if done.name else "", *done.notes, *done.warnings]).strip())

    @on(Told)
    def _told(self, event: Told) -> None:
        event.stop()
        self._show(event.text)
