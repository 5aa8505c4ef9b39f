"""What others wrote and edits here disagree about: decide it place by place, or all at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.message import Message
from textual.widgets import Static

from contextdb.errors import plural, safe_text
from contextdb.tables.merging.conflicts import Conflict, Side

from ..widgets.line_list import LineList, ListCell, ListColumn
from .dialog import Dialog, buttons

CHOSEN, OPEN = "●", "○"
WHERE_WIDTH = 10
TEXT_WIDTH = 11
N_OTHER_LINES = 15
"""What the dialog has next to its list: the border, the texts of the chosen place, the choices, and the lines between."""


class ConflictLines(LineList):
    """The places in question. A click on a text takes it."""

    class Taken(Message):
        """A side was clicked."""

        def __init__(self, index: int, side: Side) -> None:
            super().__init__()
            self.index, self.side = index, side

    def on_click(self, event: events.Click) -> None:
        """Go to the line; take the side that was clicked."""
        event.prevent_default()  # else the list would choose the line
        index = event.y - 1 + self.scroll_offset.y
        if event.y < 1 or index >= self.n_lines:
            return
        self.go(index)
        *_, mine, theirs = self._widths(self.scrollable_content_region.width)
        start = self.scrollable_content_region.width - theirs - 2
        if event.x >= start:
            self.post_message(self.Taken(index, "theirs"))
        elif event.x >= start - mine - 2:
            self.post_message(self.Taken(index, "ours"))


class ConflictsDialog(Dialog[Mapping[int, Side]]):
    """Decide conflicts. Gives a side for each of them, by its place in the list; None to leave all as it is."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left", "take('ours')", "Mine", priority=True),
        Binding("right", "take('theirs')", "On disk", priority=True),
        Binding("space", "turn", "Other side", priority=True),
        Binding("m", "take_all('ours')", "All mine"),
        Binding("d", "take_all('theirs')", "All on disk"),
    ]
    DEFAULT_CSS = """
    ConflictsDialog {
        & > #dialog { width: 90%; }
        & #dialog-body > Static { height: auto; }
        & ConflictLines { margin: 1 0; }
        & #conflict-texts { height: 4; }
        & #conflict-choices { margin-top: 1; }
    }
    """
    title_text = "The file was changed on disk"
    keys_text = "← mine · → on disk · M D for all · Enter merge · Esc cancel"

    def __init__(self, conflicts: Sequence[Conflict], file: str = "", sides: tuple[str, str] | None = None) -> None:
        """`sides`: what the two sides of a merge of git are called; None: the sheet and the disk."""
        super().__init__()
        self.names = sides or ("Mine", "On disk")
        self._is_git = sides is not None
        if self._is_git:
            self.title_text = "The file holds a merge conflict"
            self.keys_text = "← ours · → theirs · M D for all · Enter merge · Esc cancel"
        self.conflicts = tuple(conflicts)
        self.sides: dict[int, Side] = {}
        self._file = file

    def compose_body(self) -> ComposeResult:
        """How many there are, the list, the texts of the chosen one in full, and what can be clicked."""
        where = f" in {safe_text(self._file)}" if self._file else ""
        yield Static(Content(f"{plural(len(self.conflicts), 'place')}{where} changed {self._both}. Everything else is merged."))
        columns = [ListColumn("Asset", WHERE_WIDTH, 2, is_name=True), ListColumn("Column", WHERE_WIDTH, 1, is_name=True)]
        texts = [ListColumn(title, TEXT_WIDTH, 2) for title in ("Before", *self.names)]
        yield ConflictLines([*columns, *texts])
        yield Static(id="conflict-texts")
        yield Static(id="conflict-choices")

    def on_mount(self) -> None:
        self._lines.show(len(self.conflicts), self._line)
        self._lines.focus()
        self._show()

    def on_resize(self, event: events.Resize) -> None:
        """Give the list the lines that it needs, or all that are left."""
        left = event.size.height * 92 // 100 - N_OTHER_LINES
        self._lines.styles.height = max(3, min(len(self.conflicts) + 1, left))

    @property
    def _lines(self) -> ConflictLines:
        return self.query_one(ConflictLines)

    @property
    def _both(self) -> str:
        return "on both sides" if self._is_git else "both here and on disk"

    @property
    def _all(self) -> list[tuple[str, str]]:
        ours, theirs = ("All ours", "All theirs") if self._is_git else ("All mine", "All on disk")
        return [("take_all('ours')", ours), ("take_all('theirs')", theirs)]

    @property
    def n_open(self) -> int:
        """How many are not decided yet."""
        return len(self.conflicts) - len(self.sides)

    # ---- keys and mouse

    def action_take(self, side: Side) -> None:
        """Decide the one of the cursor, and go to the next that is open when it was."""
        self._take(self._lines.index, side)

    def action_turn(self) -> None:
        """Decide the one of the cursor the other way."""
        at = self._lines.index
        self.sides[at] = "theirs" if self.sides.get(at) == "ours" else "ours"
        self._show()

    def action_take_all(self, side: Side) -> None:
        self.sides = dict.fromkeys(range(len(self.conflicts)), side)
        self._show()

    def action_merge(self) -> None:
        """Give back what was decided, or go to the first that is not."""
        if not self.n_open:
            self.dismiss(dict(self.sides))
            return
        self._lines.go(next(at for at in range(len(self.conflicts)) if at not in self.sides))
        self._show(is_asked=True)

    @on(LineList.Chosen)
    def _chosen(self, event: LineList.Chosen) -> None:
        event.stop()
        self.action_merge()

    @on(LineList.Moved)
    def _moved(self, event: LineList.Moved) -> None:
        event.stop()
        self._show_texts()

    @on(ConflictLines.Taken)
    def _taken(self, event: ConflictLines.Taken) -> None:
        event.stop()
        self.sides[event.index] = event.side
        self._show()

    def _take(self, at: int, side: Side) -> None:
        was_open = at not in self.sides
        self.sides[at] = side
        following = (i for i in range(at + 1, len(self.conflicts)) if i not in self.sides)
        if was_open and (place := next(following, None)) is not None:
            self._lines.go(place)
        self._show()

    # ---- what is seen

    def _line(self, at: int) -> Sequence[ListCell]:
        one, side = self.conflicts[at], self.sides.get(at)
        what = one.column or "(row)"
        asset = {"column": "(column)", "name": "(name)"}.get(one.kind, one.asset)
        texts = [("ours", version_text(one.ours)), ("theirs", version_text(one.theirs))]
        cells = [(f"{CHOSEN if side == name else OPEN} {text}", _tone(side, name)) for name, text in texts]
        return [safe_text(asset), safe_text(what), (version_text(one.base, "(new)"), "muted"), *cells]

    def _show(self, is_asked: bool = False) -> None:
        self._lines.refresh()
        self._show_texts()
        status = f"{self.n_open:,} of {len(self.conflicts):,} to decide" if self.n_open else "All decided"
        status = f"Decide {self.n_open:,} first" if is_asked else status
        parts = [("merge", "Merge"), *self._all, ("cancel", "Cancel")]
        self.query_one("#conflict-choices", Static).update(buttons(parts) + Content(f"  {status}"))

    def _show_texts(self) -> None:
        if not self.conflicts:
            return
        one = self.conflicts[max(self._lines.index, 0)]
        width = max(len("Before"), *map(len, self.names))
        texts_of = zip(
            ("Before", *self.names),
            (version_text(one.base, "(new)"), version_text(one.ours), version_text(one.theirs)),
            strict=True,
        )
        lines = [(f"{name:<{width}}", text) for name, text in texts_of]
        place = Content.styled(safe_text(one.place, 200), "bold")
        texts = [Content(f"{name}  {text}") for name, text in lines]
        self.query_one("#conflict-texts", Static).update(Content("\n").join([place, *texts]))


def version_text(text: str | None, gone: str = "(deleted)") -> str:
    """A text on one line; one that is missing, or empty, in words."""
    return gone if text is None else safe_text(text, 400) if text.strip() else "(empty)"


def _tone(side: Side | None, name: str) -> str:
    return "" if side is None else "strong" if side == name else "muted"
