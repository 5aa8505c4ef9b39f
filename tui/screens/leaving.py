"""Questions on the way out and in: unsaved edits when one quits, and a table that another editor has open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from textual.binding import Binding, BindingType

from contextdb.errors import plural, safe_text

from ..model.lock import Holder
from .ask import Question

Leaving = Literal["save", "discard"]
Opening = Literal["read-only", "take-over"]
MOST_NAMED = 8


class LeavingDialog(Question[Leaving]):
    """Quit with unsaved edits? Gives "save" or "discard"; None to stay."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s,enter", "answer('save')", "Save"),
        Binding("d", "answer('discard')", "Do not save"),
    ]

    def __init__(self, tables: Sequence[str]) -> None:
        """`tables` are the names of those with unsaved edits."""
        names = [f"  {safe_text(name)}" for name in tables[:MOST_NAMED]]
        more = len(tables) - MOST_NAMED
        names += [f"  and {plural(more, 'more table')}"] if more > 0 else []
        what = "This table has" if len(tables) == 1 else "These tables have"
        save = "Save" if len(tables) == 1 else f"Save all {len(tables)}"
        answers = [("answer('save')", save), ("answer('discard')", "Do not save"), ("cancel", "Stay")]
        super().__init__("Unsaved edits", "\n".join([f"{what} edits that are not saved:", "", *names]), answers)
        self.keys_text = f"S {save.lower()} and quit · D quit without saving · Esc stay"


class HeldDialog(Question[Opening]):
    """Another editor has the table open. Gives "read-only" or, where nobody can tell whether that one still runs, "take-over"."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("r,enter", "answer('read-only')", "Open to read"),
        Binding("t", "answer('take-over')", "Take over"),
    ]

    def __init__(self, table: str, holder: Holder) -> None:
        lines = [f"{safe_text(table)} is open in another editor: {safe_text(str(holder))}.", ""]
        take = [] if holder.is_certain else [("answer('take-over')", "Take over")]
        if holder.is_certain:
            lines.append("Close it there to edit it here. Until then it can be read here, and saved under another name.")
            lines.append("What is edited here meanwhile is lost if this editor is killed.")
        else:
            lines.append("It is on another machine, so this editor cannot tell whether it is still running.")
            lines.append("If it is not, take over the table. If it is, each may overwrite what the other saved.")
        answers = [("answer('read-only')", "Open to read"), *take, ("cancel", "Cancel")]
        super().__init__("The table is open elsewhere", "\n".join(lines), answers)
        self._holder = holder
        self.keys_text = f"Enter open to read{' · T take over' if take else ''} · Esc cancel"

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Nobody takes a table from an editor that surely runs."""
        return not (action == "answer" and parameters == ("take-over",) and self._holder.is_certain)
