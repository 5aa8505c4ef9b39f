"""Where the columns of a grid stand, in terminal cells, and how a text is cut to its column.

From the left: the gutter (row number and mark), the frozen columns, which never scroll, and the others. Behind each column stands
a separator of one cell. `x` counts from the end of the gutter; a column's first cell is its mark.
"""

from __future__ import annotations

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
MOST_TEXTS = 2000
"""So many distinct texts of a column are measured."""

_SHOWN = {ord(c): s for c, s in zip("\n\r\t", "⏎⏎⇥", strict=True)}


@dataclass(frozen=True)
class Layout:
    """The columns of a grid in a window `width` cells wide."""

    widths: tuple[int, ...]
    n_frozen: int
    gutter: int
    width: int

    @cached_property
    def starts(self) -> tuple[int, ...]:
        """The x of each column, and behind the last the end of all."""
        return tuple(accumulate((w + 1 for w in self.widths), initial=0))

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
        """How far one may scroll, with the window: so far that the last column is whole and the first one seen begins in full."""
        last = self.scroll_to(len(self.widths) - 1, 0)
        return max(self.total, self.width + last)

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
        return column if self.place(column, scroll) + self.widths[column] == x else None

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


def layout(widths: Sequence[int], n_frozen: int, n_rows: int, width: int) -> Layout:
    """The layout of columns of these widths. Frozen ones take at most half of the window: they are narrowed, or scroll too."""
    gutter = len(str(n_rows)) + 3
    room = (width - gutter) // 2
    if room < (NARROWEST + 1) * n_frozen:
        n_frozen = 0
    frozen = list(widths[:n_frozen])
    excess = sum(frozen) + n_frozen - room
    for column in sorted(range(len(frozen)), key=lambda c: -frozen[c]):
        cut = max(0, min(excess, frozen[column] - NARROWEST))
        frozen[column] -= cut
        excess -= cut
    return Layout((*frozen, *widths[n_frozen:]), n_frozen, gutter, width)


def fitted_width(column: TextColumn, heads: Sequence[str], widest: int = WIDEST) -> int:
    """How wide a column must be for its texts and what stands over it, a mark on the left and a space on the right."""
    texts = [*column.texts[:MOST_TEXTS], *heads]
    return max(NARROWEST, min(max(map(cell_len, texts), default=0) + 2, widest))


@lru_cache(maxsize=1 << 16)
def cut(text: str, width: int) -> str:
    """The text in exactly so many cells; a longer one ends in "…". Line ends and tabs are shown by signs, other controls by "�"."""
    if not text.isprintable():
        text = "".join(c if c.isprintable() else "�" for c in text.translate(_SHOWN))
    if cell_len(text) <= width:
        return set_cell_size(text, width)
    return set_cell_size(text, width - 1) + "…" if width > 1 else "…"[:width]
