"""The line over a table that follows a game: who is followed, how things stand, and what differs from the game."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip
from textual.widget import Widget

from tui.model.layout import cut


@dataclass(frozen=True)
class Said:
    """What the line says."""

    sign: str = ""
    who: str = ""
    answer: str = ""
    note: str = ""
    """What one should know: the answers differ, the game is gone."""


class LiveLine(Widget):
    """One line; what does not fit is cut, the note last."""

    ALLOW_SELECT = False
    COMPONENT_CLASSES: ClassVar[set[str]] = {"live-line--who", "live-line--answer", "live-line--note"}
    DEFAULT_CSS = """
    LiveLine {
        height: 1; background: $boost; display: none;
        .live-line--who { color: $text-primary; text-style: bold; }
        .live-line--answer { color: $foreground 75%; }
        .live-line--note { color: $text-warning; text-style: bold; }
    }
    """

    def __init__(self) -> None:
        super().__init__()
        self.said = Said()

    def show(self, said: Said) -> None:
        """Say something else."""
        if said != self.said:
            self.said = said
            self.refresh()

    def render_line(self, y: int) -> Strip:
        width, said = self.size.width, self.said
        who, note = f" {said.sign} {said.who} ", f" {said.note} " if said.note else ""
        n_who = min(cell_len(who), width)
        n_note = min(cell_len(note), width - n_who)
        segments = [
            Segment(cut(who, n_who), self.get_component_rich_style("live-line--who")),
            Segment(cut(f" {said.answer}", width - n_who - n_note), self._answer),
            Segment(cut(note, n_note), self.get_component_rich_style("live-line--note")),
        ]
        return Strip(segments).adjust_cell_length(width, self._answer)

    @property
    def _answer(self) -> Style:
        return self.get_component_rich_style("live-line--answer")
