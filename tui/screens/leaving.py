"""Questions on the way out and in: unsaved edits when one quits, and a table that another editor has open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Static

from contextdb.errors import plural, shown
from tui.model.lock import Holder
from tui.screens.dialog import Dialog, buttons

Leaving = Literal["save", "discard"]
Opening = Literal["read-only", "take-over"]
MOST_NAMED = 8


class LeavingDialog(Dialog[Leaving]):
    """Quit with unsaved edits? Gives "save" or "discard"; None to stay."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s,enter", "answer('save')", "Save"),
        Binding("d", "answer('discard')", "Do not save"),
    ]
    title_text = "Unsaved edits"

    def __init__(self, tables: Sequence[str]) -> None:
        """`tables` are the names of those with unsaved edits."""
        super().__init__()
        self._tables = tuple(tables)
        self._save = "Save" if len(tables) == 1 else f"Save all {len(tables)}"
        self.keys_text = f"S {self._save.lower()} and quit · D quit without saving · Esc stay"

    def compose_body(self) -> ComposeResult:
        """Which tables, and the answers to click."""
        names = [f"  {shown(name)}" for name in self._tables[:MOST_NAMED]]
        more = len(self._tables) - MOST_NAMED
        names += [f"  and {plural(more, 'more table')}"] if more > 0 else []
        what = "This table has" if len(self._tables) == 1 else "These tables have"
        yield Static(Content("\n".join([f"{what} edits that are not saved:", "", *names, ""])))
        yield Static(buttons([("answer('save')", self._save), ("answer('discard')", "Do not save"), ("cancel", "Stay")]))

    def action_answer(self, answer: Leaving) -> None:
        """Give the answer."""
        self.dismiss(answer)


class HeldDialog(Dialog[Opening]):
    """Another editor has the table open. Gives "read-only" or, where nobody can tell whether that one still runs, "take-over"."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("r,enter", "answer('read-only')", "Open to read"),
        Binding("t", "answer('take-over')", "Take over"),
    ]
    title_text = "The table is open elsewhere"

    def __init__(self, table: str, holder: Holder) -> None:
        super().__init__()
        self._table, self._holder = table, holder
        take = "" if holder.is_certain else " · T take over"
        self.keys_text = f"Enter open to read{take} · Esc cancel"

    def compose_body(self) -> ComposeResult:
        """Who has it, what one can do, and the answers to click."""
        lines = [f"{shown(self._table)} is open in another editor: {shown(str(self._holder))}.", ""]
        if self._holder.is_certain:
            lines.append("Close it there to edit it here. Until then it can be read here, and saved under another name.")
            lines.append("What is edited here meanwhile is lost if this editor is killed.")
        else:
            lines.append("It is on another machine, so this editor cannot tell whether it is still running.")
            lines.append("If it is not, take over the table. If it is, each may overwrite what the other saved.")
        choices = [("answer('read-only')", "Open to read"), ("answer('take-over')", "Take over"), ("cancel", "Cancel")]
        yield Static(Content("\n".join([*lines, ""])))
        yield Static(buttons([c for c in choices if not (self._holder.is_certain and "take-over" in c[0])]))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Nobody takes a table from an editor that surely runs."""
        return not (action == "answer" and parameters == ("take-over",) and self._holder.is_certain)

    def action_answer(self, answer: Opening) -> None:
        """Give the answer."""
        self.dismiss(answer)
