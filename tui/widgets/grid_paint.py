"""Paint the lines of a grid: three lines of headers (one in a low window), the rows on the screen, and the test row at the foot.

Only what is seen is read and painted, so that a line costs the same in a table of ten rows and of a hundred thousand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from contextdb.errors import plural
from tui.model.layout import Layout, cut
from tui.model.selection import Block
from tui.model.shown import Header, ShownTable
from tui.model.window import MARKS, PICKED, Window

N_HEADERS = 3
LOWEST = 8
"""In a window of fewer lines only the names of the columns stand over the rows."""
UP, DOWN, UNSORTED = "▲", "▼", "↕"
COMPUTED = "="
"""Stands before a fact of the test row that is computed from others."""
OPENS = "▸"
"""Stands before the asset cell of a row that refers to another table."""
LEAST_BESIDE = 6
"""So much of a text stays where something is at its right."""

StyleOf = Callable[[str, str], Style]
"""The style of a ground and of what is on it: `style("cursor", "text")`."""


def n_headers(height: int) -> int:
    """How many lines stand over the rows in a window so high."""
    return N_HEADERS if height >= LOWEST else 1


@dataclass(frozen=True)
class Look:
    """Where a grid is at present."""

    layout: Layout
    height: int
    left: int
    """How many cells it is scrolled to the right."""
    top: int
    """The first row of the view that is seen."""
    is_in_test_row: bool
    has_focus: bool
    has_test_row: bool = True
    is_in_new_row: bool = False
    """The cursor is in the empty row below the last one."""
    has_new_row: bool = False
    field: int | None = None
    """The column of the test row that the cursor is in, where that is not the sheet's: fields behind its last column count on."""

    @property
    def foot(self) -> int:
        """The line of the test row; past the last one where there is none."""
        return self.height - 1 if self.has_test_row else self.height

    @property
    def n_headers(self) -> int:
        """How many lines stand over the rows."""
        return n_headers(self.height)

    @property
    def n_body(self) -> int:
        """How many lines there are for rows."""
        return max(self.foot - self.n_headers, 0)


class Painter:
    """Paints a sheet. `changed` must be called when anything but the cursor has changed."""

    def __init__(self, sheet: ShownTable, style: StyleOf) -> None:
        self.sheet = sheet
        self.style = style
        self._window: Window | None = None
        self._headers: dict[int, Header] = {}
        self._read = sheet.table, sheet.view

    def changed(self) -> None:
        """Read the sheet again."""
        self._window = None
        self._headers.clear()
        self._read = self.sheet.table, self.sheet.view

    def line(self, y: int, look: Look) -> Strip:
        """Line `y` of the window."""
        if self._read[0] is not self.sheet.table or self._read[1] is not self.sheet.view:
            self.changed()  # painted between a step and word of it
        if y < look.n_headers:
            return self._header_line(y, look)
        if y == look.foot:
            return self._test_line(look)
        row = look.top + y - look.n_headers
        if row == len(self.sheet.view) and look.has_new_row:
            return self._new_line(look)
        if row >= len(self.sheet.view):
            return self._empty_line(row, look)
        return self._body_line(row, look)

    # ---- headers

    def _header_line(self, y: int, look: Look) -> Strip:
        ground = ("header", "header-kind", "header-leaves")[y]
        texts = (self._name, self._kind, self._leaves)[y]
        block = self.sheet.block
        gutter = ("#".rjust(look.layout.gutter - 3) + "   ") if y == 0 else " " * look.layout.gutter

        def cell(column: int) -> Iterator[Segment]:
            is_chosen = (
                column == look.field if look.is_in_test_row and look.field is not None else block.left <= column < block.right
            )
            chosen = "header-chosen" if is_chosen else ground
            yield from texts(column, look.layout.widths[column], chosen)

        return self._joined(Segment(gutter, self.style(ground, "muted")), cell, look, ground)

    def _name(self, column: int, width: int, ground: str) -> Iterator[Segment]:
        header, sort = self._header(column), self.sheet.sort
        if header.is_extra:
            yield Segment(" " + cut(header.name, width - 1), self.style(ground, "muted"))
            return
        sign = UNSORTED
        if sort is not None and sort.column == header.name:
            sign = DOWN if sort.is_descending else UP
        yield Segment(" " + cut(header.name, width - 3), self.style(ground, "name"))
        yield Segment(" " + sign, self.style(ground, "muted" if sign == UNSORTED else "name"))

    def _kind(self, column: int, width: int, ground: str) -> Iterator[Segment]:
        header = self._header(column)
        kind = f"{header.kind} · {header.unit}" if header.unit else header.kind
        yield Segment(" " + cut(kind, width - 1), self.style(ground, "muted"))

    def _leaves(self, column: int, width: int, ground: str) -> Iterator[Segment]:
        header = self._header(column)
        if header.fault is not None:
            yield Segment("!" + cut("cannot be read", width - 1), self.style(ground, "fault"))
            return
        text = "" if header.leaves is None else f"leaves {header.leaves:,}"
        text = plural(header.n_actors, "actor") if header.n_actors else "no column" if header.is_extra else text
        yield Segment(" " + cut(text, width - 1), self.style(ground, "muted"))

    def _header(self, column: int) -> Header:
        if column not in self._headers:
            self._headers[column] = self.sheet.header(column)
        return self._headers[column]

    # ---- rows

    def _body_line(self, row: int, look: Look) -> Strip:
        window = self._window_at(row, look)
        seen, block, ground = window.row(row), self._block(look), self._ground(row, window)
        asset = self.sheet.asset_at
        is_away = look.is_in_test_row or look.is_in_new_row
        cursor = None if is_away or self.sheet.cursor[0] != row else self.sheet.cursor[1]

        n_columns = len(self.sheet.table.columns)

        def cell(column: int) -> Iterator[Segment]:
            if column >= n_columns:
                yield Segment(" " * look.layout.widths[column], self.style(ground, "muted"))
                return
            text, kind = window.cell(row, column)
            meant: str = kind if seen.is_enabled or kind == "fault" else "disabled"
            under = ground if column >= look.layout.n_frozen or seen.is_valid else "frozen"
            if column == cursor:
                under, meant = ("cursor", "on-cursor") if look.has_focus else ("cursor-away", "name")
            elif block is not None and block.holds(row, column):
                under = "selected"
            note, width = window.note(row, column), look.layout.widths[column] - 1
            mark = OPENS if note is not None and column == asset and kind == "text" else MARKS[kind]
            room = width - cell_len(note) - 1 if note else width
            if note and room >= min(cell_len(text), LEAST_BESIDE):
                yield Segment(mark + cut(text, room), self.style(under, meant))
                yield Segment(f" {note}", self.style(under, meant if column == cursor else "valid" if seen.is_valid else "muted"))
            else:
                yield Segment(mark + cut(text, width), self.style(under, meant))

        number = f"{seen.number:>{look.layout.gutter - 3}} {seen.mark} "
        style = self.style("gutter", "valid" if seen.is_valid else "name" if cursor is not None else "muted")
        return self._joined(Segment(number, style), cell, look, ground)

    def _window_at(self, row: int, look: Look) -> Window:
        if self._window is None or not self._window.holds(row):
            self._window = Window(self.sheet, look.top, max(look.n_body, 1))
            if not self._window.holds(row):
                self._window = Window(self.sheet, row, 1)
        return self._window

    def _ground(self, row: int, window: Window) -> str:
        seen = window.row(row)
        return "row-picked" if seen.mark == PICKED else "row-valid" if seen.is_valid else "row"

    def _block(self, look: Look) -> Block | None:
        block = self.sheet.block
        return None if block.n_cells <= 1 or look.is_in_test_row or look.is_in_new_row else block

    def _new_line(self, look: Look) -> Strip:
        """The row below the last one, which takes what is typed or pasted."""
        asset, n_rows = self.sheet.asset_at, len(self.sheet.view)
        hint = "new row" if n_rows or not self.sheet.table.n_rows else "no row passes the filter"

        def cell(column: int) -> Iterator[Segment]:
            is_cursor = look.is_in_new_row and column == self.sheet.cursor[1]
            ground = "row" if not is_cursor else "cursor" if look.has_focus else "cursor-away"
            text = hint if column == asset and (look.is_in_new_row or not n_rows) else ""
            said = "on-cursor" if is_cursor and look.has_focus else "muted"
            yield Segment(" " + cut(text, look.layout.widths[column] - 1), self.style(ground, said))

        gutter = "+".rjust(look.layout.gutter - 3) + "   "
        return self._joined(Segment(gutter, self.style("gutter", "muted")), cell, look, "row")

    def _empty_line(self, row: int, look: Look) -> Strip:
        text = ""
        if row == look.top and not len(self.sheet.view):
            text = "no row passes the filter" if self.sheet.table.n_rows else "the table has no rows: Ctrl+N makes one"
        space = " " * look.layout.gutter
        line = Strip([Segment(space + cut(text, max(look.layout.width - len(space), 0)), self.style("row", "muted"))])
        return line.adjust_cell_length(look.layout.width)

    # ---- the test row

    def _test_line(self, look: Look) -> Strip:
        query, asset = self.sheet.query, self.sheet.asset_at

        def cell(column: int) -> Iterator[Segment]:
            width, condition = look.layout.widths[column], self.sheet.fact_of(column)
            is_cursor = look.is_in_test_row and column == (self.sheet.cursor[1] if look.field is None else look.field)
            ground = ("cursor" if look.has_focus else "cursor-away") if is_cursor else "test"
            is_lit = is_cursor and look.has_focus
            if column == asset:
                yield Segment(" " + cut(self._said(), width - 1), self.style(ground, "on-cursor" if is_lit else "name"))
                return
            name = condition.name if condition is not None else ""
            is_cast, is_computed = query.role_of(name) is not None, query.is_computed(name)
            is_wrong = name in query.faults and not is_cast
            text = "cast" if is_cast else query.text(name)
            mark = "!" if is_wrong else COMPUTED if is_computed and not is_cast else " "
            meant = "fault" if is_wrong else "muted" if is_cast or is_computed else "text"
            yield Segment(mark + cut(text, width - 1), self.style(ground, "on-cursor" if is_lit else meant))

        gutter = "?".rjust(look.layout.gutter - 3) + "   "
        return self._joined(Segment(gutter, self.style("test", "name")), cell, look, "test")

    def _said(self) -> str:
        query = self.sheet.query
        if query.is_empty:
            return "test row"
        may_be = f", {query.n_undecided:,} may be" if query.n_undecided else ""
        return f"{query.n_valid - query.n_undecided:,} of {plural(self.sheet.table.n_rows, 'row')} valid{may_be}"

    # ---- parts

    def _joined(self, gutter: Segment, cell: Callable[[int], Iterator[Segment]], look: Look, ground: str) -> Strip:
        """The gutter, the frozen columns and those that are scrolled, each followed by its separator."""
        layout = look.layout
        bar = Segment("│", self.style(ground, "line"))
        line = [gutter]
        for column in range(layout.n_frozen):
            line += [*cell(column), bar]
        moving: list[Segment] = []
        columns = layout.visible(look.left)
        for column in columns:
            moving += [*cell(column), bar]
        start = look.left - (layout.starts[columns.start] - layout.frozen) if len(columns) else 0
        line += _from(moving, start)
        return Strip(line).adjust_cell_length(layout.width, self.style(ground, "text"))


def _from(segments: list[Segment], start: int) -> list[Segment]:
    """The segments without their first `start` cells."""
    while start > 0 and segments:
        first, *rest = segments
        if first.cell_length > start:
            return [first.split_cells(start)[1], *rest]
        segments, start = rest, start - first.cell_length
    return segments
