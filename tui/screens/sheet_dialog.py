"""What dialogs with a small sheet share: a grid in a box, its cell editor, the clipboard, and a line that says what was done."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import ClassVar

from textual import events, on
from textual.content import Content
from textual.geometry import Size
from textual.message import Message
from textual.widgets import Static

from ..clipboard import Clipboard
from ..messages import Edited, Notice
from ..model.roomy_sheet import RoomySheet
from ..widgets.cell_editor import CellEditor, is_free_for
from ..widgets.grid import Grid
from .dialog import Answer, Dialog, buttons


class SmallGrid(Grid):
    """The grid of a dialog."""

    has_test_row: ClassVar[bool] = False
    has_new_row: ClassVar[bool] = False
    asks_of_pastes: ClassVar[bool] = False

    class Left(Message):
        """Esc was pressed."""

    def action_leave(self) -> None:
        """Out of the dialog, also with several cells selected, as after a paste."""
        self.post_message(self.Left())


class SheetDialog(Dialog[Answer]):
    """A dialog with a sheet that is edited with the keys of the grid."""

    DEFAULT_CSS = """
    SheetDialog {
        & > #dialog { width: 96%; max-width: 150; height: 92%; padding: 0 1; }
        & > #dialog > #dialog-body { height: 1fr; }
        & .sheet--about { height: auto; max-height: 3; padding: 0 1; color: $text-muted; }
        & SmallGrid { height: 1fr; margin: 1 0; }
        & .sheet--message { height: auto; max-height: 4; padding: 0 1; }
        & .sheet--keys { height: auto; max-height: 2; padding: 0 1; color: $text-muted; }
        &.-tall > #dialog, &.-tall > #dialog > #dialog-body { height: auto; }
        &.-tall SmallGrid { height: auto; min-height: 14; max-height: 60vh; }
    }
    """

    clipboard: Clipboard

    @property
    def sheet(self) -> RoomySheet:
        """The sheet that is seen."""
        raise NotImplementedError

    @property
    def grid(self) -> SmallGrid:
        return self.query_one(SmallGrid)

    @property
    def editor(self) -> CellEditor | None:
        """The editor that is open over a cell."""
        return next((one for one in self.query(CellEditor) if one.is_open), None)

    def is_fact(self, column: int) -> bool:
        """Whether a column holds facts, not cells."""
        return False

    def show_sheet(self, message: str = "") -> None:
        """Show the sheet as it is now, and say something."""
        self.sheet.with_room()
        self.grid.changed()
        self.query_one(".sheet--message", Static).update(Content(message))

    def show_keys(self, keys: Sequence[tuple[str, str]]) -> None:
        """Say what can be done: actions with their labels, which a click runs too."""
        self.query_one(".sheet--keys", Static).update(buttons(keys))

    # ---- what the grid asks for

    @on(Grid.EditWanted)
    def _open_editor(self, event: Grid.EditWanted) -> None:
        event.stop()
        if self.editor is not None:
            return
        sheet, (_, column) = self.sheet, self.sheet.cursor
        editor = next(iter(self.query(CellEditor)), None) or CellEditor()
        editor.place(self.grid.cell_region(), Size(self.size.width, self.size.height))
        editor.open(
            sheet.of_column(column),
            sheet.header(column).kind,
            event.text,
            check=lambda text: sheet.fault_of(column, text),
            on_done=self._edit_done,
            known=sheet.known(column),
            is_fact=self.is_fact(column),
            is_typing=event.is_typing,
            open_list=event.opens_list,
        )
        if editor.parent is None:
            self.query_one("#dialog-body").mount(editor)

    def _forward_event(self, event: events.Event) -> None:
        if is_free_for(self, event):
            super()._forward_event(event)

    def on_resize(self) -> None:
        self.call_after_refresh(self._place_editor)

    def _place_editor(self) -> None:
        if self.editor is not None:
            self.editor.place(self.grid.cell_region(), Size(self.size.width, self.size.height))

    def _edit_done(self, outcome: CellEditor.Outcome) -> None:
        if isinstance(outcome, CellEditor.Committed):
            self._commit(outcome)
        elif isinstance(outcome, CellEditor.Cancelled):
            self._close_editor()

    def _commit(self, outcome: CellEditor.Committed) -> None:
        if outcome.is_fill:
            self.sheet.fill(outcome.text)
        elif fault := self.sheet.type_text(outcome.text):
            if self.editor is not None:
                self.editor.refuse(fault)
            return
        self.grid.again = partial(self.grid.fill, outcome.text)
        self._close_editor()
        self.sheet.with_room()
        start = None
        if outcome.is_tab:
            self.grid.run.tab(*self.sheet.cursor)
        elif outcome.down == 1 and self.sheet.block.n_cells == 1:
            start = self.grid.run.enter(*self.sheet.cursor)
        if not outcome.is_fill:
            self.sheet.move_on(outcome.down, outcome.right)
        if start is not None:
            self.sheet.go(self.sheet.cursor[0], start)
        self.show_sheet()

    def _close_editor(self) -> None:
        if self.editor is not None:
            self.editor.close()
        self.grid.focus()

    @on(Grid.CopyWanted)
    def _copy(self, event: Grid.CopyWanted) -> None:
        event.stop()
        self.show_sheet(self.clipboard.copy(event.text) or "Copied.")

    @on(Grid.PasteWanted)
    def _paste(self, event: Grid.PasteWanted) -> None:
        event.stop()
        self.grid.paste(self.clipboard.paste())

    @on(Grid.RenameUndoWanted)
    def _nothing_to_undo(self, event: Grid.RenameUndoWanted) -> None:
        event.stop()
        self.show_sheet(f"There is nothing to {'redo' if event.is_redo else 'undo'}.")

    @on(Edited)
    def _edited(self, event: Edited) -> None:
        event.stop()
        done = event.done
        self.grid.forget_widths()
        self.show_sheet(" ".join([f"{done.name}." if done.name else "", *done.notes, *done.warnings]).strip())

    @on(Notice)
    def _show_notice(self, event: Notice) -> None:
        event.stop()
        self.show_sheet(event.text)
