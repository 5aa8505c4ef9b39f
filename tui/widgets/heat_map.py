"""A map of squares with numbers in them, to move about in. What a colour says, the number says too.

Rows and columns have labels; row labels and the line of column labels stay where they are. The number is a percentage that is
never rounded to 0 or 100; what cannot be measured is a dot.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
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

from .cursor_lines import PAGES, style_names
from .fitted import fitted

ROOMY = 9
"""Where there is room a square takes so many cells for each line it is high."""
TALLEST = 3
"""A square is so many lines high at most."""
UNDER = 3
"""Lines for the labels of the columns, and for the legend below the squares."""
STEPS = ("<20", "<40", "<60", "<80", "<100")
LEGEND = (("empty", "0"), *((f"step-{at}", text) for at, text in enumerate(STEPS)), ("full", "100"))
COVERED = "% covered"
NARROW = 5
"""A square takes so many cells at least: "[100]"."""


@dataclass(frozen=True, slots=True)
class Square:
    """One square: a share between two ends, all equal where it is known; None where there is none."""

    share: float | None
    lower: float = 0.0
    upper: float = 1.0

    @property
    def text(self) -> str:
        """The share in at most three cells: "0", "<1", "42", ">99", "100"; a dot where there is none.

        An estimate is never 0 or 100: where every sample was, the end of its interval is given, as in "<4" or ">96".
        """
        if self.share is None:
            return "·"
        if self.share <= 0.0 and self.upper > 0.0:
            return f"<{math.ceil(100.0 * self.upper)}"
        if self.share >= 1.0 and self.lower < 1.0:
            return f">{math.floor(100.0 * self.lower)}"
        return short_percent(self.share)

    @property
    def level(self) -> str:
        """In which of the colours it is: 0, five steps of twenty, 100; "none" where there is no share."""
        if self.share is None:
            return "none"
        if self.share <= 0.0 or self.share >= 1.0:
            is_known = self.lower == self.upper
            return ("empty" if is_known else "step-0") if self.share <= 0.0 else ("full" if is_known else "step-4")
        return f"step-{min(int(self.share * 5), 4)}"


def short_percent(share: float) -> str:
    """A share in at most three characters that is 0 or 100 only where it is."""
    if share <= 0.0 or share >= 1.0:
        return "0" if share <= 0.0 else "100"
    percent = round(100.0 * share)
    return "<1" if percent < 1 else ">99" if percent > 99 else str(percent)


class HeatMap(ScrollView, can_focus=True):
    """Squares in rows and columns, one of which is chosen."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "move(-1, 0)", "Up", show=False),
        Binding("down", "move(1, 0)", "Down", show=False),
        Binding("left", "move(0, -1)", "Left", show=False),
        Binding("right", "move(0, 1)", "Right", show=False),
        *PAGES,
        Binding("home", "end_of_row(-1)", "First", show=False),
        Binding("end", "end_of_row(1)", "Last", show=False),
        Binding("enter", "choose", "Open", show=False),
    ]
    DEFAULT_CSS = """
    HeatMap {
        background: $surface;
        scrollbar-size-vertical: 1; scrollbar-size-horizontal: 1;
        & .heat-map--label { color: $text-muted; }
        & .heat-map--here { color: $foreground; text-style: bold; }
        & .heat-map--none { color: $text-muted; }
        & .heat-map--empty { background: $error 55%; color: $foreground; }
        & .heat-map--step-0 { background: $error 38%; color: $foreground; }
        & .heat-map--step-1 { background: $error 22%; color: $foreground; }
        & .heat-map--step-2 { background: $warning 18%; color: $foreground; }
        & .heat-map--step-3 { background: $success 16%; color: $foreground; }
        & .heat-map--step-4 { background: $success 32%; color: $foreground; }
        & .heat-map--full { background: $success 55%; color: $foreground; }
        &:nocolor {
            & .heat-map--step-0 { background: $foreground 30%; }
            & .heat-map--empty { background: $foreground 38%; }
            & .heat-map--step-1 { background: $foreground 23%; }
            & .heat-map--step-2 { background: $foreground 17%; }
            & .heat-map--step-3 { background: $foreground 11%; }
            & .heat-map--step-4 { background: $foreground 6%; }
            & .heat-map--full { background: $surface; }
        }
        &:ansi {
            & .heat-map--empty { background: ansi_default; color: ansi_red; text-style: bold; }
            & .heat-map--step-0, & .heat-map--step-1 { background: ansi_default; color: ansi_red; }
            & .heat-map--step-2, & .heat-map--step-3 { background: ansi_default; color: ansi_yellow; }
            & .heat-map--step-4 { background: ansi_default; color: ansi_green; }
            & .heat-map--full { background: ansi_default; color: ansi_green; text-style: bold; }
        }
    }
    """
    COMPONENT_CLASSES: ClassVar[set[str]] = style_names(DEFAULT_CSS)

    @dataclass
    class Moved(Message):
        """Another square is the chosen one."""

        map: HeatMap
        row: int
        column: int

        @property
        def control(self) -> HeatMap:
            return self.map

    @dataclass
    class Chosen(Message):
        """Enter, or a click on the chosen square."""

        map: HeatMap
        row: int
        column: int

        @property
        def control(self) -> HeatMap:
            return self.map

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self.rows: tuple[str, ...] = ()
        self.columns: tuple[str, ...] = ()
        self.place = (0, 0)
        self._square: Callable[[int, int], Square] = lambda row, column: Square(None)
        self._most_wide = NARROW
        self.corner = ""
        """Stands over the row labels."""

    def show(
        self,
        rows: Sequence[str],
        columns: Sequence[str],
        square: Callable[[int, int], Square],
        place: tuple[int, int] = (0, 0),
        most_wide: int = NARROW,
        corner: str = "",
    ) -> None:
        """Show these squares; columns may be up to `most_wide` cells wide, where their labels need it."""
        self.corner = corner
        self.rows, self.columns, self._square = tuple(rows), tuple(columns), square
        self._most_wide = max(NARROW, most_wide)
        self._resize()
        self.place = (-1, -1)
        self.go(*place)
        self.refresh(layout=self.styles.is_auto_height)

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """As high as the squares are on half of the screen."""
        room = viewport.height // 2 - UNDER
        return len(self.rows) * max(1, min(TALLEST, room // max(1, len(self.rows)))) + UNDER

    @property
    def label_width(self) -> int:
        """How wide the row labels are."""
        longest = max((cell_len(label) for label in (*self.rows, self.corner)), default=0)
        return min(longest, max(8, self.scrollable_content_region.width * 2 // 5)) + 1

    @property
    def square_width(self) -> int:
        """How wide a square is: as its column's label needs, where there is room."""
        longest = max((cell_len(label) + 2 for label in self.columns), default=0)
        room = (self.scrollable_content_region.width - self.label_width) // max(1, len(self.columns))
        roomy = ROOMY * self.square_height
        return max(NARROW, min(max(longest, roomy), max(self._most_wide, roomy), room))

    @property
    def square_height(self) -> int:
        """How high a square is: as many lines as all rows have room for."""
        room = self.scrollable_content_region.height - UNDER
        return max(1, min(TALLEST, room // max(1, len(self.rows))))

    def go(self, row: int, column: int) -> None:
        before = self.place
        self.place = max(0, min(row, len(self.rows) - 1)), max(0, min(column, len(self.columns) - 1))
        self._keep_in_sight()
        if self.place != before:
            self.refresh()
        if self.rows and self.columns:
            self.post_message(self.Moved(self, *self.place))

    def _resize(self) -> None:
        self.virtual_size = Size(self.label_width + len(self.columns) * self.square_width, len(self.rows) * self.square_height + 1)

    def _keep_in_sight(self) -> None:
        row, column = self.place
        region, wide = self.scrollable_content_region, self.square_width
        height, width = max(1, region.height - 1), max(wide, region.width - self.label_width)
        tall = self.square_height
        y = min(max(self.scroll_offset.y, (row + 1) * tall - height), row * tall)
        x = min(max(self.scroll_offset.x, (column + 1) * wide - width), column * wide)
        if (x, y) != (self.scroll_offset.x, self.scroll_offset.y):
            self.scroll_to(x=x, y=y, animate=False, immediate=True)

    # ---- keys and mouse

    def action_move(self, down: int, right: int) -> None:
        self.go(self.place[0] + down, self.place[1] + right)

    def action_page(self, down: int) -> None:
        """Go as far as is seen."""
        self.go(self.place[0] + down * max(1, (self.scrollable_content_region.height - 2) // self.square_height), self.place[1])

    def action_end_of_row(self, right: int) -> None:
        """Go to the first or last column."""
        self.go(self.place[0], 0 if right < 0 else len(self.columns) - 1)

    def action_choose(self) -> None:
        if self.rows and self.columns:
            self.post_message(self.Chosen(self, *self.place))

    def on_click(self, event: events.Click) -> None:
        """Go to the square clicked; open the chosen one."""
        column = (event.x - self.label_width + self.scroll_offset.x) // self.square_width
        row = (event.y - 1 + self.scroll_offset.y) // self.square_height
        if event.y < 1 or event.x < self.label_width or row >= len(self.rows) or column >= len(self.columns):
            return
        if (row, column) == self.place:
            self.action_choose()
        else:
            self.go(row, column)

    def on_resize(self) -> None:
        self._resize()
        if self.rows:
            self.go(*self.place)

    # ---- painting

    def render_line(self, y: int) -> Strip:
        width, base = self.scrollable_content_region.width, self.rich_style
        tall = self.square_height
        row, line = divmod(y - 1 + self.scroll_offset.y, tall)
        if y > 0 and row >= len(self.rows):
            is_legend = self.rows and row * tall + line == len(self.rows) * tall + 1
            return self._legend(width, base) if is_legend else Strip.blank(width, base)
        labels, is_named = self.label_width, line == tall // 2
        name = self.corner if y == 0 else self.rows[row] if is_named else ""
        head = self._label(name, labels, y > 0 and row == self.place[0])
        wide = self.square_width
        first = self.scroll_offset.x // wide
        last = min(len(self.columns), first + (width - labels) // wide + 2)
        paint = self._column_label if y == 0 else self._painted if is_named else self._plain
        body = Strip([segment for column in range(first, last) for segment in paint(row, column, wide)])
        cut = self.scroll_offset.x - first * wide
        body = body.crop(cut, cut + max(0, width - labels))
        return Strip.join([Strip([head]), body]).adjust_cell_length(width, base)

    def _legend(self, width: int, base: Style) -> Strip:
        """What the colours mean, two lines below the squares where there is room."""
        needed = sum(len(text) + 3 for _, text in LEGEND) + len(COVERED)
        parts = [Segment(" " * max(0, min(self.label_width, width - needed)), base)]
        for level, text in LEGEND:
            parts += [Segment(f" {text} ", self.get_component_rich_style(f"heat-map--{level}")), Segment(" ", base)]
        parts.append(Segment(COVERED, self.get_component_rich_style("heat-map--label")))
        return Strip(parts).adjust_cell_length(width, base)

    def _label(self, text: str, width: int, is_here: bool) -> Segment:
        kind = "heat-map--here" if is_here else "heat-map--label"
        return Segment(fitted(text, width - 1) + " ", self.get_component_rich_style(kind))

    def _column_label(self, row: int, column: int, wide: int) -> list[Segment]:
        kind = "heat-map--here" if column == self.place[1] else "heat-map--label"
        return [Segment(f"{fitted(self.columns[column], wide - 1, True)} ", self.get_component_rich_style(kind))]

    def _plain(self, row: int, column: int, wide: int) -> list[Segment]:
        """A line of a square above or below its number."""
        style = self.get_component_rich_style(f"heat-map--{self._square(row, column).level}")
        is_here = (row, column) == self.place
        return [Segment(" " * wide, self._chosen(style) if is_here else style)]

    def _chosen(self, style: Style) -> Style:
        """The colours of the chosen square: turned round where the keys are here. Only the terminal can turn its own colours."""
        ground = style.bgcolor
        if not self.has_focus:
            return style
        if ground is None or ground.is_default or ground.number is not None:
            return style + Style(reverse=True)
        return style + Style(color=ground, bgcolor=style.color)

    def _painted(self, row: int, column: int, wide: int) -> list[Segment]:
        square = self._square(row, column)
        style = self.get_component_rich_style(f"heat-map--{square.level}")
        if (row, column) == self.place:
            text = fitted(f"[{square.text}", wide - 1, True) + "]"
            return [Segment(text, self._chosen(style) + Style(bold=True))]
        return [Segment(fitted(square.text, wide - 1, True) + " ", style)]
