"""Tab-separated text both ways, as Excel, LibreOffice and Google Sheets write and read it, and where a paste goes.

A cell with a tab, a line end or a double quote at its start is in double quotes, with quotes in it doubled. Lines end in
"\\n", "\\r\\n", or "\\r" (a bracketed paste in a terminal); one line end at the end closes the last row.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from contextdb.cells.conditions import Condition
from contextdb.exchange.reading import DECIMAL_COMMA, PAIR, as_pair
from contextdb.tables.table import Table

from .selection import Block

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
        field = _FIELD.match(text, at)
        assert field is not None, "the second way matches any text"
        at, end = field.end(), field[3]
        rows[-1].append(field[2] if field[1] is None else field[1].replace('""', '"'))
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


@dataclass(frozen=True, slots=True)
class PasteDoubt:
    """A text that could be meant in two ways: what is asked, and for each answer the text to paste."""

    question: str
    ways: tuple[tuple[str, str], ...]


def paste_doubt(text: str, conditions: Sequence[Condition | None]) -> PasteDoubt | None:
    """What to ask before a text is pasted into columns of these conditions, None for other columns: whether commas part cells, or
    are decimal signs; None where it is clear."""
    if "," not in text:
        return None
    return _comma_lines(text, len(conditions)) or _decimal_commas(text, conditions)


def _comma_lines(text: str, n_columns: int) -> PasteDoubt | None:
    """A text without tabs whose lines have equally many commas, with nothing blank behind them: it may be CSV."""
    if "\t" in text:
        return None
    try:
        rows = list(csv.reader(_LINE_END.split(text.rstrip("\r\n")), strict=True))
    except csv.Error:
        return None
    width = len(rows[0]) if rows else 0
    is_even = all(len(row) == width for row in rows) and not any(cell[:1] == " " for row in rows for cell in row)
    are_numbers = all(PAIR.fullmatch(line) for line in _LINE_END.split(text) if line)
    if not is_even or are_numbers or not 2 <= width <= n_columns or len(rows) * width < 3:
        return None
    split, whole = f"Split at the commas, into {width} columns", "As it is, into one column"
    return PasteDoubt("Commas in the text that is pasted", ((split, format_tsv(rows)), (whole, text)))


def _decimal_commas(text: str, conditions: Sequence[Condition | None]) -> PasteDoubt | None:
    """Numbers with a comma in columns of numbers, where a cell reads centre and tolerance."""
    rows = parse_tsv(text)
    numeric = [
        at for at, one in enumerate(conditions) if one is not None and one.domain.type.is_numeric and rows and at < len(rows[0])
    ]
    pointed, first = [list(row) for row in rows], None
    for row in pointed:
        for at in numeric:
            if "," in row[at] and PAIR.fullmatch(row[at]):
                pair, row[at] = row[at].strip(), DECIMAL_COMMA.sub(".", row[at]).strip()
                first = first or (pair, row[at])
    if first is None:
        return None
    as_number, as_it_is = f"{first[1]}: the comma is a decimal sign", f"{as_pair(first[0])}: centre and tolerance"
    return PasteDoubt(f"What {first[0]} means", ((as_number, format_tsv(pointed)), (as_it_is, text)))


def asks_how_to_read(text: str, table: Table) -> bool:
    """Whether a text that is pasted into a table without rows is a table itself: it has a line of names, or columns to spare."""
    if table.n_rows:
        return False
    texts = parse_tsv(text)
    names = {column.name.casefold() for column in table.columns}
    has_names = bool(texts) and any(cell.strip().casefold() in names for cell in texts[0])
    return bool(texts) and (has_names or len(texts[0]) > len(table.columns))
