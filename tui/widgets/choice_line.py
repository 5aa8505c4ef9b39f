"""A line of choices, one of which is taken: "1 Gaps 7   2 Pairs   3 Crowded 2". Number keys are the pane's to bind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.cells import cell_len
from textual import events
from textual.content import Content
from textual.message import Message
from textual.widget import Widget

GAP = 3


class ChoiceLine(Widget):
    """Choices side by side, chosen by click."""

    DEFAULT_CSS = """
    ChoiceLine { height: 1; padding: 0 2; background: $surface; color: $text-muted; }
    """

    @dataclass
    class Picked(Message):
        """A choice was clicked."""

        line: ChoiceLine
        index: int

        @property
        def control(self) -> ChoiceLine:
            return self.line

    def __init__(self, labels: Sequence[str], *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self.labels = tuple(labels)
        self.taken = 0

    def show(self, labels: Sequence[str], taken: int) -> None:
        self.labels, self.taken = tuple(labels), taken
        self.refresh()

    @property
    def _gap(self) -> int:
        """So many cells between two choices: fewer where not all would fit."""
        width = sum(map(cell_len, self.labels))
        return next((gap for gap in range(GAP, 1, -1) if width + gap * (len(self.labels) - 1) <= self.content_size.width), 1)

    def render(self) -> Content:
        parts: list[Content] = []
        for at, label in enumerate(self.labels):
            parts.append(Content.styled(label, "$foreground bold underline" if at == self.taken else ""))
            parts.append(Content(" " * self._gap))
        return Content("").join(parts)

    def on_click(self, event: events.Click) -> None:
        offset = event.get_content_offset(self)
        at_x = 0 if offset is None else offset.x
        start = 0
        for at, label in enumerate(self.labels):
            stop = start + cell_len(label)
            if offset is not None and start <= at_x < stop + 1:
                self.post_message(self.Picked(self, at))
            start = stop + self._gap
