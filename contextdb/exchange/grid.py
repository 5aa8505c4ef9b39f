"""A grid of texts, as a sheet or a text file holds it, as the columns of one table.

What stands around the table is reported: a title above it, blank rows in it, a second table beside or below it. A table's first row
names its columns.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.domains import NUMBER
from contextdb.cells.grammar import reads
from contextdb.columns import TextColumn
from contextdb.errors import Fault, Place, TableError, in_quotes, plural
from contextdb.exchange.everyday import HIGHS, LOWS, is_sum
from contextdb.exchange.reading import Remark, TableWanted, capped
from contextdb.files.csv_source import MOST_CHARACTERS, name_faults

Grid = Sequence[Sequence[str]]
"""Rows of texts; all rows are equally wide."""

_RANGE = re.compile(r"\$?([A-Za-z]{1,3})\$?(\d{1,7}):\$?([A-Za-z]{1,3})\$?(\d{1,7})?")
LAST_ROW = 10_000_000
"""The end of a range that names no last row."""
MOST_BLOCKS = 8
MOST_ABOVE = 10
"""Rows in which the header is looked for."""
MOST_NAMELESS = 3
"""Columns without a name that are reported one by one."""
_VALUES = frozenset(("true", "false", "any"))
MOST_LOOKED_AT = 1_000
"""Blocks of cells that are compared with each other; a sheet with more is not a list of assets."""


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

    @property
    def is_open(self) -> bool:
        """Whether it goes to the last row, whichever that is."""
        return self.bottom >= LAST_ROW

    def __str__(self) -> str:
        last_row = "" if self.is_open else self.bottom
        first, last = f"{column_letters(self.left)}{self.top + 1}", f"{column_letters(self.right - 1)}{last_row}"
        return first if first == last else f"{first}:{last}"


class Columns(NamedTuple):
    """The columns of a table in a grid."""

    columns: list[TextColumn]
    remarks: list[Remark]
    rows: Sequence[int]
    """The row of the grid, from 0, of each row."""
    places: Sequence[int]
    """The column of the grid, from 0, of each column."""


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
    """A range as a spreadsheet writes it, such as A10:F20, or A10:F to the last row; None for another text."""
    match = _RANGE.fullmatch(text.strip())
    if not match:
        return None
    columns = [column_number(match[i]) - 1 for i in (1, 3)]
    rows = [int(match[2]), int(match[4] or LAST_ROW)]
    return Block(max(min(rows), 1) - 1, min(columns), max(rows), max(columns) + 1)


def columns_of(
    grid: Grid,
    file: str,
    block: Block | None = None,
    row_noun: str = "row",
    sheet: str | None = None,
    wide: Collection[int] = (),
    takes_all: bool = False,
) -> Columns:
    """The columns of the table in a grid, or in a block of it whose first row is the names; None: it is looked for, also below a
    title.

    `row_noun` is what messages call a row of the grid, "sheet row" of a workbook or "line" of a text, and `sheet` its name. `wide`
    are rows, from 0, with a cell that is merged over several columns: no row of names has one, and one right above the names groups
    the columns. `takes_all`: every row is an asset, also a total, as somebody chose them.

    Raises TableError where there is no table, more than one, columns without a name or with one name twice, or a text that is too
    long.
    """
    if block is None:
        block, remarks = _table_block(grid, file, wide, sheet)
    else:
        remarks = list[Remark]()
        block = Block(block.top, block.left, min(block.bottom, len(grid)), min(block.right, len(grid[0]) if grid else 0))
    rows: list[Sequence[str]] = [
        [text if text.strip() else "" for text in row[block.left : block.right]] for row in grid[block.top : block.bottom]
    ]
    if not rows or not any(map(any, rows)):
        raise TableError(
            Fault("there is nothing to read.", "a row with the names of the columns, then one for each asset", place=Place(file))
        )
    blank = [at for at, row in enumerate(rows[1:], block.top + 2) if not any(row)]
    body = {at: row for at, row in enumerate(rows[1:], block.top + 2) if any(row)}
    if blank:
        remarks.append(Remark(f"{plural(len(blank), f'blank {row_noun}')} left out.", f"{row_noun} {blank[0]}"))
    if not takes_all:
        remarks += [
            Remark(f"left out, as it is no asset: {in_quotes(text)}.", f"{row_noun} {at}", is_loss=True)
            for at, text in _taken_out(body, blank, wide)
        ]
    filled = list(body.values())
    names = _with_groups(_groups_above(grid, block, wide), rows[0])
    renamed = next(
        ((old.strip(), new) for old, new in zip(rows[0], names, strict=True) if " ".join(old.split()) not in ("", new)), None
    )
    if renamed:
        remarks.append(Remark("names have their group in front: {} is now {}.".format(*map(in_quotes, renamed))))
    _require_names(names, filled, block, Place(file, block.top + 1), _mend(rows, block, sheet))
    columns = [TextColumn.of(n, t) for n, t in zip(names, zip(*filled, strict=True) if filled else [()] * len(names), strict=True)]
    _require_short(columns, file)
    named = [(at, column) for at, column in enumerate(columns, block.left) if column.name]
    return Columns([column for _, column in named], remarks, [at - 1 for at in body], [at for at, _ in named])


def _taken_out(body: dict[int, Sequence[str]], blank: Sequence[int], wide: Collection[int]) -> list[tuple[int, str]]:
    """Take out the rows below a header that are no assets, and give their places and texts: headings merged over all columns,
    totals at the end, and a remark below a blank row."""
    out = [at for at, row in body.items() if at - 1 in wide and is_title(row) and all(row)]
    for at in reversed(body):
        texts = [text for text in body[at] if text.strip()]
        is_remark = len(texts) == 1 < len(body[at]) - 1 and at - 1 in blank and not _is_value(texts[0])
        if at in out or is_remark or (is_sum(texts[0]) and all(map(_is_number, texts[1:]))):
            out.append(at)
        else:
            break
    return [(at, next(filter(None, body.pop(at)))) for at in sorted(set(out)) if len(body) > 1]


def _is_number(text: str) -> bool:
    return reads(text.replace(",", "."), NUMBER) or text.startswith("#")  # or an error of Excel


def _require_names(names: Sequence[str], rows: Grid, block: Block, place: Place, mend: str) -> None:
    nameless = [at for at, name in enumerate(names) if not name and any(row[at] for row in rows)]
    if len(nameless) > MOST_NAMELESS:
        letters = ", ".join(column_letters(block.left + at) for at in nameless[:MOST_NAMELESS])
        problem = f"{len(nameless):,} of {plural(len(names), 'column')} have no name: {letters}, …"
        raise TableError(Fault(problem, "a name in the first row of each column", mend, place))
    faults = []
    for at in nameless:
        held = next((row[at] for row in rows if row[at].strip()), None)
        of = f"; it holds {in_quotes(held)}" if held else ""
        faults.append(
            Fault(f"column {column_letters(block.left + at)} has no name{of}.", "a name in the first row of each column", mend)
        )
    faults = faults or list(name_faults([name for name in names if name]))
    if mend and len(faults) > 1:  # the row is no header: which of its cells are wrong is no help
        faults = [replace(faults[0], mend=mend)]
    if faults:
        raise TableError(*(fault.at(place) for fault in faults))


def _mend(rows: Grid, block: Block, sheet: str | None) -> str:
    """The cells of the table without the rows above its header, where those are more than a title."""
    at = header_at(rows)
    if at == 0 or sheet is None:
        return ""
    cells = Block(block.top + at, block.left, block.bottom, block.right)
    return f"to name the cells of the table: --sheet {in_quotes(f'{sheet}!{cells}')}"


def header_at(rows: Grid) -> int:
    """The row that names the columns: the first of a few that could; 0 where none could."""
    return next((at for at, row in enumerate(rows[:MOST_ABOVE]) if is_header(row)), 0)


def is_header(row: Sequence[str]) -> bool:
    """Whether a row names columns: every cell says something, no two the same, and none a number or a truth."""
    names = [name.strip() for name in row]
    return all(names) and len(set(names)) == len(names) and not any(map(_is_value, names))


def _is_value(text: str) -> bool:
    """Whether a text is a value, as no name of a column is."""
    return reads(text, NUMBER) or text.casefold() in _VALUES


def is_title(row: Sequence[str]) -> bool:
    """Whether a row of several cells says one thing alone, in one of them or over all of them."""
    return len(row) > 1 and len({text.strip() for text in row if text.strip()}) == 1


def _is_groups(rows: Grid, is_wide: bool) -> bool:
    """Whether the first of two rows groups the columns of the second: its first cell is blank, or merged with the next one, or
    names a column whose cell below is blank; and a group that is not merged has blank cells behind it. Over nothing but "min" and
    "max" also the names of the other columns may stand in the first."""
    first, *_ = rows
    if len(rows) < 2 or len(first) < 2:
        return False
    if is_wide:
        return first[0] in ("", first[1], rows[-1][0]) or rows[-1][0] == ""
    below = {text.casefold() for text in rows[-1] if text}
    if below & LOWS and below & HIGHS and below <= LOWS | HIGHS:
        return not all(first) and all(map(any, zip(*rows, strict=True))) and not set(map(str.casefold, first)) & below
    texts = [text for text in first if text]
    return first[0] == "" and 0 < len(set(texts)) == len(texts) and len(texts) <= len(first) // 2 and all(rows[-1])


def is_grouped(rows: Grid) -> bool:
    """Whether the first of some rows groups the columns that the second names; the shorter of the two ends in blank cells."""
    if len(rows) < 2:
        return False
    width = max(map(len, rows[:2]))
    even = [[*row, *[""] * (width - len(row))] for row in rows[:2]]
    return _is_groups(even, is_wide=False) and is_header(_names_at(even, Block(0, 0, 2, width), 1, ()))


def _groups_above(grid: Grid, block: Block, wide: Collection[int]) -> Sequence[str]:
    """The group of each column of a block by the row above its header; empty where that has none."""
    at = block.top - 1
    if at < 0:
        return ()
    row = grid[at][block.left : block.right]
    if at in wide:
        return row
    if not _is_groups([row, grid[block.top][block.left : block.right]], is_wide=False):
        return ()
    groups, group = list[str](), ""
    for text in row:
        group = text.strip() or group
        groups.append(group)
    return groups


def _with_groups(groups: Sequence[str], row: Sequence[str]) -> list[str]:
    """The names of a row under their groups. Groups with a column of one name are roles, as Attacker.Stance and Victim.Stance are,
    and stand before the names of all their columns; one over "min" and "max" is what these are of; one over a single blank cell is
    the name."""
    names = [" ".join(name.split()) for name in row]
    n_times, n_groups = Counter(names), Counter(groups)
    pairs = [(group, name or (group if n_groups[group] == 1 else "")) for group, name in zip_longest(groups, names, fillvalue="")]
    roles = {group for group, name in pairs if group and name and n_times[name] > 1 and name.casefold() not in LOWS | HIGHS}
    return [_in_group(group, name, group in roles) if group and group != name else name for group, name in pairs]


def _in_group(group: str, name: str, is_role: bool) -> str:
    if name.casefold() in LOWS | HIGHS:
        return f"{group} {name}"
    return f"{group}.{name}" if name and is_role else name


def doubts(columns: Sequence[TextColumn]) -> list[Remark]:
    """What a person should look at: names that look like values, as where a header is missing."""
    remarks = []
    odd = next((c for c in columns if _is_value(c.name) or (c.name and c.name in c.texts)), None)
    if odd is not None:
        why = "is also one of its cells" if odd.name in odd.texts else "looks like a value"
        remarks.append(Remark(f"is the header missing? The name {in_quotes(odd.name)} {why}. The first row is read as names."))
    return remarks


def _require_short(columns: Sequence[TextColumn], file: str) -> None:
    for column in columns:
        longest = max(column.texts, key=len, default="")
        if len(longest) > MOST_CHARACTERS:
            problem = f"a cell has {len(longest):,} characters: {in_quotes(longest)}."
            raise TableError(
                Fault(problem, f"at most {MOST_CHARACTERS:,} characters in a cell", place=Place(file, column=column.name))
            )


# ---- where the table is


def _table_block(grid: Grid, file: str, wide: Collection[int], sheet: str | None) -> tuple[Block, list[Remark]]:
    try:
        blocks = blocks_of(grid)
    except TableError as error:
        raise TableError(*(fault.at(Place(file)) for fault in error.faults)) from None
    if not blocks:
        raise TableError(
            Fault("there is nothing to read.", "a row with the names of the columns, then one for each asset", place=Place(file))
        )
    blocks, titles = _without_titles(blocks, grid, wide)
    deep = [block for block in blocks if block.n_rows > 1]
    tables = [block for block in deep if block.right - block.left > 1] or deep or blocks[:1]
    if len(tables) > 1:
        places = ", ".join(map(str, tables[:MOST_BLOCKS]))
        more = f" and {len(tables) - MOST_BLOCKS} more" if len(tables) > MOST_BLOCKS else ""
        problem = f"the sheet holds {len(tables)} tables: {places}{more}."
        mend = f'to name its cells, as in --sheet "SHEET!{tables[0]}"'
        raise TableWanted(
            Fault(problem, "one of them", mend, Place(file)), blocks=[f"{sheet}!{each}" if sheet else str(each) for each in tables]
        )
    left = [block for block in blocks if block is not tables[0]]
    notes = [
        Remark(f"left out because it is not a table: {in_quotes(_first_text(grid, block))}.", f"cells {block}") for block in left
    ]
    return tables[0], list(capped([*titles, *notes], "such texts"))


def _without_titles(blocks: Sequence[Block], grid: Grid, wide: Collection[int]) -> tuple[list[Block], list[Remark]]:
    """The blocks without the rows of a title, or of groups, right above a header, and blocks that are titles alone as one row."""
    without, remarks = [], []
    for block in blocks:
        rows = [row[block.left : block.right] for row in grid[block.top : block.bottom]]
        above = [not any(row) or is_title(row) for row in rows[:MOST_ABOVE]]
        above = [one or _is_groups(rows[at : at + 2], at + block.top in wide) for at, one in enumerate(above)]
        n_titles = above.index(False) if False in above else len(above)
        if n_titles == len(rows):  # a title of several lines
            first = next(at for at, row in enumerate(rows, block.top) if any(row))
            without.append(Block(first, block.left, first + 1, block.right))
        elif header := next((at for at in range(1, n_titles + 1) if is_header(_names_at(grid, block, at, wide))), 0):
            without.append(replace(block, top=block.top + header))
        else:
            without.append(block)
            continue
        for at, row in enumerate(grid[block.top : without[-1].top], block.top + 1):
            if text := ", ".join(dict.fromkeys(filter(None, row[block.left : block.right]))):
                remarks.append(Remark(f"left out above the header: {in_quotes(text)}.", f"sheet row {at}"))
    return without, remarks


def _names_at(grid: Grid, block: Block, at: int, wide: Collection[int]) -> list[str]:
    """The names of the columns, if a row of a block were its header."""
    below = replace(block, top=block.top + at)
    return _with_groups(_groups_above(grid, below, wide), grid[below.top][block.left : block.right])


def _first_text(grid: Grid, block: Block) -> str:
    return next(text for row in grid[block.top : block.bottom] for text in row[block.left : block.right] if text)


def blocks_of(grid: Grid) -> list[Block]:
    """The tables of a grid: what blank columns, or blank rows, part from each other.

    Rows below a blank one belong to the same table when they are under its columns, and do not begin with other names. Raises
    TableError where there are more blocks than can be compared.
    """
    if not grid or not grid[0]:
        return []
    is_filled = np.array([list(map(bool, row)) for row in grid], np.bool_)
    blocks = list[Block]()
    for top, bottom in _runs(np.asarray(is_filled.any(axis=1))):
        for left, right in _runs(np.asarray(is_filled[top:bottom].any(axis=0))):
            _add(blocks, Block(top, left, bottom, right), is_filled)
            if len(blocks) > MOST_LOOKED_AT:
                problem = f"the sheet holds more than {MOST_LOOKED_AT:,} blocks of cells apart from each other."
                raise TableError(Fault(problem, "one table", 'to name its cells, as in --sheet "SHEET!A1:F20"'))
    return blocks


def _add(blocks: list[Block], block: Block, is_filled: NDArray[np.bool_]) -> None:
    """Add a block, or grow the one above it that it continues."""
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
