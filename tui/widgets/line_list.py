"""A list with columns of which only the visible lines are built, so that it may be of any length.

The lines come from a function; cells are cut to their column's width. Columns have a width, or grow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import ClassVar

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.binding import Binding, BindingType
from textual.geometry import Size
from textual.message import Message
from textual.scroll_view import ScrollView
from textual.strip import Strip

from ..model.layout import cut_middle
from .cursor_lines import PAGES, UP_DOWN, style_names
from .fitted import fitted

ListCell = str | tuple[str, str] | Callable[[int], str]
"""A text, or a text and its tone ("error", "warning", "info", "muted" or "strong"), or the text that suits a width."""
MARK = "▸ "


@dataclass(frozen=True, slots=True)
class ListColumn:
    """A column: so wide at least, and which part of the rest of the line it gets. Names are cut in their middle."""

    title: str
    width: int
    grow: int = 0
    to_right: bool = False
    is_name: bool = False


class LineList(ScrollView, can_focus=True):
    """A list to look through and choose from."""

    BINDINGS: ClassVar[list[BindingType]] = [
        *UP_DOWN,
        *PAGES,
        Binding("home", "go(0)", "First", show=False),
        Binding("end", "last", "Last", show=False),
        Binding("enter", "choose", "Choose", show=False),
    ]
    DEFAULT_CSS = """
    LineList {
        background: $surface;
        scrollbar-size-vertical: 1;
        & .line-list--header { color: $text-muted; text-style: underline; }
        & .line-list--cursor { background: $panel; }
        & .line-list--error { color: $text-error; text-style: bold; }
        & .line-list--warning { color: $text-warning; }
        & .line-list--info { color: $text-accent; }
        & .line-list--muted { color: $text-muted; }
        & .line-list--strong { text-style: bold; }
        &:focus .line-list--cursor { background: $primary 40%; }
        &:ansi .line-list--cursor { background: ansi_blue; color: ansi_bright_white; }
    }
    """
    COMPONENT_CLASSES: ClassVar[set[str]] = style_names(DEFAULT_CSS)

    @dataclass
    class Moved(Message):
        """The cursor is on another line, or the lines are others."""

        list: LineList
        index: int
        """-1: there is no line."""

        @property
        def control(self) -> LineList:
            return self.list

    @dataclass
    class Chosen(Message):
        """Enter, or a click on the line of the cursor."""

        list: LineList
        index: int

        @property
        def control(self) -> LineList:
            return self.list

    def __init__(self, columns: Sequence[ListColumn], *, empty: str = "Nothing.", id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self.columns = tuple(columns)
        self.empty = empty
        """Stands there when there is no line."""
        self.n_lines = self._most_lines = 0
        self.index = 0
        self._line: Callable[[int], Sequence[ListCell]] = lambda at: ()

    def show(self, n_lines: int, line: Callable[[int], Sequence[ListCell]], index: int = 0) -> None:
        """Show these lines, with the cursor on one of them."""
        has_grown, self.n_lines, self._line = n_lines != self.n_lines, n_lines, line
        self.virtual_size = Size(0, n_lines + 1)
        self.index = -1
        self.go(index)
        self.refresh(layout=has_grown and self.styles.is_auto_height)

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """The titles and every line, or those that say that there is none. It never shrinks: nothing jumps while one types."""
        self._most_lines = max(self._most_lines, self.n_lines)
        return 1 + (self._most_lines or len(self._empty_lines(width)))

    def say_empty(self, text: str) -> None:
        """Say something else where there is no line."""
        if text != self.empty:
            self.empty = text
            self.refresh()

    def go(self, index: int) -> None:
        before, self.index = self.index, max(0, min(index, self.n_lines - 1))
        height = max(1, self.scrollable_content_region.height - 1)
        top = self.scroll_offset.y
        wanted = min(max(top, self.index - height + 1), self.index)
        if wanted != top:
            self.scroll_to(y=wanted, animate=False, immediate=True)
        if before != self.index:
            self.refresh()
        self.post_message(self.Moved(self, self.index if self.n_lines else -1))

    # ---- keys and mouse

    def action_move(self, down: int) -> None:
        self.go(self.index + down)

    def action_page(self, down: int) -> None:
        """Move the cursor by what is seen."""
        self.go(self.index + down * max(1, self.scrollable_content_region.height - 2))

    def action_go(self, index: int) -> None:
        self.go(index)

    def action_last(self) -> None:
        """Move the cursor to the last line."""
        self.go(self.n_lines - 1)

    def action_choose(self) -> None:
        if self.n_lines:
            self.post_message(self.Chosen(self, self.index))

    def on_click(self, event: events.Click) -> None:
        """Go to the line clicked; choose the one where the cursor is already."""
        index = event.y - 1 + self.scroll_offset.y
        if event.y < 1 or index >= self.n_lines:
            return
        if index == self.index:
            self.action_choose()
        else:
            self.go(index)

    def on_resize(self) -> None:
        if self.n_lines:
            self.go(self.index)

    # ---- painting

    def render_line(self, y: int) -> Strip:
        width = self.scrollable_content_region.width
        base = self.rich_style
        if y == 0:
            style = base + self._tone("header")
            titles = [_titled(c.title, w, c.to_right) for c, w in zip(self.columns, self._widths(width), strict=True)]
            return _strip([Segment("  ", base), *_spaced(titles, style, base)], width, base)
        index = y - 1 + self.scroll_offset.y
        if not self.n_lines and y <= len(empty_lines := self._empty_lines(width)):
            return _strip([Segment(fitted(f"  {empty_lines[y - 1]}", width), base + self._tone("muted"))], width, base)
        if index >= self.n_lines:
            return Strip.blank(width, base)
        return self._line_strip(index, width, base)

    def _empty_lines(self, width: int) -> list[str]:
        return wrap(self.empty, max(8, width - 4)) or [""]

    def _line_strip(self, index: int, width: int, base: Style) -> Strip:
        is_here = index == self.index
        style = base
        cursor = self._cursor if is_here else Style.null()
        segments = [Segment(MARK if is_here else "  ", style + cursor)]
        for cell, column, w in zip(self._line(index), self.columns, self._widths(width), strict=True):
            text, tone = cell if isinstance(cell, tuple) else (cell if isinstance(cell, str) else cell(w), "")
            text = cut_middle(text, w) if column.is_name and 0 < w < cell_len(text) else text
            segments.append(Segment(fitted(text, w, column.to_right), style + self._tone(tone) + cursor))
            segments.append(Segment("  ", style + cursor))
        return _strip(segments, width, style + cursor)

    @property
    def _cursor(self) -> Style:
        """The ground of the line of the cursor; in colours of the terminal, of which no other can be read on it, its text too."""
        whole = self.get_component_rich_style("line-list--cursor")
        is_terminals = whole.bgcolor is not None and whole.bgcolor.number is not None
        return Style(bgcolor=whole.bgcolor, color=whole.color if is_terminals else None, bold=True)

    def _tone(self, tone: str) -> Style:
        """The colour of a tone as it is on the list's background, and whether it is bold or underlined."""
        if not tone:
            return Style.null()
        whole = self.get_component_rich_style(f"line-list--{tone}")
        return Style(color=whole.color, bold=whole.bold, underline=whole.underline)

    def _widths(self, width: int) -> list[int]:
        """The columns' widths: what is left over is shared by those that grow; too narrow a screen cuts the last ones."""
        left = width - 2 - sum(c.width + 2 for c in self.columns) + 2
        parts = sum(c.grow for c in self.columns)
        widths = [c.width + (max(0, left) * c.grow // parts if parts else 0) for c in self.columns]
        for at in reversed(range(len(widths))):
            if left < 0 and self.columns[at].grow:
                cut = min(-left, max(0, widths[at] - 6))
                widths[at], left = widths[at] - cut, left + cut
        return widths


def _titled(title: str, width: int, to_right: bool) -> str:
    """A title, which may be the name of a condition, in so many cells."""
    return cut_middle(title, width) if 0 < width < cell_len(title) else fitted(title, width, to_right)


def _spaced(texts: Sequence[str], style: Style, base: Style) -> list[Segment]:
    segments = []
    for text in texts:
        segments += [Segment(text, style), Segment("  ", base)]
    return segments


def _strip(segments: list[Segment], width: int, style: Style) -> Strip:
    return Strip(segments).adjust_cell_length(width, style)
