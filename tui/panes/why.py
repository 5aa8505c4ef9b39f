"""The side pane Why: the row of the cursor against the test row, cell by cell, beside the table. It follows the cursor."""

from __future__ import annotations

from collections.abc import Sequence

from textual.content import Content, Span
from textual.geometry import Region, Size
from textual.scroll_view import ScrollView
from textual.strip import Strip
from textual.style import Style
from textual.visual import Visual

from ..model.displayed_table import DisplayedTable
from ..model.why import CellWhy, RowWhy, why_row
from ..screens.nearest import STATES, row_state

WIDE = 140
"""The pane stands beside the table on screens of so many columns; on others F12 opens a dialog."""
OFTEN_S = 0.2
"""While a game runs the pane is written again so often; nobody reads faster, and it costs more than all the rest."""
MUTED = "$foreground 60%"
NO_FACTS = "The test row is empty: F6 goes there, F9 loads a context."


class WhyPane(ScrollView, can_focus=False):
    """Why the row of the cursor is valid, or not. Only lines that look otherwise than for the row before are painted."""

    DEFAULT_CSS = """
    WhyPane {
        width: 46; height: 1fr; display: none; padding: 0 1; background: $surface; border-left: solid $panel;
        scrollbar-size-vertical: 1; overflow-x: hidden;
        &.-open { display: block; }
    }
    """

    def __init__(self) -> None:
        super().__init__()
        self._waiting: DisplayedTable | None = None
        """What is displayed when its time comes."""
        self._lines_of_why: list[Content] = []
        self._strips: list[Strip] = []
        self._wrapped: dict[tuple[str, tuple[Span, ...]], list[Strip]] = {}
        """The text of the lines that it takes, so wide and in such colours."""
        self._wrapped_for: tuple[int, Style] | None = None

    @property
    def is_open(self) -> bool:
        return self.has_class("-open")

    def turn(self, sheet: DisplayedTable) -> None:
        self.toggle_class("-open")
        self.follow(sheet)

    def follow_soon(self, sheet: DisplayedTable) -> None:
        """Show the row of the cursor, a few times a second."""
        if self.is_open and self._waiting is None:
            self.set_timer(OFTEN_S, self._follow_now)
        self._waiting = sheet if self.is_open else None

    def _follow_now(self) -> None:
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            self.follow(waiting)

    def follow(self, sheet: DisplayedTable) -> None:
        if not self.is_open:
            return
        if sheet.query.is_empty or not len(sheet.view):
            self._lines_of_why = [Content(NO_FACTS if sheet.query.is_empty else "No row is shown.")]
        else:
            row = int(sheet.view.rows[sheet.cursor[0]])
            why, outputs = why_row(sheet.query, sheet.table, row), sheet.table.settings.outputs
            gives = [f"{name} = {sheet.table.text(row, name) or '–'}" for name in outputs] if why.is_picked else []
            self._lines_of_why = _why_lines(why, gives)
        self._show()

    def on_resize(self) -> None:
        self._show()

    def notify_style_update(self) -> None:
        super().notify_style_update()
        self._show()

    def _show(self) -> None:
        """Paint the lines that look otherwise than before."""
        size = self.scrollable_content_region.size
        if not size:
            return
        before, self._strips = self._strips, self._wrap(size.width)
        height = max(len(self._strips), size.height)
        if self.virtual_size != (size.width, height):
            self.virtual_size = Size(size.width, height)
        top, longest = self.scroll_offset.y, max(len(before), len(self._strips))
        others = [y for y in range(top, min(top + size.height, longest)) if before[y : y + 1] != self._strips[y : y + 1]]
        if others:
            self.refresh(*(Region(0, y - top, size.width, 1) for y in others))

    def _wrap(self, width: int) -> list[Strip]:
        style = self.visual_style
        if self._wrapped_for != (width, style):
            self._wrapped_for, self._wrapped, self._strips = (width, style), {}, []
        before, self._wrapped = self._wrapped, {}
        for one in self._lines_of_why:
            of = one.plain, tuple(one.spans)
            self._wrapped[of] = before.get(of) or self._wrapped.get(of) or self._strips_of(one, width, style)
        return [strip for one in self._lines_of_why for strip in self._wrapped[one.plain, tuple(one.spans)]]

    def _strips_of(self, line: Content, width: int, style: Style) -> list[Strip]:
        """A line in as many as it takes, each as far in as the first."""
        indent = len(line.plain) - len(line.plain.lstrip())
        strips = Visual.to_strips(self, line[indent:], max(1, width - indent), None, style)
        return [Strip.join([Strip.blank(indent, style.rich_style), strip]) for strip in strips]

    def render_line(self, y: int) -> Strip:
        y += self.scroll_offset.y
        return self._strips[y] if y < len(self._strips) else Strip.blank(self.size.width, self.visual_style.rich_style)


def _why_lines(why: RowWhy, gives: Sequence[str]) -> list[Content]:
    """A row in full: what it gives where it may be picked, the cells that matter, those that hold in few words."""
    lines = [Content.styled(row_state(why), "bold"), Content("")]
    lines += [Content(f"gives {', '.join(gives)}"), Content("")] if gives else []
    for cell in why.cells:
        if cell.is_wrong or cell.state == "open":
            lines += _cell_lines(cell)
    holds = [cell.column for cell in why.cells if cell.state == "holds"]
    missing = [cell.column for cell in why.cells if cell.state == "not given"]
    lines += [Content.styled(f"✓ {', '.join(holds)}", MUTED), Content("")] if holds else []
    lines += [Content.styled(f"not given: {', '.join(missing)}", MUTED), Content("")] if missing else []
    lines.append(Content.styled("F12 closes · Shift+F12 nearest rows, correct", MUTED))
    return lines


def _cell_lines(cell: CellWhy) -> list[Content]:
    sign, tone = STATES[cell.state]
    lines = [Content.styled(f"{sign.split()[0]} {cell.column}", f"$text-{tone}" if tone else "")]
    lines.append(Content(f"  is {cell.fact or '–'}; the cell says {cell.cell or 'Any'}"))
    if cell.mend is not None:
        lines.append(Content.styled(f"  {cell.mend} would accept it", "$text-accent"))
    return [*lines, Content("")]
