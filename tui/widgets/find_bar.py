"""The bars over the foot of the sheet: find and replace, and the filter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.compose import compose
from textual.containers import Horizontal
from textual.message import Message
from textual.widgets import Button, Checkbox, Input, Static

from ..model.find import Search
from .ticks import Tick

CSS = """
{name} {{
    height: auto; background: $panel; display: none;
    &.-open {{ display: block; }}
    & Horizontal {{ height: 1; width: 100%; }}
    & Static {{ width: auto; padding: 0 1; color: $foreground 75%; }}
    & Input {{ width: 1fr; min-width: 10; }}
    & Checkbox {{ width: auto; margin: 0 1; background: transparent; }}
}}
"""


class SheetBar(Horizontal):
    """A bar that opens over the foot of the sheet and closes with Escape."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "close", "Close")]

    @dataclass
    class Closed(Message):
        """The bar was closed: the grid takes the keys again."""

    def parts(self) -> ComposeResult:
        """What is in it. It is made when the bar is opened first: a table that is only looked at needs none of it."""
        raise NotImplementedError

    async def open(self) -> None:
        """Show it, ready to type in."""
        if not self.children:
            await self.mount_all(compose(self, self.parts()))
        self.add_class("-open")
        entry = self.query(Input).first()
        entry.focus()
        entry.action_select_all()

    def action_close(self) -> None:
        self.remove_class("-open")
        self.post_message(self.Closed())


class FindBar(SheetBar):
    """Find and replace: two entries, three switches, two buttons, all in one bar."""

    DEFAULT_CSS = CSS.format(name="FindBar") + "FindBar { layout: vertical; }"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("down,f3", "next(False)", "Next"),
        Binding("up,shift+f3", "next(True)", "Previous"),
        Binding("alt+r", "replace", "Replace"),
        Binding("alt+a", "replace_all", "Replace all"),
        Binding("tab", "turn(1)", "Next part", show=False),
        Binding("shift+tab", "turn(-1)", "Part before", show=False),
    ]
    ORDER = ("text", "replacement", "selection", "replace", "all", "whole", "case", "pattern")
    """Where Tab goes: from the text to what replaces it."""

    @dataclass
    class Sought(Message):
        """Go to the next matching cell; or only count them, as the text is typed."""

        search: Search
        is_backwards: bool = False
        only_counts: bool = False

    @dataclass
    class Replaced(Message):
        """Replace the matches: in the cursor's cell, in every visible cell, or in those selected."""

        search: Search
        replacement: str
        is_all: bool
        in_selection: bool

    def parts(self) -> ComposeResult:
        with Horizontal():
            yield Static("Find")
            yield Input(compact=True, id="find-text", placeholder="text")
            yield Tick("whole", id="find-whole")
            yield Tick("case", id="find-case")
            yield Tick("pattern", id="find-pattern")
            yield Static("", id="find-count")
        with Horizontal():
            yield Static("Replace with")
            yield Input(compact=True, id="find-replacement")
            yield Tick("in selection", id="find-selection")
            yield Button("Replace", compact=True, id="find-replace")
            yield Button("All", compact=True, id="find-all")

    @property
    def search(self) -> Search:
        text = self.query_one("#find-text", Input).value
        return Search(text, self._is("whole"), self._is("case"), self._is("pattern"))

    def say(self, text: str) -> None:
        for count in self.query("#find-count").results(Static):
            count.update(text)

    def action_next(self, is_backwards: bool) -> None:
        self.post_message(self.Sought(self.search, is_backwards))

    def action_turn(self, step: int) -> None:
        """Go to another part of the bar."""
        here = (self.screen.focused.id or "").removeprefix("find-") if self.screen.focused else ""
        at = self.ORDER.index(here) + step if here in self.ORDER else 0
        self.query_one(f"#find-{self.ORDER[at % len(self.ORDER)]}").focus()

    def action_replace(self) -> None:
        """Replace in the cursor's cell and go on."""
        self._replace(False)

    def action_replace_all(self) -> None:
        self._replace(True)

    def _replace(self, is_all: bool) -> None:
        text = self.query_one("#find-replacement", Input).value
        self.post_message(self.Replaced(self.search, text, is_all, self._is("selection")))

    def _is(self, name: str) -> bool:
        return self.query_one(f"#find-{name}", Checkbox).value

    def on_input_submitted(self, event: Input.Submitted) -> None:
        event.stop()
        if event.input.id == "find-replacement":
            self.action_replace()
        else:
            self.action_next(False)

    def on_input_changed(self, event: Input.Changed) -> None:
        event.stop()
        if event.input.id == "find-text":
            self.post_message(self.Sought(self.search, only_counts=True))

    def on_checkbox_changed(self, event: Checkbox.Changed) -> None:
        event.stop()
        self.post_message(self.Sought(self.search, only_counts=True))

    def on_button_pressed(self, event: Button.Pressed) -> None:
        event.stop()
        self._replace(event.button.id == "find-all")


class FilterBar(SheetBar):
    """Which rows are displayed."""

    DEFAULT_CSS = CSS.format(name="FilterBar")

    @dataclass
    class Wanted(Message):
        """Show only rows with this text."""

        text: str
        in_column: bool
        """Only the column of the cursor is looked at."""
        is_valid: bool
        has_findings: bool

    def parts(self) -> ComposeResult:
        with Horizontal():
            yield Static("Filter")
            yield Input(compact=True, id="filter-text", placeholder="rows with this text; in a column also <3, not Walk")
            yield Tick("this column", id="filter-column")
            yield Tick("valid", id="filter-valid")
            yield Tick("with problems", id="filter-problems")
            yield Button("Clear", compact=True, id="filter-clear")

    def clear(self) -> None:
        for entry in self.query(Input):
            entry.value = ""
        for box in self.query(Checkbox):
            box.value = False
        self.post_message(self.Wanted("", False, False, False))

    def clear_text(self) -> None:
        """Take the text away, without a word: what it requested stays, or has been taken off."""
        with self.prevent(Input.Changed):
            for entry in self.query(Input):
                entry.value = ""

    def _tell(self) -> None:
        text = self.query_one(Input).value
        column, valid, problems = (self.query_one(f"#filter-{n}", Checkbox).value for n in ("column", "valid", "problems"))
        self.post_message(self.Wanted(text, column, valid, problems))

    def on_input_changed(self, event: Input.Changed) -> None:
        event.stop()
        self._tell()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        event.stop()
        self.post_message(self.Closed())

    def on_checkbox_changed(self, event: Checkbox.Changed) -> None:
        event.stop()
        self._tell()

    def on_button_pressed(self, event: Button.Pressed) -> None:
        event.stop()
        self.clear()
