"""The line over a table that follows a game: who is followed, how things stand, and what differs from the game."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip
from textual.widget import Widget

from ..model.layout import cut


@dataclass(frozen=True)
class LiveState:
    """What the line says."""

    sign: str = ""
    source: str = ""
    answer: str = ""
    note: str = ""
    """What one should know: the answers differ, the game is gone."""


class LiveLine(Widget):
    """One line; what does not fit is cut, the note last."""

    ALLOW_SELECT = False
    COMPONENT_CLASSES: ClassVar[set[str]] = {"live-line--source", "live-line--answer", "live-line--note"}
    DEFAULT_CSS = """
    LiveLine {
        height: 1; background: $boost; display: none;
        .live-line--source { color: $text-primary; text-style: bold; }
        .live-line--answer { color: $foreground 75%; }
        .live-line--note { color: $text-warning; text-style: bold; }
    }
    """

    def __init__(self) -> None:
        super().__init__()
        self.state = LiveState()

    def show(self, state: LiveState) -> None:
        if state != self.state:
            self.state = state
            self.refresh()

    def render_line(self, y: int) -> Strip:
        width, state = self.size.width, self.state
        source, note = f" {state.sign} {state.source} ", f" {state.note} " if state.note else ""
        n_source = min(cell_len(source), width)
        n_note = min(cell_len(note), width - n_source)
        segments = [
            Segment(cut(source, n_source), self.get_component_rich_style("live-line--source")),
            Segment(cut(f" {state.answer}", width - n_source - n_note), self._answer),
            Segment(cut(note, n_note), self.get_component_rich_style("live-line--note")),
        ]
        return Strip(segments).adjust_cell_length(width, self._answer)

    @property
    def _answer(self) -> Style:
        return self.get_component_rich_style("live-line--answer")
