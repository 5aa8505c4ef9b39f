"""A run of Tabs in one row of a sheet: Enter after it goes to the next row, to the column where the run began."""

from __future__ import annotations


class TabRun:
    """Where the run began, as long as the cursor is in the cell that the last Tab went to."""

    def __init__(self) -> None:
        self._at = (-1, -1)
        self._start = 0

    def tab(self, row: int, column: int, by: int = 1) -> None:
        self._start = column if self._at != (row, column) else self._start
        self._at = row, column + by

    def enter(self, row: int, column: int) -> int | None:
        """Enter was pressed in a cell: the column to go back to, None where no run led here."""
        start = self._start if self._at == (row, column) else None
        self._at = -1, -1
        return start
