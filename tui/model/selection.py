"""What is selected: a rectangle of cells from an anchor to a cursor, whole rows or whole columns.

All places are (row, column) of the *view*: row 0 is the first row displayed, whatever row of the file it is. A selection is never
changed; each key gives a new one. With `extend` the anchor stays, as with Shift held.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

Shape = tuple[int, int]
"""Rows and columns of the view."""

Filled = Callable[[int, int], bool]
"""Whether a cell of the view holds a text."""


@dataclass(frozen=True, slots=True)
class Block:
    """A rectangle of cells: rows `top` up to, not including, `bottom`, columns `left` up to `right`."""

    top: int
    left: int
    bottom: int
    right: int

    @property
    def shape(self) -> Shape:
        return self.bottom - self.top, self.right - self.left

    @property
    def n_cells(self) -> int:
        return (self.bottom - self.top) * (self.right - self.left)

    def holds(self, row: int, column: int) -> bool:
        return self.top <= row < self.bottom and self.left <= column < self.right


@dataclass(frozen=True, slots=True)
class Selection:
    """The cell where typing goes (`row`, `column`), and a rectangle round it from an anchor to a far corner."""

    row: int = 0
    column: int = 0
    anchor: tuple[int, int] = (0, 0)
    far: tuple[int, int] = (0, 0)
    """The corner that Shift and the arrows move; what the window scrolls to."""
    kind: Literal["cells", "rows", "columns", "all"] = "cells"

    def block(self, shape: Shape) -> Block:
        """The cells selected, in a view of this shape; an empty view has none."""
        n_rows, n_columns = shape
        now = self.within(shape)
        top, bottom = sorted((now.anchor[0], now.far[0]))
        left, right = sorted((now.anchor[1], now.far[1]))
        if self.kind in ("columns", "all"):
            top, bottom = 0, n_rows - 1
        if self.kind in ("rows", "all"):
            left, right = 0, n_columns - 1
        return Block(top, left, min(bottom + 1, n_rows), min(right + 1, n_columns))

    def within(self, shape: Shape) -> Selection:
        """The selection cut to a view that may have become smaller."""
        row, column = _inside((self.row, self.column), shape)
        return Selection(row, column, _inside(self.anchor, shape), _inside(self.far, shape), self.kind)

    def at(self, row: int, column: int, shape: Shape, extend: bool = False) -> Selection:
        """The cell clicked; with `extend` a drag or a Shift-click up to it."""
        if not extend:
            return Selection(row, column, (row, column), (row, column)).within(shape)
        return replace(self, anchor=(self.row, self.column), far=(row, column)).within(shape)

    def moved(self, down: int, right: int, shape: Shape, extend: bool = False) -> Selection:
        """On by so many cells: arrows, Page Up and Page Down."""
        row, column = self._start(extend)
        return self.at(row + down, column + right, shape, extend)

    def home(self, shape: Shape, extend: bool = False) -> Selection:
        return self.at(self._start(extend)[0], 0, shape, extend)

    def end(self, shape: Shape, extend: bool = False) -> Selection:
        return self.at(self._start(extend)[0], shape[1] - 1, shape, extend)

    def first(self, shape: Shape, extend: bool = False) -> Selection:
        """The first cell of all: Ctrl+Home."""
        return self.at(0, 0, shape, extend)

    def last(self, shape: Shape, extend: bool = False) -> Selection:
        """The last cell of all: Ctrl+End."""
        return self.at(shape[0] - 1, shape[1] - 1, shape, extend)

    def to_edge(self, down: int, right: int, shape: Shape, is_filled: Filled, extend: bool = False) -> Selection:
        """Ctrl and an arrow: to the end of the filled cells, or over empty ones to the next filled one, or to the last cell."""
        row, column = self._start(extend)
        if down:
            return self.at(_edge(row, down, shape[0], lambda at: is_filled(at, column)), column, shape, extend)
        return self.at(row, _edge(column, right, shape[1], lambda at: is_filled(row, at)), shape, extend)

    def next_cell(self, down: int, right: int, shape: Shape) -> Selection:
        """Enter (down 1) and Tab (right 1): through the selected cells when there are several, which stay selected; else on by
        one."""
        block = self.block(shape)
        if block.n_cells <= 1:
            return self.moved(down, right, shape)
        n_rows, n_columns = block.shape
        row, column = self.row - block.top, self.column - block.left
        place = (column * n_rows + row + down) if down else (row * n_columns + column + right)
        place %= block.n_cells
        row, column = (place % n_rows, place // n_rows) if down else divmod(place, n_columns)
        return replace(self, row=block.top + row, column=block.left + column)

    def rows(self, shape: Shape) -> Selection:
        """Whole rows: Shift+Space, or after `at` a click on a row's number."""
        return replace(self, kind="rows").within(shape)

    def columns(self, shape: Shape) -> Selection:
        """Whole columns: Ctrl+Space, or after `at` a click on a header."""
        return replace(self, kind="columns").within(shape)

    def everything(self) -> Selection:
        """Every cell: Ctrl+A."""
        return replace(self, kind="all")

    def _start(self, extend: bool) -> tuple[int, int]:
        return self.far if extend else (self.row, self.column)


def _inside(place: tuple[int, int], shape: Shape) -> tuple[int, int]:
    return _between(place[0], max(shape[0] - 1, 0)), _between(place[1], max(shape[1] - 1, 0))


def _between(place: int, last: int) -> int:
    return max(0, min(place, last))


def _edge(place: int, step: int, n_cells: int, is_filled: Callable[[int], bool]) -> int:
    last = n_cells - 1 if step > 0 else 0
    if place == last or n_cells == 0:
        return place
    if is_filled(place) and is_filled(place + step):
        while place != last and is_filled(place + step):
            place += step
        return place
    place += step
    while place != last and not is_filled(place):
        place += step
    return place
