"""Sets of doubles as unions of closed intervals, on the line and on the circle.

Doubles are a finite ladder, so an open end is a closed one a rung further in: `(5..` starts at the double after 5. Every set
below is thus a tuple of spans `(low, high)`, both ends inside, ascending, apart by at least one double, and equality of sets is
equality of tuples. -0.0 and 0.0 are the same number. On the circle angles are degrees in [-180, 180).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Span = tuple[float, float]
Spans = tuple[Span, ...]

EVERYTHING: Spans = ((-math.inf, math.inf),)
CIRCLE: Span = (-180.0, math.nextafter(180.0, 0.0))


def above(value: float) -> float:
    """The next double up."""
    return math.nextafter(value, math.inf)


def below(value: float) -> float:
    """The next double down."""
    return math.nextafter(value, -math.inf)


def union(spans: Iterable[Span]) -> Spans:
    """The set that holds what any of the spans holds; spans whose low end is above the high end hold nothing."""
    merged: list[Span] = []
    for low, high in sorted((low + 0.0, high + 0.0) for low, high in spans if low <= high):
        if merged and low <= above(merged[-1][1]):
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return tuple(merged)


def complement(spans: Spans, low: float, high: float) -> Spans:
    """What of [low, high] the set does not hold."""
    free: list[Span] = []
    start = low
    for first, last in spans:
        if start < first:
            free.append((start, min(below(first), high)))
        if last >= high:
            return union(free)
        start = max(start, above(last))
    free.append((start, high))
    return union(free)


def holds(spans: Spans, value: float) -> bool:
    """Whether the value is in the set; never for NaN."""
    at = bisect_right(spans, (value, math.inf)) - 1
    return at >= 0 and spans[at][0] <= value <= spans[at][1]


def whole(spans: Spans) -> Spans:
    """The whole numbers of a set, each span between whole numbers and neighbours joined."""
    inner: list[Span] = []
    for low, high in spans:
        first, last = _ceil(low), _floor(high)
        if first > last:
            continue
        if inner and first <= inner[-1][1] + 1.0:
            inner[-1] = (inner[-1][0], last)
        else:
            inner.append((first, last))
    return tuple(inner)


def arc(low: float, high: float, is_low_open: bool = False, is_high_open: bool = False) -> Spans:
    """The angles from `low` upwards to `high`: through 180 where `high` lies behind, and all of them from 360 degrees on."""
    turn = _turn(low, high)
    first, last = wrap_angle(low), wrap_angle(high)
    if turn > 360.0 or (turn == 360.0 and not (is_low_open and is_high_open)):
        return (CIRCLE,)
    if turn == 360.0:
        return complement(((first, first),), *CIRCLE)
    start = above(first) if is_low_open else first
    end = below(last) if is_high_open else last
    if first <= last:
        return union([(start, end)])
    return union([(start, CIRCLE[1]), (-180.0, end)])


def _turn(low: float, high: float) -> float | Fraction:
    """high - low; exactly where rounding could make it 360."""
    turn = high - low
    return Fraction(high) - Fraction(low) if abs(turn - 360.0) < 1.0 else turn


def _ceil(value: float) -> float:
    return value if math.isinf(value) else float(math.ceil(value))


def _floor(value: float) -> float:
    return value if math.isinf(value) else float(math.floor(value))


# ---- angles on the circle: degrees in [-180, 180), exactly, one at a time and many at once


def wrap_angle(degrees: float) -> float:
    """The same angle in [-180, 180), exactly: both steps lose no bit."""
    rest = math.fmod(degrees, 360.0)
    if rest >= 180.0:
        return rest - 360.0
    return rest + 360.0 if rest < -180.0 else rest + 0.0


def wrap_angles(degrees: NDArray[np.float64]) -> NDArray[np.float64]:
    """As `wrap_angle`, of an array; NaN for what is not finite. Angles that are wrapped already come back as the same array."""
    if not ((degrees < -180.0) | (degrees >= 180.0)).any():
        return degrees
    with np.errstate(invalid="ignore"):
        rest = np.fmod(degrees, 360.0)
    return np.where(rest >= 180.0, rest - 360.0, np.where(rest < -180.0, rest + 360.0, rest + 0.0))
