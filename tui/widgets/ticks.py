"""A list of names to tick, that says without colour which are ticked."""

from __future__ import annotations

from rich.segment import Segment
from textual.strip import Strip
from textual.widgets import SelectionList


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
