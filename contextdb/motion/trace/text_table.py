"""Columns of text as lines that fit a terminal: empty columns are left out, headers wrap, long names lose their middle.

What is too wide for one table continues in a second one below, with the key columns again. Nothing here prints.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from contextdb.console import aligned, printable, width_of

WIDTH = 100
MOST_NAMES = (32, 28, 24, 20)
"""A name is shortened to the first of these with which a table fits; to the first where none does."""
HEADER = 8
"""The header of a narrow column of numbers wraps at this width."""
GAP = 2


@dataclass(frozen=True)
class Column:
    """A column of a table: a text for each row; one of empty texts is left out. Numbers stand to the right, and are never
    shortened; a key stands in each part of a table that is too wide for one."""

    header: str
    texts: Sequence[str]
    is_number: bool = False
    is_key: bool = False

    @property
    def is_empty(self) -> bool:
        return not any(self.texts)

    @property
    def heading(self) -> list[str]:
        """The header in lines; that of numbers is about as narrow as they are."""
        if not self.is_number:
            return [self.header]
        widest = max(map(width_of, self.texts), default=0)
        return textwrap.wrap(self.header, max(HEADER, widest), break_long_words=False, break_on_hyphens=False) or [""]

    @property
    def width(self) -> int:
        """How many cells of a terminal it takes."""
        return max(map(width_of, (*self.heading, *self.texts)))

    def narrowed(self, most: int) -> Column:
        """The same with shortened texts, if it is no column of numbers."""
        return self if self.is_number else replace(self, texts=[shortened(text, most) for text in self.texts])


def shortened(text: str, most: int) -> str:
    """A text in at most so many cells: what is too long loses its middle, for names differ at their ends."""
    if width_of(text) <= most:
        return text
    length = max(0, min(len(text), most) - 1)
    while length and width_of(_without_middle(text, length)) > most:
        length -= 1
    return _without_middle(text, length)


def _without_middle(text: str, length: int) -> str:
    tail = length // 2
    return f"{text[: length - tail]}…{text[len(text) - tail :]}"


def table_lines(columns: Sequence[Column], width: int = WIDTH, indent: str = "") -> Iterator[str]:
    """The lines of a table; none when it has no rows."""
    filled = [replace(column, texts=[printable(text) for text in column.texts]) for column in columns if not column.is_empty]
    room = width - len(indent)
    if _width(filled) > room:
        narrowed = [[column.narrowed(most if column.is_key else room // 2) for column in filled] for most in MOST_NAMES]
        filled = next((each for each in narrowed if _width(each) <= room), narrowed[0])
    for i, part in enumerate(_parts(filled, room)):
        if i:
            yield ""
        yield from _part_lines(part, indent)


def _width(columns: Sequence[Column]) -> int:
    return sum(column.width for column in columns) + GAP * (len(columns) - 1)


def _parts(columns: Sequence[Column], room: int) -> Iterator[list[Column]]:
    """The columns in as few parts as fit, each with the keys in front."""
    keys = [column for column in columns if column.is_key]
    part = list(keys)
    for column in (column for column in columns if not column.is_key):
        if len(part) > len(keys) and _width([*part, column]) > room:
            yield part
            part = list(keys)
        part.append(column)
    if part:
        yield part


def _part_lines(columns: Sequence[Column], indent: str) -> Iterator[str]:
    headings = [column.heading for column in columns]
    height = max(map(len, headings))
    tops = zip(*([""] * (height - len(lines)) + lines for lines in headings), strict=True)
    rows = zip(*(column.texts for column in columns), strict=True)
    numbers = [i for i, column in enumerate(columns) if column.is_number]
    yield from aligned([*tops, *rows], right=numbers, indent=indent)
