"""Ends of numbers as people write them, for cells that nobody wrote: 29.99, not 29.990000000000006.

`20, 9.99` ends at 20 + 9.99, which in doubles is 29.990000000000002, so what lies above it begins at 29.990000000000006. Here such
an end becomes the decimal that it was meant to be, `(29.99..`. A *cut* is the first double above a boundary. A cut moves only to
a decimal of at most 15 digits, of the size of the column's numbers, and only where between the two there is no other cut of the
column and no such decimal: so no number that somebody writes changes sides, and no set of classes becomes another.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence

from contextdb.cells import intervals
from contextdb.cells.intervals import Span
from contextdb.cells.sets import Accepted, NumberSet

DIGITS = 15
"""So many digits of a decimal come back out of a double."""
SAVED = 4
"""A decimal is worth a move when it is so many characters shorter."""


def plain(accepts: Accepted, cuts: Sequence[float], keeps_all: bool = False) -> Accepted:
    """The set with plain ends; what is no set of numbers stays.

    `cuts` are the first numbers of the classes that the column's cells distinguish, ascending, and those of the set are among them.
    With `keeps_all` no number is lost: ends move outwards only, so that a row that gets the cell leaves nothing of the set open.
    """
    if not isinstance(accepts, NumberSet) or not any(_length(end) > DIGITS for end in cuts_of(accepts)):
        return accepts
    largest = max((abs(cut) for cut in (*cuts[:2], *cuts[-2:]) if math.isfinite(cut)), default=1.0)
    n_decimals = DIGITS - 1 - math.floor(math.log10(largest or 1.0))
    moved = [_moved(span, cuts, n_decimals, keeps_all) for span in accepts.spans]
    return NumberSet(intervals.union(moved), accepts.is_circular)


def cuts_of(*sets: Accepted | None) -> list[float]:
    """The cuts that some sets make, ascending."""
    spans = [span for accepts in sets if isinstance(accepts, NumberSet) for span in accepts.spans]
    return sorted({cut for low, high in spans for cut in (low, intervals.above(high)) if math.isfinite(cut)})


def _moved(span: Span, cuts: Sequence[float], n_decimals: int, keeps_all: bool) -> Span:
    low, stop = span[0], intervals.above(span[1])
    if low == span[1]:
        return span
    first, last = _plain_cut(low, cuts, n_decimals), _plain_cut(stop, cuts, n_decimals)
    if keeps_all:
        first, last = min(low, first), max(stop, last)
    return first, span[1] if last == stop else intervals.below(last)


def _plain_cut(cut: float, cuts: Sequence[float], n_decimals: int) -> float:
    """The cut at the decimal that was meant, on that side of it where it was; the cut itself where there is none."""
    if not math.isfinite(cut):
        return cut
    decimal = round(cut, n_decimals) + 0.0
    if min(_length(cut), _length(intervals.below(cut))) < _length(decimal) + SAVED:
        return cut
    moved = decimal if decimal >= cut else intervals.above(decimal)
    low, high = min(cut, moved), max(cut, moved)
    n_between = bisect_right(cuts, high) - bisect_left(cuts, low)
    return moved if n_between <= 1 else cut


def _length(value: float) -> int:
    return len(repr(value))
