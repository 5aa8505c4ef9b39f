"""The sheet of a file that is imported, to say which of its rows names the columns, and which is the last."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import accumulate
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Static

from contextdb.cells.domains import NUMBER
from contextdb.cells.grammar import reads
from contextdb.errors import plural
from contextdb.exchange.grid import LAST_ROW, MOST_ABOVE, Block, blocks_of, column_letters, parse_block

from ..widgets.line_list import LineList, ListCell, ListColumn
from .dialog import Dialog, buttons

SAMPLE = 100
"""Rows of which the columns are as wide as their texts."""
WIDEST = 18
KEYS = "Enter header · L last row · ←→ columns · F6 read these · Esc as it was"


def first_header(grid: Sequence[Sequence[str]], cells: str) -> int:
    """The row that names the columns, from 0: that of the cells that are chosen, else the one with most names."""
    block = parse_block(cells.rpartition("!")[2])
    if block is not None:
        return min(block.top, len(grid) - 1)
    names = [sum(bool(text.strip()) and not reads(text, NUMBER) for text in row) for row in grid[:MOST_ABOVE]]
    return names.index(max(names))


class RowsDialog(Dialog[str]):
    """Which rows of a sheet are the table: gives its cells as A5:F20, or A5:F to the last row."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("l", "last_row", "The last row is here"),
        Binding("f6,ctrl+j", "accept", "Read these"),
        Binding("left", "turn(-1)", "Columns before", show=False),
        Binding("right", "turn(1)", "Next columns", show=False),
    ]
    DEFAULT_CSS = """
    RowsDialog {
        & > #dialog { padding: 0 2; }
        & LineList { height: 1fr; margin: 1 0; }
        & #rows-said { height: 1; text-style: bold; }
    }
    """
    keys_text = KEYS

    def __init__(self, grid: Sequence[Sequence[str]], name: str, at: int = 0) -> None:
        """`name` is that of the sheet; the cursor begins at row `at`, from 0."""
        super().__init__(classes="-wide")
        self.title_text = f"The rows of {name or 'the file'}"
        self.grid = grid
        self.header, self.last = at, LAST_ROW
        self.first = 0
        """The first column that is seen."""

    @property
    def block(self) -> Block:
        """The cells that are chosen: from the header on the columns of its table, and those that the header fills."""
        row = self.grid[self.header]
        filled = [at for at, text in enumerate(row) if text.strip()] or [0]
        tables = (each for each in blocks_of([row, *self.grid[self.header + 1 : self.header + SAMPLE]]) if each.top == 0)
        right = max([filled[-1] + 1, *(each.right for each in tables if each.left <= filled[0])])
        return Block(self.header, filled[0], max(self.last, self.header + 1), right)

    def compose_body(self) -> ComposeResult:
        """The sheet, and what is chosen of it."""
        yield Static("", id="rows-said")
        yield LineList([], id="rows-lines")
        yield Static(buttons([("accept", "Read these"), ("cancel", "Cancel")]))

    def on_mount(self) -> None:
        """Stand on the header as it was found."""
        self._show(self.header)
        self.query_one(LineList).focus()

    def _show(self, at: int) -> None:
        block = self.block
        end = "to the last row" if block.is_open else f"and {plural(block.bottom - block.top - 1, 'row')} below it"
        self.query_one("#rows-said", Static).update(Content(f"{block}: the header is row {block.top + 1}, {end}."))
        lines = self.query_one(LineList)
        lines.columns = (ListColumn("Row", len(f"{len(self.grid)}") + 7, 0, True), *self._columns[self.first :])
        lines.show(len(self.grid), self._line, at)

    @cached_property
    def _columns(self) -> list[ListColumn]:
        rows = self.grid[:SAMPLE]
        widths = [min(max(3, *(len(row[at]) for row in rows)), WIDEST) for at in range(len(rows[0]))]
        return [ListColumn(column_letters(at), width, is_name=True) for at, width in enumerate(widths)]

    def action_turn(self, step: int) -> None:
        """Show the columns from the next one on, or from that before."""
        room = self.query_one(LineList).size.width - 16
        seen = accumulate(column.width + 2 for column in reversed(self._columns))
        last = len(self._columns) - max(1, sum(wide <= room for wide in seen))
        self.first = max(0, min(self.first + step, last))
        self._show(self.query_one(LineList).index)

    def _line(self, at: int) -> Sequence[ListCell]:
        block = self.block
        is_header = at == block.top
        sign = "header " if is_header else "last " if at + 1 == block.bottom else ""
        tone = "info" if is_header else "" if block.top < at < block.bottom else "muted"
        cells = [text.replace("\n", " ") for text in self.grid[at]]
        in_block = [(text, tone if block.left <= column < block.right else "muted") for column, text in enumerate(cells)]
        return (f"{sign}{at + 1}", tone), *in_block[self.first :]

    def on_line_list_chosen(self, event: LineList.Chosen) -> None:
        """The header is here; a last row above it counts no more."""
        event.stop()
        self.header = event.index
        self.last = self.last if self.last > self.header + 1 else LAST_ROW
        self._show(event.index)

    def action_last_row(self) -> None:
        """The last row is here, or again all rows come where it is so already."""
        at = self.query_one(LineList).index
        if at > self.header:
            self.last = LAST_ROW if self.last == at + 1 else at + 1
            self._show(at)

    def action_accept(self) -> None:
        """Give back the cells."""
        self.dismiss(str(self.block))
