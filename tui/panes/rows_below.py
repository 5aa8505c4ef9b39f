"""The rows of the table that a line of a list is about, below it, where the screen has room for them. Enter goes to one of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import ClassVar

from rich.cells import cell_len
from textual import on
from textual.binding import Binding, BindingType

from contextdb.tables.table import Table

from ..messages import GoToCell
from ..model.coverage_lines import short_name
from ..widgets.line_list import LineList, ListCell, ListColumn

MOST = 100
"""So many rows are looked at for the widths of their columns, and are listed where they are ranked."""
WIDEST, WIDEST_ASSET, LEAST = 28, 44, 5
IN_TABLE = "In the table"
SIGNS = {"error": "!", "warning": "×"}
"""What a tone says without colours, as in the sheet."""


class RowsBelow(LineList):
    """Rows as they are in the table, the cells that matter marked."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "choose", "Go to the row")]
    DEFAULT_CSS = """
    RowsBelow {
        display: none; height: 1fr; border-top: solid $panel; border-title-color: $text-muted; border-title-background: $surface;
    }
    """

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__([], id=id)
        self._displayed: tuple[Table, str, Sequence[int], Mapping[tuple[int, str], str], int, str | None] | None = None

    def show_rows(
        self,
        table: Table,
        title: str,
        rows: Sequence[int],
        tones: Mapping[tuple[int, str], str] | None = None,
        at: int = 0,
        column: str | None = None,
    ) -> None:
        """Show rows of a table, the one at a place chosen. Cells have a tone by row and column; `column` is seen in any case."""
        self.border_title = title
        self.set_class(bool(rows), "-filled")
        self._displayed = table, title, rows, tones or {}, at, column
        self._lay_out()

    def show_compared(self, table: Table, rows: Sequence[int], tones: Mapping[tuple[int, str], str], column: str | None) -> None:
        """Show a row, those that it is compared with, and then the rest of the table."""
        named = {(row, table.asset_column): "info" for row in rows}
        compared = set(rows)
        others = [row for row in range(table.n_rows) if row not in compared]
        self.show_rows(
            table, "The row, those that it is compared with, and the others", [*rows, *others], {**named, **tones}, 0, column
        )

    def show_none(self) -> None:
        """There are no rows to show."""
        self._displayed = None
        self.remove_class("-filled")

    def on_resize(self) -> None:
        self._lay_out()

    def _lay_out(self) -> None:
        if self._displayed is None or not self.size.width:
            return
        table, _, rows, tones, at, column = self._displayed
        sample = rows[max(0, at - MOST // 2) : max(0, at - MOST // 2) + MOST]
        names, widths = _columns(table, sample, self.size.width - len("▸ ") - 7, column)
        titles = [name if cell_len(name) <= width else short_name(name) for name, width in zip(names, widths, strict=True)]
        self.columns = (ListColumn("Row", 5, 0, True), *map(ListColumn, titles, widths))

        def line(index: int) -> Sequence[ListCell]:
            row = rows[index]
            return [str(row + 1), *(_cell(table.text(row, name), tones.get((row, name), "")) for name in names)]

        self.show(len(rows), line, at)
        self.scroll_to(y=max(0, at - max(0, self.size.height - 2) // 2), animate=False, immediate=True)

    @on(LineList.Moved)
    def _moved_here(self, event: LineList.Moved) -> None:
        event.stop()

    @on(LineList.Chosen)
    def _go_to(self, event: LineList.Chosen) -> None:
        event.stop()
        if self._displayed is not None:
            self.post_message(GoToCell(self._displayed[2][event.index], self._displayed[5]))


def _columns(table: Table, rows: Sequence[int], room: int, column: str | None) -> tuple[list[str], list[int]]:
    """The columns that there is room for, with their widths: that of the assets, then those from the left, others instead where
    `column` is not among them. Long names are whole where all columns have room so."""
    names = [table.asset_column, *(one.name for one in table.columns if one.name != table.asset_column)]
    most = room // (LEAST + 2)

    @cache
    def of_cells(at: int) -> int:
        return max((cell_len(table.text(row, names[at])) for row in rows), default=0) + 1

    if len(names) <= most:
        whole = [max(of_cells(at), cell_len(name), LEAST) for at, name in enumerate(names)]
        if sum(whole) + 2 * len(whole) <= room:
            return names, whole

    def width(at: int) -> int:
        return min(max(of_cells(at), cell_len(short_name(names[at])), LEAST), WIDEST)

    first = min(max(of_cells(0), LEAST), WIDEST_ASSET)
    end = max(names.index(column) + 1 if column in names else 2, 2)
    room -= first + 2
    start = max(1, end - 1 - most)
    while start < end - 1 and sum(map(width, range(start, end))) + 2 * (end - start) > room:
        start += 1
    while end < len(names) and sum(map(width, range(start, end + 1))) + 2 * (end + 1 - start) <= room:
        end += 1
    return [names[0], *names[start:end]], [first, *map(width, range(start, min(end, len(names))))]


def _cell(text: str, tone: str) -> ListCell:
    return (f"{SIGNS.get(tone, '')}{text or 'Any'}", tone) if tone else (text or "Any", "muted") if text in ("", "Any") else text
