"""A grid of texts, as a sheet or a text file holds it, as the columns of one table.

What stands around the table is told: a title above it, blank rows in it, a second table beside or below it. A table's first row
names its columns.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.columns import TextColumn
from contextdb.errors import Fault, Place, TableError, in_quotes, plural
from contextdb.exchange.reading import Remark, capped
from contextdb.record_faults import MOST_CHARACTERS
from contextdb.source import name_faults

Grid = Sequence[Sequence[str]]
"""Rows of texts; all rows are equally wide."""

_RANGE = re.compile(r"\$?([A-Za-z]{1,3})\$?(\d{1,7}):\$?([A-Za-z]{1,3})\$?(\d{1,7})")
MOST_BLOCKS = 8


@dataclass(frozen=True, slots=True)
class Block:
    """Cells of a grid: rows [top, bottom), columns [left, right), from 0."""

    top: int
    left: int
    bottom: int
    right: int

    @property
    def n_rows(self) -> int:
        """How many rows it has, the header counted."""
        return self.bottom - self.top

    def __str__(self) -> str:
        first, last = f"{column_letters(self.left)}{self.top + 1}", f"{column_letters(self.right - 1)}{self.bottom}"
        return first if first == last else f"{first}:{last}"


def column_letters(column: int) -> str:
    """The name of a column in a spreadsheet: A, B, …, Z, AA for 0, 1, …, 25, 26."""
    letters = ""
    column += 1
    while column:
        column, rest = divmod(column - 1, 26)
        letters = chr(65 + rest) + letters
    return letters


def column_number(letters: str) -> int:
    """The number of a column, from 1: of AA, 27."""
    number = 0
    for letter in letters.upper():
        number = number * 26 + ord(letter) - 64
    return number


def parse_block(text: str) -> Block | None:
    """A range as a spreadsheet writes it, such as A10:F20; None for another text."""
    found = _RANGE.fullmatch(text.strip())
    if not found:
        return None
    columns = [column_number(found[i]) - 1 for i in (1, 3)]
    rows = [int(found[i]) for i in (2, 4)]
    return Block(max(min(rows), 1) - 1, min(columns), max(rows), max(columns) + 1)


def columns_of(grid: Grid, file: str, block: Block | None = None, row_noun: str = "row") -> tuple[list[TextColumn], list[Remark]]:
    """The columns of the table in a grid, or in a block of it.

    Parameters
    ----------
    block : Block, optional
        Where the table stands; default: it is looked for.
    row_noun : str
        What a row of the grid is called in messages: "row" of a sheet, "line" of a text.

    Raises
    ------
    TableError
        There is no table, more than one, columns without a name or with one name twice, or a text that is too long.
    """
    if block is None:
        block, remarks = _found(grid, file)
    else:
        remarks = list[Remark]()
        block = Block(block.top, block.left, min(block.bottom, len(grid)), min(block.right, len(grid[0]) if grid else 0))
    rows = [row[block.left : block.right] for row in grid[block.top : block.bottom]]
    if not rows or not any(map(any, rows)):
        raise TableError(
            Fault("there is nothing to read.", "a row with the names of the columns, then one for each asset", place=Place(file))
        )
    kept = [row for row in rows[1:] if any(row)]
    if len(kept) < len(rows) - 1:
        first = next(at for at, row in enumerate(rows[1:], block.top + 2) if not any(row))
        remarks.append(Remark(f"{plural(len(rows) - 1 - len(kept), f'blank {row_noun}')} left out.", f"{row_noun} {first}"))
    names = [name.strip() for name in rows[0]]
    _require_names(names, kept, block, file)
    columns = [TextColumn.of(n, t) for n, t in zip(names, zip(*kept, strict=True) if kept else [()] * len(names), strict=True)]
    _require_short(columns, file)
    return columns, remarks


def _require_names(names: Sequence[str], rows: Grid, block: Block, file: str) -> None:
    faults = []
    for at, name in enumerate(names):
        if not name:
            held = next((row[at] for row in rows if row[at].strip()), None)
            of = f"; it holds {in_quotes(held)}" if held else ""
            faults.append(
                Fault(f"column {column_letters(block.left + at)} has no name{of}.", "a name in the first row of each column")
            )
    faults = faults or list(name_faults(names))
    if faults:
        raise TableError(*(fault.at(Place(file, block.top + 1)) for fault in faults))


def _require_short(columns: Sequence[TextColumn], file: str) -> None:
    for column in columns:
        longest = max(column.texts, key=len, default="")
        if len(longest) > MOST_CHARACTERS:
            found = f"a cell has {len(longest):,} characters: {in_quotes(longest)}."
            raise TableError(
                Fault(found, f"at most {MOST_CHARACTERS:,} characters in a cell", place=Place(file, column=column.name))
            )


# ---- where the table stands


def _found(grid: Grid, file: str) -> tuple[Block, list[Remark]]:
    blocks = blocks_of(grid)
    if not blocks:
        raise TableError(
            Fault("there is nothing to read.", "a row with the names of the columns, then one for each asset", place=Place(file))
        )
    tables = [block for block in blocks if block.n_rows > 1] or blocks[:1]
    if len(tables) > 1:
        places = ", ".join(map(str, tables[:MOST_BLOCKS]))
        more = f" and {len(tables) - MOST_BLOCKS} more" if len(tables) > MOST_BLOCKS else ""
        found = f"the sheet holds {len(tables)} tables: {places}{more}."
        raise TableError(Fault(found, "one of them", f'to name its cells, as in --sheet "SHEET!{tables[0]}"', Place(file)))
    left = [block for block in blocks if block is not tables[0]]
    notes = [Remark(f"left out, as it is no table: {in_quotes(_first_text(grid, block))}.", f"cells {block}") for block in left]
    return tables[0], list(capped(notes, "such texts"))


def _first_text(grid: Grid, block: Block) -> str:
    return next(text for row in grid[block.top : block.bottom] for text in row[block.left : block.right] if text)


def blocks_of(grid: Grid) -> list[Block]:
    """The tables of a grid: what blank columns, or blank rows, part from each other.

    Rows below a blank one belong to the same table when they stand under its columns, and do not begin with other names.
    """
    if not grid or not grid[0]:
        return []
    is_filled = np.array([list(map(bool, row)) for row in grid], np.bool_)
    blocks = list[Block]()
    for top, bottom in _runs(np.asarray(is_filled.any(axis=1))):
        for left, right in _runs(np.asarray(is_filled[top:bottom].any(axis=0))):
            _add(blocks, Block(top, left, bottom, right), is_filled)
    return blocks


def _add(blocks: list[Block], block: Block, is_filled: NDArray[np.bool_]) -> None:
    """Add a block, or grow the one above it that it goes on."""
    for at, above in enumerate(blocks):
        is_under = above.left <= block.left and block.right <= above.right and above.n_rows > 1
        if is_under and above.bottom < block.top and is_filled[block.top, above.left]:
            if _is_header_like(is_filled, above, block):
                break
            blocks[at] = Block(above.top, above.left, block.bottom, above.right)
            return
        if is_under and above.bottom == block.bottom:  # the rest of a row that a blank cell parts
            return
    blocks.append(block)


def _is_header_like(is_filled: NDArray[np.bool_], above: Block, block: Block) -> bool:
    """Whether a block could be a table of its own: fewer columns than the one above, all of them filled in its first row."""
    is_narrower = block.right - block.left < above.right - above.left
    return is_narrower and block.n_rows > 1 and bool(is_filled[block.top, block.left : block.right].all())


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Where flags are set, as [start, stop) of each run."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return list(zip(edges[0::2].tolist(), edges[1::2].tolist(), strict=True))
