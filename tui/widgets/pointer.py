"""The mouse on a grid: click, drag and double click on cells, row numbers, headers, the sort sign and the lines between columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from textual import events

from tui.model.layout import NARROWEST
from tui.model.selection import Selection
from tui.widgets.grid_paint import N_HEADERS, Look

if TYPE_CHECKING:
    from tui.widgets.grid import Grid

Dragged = Literal["cells", "rows", "columns", "width"]


class Pointer:
    """The mouse on one grid."""

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        self._dragged: Dragged | None = None
        self._column = 0
        """The column whose width is dragged."""

    def press(self, event: events.MouseDown) -> None:
        """The button goes down: go there, select, or begin to drag."""
        grid, look = self.grid, self.grid.look
        grid.focus()
        row, column = self._place_at(event.x, event.y)
        if event.y < N_HEADERS:
            self._press_header(event, column, look)
        elif event.y == look.height - 1:
            grid.moving(lambda: grid.sheet.go(grid.sheet.cursor[0], column))
            grid.is_in_test_row = True
        elif self._is_cell_line(event.y, look):
            grid.is_in_test_row = False
            grid.moving(lambda: grid.sheet.go(row, column, event.shift))
            if event.x < look.layout.gutter:
                grid.action_select_rows()
            self._begin("rows" if event.x < look.layout.gutter else "cells")

    def move(self, event: events.MouseMove) -> None:
        """The mouse moves with its button down."""
        grid, look = self.grid, self.grid.look
        if self._dragged == "width":
            grid.set_width(self._column, max(NARROWEST, event.x - look.layout.place(self._column, look.left)))
        elif self._dragged is not None:
            row, column = self._place_at(event.x, event.y)
            if event.y >= look.height - 1:  # past the foot or the head: the rows come after the mouse
                row = min(row + 1, len(grid.sheet.view) - 1)
            elif event.y < N_HEADERS:
                row = max(look.top - 1, 0)
            grid.moving(lambda: self._drag_to(row, column, grid.sheet.selection.kind))

    def release(self) -> None:
        """The button goes up."""
        self._dragged = None
        self.grid.release_mouse()

    def click_twice(self, event: events.Click) -> None:
        """A double click: edit the cell, or fit the column left of a line."""
        look = self.grid.look
        separator = look.layout.separator_at(event.x, look.left)
        if event.y < N_HEADERS and separator is not None:
            self.grid.set_width(separator, None)
        elif event.x >= look.layout.gutter and self._is_cell_line(event.y, look):
            self.grid.action_edit()

    # ---- parts

    def _press_header(self, event: events.MouseDown, column: int, look: Look) -> None:
        grid, separator = self.grid, look.layout.separator_at(event.x, look.left)
        if separator is not None:
            self._column = separator
            self._begin("width")
        elif event.y == 0 and event.x >= look.layout.place(column, look.left) + look.layout.widths[column] - 2:
            grid.sort_by(column)
        else:
            grid.is_in_test_row = False
            grid.moving(lambda: grid.sheet.go(grid.sheet.cursor[0], column, event.shift))
            grid.action_select_columns()
            self._begin("columns")

    def _begin(self, what: Dragged) -> None:
        self._dragged = what
        self.grid.capture_mouse()

    def _drag_to(self, row: int, column: int, kind: str) -> None:
        sheet = self.grid.sheet
        sheet.go(row, column, True)
        if kind == "rows":
            sheet.select(Selection.rows)
        elif kind == "columns":
            sheet.select(Selection.columns)

    def _place_at(self, x: int, y: int) -> tuple[int, int]:
        look = self.grid.look
        row = look.top + y - N_HEADERS
        return max(0, min(row, len(self.grid.sheet.view) - 1)), look.layout.column_at(x, look.left)

    def _is_cell_line(self, y: int, look: Look) -> bool:
        """Whether cells stand on a line of the window: those of a row, or of the test row."""
        return y == look.height - 1 or (y >= N_HEADERS and look.top + y - N_HEADERS < len(self.grid.sheet.view))
