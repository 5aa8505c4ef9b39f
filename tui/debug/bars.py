"""Bars for every frame of every asset: a line an asset, the taller a bar the cheaper, coloured by why a frame may not be chosen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from rich.segment import Segment
from rich.style import Style
from textual.binding import BindingType
from textual.message import Message
from textual.strip import Strip

from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.trace.cost_views import cost_text

from ..widgets.cursor_lines import PAGES, CursorLines, style_names
from ..widgets.fitted import fitted
from .landscape import LEVELS, Landscape, Row
from .timeline import BARS

LEAST_NAME, MOST_NAME, COST = 12, 34, 9
TIMES = (LeftOut.JUMP, LeftOut.HISTORY, LeftOut.PHASE)


class Bars(CursorLines):
    """What every frame of every asset costs."""

    BINDINGS: ClassVar[list[BindingType]] = PAGES
    DEFAULT_CSS = """
    Bars {
        background: $surface;
        & .bars--head { color: $text-muted; }
        & .bars--name { color: $foreground; }
        & .bars--out { color: $foreground 45%; }
        & .bars--cursor { background: $boost; text-style: bold; }
        & .bars--free { color: $primary; }
        & .bars--invalid { color: $error 45%; }
        & .bars--marked { color: $warning 60%; }
        & .bars--recent { color: $foreground 40%; }
        & .bars--chosen { color: $background; background: $success; text-style: bold; }
        & .bars--playing { color: $background; background: $warning; text-style: bold; }
        &:focus .bars--cursor { background: $primary 35%; }
        &:ansi .bars--cursor { background: ansi_blue; color: ansi_bright_white; }
    }
    """
    COMPONENT_CLASSES: ClassVar[set[str]] = style_names(DEFAULT_CSS)

    @dataclass
    class Moved(Message):
        """The cursor is at another asset."""

        row: Row | None

    def __init__(self) -> None:
        super().__init__(id="bars")
        self.landscape = Landscape({})
        self.rows: list[Row] = []
        self.chosen: tuple[str, int] | None = None
        """Database and frame of what the search chooses."""
        self.playing: tuple[str, int] | None = None
        """And of what would have played on."""
        self.choices: dict[str, bool] = {}
        """The assets that the person here would have chosen, and would not."""
        self.note = ""
        """Why there are no bars."""

    @property
    def row(self) -> Row | None:
        return self.rows[self.at] if self.rows else None

    def show(self, landscape: Landscape, rows: list[Row], note: str) -> None:
        """Show these rows; the cursor stays at its asset."""
        before = self.row
        self.landscape, self.rows, self.note = landscape, rows, note
        key = None if before is None else (before.database, before.asset, before.mirrored)
        places = [i for i, row in enumerate(rows) if (row.database, row.asset, row.mirrored) == key]
        self.at = places[0] if places else 0
        self.keep_in_sight()
        self.refresh()

    @property
    def n_lines(self) -> int:
        return len(self.rows)

    def moved(self) -> None:
        self.post_message(self.Moved(self.row))

    def on_mouse_scroll_up(self) -> None:
        self.go(self.at - 3)

    def on_mouse_scroll_down(self) -> None:
        self.go(self.at + 3)

    # ---- painting

    @property
    def _name_width(self) -> int:
        longest = max((len(row.name) for row in self.rows), default=LEAST_NAME)
        return min(max(LEAST_NAME, longest), MOST_NAME, max(LEAST_NAME, self.size.width * 2 // 5))

    def render_line(self, y: int) -> Strip:
        width = self.size.width
        if y == 0:
            head = f"  {fitted('asset', self._name_width)} {'best':>{COST}} every frame: tall is cheap"
            return Strip([Segment(fitted(head, width), self.get_component_rich_style("bars--head"))])
        at = self.top + y - 1
        if self.note and y == 1:
            return Strip([Segment(fitted(f"  {self.note}", width), self.get_component_rich_style("bars--out"))])
        if at >= len(self.rows):
            return Strip.blank(width, self.rich_style)
        return self._row(self.rows[at], at == self.at, width)

    def _row(self, row: Row, is_here: bool, width: int) -> Strip:
        name_width = self._name_width
        is_chosen = self.is_in(row, self.chosen)
        plain = self.get_component_rich_style("bars--name" if row.may_play else "bars--out")
        over = self.get_component_rich_style("bars--cursor") if is_here else Style()
        mark = "▶" if is_chosen else "○" if self.is_in(row, self.playing) else " "
        sign = {True: "+", False: "-", None: " "}[self.choices.get(row.asset)]
        text = f"{mark}{sign}{shortened(row.name, name_width)} {cost_text(row.cost):>{COST}} "
        room = max(0, width - len(text))
        return Strip([Segment(text, plain + over), *self._bars(row, room)]).adjust_cell_length(width, self.rich_style)

    def to_chosen(self) -> None:
        """Move the cursor to what is chosen, without a message."""
        self.at = next((i for i, row in enumerate(self.rows) if self.is_in(row, self.chosen)), self.at)
        self.keep_in_sight()
        self.refresh()

    def is_in(self, row: Row, frame: tuple[str, int] | None) -> bool:
        """Whether a frame is in the range of a row."""
        if frame is None or frame[0] != row.database:
            return False
        database = self.landscape.searches[row.database].database
        return int(database.starts[row.range]) <= frame[1] < int(database.stops[row.range])

    def _bars(self, row: Row, width: int) -> list[Segment]:
        levels, is_valid, (start, stop) = self.landscape.bars(row, width)
        why = "bars--invalid" if row.left_out is LeftOut.NOT_VALID else "bars--marked"
        out = self.get_component_rich_style("bars--recent" if row.left_out in TIMES else why)
        free = self.get_component_rich_style("bars--free")
        cells = [(BARS[level], free if ok else out) for level, ok in zip(levels.tolist(), is_valid.tolist(), strict=True)]
        for frame, kind, sign in ((self.playing, "bars--playing", "○"), (self.chosen, "bars--chosen", "▶")):
            if frame is not None and frame[0] == row.database and start <= frame[1] < stop and cells:
                edges = (np.arange(len(cells)) * (stop - start)) // len(cells)
                at = int(np.searchsorted(edges, frame[1] - start, side="right")) - 1
                cells[at] = (sign, self.get_component_rich_style(kind))
        return [Segment(text, style) for text, style in cells]


assert len(BARS) == LEVELS + 1


def shortened(name: str, width: int) -> str:
    """A name in just so many cells; one that is too long lacks some of its middle: its end says more than that."""
    clean = fitted(name, 400).rstrip() if len(name) > width else name
    if len(clean) <= width:
        return fitted(clean, width)
    tail = (width - 1) * 2 // 3
    return fitted(f"{clean[: width - 1 - tail]}…{clean[len(clean) - tail :]}", width)
