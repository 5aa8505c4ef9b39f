"""Channels with their weights, which can be turned, and what each adds to the cost of three frames; thresholds below them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rich.segment import Segment
from rich.style import Style
from textual.message import Message
from textual.strip import Strip

from contextdb.motion.trace.cost_views import cost_text

from ..widgets.cursor_lines import CursorLines, style_names
from ..widgets.fitted import fitted

NUMBER, COST, LEAST_NAME = 11, 9, 18


@dataclass(frozen=True, slots=True)
class Dial:
    """A number that can be turned: the weight of a channel, or the threshold of a database.

    `costs` are what a channel adds to what is chosen, to what would play on, and to the asset under the cursor.
    """

    name: str
    is_weight: bool
    recorded: float
    now: float
    costs: tuple[float | None, float | None, float | None] = (None, None, None)

    @property
    def label(self) -> str:
        return self.name if self.is_weight else f"threshold {self.name}"


class Channels(CursorLines):
    """Weights and thresholds."""

    DEFAULT_CSS = """
    Channels {
        background: $surface;
        & .channels--head { color: $text-muted; }
        & .channels--plain { color: $foreground; }
        & .channels--cursor { background: $boost; text-style: bold; }
        & .channels--turned { color: $warning; text-style: bold; }
        & .channels--chosen { color: $success; }
        & .channels--playing { color: $foreground 60%; }
        & .channels--asset { color: $warning; }
        &:focus .channels--cursor { background: $primary 35%; }
        &:ansi .channels--cursor { background: ansi_blue; color: ansi_bright_white; }
    }
    """
    COMPONENT_CLASSES: ClassVar[set[str]] = style_names(DEFAULT_CSS)

    @dataclass
    class Clicked(Message):
        """One of the two arrows was clicked."""

        up: bool

    def __init__(self) -> None:
        super().__init__(id="channels")
        self.dials: list[Dial] = []

    def get_content_height(self, container: object, viewport: object, width: int) -> int:
        """A line for each number, and one above them."""
        return 1 + len(self.dials)

    @property
    def dial(self) -> Dial | None:
        """The number under the cursor."""
        return self.dials[self.at] if self.dials else None

    def show(self, dials: list[Dial]) -> None:
        is_longer = len(dials) != len(self.dials)
        self.dials = dials
        self.at = min(self.at, max(0, len(dials) - 1))
        self.keep_in_sight()
        self.refresh(layout=is_longer)

    @property
    def n_lines(self) -> int:
        return len(self.dials)

    def clicked(self, x: int) -> None:
        """Turn the number where one of its arrows was clicked."""
        x -= 1 + self._name_width
        if 0 <= x < NUMBER:
            self.post_message(self.Clicked(x > NUMBER // 2))

    # ---- painting

    @property
    def _n_costs(self) -> int:
        return min(3, max(0, (self.size.width - 2 - LEAST_NAME - NUMBER) // (COST + 1)))

    @property
    def _name_width(self) -> int:
        longest = max((len(dial.label) for dial in self.dials), default=LEAST_NAME)
        room = self.size.width - 2 - NUMBER - self._n_costs * (COST + 1)
        return max(LEAST_NAME, min(longest, room))

    def render_line(self, y: int) -> Strip:
        width, name_width = self.size.width, self._name_width
        if y == 0:
            heads = "".join(f" {text:>{COST}}" for text in ("chosen", "plays on", "at cursor")[: self._n_costs])
            text = f" {fitted('channel', name_width)}{'weight':^{NUMBER}}{heads}"
            return Strip([Segment(fitted(text, width), self.get_component_rich_style("channels--head"))])
        at = self.top + y - 1
        if at >= len(self.dials):
            return Strip.blank(width, self.rich_style)
        dial = self.dials[at]
        over = self.get_component_rich_style("channels--cursor") if at == self.at else Style()
        kind = "turned" if dial.now != dial.recorded else "plain"
        plain = self.get_component_rich_style("channels--plain") + over
        number = f"◀ {dial.now:g} ▶"
        segments = [
            Segment(f" {fitted(dial.label, name_width)}", plain),
            Segment(f"{number:^{NUMBER}}"[:NUMBER], self.get_component_rich_style(f"channels--{kind}") + over),
        ]
        kinds = ("chosen", "playing", "asset")[: self._n_costs]
        for cost, of in zip(dial.costs, kinds, strict=False):
            style = self.get_component_rich_style(f"channels--{of}") + over
            segments.append(Segment(f" {cost_text(cost):>{COST}}", style))
        return Strip(segments).adjust_cell_length(width, plain)
