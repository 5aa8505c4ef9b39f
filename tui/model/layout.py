"""Where the columns of a grid stand, in terminal cells, and how a text is cut to its column.

From the left: the gutter (row number, mark and chance, each in a column), the frozen columns, which never scroll, and the others.
Behind each column stands a separator of one cell. `x` counts from the end of the gutter; a column's first cell is its mark.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import accumulate

from rich.cells import cell_len, set_cell_size

from contextdb.columns import TextColumn

NARROWEST, WIDEST = 6, 60
"""Of a column fitted to its texts."""
COMPACT = 22
"""The most a column takes for its name when a table is opened; what is cut can be seen in the line over the grid."""
LEAST_FROZEN = 24
"""Frozen columns are not made narrower than this together, where that is not more than half of the window."""
MOST_TEXTS = 2000
"""So many distinct texts of a column are measured."""

CHANCE = len(">99 %")
"""The width of a chance."""
N_NAME_LINES = 3
"""So many lines a name over a column may take."""
_JOINT = re.compile(r"(?<=[_.\-/ ])|(?<=[a-z0-9])(?=[A-Z])")
"""Where a name may go on in the next line: behind a sign that joins words, and before a capital."""

JOINER = "\u200d"
"""Makes one sign of two; `tui.drawn` shows the first of them."""
_SHOWN = {ord(c): s for c, s in zip("\n\r\t", "⏎⏎⇥", strict=True)}


@dataclass(frozen=True)
class Layout:
    """The columns of a grid in a window `width` cells wide."""

    widths: tuple[int, ...]
    n_frozen: int
    n_digits: int
    """How wide the numbers of the rows are."""
    chance: int
    """How wide the chances are; 0 where no row has one."""
    width: int

    @property
    def gutter(self) -> int:
        """How many cells stand before the first column: a number, a sign for what plays, a mark of two, a chance."""
        return self.n_digits + 3 + self.chance

    def gutter_text(self, number: str, chance: str = "") -> str:
        """A gutter with these texts where the numbers and the chances are."""
        return f"{number:>{self.n_digits}}   {chance[: self.chance].rjust(self.chance)}"

    @cached_property
    def starts(self) -> tuple[int, ...]:
        """The x of each column, and behind the last the end of all. A hidden column has no width and no separator."""
        return tuple(accumulate((w + 1 if w else 0 for w in self.widths), initial=0))

    @cached_property
    def hides(self) -> frozenset[int]:
        """The columns that are seen, behind which others are hidden."""
        visible = [at for at, width in enumerate(self.widths) if width]
        following = [*visible[1:], len(self.widths)]
        return frozenset(at for at, after in zip(visible, following, strict=True) if after > at + 1)

    @property
    def frozen(self) -> int:
        """How many cells the frozen columns take."""
        return self.starts[self.n_frozen]

    @property
    def total(self) -> int:
        """How many cells everything takes."""
        return self.gutter + self.starts[-1]

    @property
    def extent(self) -> int:
        """How far one may scroll, with the window: so far that the last column is whole and the first one seen begins in full.

        A table that is seen whole is no wider than itself, for the window becomes narrower with a scroll bar beside it."""
        last = self.scroll_to(len(self.widths) - 1, 0)
        return max(self.total, self.width + last) if last else self.total

    def visible(self, scroll: int) -> range:
        """The columns not frozen that are in the window, at least in part, when it is scrolled to the right by so many cells."""
        first = max(bisect_right(self.starts, self.frozen + scroll) - 1, self.n_frozen)
        last = bisect_right(self.starts, self.width - self.gutter + scroll - 1)
        return range(first, min(max(last, first), len(self.widths)))

    def column_at(self, x: int, scroll: int) -> int:
        """Which column is at cell `x` of the window; the nearest one where none does."""
        place = x - self.gutter
        place += scroll if place >= self.frozen else 0
        return max(0, min(bisect_right(self.starts, place) - 1, len(self.widths) - 1))

    def separator_at(self, x: int, scroll: int) -> int | None:
        """The column whose separator is at cell `x` of the window."""
        column = self.column_at(x, scroll)
        return column if self.widths[column] and self.place(column, scroll) + self.widths[column] == x else None

    def place(self, column: int, scroll: int) -> int:
        """Where a column's first cell is in the window."""
        return self.gutter + self.starts[column] - (scroll if column >= self.n_frozen else 0)

    def scroll_to(self, column: int, scroll: int) -> int:
        """How far to scroll so that a column is seen, as whole as may be; what is at the left then begins with its first cell."""
        if column < self.n_frozen:
            return scroll
        left = self.starts[column] - self.frozen
        right = self.starts[column + 1] - (self.width - self.gutter)
        if left < scroll:
            return left
        if right <= scroll:
            return scroll
        return self.starts[min(bisect_left(self.starts, self.frozen + right), column)] - self.frozen


def layout(widths: Sequence[int], n_frozen: int, n_rows: int, width: int, has_chance: bool = False) -> Layout:
    """The layout of columns of these widths. Frozen ones take at most half of the window, and a single one about a third where not
    all columns are seen: the widest are narrowed, or all scroll too."""
    n_digits, chance = len(str(n_rows)), CHANCE * has_chance
    gutter = Layout((), 0, n_digits, chance, width).gutter
    room = (width - gutter) // 2
    if room < (NARROWEST + 1) * n_frozen:
        n_frozen = 0
    if n_frozen == 1 and gutter + sum(widths) + sum(map(bool, widths)) > width:
        room = min(room, max((width - gutter) // 3, LEAST_FROZEN))
    frozen = list(widths[:n_frozen])
    excess = sum(frozen) + sum(map(bool, frozen)) - room
    for _ in range(excess if frozen else 0):
        widest = max(range(n_frozen), key=frozen.__getitem__)
        frozen[widest] = max(frozen[widest] - 1, NARROWEST)
    return Layout((*frozen, *widths[n_frozen:]), n_frozen, n_digits, chance, width)


def fitted_width(column: TextColumn, heads: Sequence[str], widest: int = WIDEST) -> int:
    """How wide a column must be for its texts and what stands over it, a mark on the left and a space on the right."""
    texts = [*column.texts[:MOST_TEXTS], *heads]
    return max(NARROWEST, min(max(map(cell_len, texts), default=0) + 2, widest))


def name_width(name: str) -> int:
    """The least width in which a name is whole within three lines."""
    pieces = _JOINT.split(name)
    widths = range(max(map(cell_len, pieces)), cell_len(name) + 1)
    return next((width for width in widths if len(_packed(pieces, width)) <= N_NAME_LINES), cell_len(name))


@lru_cache(maxsize=1 << 12)
def name_lines(name: str, width: int) -> tuple[str, ...]:
    """A name in at most three lines so wide, parted at its joints; the middle of a longer one is left out."""
    pieces = _JOINT.split(name)
    if max(map(cell_len, pieces)) <= width and len(lines := _packed(pieces, width)) <= N_NAME_LINES:
        return tuple(lines)
    rest, lines = cut_middle(name, N_NAME_LINES * width).rstrip(), []
    while rest:
        line = set_cell_size(rest, min(width, cell_len(rest)))
        lines.append(line)
        rest = rest[max(len(line), 1) :]
    return tuple(lines[:N_NAME_LINES])


def _packed(pieces: Sequence[str], width: int) -> list[str]:
    """Pieces in as few lines as they fit in."""
    lines: list[str] = []
    for piece in pieces:
        if lines and cell_len(lines[-1]) + cell_len(piece) <= width:
            lines[-1] += piece
        else:
            lines.append(piece)
    return lines


@lru_cache(maxsize=1 << 16)
def cut_middle(text: str, width: int, n_shared: int = 0) -> str:
    """The text in exactly so many cells; the middle of a longer one is left out, since names differ at their ends too, and the
    last `n_shared` characters, that all names have in common."""
    if width < 8 or cell_len(text) <= width or not text.isprintable() or not text.isascii():
        return cut(text, width)
    if n_shared and len(text) - n_shared >= width // 2:
        return set_cell_size(cut_middle(text[: len(text) - n_shared], width - 1).rstrip() + "…", width)
    tail = (width - 1) // 2
    return f"{text[: width - 1 - tail]}…{text[len(text) - tail :]}"


@lru_cache(maxsize=1 << 16)
def cut(text: str, width: int) -> str:
    """The text in exactly so many cells; a longer one ends in "…". Line ends and tabs become signs, other controls "�"."""
    if not text.isprintable():
        text = "".join(c if c.isprintable() or c == JOINER else "�" for c in text.translate(_SHOWN))
    if cell_len(text) <= width:
        return set_cell_size(text, width)
    return set_cell_size(text, width - 1) + "…" if width > 1 else "…"[:width]
