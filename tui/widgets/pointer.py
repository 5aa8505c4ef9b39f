"""The mouse on a grid: click, drag and double click on cells, row numbers, headers, the sort sign and the lines between columns."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, Protocol

from textual import events
from textual.app import App
from textual.timer import Timer

from ..model.layout import NARROWEST
from ..model.selection import Selection
from ..model.sheet import Sheet
from .grid_paint import Look

Dragged = Literal["cells", "rows", "columns", "width", "move rows", "move columns", "fill"]
TAKEN = ("move rows", "move columns", "fill")
"""Drags of what is selected to another place."""
PULL_EVERY_S = 0.06
"""So often a drag that rests at an edge takes in one more row or column."""


class Pointed(Protocol):
    """What the mouse needs of a grid: `tui.widgets.grid.Grid`."""

    sheet: Sheet
    is_in_test_row: bool

    @property
    def look(self) -> Look: ...

    @property
    def app(self) -> App[Any]: ...

    def moving(self, move: Callable[[], None], in_new_row: bool = False) -> None:
        """Move the cursor, and show what has changed."""

    def go_to_field(self, column: int) -> None:
        """Go to a field of the test row."""

    def set_width(self, column: int, width: int | None) -> None:
        """Set the width of a column; None fits it."""

    def sort_by(self, column: int) -> None:
        """Sort what is displayed by a column."""

    def put_down(self, what: str, row: int, column: int) -> None:
        """Rows or columns, or the handle to fill from, were dragged to a place."""

    def action_edit(self) -> None:
        """Edit the cell."""

    def action_open_row(self) -> None:
        """Go into the table that the row refers to."""

    def action_select_rows(self) -> None:
        """Select whole rows."""

    def action_select_columns(self) -> None:
        """Select whole columns."""

    def focus(self) -> object:
        """Take the keys."""

    def refresh(self) -> object:
        """Paint again."""

    def capture_mouse(self) -> None:
        """Take every event of the mouse."""

    def release_mouse(self) -> None:
        """Take them no more."""

    def set_interval(self, interval: float, callback: Callable[[], None]) -> Timer: ...


class Pointer:
    """The mouse on one grid."""

    def __init__(self, grid: Pointed) -> None:
        self.grid = grid
        self._dragged: Dragged | None = None
        self._column = 0
        """The column whose width is dragged."""
        self._at = (0, 0)
        """Where the mouse is while it drags."""
        self._timer: Timer | None = None
        self._is_moved = False
        """The mouse has moved since it took something."""
        self._source = Selection()
        """What was selected when it took something."""

    def press(self, event: events.MouseDown) -> None:
        """The button goes down: go there, select, or begin to drag."""
        grid, look = self.grid, self.grid.look
        grid.focus()
        row, column = self._place_at(event.x, event.y)
        if event.y == look.test_line:
            grid.is_in_test_row = True
            grid.moving(lambda: grid.go_to_field(column))
            grid.refresh()
        elif event.y < look.n_headers:
            self._press_header(event, column, look)
        elif look.has_new_row and look.top + event.y - look.n_headers == len(grid.sheet.view):
            grid.is_in_test_row = False
            grid.moving(lambda: grid.sheet.go(grid.sheet.cursor[0], column), in_new_row=True)
        elif self._is_cell_line(event.y, look):
            grid.is_in_test_row = False
            if taken := self._takes(event, row, look):
                self._begin(taken)
                return
            grid.moving(lambda: grid.sheet.go(row, column, event.shift))
            if self._is_opener(event.x, row, column, look):
                grid.action_open_row()
                return
            if event.x < look.layout.gutter:
                grid.action_select_rows()
            self._begin("rows" if event.x < look.layout.gutter else "cells")

    def point(self, event: events.MouseDown) -> bool:
        """The right button goes down: go there, unless it is selected already; gives whether a column was meant."""
        grid, look = self.grid, self.grid.look
        grid.focus()
        row, column = self._place_at(event.x, event.y)
        is_header = event.y < look.n_headers and event.y != look.test_line
        n_columns, block = grid.sheet.shape[1], grid.sheet.block
        if column < n_columns and (is_header or self._is_cell_line(event.y, look)) and event.y != look.test_line:
            grid.is_in_test_row = False
            if not (block.holds(row, column) or (is_header and block.left <= column < block.right)):
                grid.moving(lambda: grid.sheet.go(grid.sheet.cursor[0] if is_header else row, column))
        return is_header

    def move(self, event: events.MouseMove) -> None:
        """The mouse moves with its button down."""
        grid, look = self.grid, self.grid.look
        if self._dragged == "width":
            grid.set_width(self._column, max(NARROWEST, event.x - look.layout.place(self._column, look.left)))
        elif self._dragged in TAKEN and self._dragged != "fill":
            self._is_moved = True
        elif self._dragged is not None:
            self._is_moved = True
            self._at = (event.x, event.y)
            self.pull()
            self._pull_on(self._edge() != (0, 0))

    def pull(self) -> None:
        """Select up to where the mouse is; past an edge the rows and columns come after it, one at a time."""
        grid, look = self.grid, self.grid.look
        (x, y), (down, right) = self._at, self._edge()
        row, column = self._place_at(x, y)
        if down:
            row = look.top + look.n_body if down > 0 else look.top - 1
        if right:
            column = grid.sheet.selection.far[1] + right
        row, column = max(0, min(row, len(grid.sheet.view) - 1)), max(0, min(column, grid.sheet.shape[1] - 1))
        grid.moving(lambda: self._drag_to(row, column, grid.sheet.selection.kind))

    def pull_again(self) -> None:
        """The mouse rests past an edge; one that was let go elsewhere pulls no more."""
        captured: object = self.grid.app.mouse_captured
        if self._edge() != (0, 0) and captured is self.grid:
            self.pull()
        else:
            self._pull_on(False)

    def release(self, event: events.MouseUp) -> None:
        """The button goes up: what was taken is put down here."""
        dragged, grid = self._dragged, self.grid
        row, column = self._place_at(event.x, event.y)
        column = min(column, grid.sheet.shape[1] - 1)
        if dragged == "fill" and self._is_moved:
            row, column = grid.sheet.selection.far
            grid.sheet.select(lambda *_: self._source)
        if dragged in TAKEN and self._is_moved:
            grid.put_down(dragged, row, column)
        elif dragged == "move rows":
            grid.moving(lambda: grid.sheet.go(row, grid.sheet.cursor[1]))
            grid.action_select_rows()
        elif dragged == "move columns":
            grid.moving(lambda: grid.sheet.go(grid.sheet.cursor[0], column))
            grid.action_select_columns()
        self._dragged, self._is_moved = None, False
        self._pull_on(False)
        self.grid.release_mouse()

    def click_twice(self, event: events.Click) -> None:
        """A double click: edit the cell, or fit the column left of a line."""
        look = self.grid.look
        separator = look.layout.separator_at(event.x, look.left)
        if event.y < look.n_headers and event.y != look.test_line and separator is not None:
            self.grid.set_width(separator, None)
        elif event.x >= look.layout.gutter and self._is_cell_line(event.y, look):
            self.grid.action_edit()

    # ---- parts

    def _press_header(self, event: events.MouseDown, column: int, look: Look) -> None:
        grid, separator = self.grid, look.layout.separator_at(event.x, look.left)
        if separator is not None:
            self._column = separator
            self._begin("width")
        elif column >= grid.sheet.shape[1]:
            grid.is_in_test_row = True
            grid.moving(lambda: grid.go_to_field(column))
        elif event.y == look.sort_line and event.x >= look.layout.place(column, look.left) + look.layout.widths[column] - 2:
            grid.sort_by(column)
        elif (
            grid.sheet.selection.kind == "columns" and not event.shift and grid.sheet.block.left <= column < grid.sheet.block.right
        ):
            self._begin("move columns")
        else:
            grid.is_in_test_row = False
            grid.moving(lambda: grid.sheet.go(grid.sheet.cursor[0], column, event.shift))
            grid.action_select_columns()
            self._begin("columns")

    def _takes(self, event: events.MouseDown, row: int, look: Look) -> Dragged | None:
        """What the mouse takes here to put it down elsewhere: the rows that are selected, or the handle to fill from."""
        sheet, block = self.grid.sheet, self.grid.sheet.block
        if event.shift or look.top + event.y - look.n_headers >= len(sheet.view):
            return None
        if event.x < look.layout.gutter:
            return "move rows" if sheet.selection.kind == "rows" and block.top <= row < block.bottom else None
        at_corner = row == block.bottom - 1 and look.layout.separator_at(event.x, look.left) == block.right - 1
        return "fill" if at_corner else None

    def _begin(self, what: Dragged) -> None:
        self._dragged, self._source = what, self.grid.sheet.selection
        self.grid.capture_mouse()

    def _edge(self) -> tuple[int, int]:
        """At which edges of the cells the mouse is: down 1, up -1; right 1, left -1. At the right it cannot leave the screen."""
        (x, y), look = self._at, self.grid.look
        down = 0 if self._dragged == "columns" else (y >= look.height) - (y < look.n_headers)
        first = look.layout.gutter + (look.layout.frozen if look.left else 0)
        is_frozen = self.grid.sheet.selection.far[1] < look.layout.n_frozen
        right = 0 if self._dragged == "rows" else (x >= look.layout.width - 1) - (x < first and look.left > 0 and not is_frozen)
        return down, right

    def _pull_on(self, is_on: bool) -> None:
        """Go on pulling while the mouse rests past an edge, or stop."""
        if is_on and self._timer is None:
            self._timer = self.grid.set_interval(PULL_EVERY_S, self.pull_again)
        elif not is_on and self._timer is not None:
            self._timer.stop()
            self._timer = None

    def _drag_to(self, row: int, column: int, kind: str) -> None:
        sheet = self.grid.sheet
        if self._dragged == "fill":  # what would be filled is selected
            block, shape = self._source.block(sheet.shape), sheet.shape
            to = (row, block.right - 1) if row >= block.bottom else (block.bottom - 1, max(column, block.right - 1))
            sheet.select(lambda *_: self._source.at(block.top, block.left, shape).at(*to, shape, extend=True))
            return
        sheet.go(row, column, True)
        if kind == "rows":
            sheet.select(Selection.rows)
        elif kind == "columns":
            sheet.select(Selection.columns)

    def _place_at(self, x: int, y: int) -> tuple[int, int]:
        look = self.grid.look
        row = look.top + y - look.n_headers
        return max(0, min(row, len(self.grid.sheet.view) - 1)), look.layout.column_at(x, look.left)

    def _is_opener(self, x: int, row: int, column: int, look: Look) -> bool:
        """Whether the mark before a row that refers to another table is at a place."""
        sheet = self.grid.sheet
        is_mark = column == sheet.asset_at and x == look.layout.place(column, look.left)
        return is_mark and len(sheet.view) > 0 and sheet.query.inside(sheet.row_number(row) - 1) is not None

    def _is_cell_line(self, y: int, look: Look) -> bool:
        """Whether cells are on a line of the window: those of a row, or of the test row."""
        n_rows = len(self.grid.sheet.view) + look.has_new_row
        return y == look.test_line or (y >= look.n_headers and look.top + y - look.n_headers < n_rows)
