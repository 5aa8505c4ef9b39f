"""Tab-separated text both ways, as Excel, LibreOffice and Google Sheets write and read it, and where a paste goes.

A cell with a tab, a line end or a double quote at its start is in double quotes, with quotes in it doubled. Lines end in
"\\n", "\\r\\n", or "\\r" (a bracketed paste in a terminal); one line end at the end closes the last row.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from contextdb.tables.table import Table
from tui.model.selection import Block

Texts = list[list[str]]
"""Rows of cells, all equally wide."""

_FIELD = re.compile(r'(?:"((?:[^"]|"")*)"(?=[\t\r\n]|\Z)|([^\t\r\n]*))(\t|\r\n|\r|\n|\Z)')
_LINE_END = re.compile(r"\r\n|\r|\n")
_NEEDS_QUOTES = re.compile(r'[\t\r\n]|^"')


def parse_tsv(text: str) -> Texts:
    """The cells of a text from the clipboard; short rows are filled with empty cells. No text is not a cell.

    A quote that is not closed, or is inside a cell, is taken as it is.
    """
    if '"' not in text:
        lines = _LINE_END.split(text)
        rows = [line.split("\t") for line in (lines if lines[-1] else lines[:-1])]
        return _as_wide(rows)
    rows = [[]]
    at = 0
    while at < len(text):
        found = _FIELD.match(text, at)
        assert found is not None, "the second way matches any text"
        at, end = found.end(), found[3]
        rows[-1].append(found[2] if found[1] is None else found[1].replace('""', '"'))
        if end == "\t" and at == len(text):
            rows[-1].append("")
        elif end not in ("\t", ""):
            rows.append([])
    return _as_wide(rows if rows[-1] else rows[:-1])


def _as_wide(rows: Texts) -> Texts:
    width = max(map(len, rows), default=0)
    return [row if len(row) == width else row + [""] * (width - len(row)) for row in rows]


def format_tsv(rows: Iterable[Sequence[str]]) -> str:
    """Cells as a text for the clipboard, each row closed by "\\n"."""
    return "".join("\t".join(map(_field, row)) + "\n" for row in rows)


def _field(text: str) -> str:
    return '"' + text.replace('"', '""') + '"' if _NEEDS_QUOTES.search(text) else text


@dataclass(frozen=True, slots=True)
class Placed:
    """Where a paste goes: its block, which may reach past the last row, and how many columns found no place."""

    block: Block
    texts: Texts
    n_columns_cut: int = 0

    def cells(self) -> Iterator[tuple[int, int, str]]:
        """Every cell as (row, column, text), the pasted rows and columns repeated as often as they fit."""
        n_rows, n_columns = len(self.texts), len(self.texts[0])
        for row in range(self.block.top, self.block.bottom):
            texts = self.texts[(row - self.block.top) % n_rows]
            for column in range(self.block.left, self.block.right):
                yield row, column, texts[(column - self.block.left) % n_columns]

    @property
    def name(self) -> str:
        """The name of the step."""
        n_rows, n_columns = self.block.shape
        return f"Paste {n_rows} × {n_columns}"


def place_paste(texts: Texts, selected: Block, n_columns: int) -> Placed:
    """Where cells go that are pasted over a selection.

    One cell, a row or a block fills the selection when that is a multiple of it, in each direction by itself; else it is once,
    from the selection's top left. It grows past the last row, never past the last column.
    """
    height, width = len(texts), len(texts[0]) if texts else 0
    if not height or not width:
        return Placed(Block(selected.top, selected.left, selected.top, selected.left), [[""]])
    tall, wide = selected.shape
    fills = (tall % height == 0 and tall > 0) and (wide % width == 0 and wide > 0)
    tall, wide = (tall, wide) if fills else (height, width)
    right = min(selected.left + wide, n_columns)
    cut = selected.left + wide - right
    return Placed(Block(selected.top, selected.left, selected.top + tall, right), texts, cut)


def asks_how_to_read(text: str, table: Table) -> bool:
    """Whether a text that is pasted into a table without rows is a table itself: it has a line of names, or columns to spare."""
    if table.n_rows:
        return False
    texts = parse_tsv(text)
    names = {column.name.casefold() for column in table.columns}
    has_names = bool(texts) and any(cell.strip().casefold() in names for cell in texts[0])
    return bool(texts) and (has_names or len(texts[0]) > len(table.columns))
