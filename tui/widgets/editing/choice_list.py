"""The list under a cell editor: painted line by line, only what is seen, so that ten thousand values cost what ten do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget

from ...model.chooser import Row
from ...model.completion import Tick
from ...model.layout import cut

MARKS: dict[Tick, str] = {"on": "[x] ", "off": "[ ] ", "+": "[+] ", "-": "[-] "}
LABELS_MEASURED = 200


class ChoiceList(Widget, can_focus=False):
    """Rows, one of them perhaps highlighted. It is given what it shows, and says what is clicked."""

    ALLOW_SELECT = False
    COMPONENT_CLASSES: ClassVar[set[str]] = {"choices--row", "choices--highlight", "choices--more"}
    DEFAULT_CSS = """
    ChoiceList {
        height: auto; width: 1fr;
        .choices--row { color: $foreground; }
        .choices--highlight { background: $block-cursor-background; color: $block-cursor-foreground; text-style: bold; }
        .choices--more { color: $foreground 55%; }
    }
    """

    @dataclass
    class Clicked(Message):
        """A row was clicked."""

        at: int

    def __init__(self) -> None:
        super().__init__()
        self.none_label = ""
        """What row None is called."""
        self.rows: Sequence[Row] = ()
        self.highlight: int | None = None
        self._tick: Callable[[Row], Tick] | None = None
        self._has_boxes = False
        self._top = 0

    def begin(self, none_label: str) -> None:
        """Forget the rows of the cell before."""
        self.none_label, self.rows, self.highlight, self._top = none_label, (), None, 0

    def show(self, rows: Sequence[Row], tick: Callable[[Row], Tick] | None, has_boxes: bool, highlight: int | None) -> None:
        """Show other rows. `tick` says what is chosen, None: nothing is; with boxes, each row has one."""
        if len(rows) != len(self.rows):
            self._top = 0
        self.rows, self._tick, self._has_boxes = rows, tick, has_boxes
        self.move_to(highlight)

    def move_to(self, highlight: int | None) -> None:
        """Highlight a row, the nearest there is."""
        self.highlight = None if highlight is None or not self.rows else max(0, min(highlight, len(self.rows) - 1))
        self.keep_in_view(max(self.size.height, 1))

    def keep_in_view(self, height: int) -> None:
        """Scroll so that the highlight is seen on so many lines."""
        at = self.highlight if self.highlight is not None else self._top
        self._top = max(0, min(max(min(self._top, at), at - height + 1), len(self.rows) - height))
        self.refresh()

    @property
    def wanted_width(self) -> int:
        return max((cell_len(self._text(row)) for row in self.rows[:LABELS_MEASURED]), default=0) + 3

    def _text(self, row: Row) -> str:
        return self._mark(row) + (self.none_label if row is None else row)

    def _mark(self, row: Row) -> str:
        if self._tick is None:
            return ""
        tick = self._tick(row)
        return MARKS[tick] if self._has_boxes else "• " if tick == "on" else "  "

    def render_line(self, y: int) -> Strip:
        width, height = self.size
        at = self._top + y
        if at >= len(self.rows):
            return Strip.blank(width, self.rich_style)
        is_highlight = at == self.highlight
        style = self._style("highlight" if is_highlight else "row")
        text = ("▸" if is_highlight else " ") + self._text(self.rows[at])
        thumb = self._thumb(y, height)
        return Strip([Segment(cut(text, width - 1), style), Segment(thumb, self._style("more"))])

    def _thumb(self, y: int, height: int) -> str:
        """A bar at the right that says where in the list one is."""
        n_rows = len(self.rows)
        if n_rows <= height:
            return " "
        size = max(1, height * height // n_rows)
        start = round((height - size) * self._top / (n_rows - height))
        return "┃" if start <= y < start + size else "│"

    def _style(self, part: str) -> Style:
        return self.get_component_rich_style(f"choices--{part}")

    def on_mouse_down(self, event: events.MouseDown) -> None:
        event.stop()
        if self._top + event.y < len(self.rows):
            self.post_message(self.Clicked(self._top + event.y))

    def on_mouse_scroll_down(self, event: events.MouseScrollDown) -> None:
        self._scroll(event, 3)

    def on_mouse_scroll_up(self, event: events.MouseScrollUp) -> None:
        self._scroll(event, -3)

    def _scroll(self, event: events.MouseEvent, lines: int) -> None:
        event.stop()
        self._top = max(0, min(self._top + lines, len(self.rows) - self.size.height))
        self.refresh()
