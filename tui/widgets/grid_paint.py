"""Paint the lines of a grid: lines of headers (fewer in a low window), the test row under them, and the rows on the screen.

Only what is seen is read and painted, so that a line costs the same in a table of ten rows and of a hundred thousand.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from contextdb.cells.words import three_digits
from contextdb.errors import plural

from ..model.displayed_table import DisplayedTable, Header
from ..model.layout import Layout, cut, cut_middle, name_lines
from ..model.selection import Block
from ..model.window import MARKS, PICKED, PLAYS, Window

LOWEST = 8
"""In a window of fewer lines only the names of the columns stand over the rows."""
LOW, ROOMY = 12, 24
"""In a window of fewer lines than the first names are not wrapped. In one of fewer than the second one line says the type, or what
the fact of the test row leaves; in others both have a line."""
AT_LEFT, AT_RIGHT = "«", "»"
"""Stand at an edge of the window behind which cells of the row fail."""
DIM_WHERE_FAR = frozenset(("text", "any", "name", "failing"))
"""What is dim in a row of which several cells fail: one that misses by a single cell is what somebody looks for."""
HIDES = "║"
"""Stands behind a column after which others are hidden."""
UP, DOWN, UNSORTED = "▲", "▼", "↕"
NOTED = "▪"
"""Stands before the text of a cell with a note."""
HANDLE = "■"
"""Stands at the lower right corner of several cells that are selected: dragged, it fills."""
COMPUTED = "="
"""Stands before a fact of the test row that is computed from others."""
OPENS = "▸"
"""Stands before the asset cell of a row that refers to another table."""
LEAST_BESIDE = 6
"""So much of a text stays where something is at its right."""

MOST_LINES = 512
"""So many lines are kept."""

StyleOf = Callable[[str, str], Style]
"""The style of a ground and of what is on it: `style("cursor", "text")`."""


@lru_cache(maxsize=256)
def header_lines(height: int, n_names: int, has_facts: bool = True) -> tuple[str, ...]:
    """What the lines over the rows say in a window so high, where the longest name takes `n_names` lines; without a test row no
    fact leaves rows."""
    if height < LOWEST:
        return ("name",)
    says = ("both",) if height < ROOMY or not has_facts else ("kind", "leaves")
    return (*["name"] * (n_names if height >= LOW else 1), *says)


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
    is_wrapped: bool = False
    """Columns are as narrow as their cells allow, and names are wrapped."""
    n_names: int = 1
    """How many lines the longest name over a column takes."""
    field: int | None = None
    """The column of the test row that the cursor is in, where that is not the sheet's: fields behind its last column count on."""

    @property
    def test_line(self) -> int:
        """The line of the test row, right under the names; -1 where there is none."""
        return len(self.header_lines) if self.has_test_row else -1

    @property
    def n_headers(self) -> int:
        """How many lines stand over the rows, the test row with them."""
        return len(self.header_lines) + self.has_test_row

    @property
    def header_lines(self) -> tuple[str, ...]:
        """What each of the lines over the rows says."""
        return header_lines(self.height, self.n_names, self.has_test_row)

    @property
    def sort_line(self) -> int:
        """The line of the header with the signs to sort by."""
        return self.n_name_lines if self.is_wrapped and len(self.header_lines) > 1 else 0

    @property
    def n_name_lines(self) -> int:
        """How many of the lines over the rows are for names."""
        return self.header_lines.count("name")

    @property
    def n_body(self) -> int:
        """How many lines there are for rows."""
        return max(self.height - self.n_headers, 0)


class Painter:
    """Paints a sheet. `changed` must be called when anything but the cursor has changed."""

    def __init__(self, sheet: DisplayedTable, style: StyleOf) -> None:
        self.sheet = sheet
        self.style = style
        self._window: Window | None = None
        self._before: Window | None = None
        """The window that was read before the last change."""
        self.flashing: frozenset[tuple[int, int]] = frozenset()
        """Cells that have just begun to fail: rows of the view, and columns."""
        self.began: frozenset[tuple[int, int]] = frozenset()
        """Those of them that began with the last facts."""
        self._headers: dict[int, Header] = {}
        self._read = sheet.table, sheet.view
        self._lines: dict[int, tuple[object, Strip]] = {}
        """By row of the view the line that was painted last, and all that it depends on but for what `_lines_of` says."""
        self._lines_of: tuple[object, ...] = ()
        self._header_lines: dict[int, tuple[object, Strip]] = {}
        """The lines of the header that were painted last, and what each was painted from."""

    def changed(self) -> None:
        self._before, self._window = self._window or self._before, None
        self.flashing = self.began = frozenset()
        self._headers.clear()
        self._read = self.sheet.table, self.sheet.view

    def requested_again(self) -> list[int] | None:
        """Read the answers again after other facts, and remember which cells have just begun to fail; gives the rows of the view
        that look otherwise, None where nothing was read yet."""
        before = self._window
        self._headers.clear()
        if before is None or self._read[0] is not self.sheet.table or self._read[1] is not self.sheet.view:
            return None
        self._window = now = before.again()
        self.began = now.began_to_fail(before)
        self.flashing = self.flashing | self.began
        return now.changed_since(before)

    def line(self, y: int, look: Look) -> Strip:
        if self._read[0] is not self.sheet.table or self._read[1] is not self.sheet.view:
            self.changed()  # painted between a step and word of it
        if y == look.test_line:
            return self._test_line(look)
        if y < look.n_headers:
            return self._header_line(y, look)
        if y >= look.height:  # under the scroll bar, where nothing is seen; the window of the rows stays as it is
            return Strip.blank(look.layout.width)
        row = look.top + y - look.n_headers
        if row == len(self.sheet.view) and look.has_new_row:
            return self._new_line(look)
        if row >= len(self.sheet.view):
            return self._empty_line(row, look)
        return self._body_line(row, look)

    # ---- headers

    def _header_line(self, y: int, look: Look) -> Strip:
        """A line of the header; the one of before where all that is seen in it is as it was."""
        layout, block, sort = look.layout, self.sheet.block, self.sheet.sort
        headers = [self._header(column) for column in (*range(layout.n_frozen), *layout.visible(look.left))]
        of = replace(look, top=0, has_focus=True), block.left, block.right, sort, headers
        known = self._header_lines.get(y)
        if known is None or known[0] != of:
            known = self._header_lines[y] = of, self._painted_header(y, look)
        return known[1]

    def _painted_header(self, y: int, look: Look) -> Strip:
        lines = look.header_lines
        says, is_last = lines[y], y == len(lines) - 1
        ground = "header" if says == "name" and len(lines) > 1 else "header-leaves" if is_last else "header-kind"
        ground = "header" if len(lines) == 1 else ground
        block = self.sheet.block
        gutter = look.layout.gutter_text("#", "%") if y == 0 else " " * look.layout.gutter

        def cell(column: int) -> Iterator[Segment]:
            is_chosen = (
                column == look.field if look.is_in_test_row and look.field is not None else block.left <= column < block.right
            )
            chosen = "header-chosen" if is_chosen else ground
            width, sign = look.layout.widths[column], self._sign(column) if y == look.sort_line else ""
            if says == "name":
                yield from self._name(column, width, chosen, y, look)
            elif says == "leaves" or (says == "both" and self._is_asked(column)):
                yield from self._leaves(column, width - 2 * bool(sign), chosen)
            else:
                yield from self._kind(column, width - 2 * bool(sign), chosen)
            if sign:
                yield Segment(" " + sign, self.style(chosen, "muted" if sign == UNSORTED else "name"))

        return self._joined([Segment(gutter, self.style(ground, "muted"))], cell, look, ground)

    def _sign(self, column: int) -> str:
        """How the rows are sorted by a column; empty for a fact that is none."""
        header, sort = self._header(column), self.sheet.sort
        if header.is_extra:
            return ""
        if sort is not None and sort.column == header.name:
            return DOWN if sort.is_descending else UP
        return UNSORTED

    def _name(self, column: int, width: int, ground: str, y: int, look: Look) -> Iterator[Segment]:
        """Line `y` of a name; a short one stands in the last of the lines."""
        header = self._header(column)
        room = width - 1 - 2 * (y == look.sort_line and not header.is_extra)
        text = header.name
        if look.n_name_lines > 1:
            lines = name_lines(header.name, width - 1)
            at = y - (look.n_name_lines - len(lines))
            text = lines[at] if at >= 0 else ""
        yield Segment(" " + cut_middle(text, room), self.style(ground, "muted" if header.is_extra else "name"))

    def _is_asked(self, column: int) -> bool:
        header = self._header(column)
        return header.fault is not None or header.leaves is not None or header.n_actors > 0 or header.is_extra

    def _kind(self, column: int, width: int, ground: str) -> Iterator[Segment]:
        header = self._header(column)
        forms = (f"{header.kind} · {header.unit}", header.unit) if header.unit else ()
        kind = next((form for form in forms if cell_len(form) < width), header.kind)
        yield Segment(" " + cut(kind, width - 1), self.style(ground, "muted"))

    def _leaves(self, column: int, width: int, ground: str) -> Iterator[Segment]:
        header = self._header(column)
        if header.fault is not None:
            yield Segment("!" + cut("cannot be read", width - 1), self.style(ground, "fault"))
            return
        text = "" if header.leaves is None else f"{header.leaves:,} left"
        text = text if len(text) < width else text.removesuffix(" left")
        text = plural(header.n_actors, "actor") if header.n_actors else "no column" if header.is_extra else text
        yield Segment(" " + cut(text, width - 1), self.style(ground, "muted"))

    def _header(self, column: int) -> Header:
        if column not in self._headers:
            self._headers[column] = self.sheet.header(column)
        return self._headers[column]

    # ---- rows

    def forget_lines(self) -> None:
        """Keep no line: what they are painted with is other."""
        self._lines.clear()
        self._header_lines.clear()

    def _body_line(self, row: int, look: Look) -> Strip:
        """The line of a row; the one of before where all that is seen of it is as it was."""
        sheet, layout = self.sheet, look.layout
        names = [c.name for c in sheet.table.columns] if sheet.marks.texts or sheet.clips.cells else None
        marks = sheet.marks, sheet.clips, sheet.domains  # a cell is odd by its text and its domain
        lines_of = layout, look.left, marks, sheet.asset_at, sheet.shared_end, len(sheet.table.columns), names
        if lines_of != self._lines_of or len(self._lines) > MOST_LINES:
            self._lines_of, self._lines = lines_of, {}
        of = self._seen_of(row, look)
        known = self._lines.get(row)
        if known is None or known[0] != of:
            known = self._lines[row] = of, self._painted_line(row, look)
        return known[1]

    def _seen_of(self, row: int, look: Look) -> object:
        """What the line of a row is painted from, with what all lines are."""
        window, block, layout, sheet = self._window_at(row, look), self._block(look), look.layout, self.sheet
        seen, n_columns = window.row(row), len(sheet.table.columns)
        columns = [c for c in (*range(layout.n_frozen), *layout.visible(look.left)) if c < n_columns and layout.widths[c]]
        cells = [window.cell(row, column) for column in columns]
        is_in_block = block is not None and block.top <= row < block.bottom
        selected = (block.left, block.right, row == block.bottom - 1, sheet.selection.kind) if block and is_in_block else None
        asset = sheet.text(row, sheet.asset_at) if sheet.marks.texts or sheet.marks.colours or sheet.clips.cells else ""
        flashing = [column for at, column in self.flashing if at == row]
        failing = window.failing(row) if seen.n_failing else []
        doubt = sheet.doubt(int(sheet.view.rows[row]), sheet.asset_at)
        return seen, cells, window.notes(row), self._cursor(row, look), look.has_focus, selected, asset, flashing, failing, doubt

    def _cursor(self, row: int, look: Look) -> int | None:
        """The column of the cursor, where it is in a row."""
        is_away = look.is_in_test_row or look.is_in_new_row
        return None if is_away or self.sheet.cursor[0] != row else self.sheet.cursor[1]

    def _painted_line(self, row: int, look: Look) -> Strip:
        window = self._window_at(row, look)
        seen, block, ground = window.row(row), self._block(look), self._ground(row, window)
        asset, cursor = self.sheet.asset_at, self._cursor(row, look)
        is_far = seen.n_failing > 1
        is_chance = seen.standing.endswith("%") and look.layout.chance > 0
        chance, outranked = (seen.standing, "") if is_chance else ("", "" if seen.standing == "100 %" else seen.standing)

        n_columns = len(self.sheet.table.columns)
        noted, colours, names = self.sheet.marks.texts, self.sheet.marks.colours, [c.name for c in self.sheet.table.columns]
        clips = self.sheet.clips.cells
        name = self.sheet.text(row, asset) if noted or colours else ""

        def cell(column: int) -> Iterator[Segment]:
            if column >= n_columns:
                yield Segment(" " * look.layout.widths[column], self.style(ground, "muted"))
                return
            text, kind = window.cell(row, column)
            meant: str = kind if seen.is_enabled or kind == "fault" else "disabled"
            meant = "muted" if meant == "inherited" or (is_far and meant in DIM_WHERE_FAR) else meant
            under = ground if column >= look.layout.n_frozen or seen.is_valid else "frozen"
            if column == cursor:
                under, meant = ("cursor", "on-cursor") if look.has_focus else ("cursor-away", "name")
            elif (row, column) in self.flashing and kind == "failing":
                under = "flash"
            elif block is not None and block.holds(row, column):
                under = "selected"
            note, width = window.note(row, column), look.layout.widths[column] - 1
            mark = OPENS if note is not None and column == asset and kind == "text" else MARKS[kind]
            if mark == " ":
                tells = kind != "any" or clips  # Any is never odd
                mark = NOTED if (name, names[column]) in noted else self.sheet.clip_mark(row, column) if tells else " "
            n_shared = self.sheet.shared_end if column == asset else None
            room = width - cell_len(note) - 1 if note else width
            if note and room >= min(cell_len(text), LEAST_BESIDE):
                yield Segment(mark + _shortened(text, room, n_shared), self.style(under, meant))
                yield Segment(f" {note}", self.style(under, meant if column == cursor else "valid" if seen.is_valid else "muted"))
            elif not note and column == asset and outranked and cell_len(text) + cell_len(outranked) < width:
                yield Segment(mark + cut(text, width - cell_len(outranked)), self.style(under, meant))
                yield Segment(outranked, self.style(under, meant if column == cursor else "muted"))
            else:
                yield Segment(mark + _shortened(text, width, n_shared), self.style(under, meant))

        corner = block.right - 1 if block is not None and row == block.bottom - 1 and self.sheet.selection.kind == "cells" else None
        tint = f"tint-{colours[name]}" if name in colours else "gutter"
        style = self.style(tint, "valid" if seen.is_valid else "name" if tint != "gutter" or cursor is not None else "muted")
        is_near = seen.mark == " " and seen.n_failing > 0
        sign = MARKS["failing"] + (str(seen.n_failing) if seen.n_failing < 10 else "+") if is_near else f"{seen.mark} "
        miss = "muted" if is_far else "failing"
        gutter = [
            Segment(f"{seen.number:>{look.layout.n_digits}}", style),
            Segment(PLAYS if seen.is_played else " ", self.style(tint, "name")),
            Segment(sign, self.style(tint, miss) if is_near else style),
            *([Segment(chance.rjust(look.layout.chance), style)] if look.layout.chance else []),
        ]
        return self._joined(gutter, cell, look, ground, window.failing(row), corner, miss)

    def _window_at(self, row: int, look: Look) -> Window:
        if self._window is None or not self._window.holds(row):
            self._window = Window(self.sheet, look.top, max(look.n_body, 1), self._window or self._before)
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
            tone = "on-cursor" if is_cursor and look.has_focus else "muted"
            yield Segment(" " + cut(text, look.layout.widths[column] - 1), self.style(ground, tone))

        gutter = look.layout.gutter_text("+")
        return self._joined([Segment(gutter, self.style("gutter", "muted"))], cell, look, "row")

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
                yield Segment(" " + cut(self._adding(width - 1), width - 1), self.style(ground, "on-cursor" if is_lit else "name"))
                return
            name = condition.name if condition is not None else ""
            is_cast, is_computed = query.role_of(name) is not None, query.is_computed(name)
            is_wrong = name in query.faults and not is_cast
            text = "cast" if is_cast else three_digits(query.text(name))
            mark = "!" if is_wrong else COMPUTED if is_computed and not is_cast else " "
            meant = "fault" if is_wrong else "muted" if is_cast or is_computed else "text"
            yield Segment(mark + cut(text, width - 1), self.style(ground, "on-cursor" if is_lit else meant))

        gutter = look.layout.gutter_text("?")
        return self._joined([Segment(gutter, self.style("test", "name"))], cell, look, "test")

    def _adding(self, width: int) -> str:
        query = self.sheet.query
        if query.is_empty:
            return "test row"
        may_be = f", {query.n_undecided:,} may be" if query.n_undecided else ""
        n_sure, n_rows = f"{query.n_valid - query.n_undecided:,}", f"{self.sheet.table.n_rows:,}"
        whole = f"{n_sure} of {plural(self.sheet.table.n_rows, 'row')} valid{may_be}"
        forms = (whole, f"{n_sure} of {n_rows} valid", f"{n_sure} of {n_rows}", f"{n_sure}/{n_rows}", n_sure)
        return next((form for form in forms if cell_len(form) <= width), n_sure)

    # ---- parts

    def _joined(
        self,
        gutter: list[Segment],
        cell: Callable[[int], Iterator[Segment]],
        look: Look,
        ground: str,
        failing: Collection[int] = (),
        corner: int | None = None,
        miss: str = "failing",
    ) -> Strip:
        """The gutter, the frozen columns and those that are scrolled, each followed by its separator; an arrow of the colour `miss`
        stands at an edge behind which columns fail."""
        layout, handle = look.layout, Segment(HANDLE, self.style(ground, "name"))
        bar, double = Segment("│", self.style(ground, "line")), Segment(HIDES, self.style(ground, "muted"))
        hides = layout.hides
        line = list(gutter)
        for column in range(layout.n_frozen):
            if layout.widths[column]:
                line += [*cell(column), handle if column == corner else double if column in hides else bar]
        moving: list[Segment] = []
        columns = layout.visible(look.left)
        for column in columns:
            if layout.widths[column]:
                moving += [*cell(column), handle if column == corner else double if column in hides else bar]
        start = look.left - (layout.starts[columns.start] - layout.frozen) if len(columns) else 0
        if any(layout.n_frozen <= column < columns.start + (start > 0) for column in failing):
            line[-1] = _ending(line[-1], AT_LEFT, self.style(ground, miss))
        line += _from(moving, start)
        if not any(column >= columns.stop for column in failing):
            return Strip(line).adjust_cell_length(layout.width, self.style(ground, "text"))
        inner = Strip(line).adjust_cell_length(layout.width - 1, self.style(ground, "text"))
        return Strip([*inner, Segment(AT_RIGHT, self.style(ground, miss))], layout.width)


def _ending(segment: Segment, sign: str, style: Style) -> Segment:
    """A separator as an arrow; a longer segment as it is."""
    return Segment(sign, style) if segment.cell_length == 1 else segment


def _shortened(text: str, width: int, n_shared: int | None) -> str:
    """A text in so many cells; the name of an asset loses its middle, and the end that all have in common."""
    return cut(text, width) if n_shared is None else cut_middle(text, width, n_shared)


def _from(segments: list[Segment], start: int) -> list[Segment]:
    """The segments without their first `start` cells."""
    while start > 0 and segments:
        first, *rest = segments
        if first.cell_length > start:
            return [first.split_cells(start)[1], *rest]
        segments, start = rest, start - first.cell_length
    return segments
