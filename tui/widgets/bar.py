"""A line of things to click: the tabs, the tools. Each is also a command with a key or a place in the palette."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget

from ..model.layout import cut


@dataclass(frozen=True)
class Item:
    """One thing to click."""

    command: str
    """The id of a command, given in `Pressed`; empty: only a text."""
    label: str
    is_on: bool = False
    """It is the one that is chosen."""
    is_strong: bool = False
    is_spare: bool = False
    """It is left out before any other item is."""


class Bar(Widget):
    """Items from the left, one text at the right. What does not fit is left out: the text, then spare items, then the last ones,
    and for the chosen one those before it but the first."""

    ALLOW_SELECT = False
    COMPONENT_CLASSES: ClassVar[set[str]] = {"bar--item", "bar--on", "bar--strong", "bar--text", "bar--hover"}

    DEFAULT_CSS = """
    Bar {
        height: 1; background: $panel;
        .bar--item { color: $foreground 75%; }
        .bar--on { color: $foreground; background: $surface; text-style: bold underline; }
        .bar--strong { color: $text-primary; text-style: bold; }
        .bar--text { color: $foreground 55%; }
        .bar--hover { color: $foreground; text-style: underline; }
    }
    """

    @dataclass
    class Pressed(Message):
        """An item was clicked."""

        command: str

    def __init__(self, items: Sequence[Item] = (), text: str = "", id: str | None = None) -> None:  # noqa: A002 - Textual's name
        super().__init__(id=id)
        self._items = tuple(items)
        self._text = text
        self._hovered: str | None = None

    def show(self, items: Sequence[Item], text: str = "") -> None:
        if (tuple(items), text) != (self._items, self._text):
            self._items, self._text = tuple(items), text
            self.refresh()

    def render_line(self, y: int) -> Strip:
        segments = [Segment(f" {item.label} ", self._style(item)) for item in self._fitting()]
        used = sum(s.cell_length for s in segments)
        room = self.size.width - used - 2
        plain = self._of("bar--text")
        if room >= cell_len(self._text):
            segments += [Segment(" " * (room - cell_len(self._text)), plain), Segment(f" {self._text} ", plain)]
        return Strip(segments).adjust_cell_length(self.size.width, plain)

    def _fitting(self) -> list[Item]:
        items, fitting, used = self._items, list[Item](), 0
        if sum(cell_len(item.label) + 2 for item in items) > self.size.width:
            items = tuple(item for item in items if not item.is_spare)
        chosen = next((at for at, item in enumerate(items) if item.is_on), 0)
        while chosen > 1 and sum(cell_len(item.label) + 2 for item in items[: chosen + 1]) > self.size.width:
            items, chosen = items[:1] + items[2:], chosen - 1
        for item in items:
            used += cell_len(item.label) + 2
            if used > self.size.width and fitting:
                break
            fitting.append(item)
        return fitting

    def _style(self, item: Item) -> Style:
        if item.is_on or item.is_strong:
            return self._of("bar--on" if item.is_on else "bar--strong")
        return self._of("bar--hover" if item.command and item.command == self._hovered else "bar--item")

    def _of(self, name: str) -> Style:
        return self.get_component_rich_style(name)

    def _item_at(self, x: int) -> Item | None:
        end = 0
        for item in self._fitting():
            end += cell_len(item.label) + 2
            if x < end:
                return item
        return None

    def on_click(self, event: events.Click) -> None:
        item = self._item_at(event.x)
        if item is not None and item.command:
            self.post_message(self.Pressed(item.command))

    def on_mouse_move(self, event: events.MouseMove) -> None:
        item = self._item_at(event.x)
        self._hover(item.command if item else None)

    def on_leave(self) -> None:
        self._hover(None)

    def _hover(self, command: str | None) -> None:
        if command != self._hovered:
            self._hovered = command
            self.refresh()


class StatusLine(Widget):
    """One line with a text at its left and one at its right; showing others is cheap, for no widget changes its size."""

    ALLOW_SELECT = False
    DEFAULT_CSS = "StatusLine { height: 1; background: $surface; color: $foreground 75%; }"

    def __init__(self) -> None:
        super().__init__()
        self._texts = ("", "")

    def show(self, left: str | None = None, right: str | None = None) -> None:
        """Show other texts; None: the one that is there."""
        texts = (self._texts[0] if left is None else left, self._texts[1] if right is None else right)
        if texts != self._texts:
            self._texts = texts
            self.refresh()

    def has_room(self, left: str) -> bool:
        """Whether a text at the left would be seen whole; so it is before the line has a size."""
        right = self._texts[1]
        return not self.size.width or cell_len(left) + 1 <= self.size.width - (cell_len(right) + 2 if right else 0)

    def render_line(self, y: int) -> Strip:
        left, right = self._texts
        width, style = self.size.width, self.rich_style
        if not right:
            return Strip([Segment(cut(f" {left}", width), style)])
        room = max(width - cell_len(right) - 2, 0)
        return Strip([Segment(cut(f" {left}", room), style), Segment(f" {right} ", style)]).adjust_cell_length(width, style)


LEAST_TO_ANSWER = 40
"""In a narrower window the line says where the cursor is, and nothing of what plays."""


class CellLine(Widget):
    """The line over the grid: which cell the cursor is in, all of its text, and what is wrong with it; at its right what plays."""

    ALLOW_SELECT = False
    COMPONENT_CLASSES: ClassVar[set[str]] = {
        *("cell-line--place", "cell-line--text", "cell-line--fault", "cell-line--about", "cell-line--plays", "cell-line--nothing"),
    }

    DEFAULT_CSS = """
    CellLine {
        height: 1; background: $surface;
        .cell-line--place { color: $text-primary; text-style: bold; }
        .cell-line--text { color: $foreground; }
        .cell-line--fault { color: $text-error; text-style: bold; }
        .cell-line--about { color: $foreground 55%; }
        .cell-line--plays { background: $success; color: $background; text-style: bold; }
        .cell-line--nothing { background: $warning; color: $background; text-style: bold; }
    }
    """

    def __init__(self) -> None:
        super().__init__()
        self._parts = ("", "", "", "")
        self._answer = ("", False)

    def show(self, place: str, text: str, fault: str = "", about: str = "") -> None:
        """Show a cell: where it is, its text, what is wrong with it, and what its column is about."""
        if (place, text, fault, about) != self._parts:
            self._parts = (place, text, fault, about)
            self.refresh()

    def answer(self, text: str, plays: bool) -> None:
        """Show what plays, the loudest of all; an empty text: nothing was asked."""
        if (text, plays) != self._answer:
            self._answer = (text, plays)
            self.refresh()

    def render_line(self, y: int) -> Strip:
        text, plays = self._answer
        if not text or self.size.width < LEAST_TO_ANSWER:
            return self._cell(self.size.width)
        answer = f" {cut(text, min(cell_len(text), self.size.width * 3 // 5))} "
        segment = Segment(answer, self._of("plays" if plays else "nothing"))
        return Strip([*self._cell(max(self.size.width - cell_len(answer), 0)), segment])

    def _cell(self, width: int) -> Strip:
        """What stands of the cell, so wide."""
        place, text, fault, about = self._parts
        plain = self._of("about")
        segments = [
            Segment(f" {cut(place, min(cell_len(place), width // 2))}  ", self._of("place")),
            Segment(cut(text, min(cell_len(text), width)) if text else "", self._of("text")),
        ]
        if fault:
            segments.append(Segment(f"  ! {fault}", self._of("fault")))
        elif about:
            segments.append(Segment(f"   {about}", plain))
        strip = Strip(segments)
        if strip.cell_length > width:
            strip = Strip.join([strip.crop(0, width - 1), Strip([Segment("…", plain)])])
        return strip.adjust_cell_length(width, plain)

    def _of(self, part: str) -> Style:
        return self.get_component_rich_style(f"cell-line--{part}")
