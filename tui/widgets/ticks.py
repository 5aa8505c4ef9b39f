"""A switch and a list of names to tick, that say without colour what is ticked."""

from __future__ import annotations

from rich.segment import Segment
from textual.content import Content
from textual.strip import Strip
from textual.widgets import Checkbox, SelectionList


class TickList(SelectionList[str]):
    """A `SelectionList` with [x] and [ ] before its names; the stock one tells the two apart by colour alone."""

    def render_line(self, y: int) -> Strip:
        """A name with its tick."""
        index = self.scroll_offset.y + y
        left, inner, right, *rest = [*super().render_line(y), Segment(""), Segment(""), Segment("")]
        if not 0 <= index < self.option_count:
            return Strip([left, inner, right, *rest])
        mark = "x" if self.get_option_at_index(index).value in self.selected else " "
        style = inner.style
        return Strip([Segment("[", style), Segment(mark, style), Segment("]", style), *rest])


class Tick(Checkbox):
    """A `Checkbox` with [x] or [ ] before its label; the stock one tells the two apart by colour alone."""

    DEFAULT_CSS = """
    Tick { border: none; padding: 0; height: 1; background: transparent; &:focus { border: none; text-style: underline; } }
    """

    def __init__(self, label: str, value: bool = False, id: str | None = None) -> None:  # noqa: A002 - Textual's name
        super().__init__(label, value, compact=True, id=id)

    @property
    def _button(self) -> Content:
        return Content("[x]" if self.value else "[ ]")
