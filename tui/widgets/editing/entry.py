"""The line that a cell is typed in."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import ClassVar, Self

from rich.cells import cell_len
from textual import events
from textual.binding import Binding, BindingType
from textual.geometry import Region
from textual.message import Message
from textual.widgets import Input
from textual.widgets.input import Selection

_SIGNS = {0x0A: "⏎", 0x09: "⇥", 0x7F: "␡", **{code: chr(0x2400 + code) for code in range(32) if code not in (0x0A, 0x09)}}
_BREAKS = re.compile(r"[\t\r\n\v\f\x1c-\x1e\x85\u2028\u2029]+")


def one_line(text: str) -> str:
    """A text from the clipboard as one line.

    Excel puts all of a paste into the cell that is being edited. So do we; line ends and tabs become spaces, for the cell is one
    line, and those at the end are left out.
    """
    line = _BREAKS.sub(" ", _BREAKS.sub("\n", text).rstrip("\n"))
    return "".join(c for c in line if c.isprintable())


class Entry(Input):
    """One line without a frame. Control characters that the text has from before are displayed as signs, and stay."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+a", "select_all", "Select all", show=False),
    ]

    class CaretMoved(Message):
        """The caret is elsewhere, or the text has changed."""

    def __init__(self, typed: Callable[[str], bool]) -> None:
        self._signs: dict[int, str] = {}
        super().__init__(compact=True, select_on_focus=False)
        self.cursor_blink = False
        self._typed = typed
        self.keys_of_list: frozenset[str] = frozenset()
        """Printable keys that mean something else at present."""

    @property
    def text(self) -> str:
        return self.value.translate({ord(sign): chr(code) for code, sign in self._signs.items()})

    def begin(self, text: str) -> None:
        """Hold the text of a cell, without word of it."""
        self._signs = {code: sign for code, sign in _SIGNS.items() if chr(code) in text and sign not in text}
        with self.prevent(Input.Changed, self.CaretMoved):
            self.write(text)

    def watch_has_focus(self, _has_focus: bool) -> None:
        """It looks the same with the keys and without: Textual would work out its styles again whenever they come and go."""

    def blur(self) -> Self:
        """Keep what there is: Textual calls this when the line is hidden, and would take the keys from whom they were given to."""
        return self

    def write(self, text: str, caret: int | None = None) -> None:
        self.value = text.translate(self._signs)
        self.selection = Selection.cursor(len(text) if caret is None else caret)

    def watch_selection(self) -> None:
        if self.is_mounted:
            self.post_message(self.CaretMoved())

    def on_resize(self) -> None:
        caret = cell_len(self.value[: self.cursor_position])
        self.scroll_to_region(Region(caret, 0, 2, 1), force=True, animate=False)

    def check_consume_key(self, key: str, character: str | None) -> bool:
        return key not in self.keys_of_list and super().check_consume_key(key, character)

    def on_key(self, event: events.Key) -> None:
        """What is typed goes to the list first, if that is open."""
        if event.is_printable and event.character and self._typed(event.character):
            event.stop()
            event.prevent_default()

    def on_paste(self, event: events.Paste) -> None:
        event.stop()
        event.prevent_default()
        self._put(one_line(event.text))

    def action_paste(self) -> None:
        self._put(one_line(self.app.clipboard))

    def _put(self, text: str) -> None:
        if text and not self._typed(text):
            self.replace(text, *self.selection)
