"""Small pictures of a set of numbers: a line from end to end of its domain, and a dial for angles; and the set in words.

    0 ├──●━━━━━━━○────┤ 7        ● this end is in, ○ it is not

Pictures are runs of (text, is_accepted): whether the cell holds any of the values that are there. Every character of a line is a
stretch of the visible range: ━ where all of it is held, ─ where none is, ● or ○ where a span ends.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from dataclasses import dataclass

from contextdb.cells.domains import Domain
from contextdb.cells.grammar import format_cell
from contextdb.cells.intervals import CIRCLE, EVERYTHING, Span, Spans
from contextdb.cells.sets import Cell, NumberSet

Run = tuple[str, bool]
"""A piece of a picture, and whether the cell holds any of the values that are there."""
Range = tuple[float, float]

HELD, FREE, END_IN, END_OUT = "━─●○"
DIAL_WIDTH, DIAL_HEIGHT = 9, 5
HALF_DOT = 0.51
"""Half of how far dots are apart, and a little more, so that an angle between two dots is under both."""
DEGREES = "degrees"

_BRAILLE = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
_WIDEST = sys.float_info.max / 4.0


@dataclass(frozen=True, slots=True)
class Piece:
    """One interval as people write it; on the circle it runs upwards from `low`, perhaps through half a turn, to `high`."""

    low: float
    high: float
    is_low_in: bool = True
    is_high_in: bool = True

    @property
    def is_point(self) -> bool:
        """Whether it is one number alone."""
        return self.low == self.high


def spans_of(cell: Cell) -> Spans:
    """The spans of a cell of a number, int or angle; Any is one from end to end."""
    return cell.accepts.spans if isinstance(cell.accepts, NumberSet) else EVERYTHING


def pieces(cell: Cell, domain: Domain) -> tuple[Piece, ...]:
    """The intervals of a cell, ascending."""
    spans = spans_of(cell)
    if not domain.type.is_circular or cell.accepts is None:
        return tuple(_piece(span, domain) for span in spans)
    is_through = len(spans) > 1 and spans[0][0] == CIRCLE[0] and spans[-1][1] == CIRCLE[1]
    all_pieces = [_piece(span, domain) for span in spans]
    if not is_through:
        return tuple(all_pieces)
    first, *middle, last = all_pieces
    return (*middle, Piece(last.low, _half_turn(first.high), last.is_low_in, first.is_high_in))


def _half_turn(degrees: float) -> float:
    """Half a turn is displayed as 180, not as the -180 that is stored."""
    return 180.0 if degrees == -180.0 else degrees


def _piece(span: Span, domain: Domain) -> Piece:
    """How the formatter writes a span: it knows which doubles are reported as the open end at their neighbour."""
    low, high = span
    text = format_cell(Cell(NumberSet((span,), domain.type.is_circular)), domain)
    is_low_in, is_high_in = not text.startswith("("), not text.endswith(")")
    if domain.type.is_circular and low == high:
        return Piece(_half_turn(low), _half_turn(high))
    return Piece(
        low if is_low_in else math.nextafter(low, -math.inf),
        high if is_high_in else math.nextafter(high, math.inf),
        is_low_in,
        is_high_in,
    )


# ---- the line


def visible_range(cell: Cell, domain: Domain) -> Range:
    """From where to where a line shows: between the bounds of the domain; without one, round the ends of the cell."""
    low, high = domain.minimum, domain.maximum
    if math.isfinite(low) and math.isfinite(high) and low < high:
        return _clamped(low), _clamped(high)
    ends = [_clamped(e) for span in spans_of(cell) for e in span if math.isfinite(e) and low <= e <= high]
    ends += [_clamped(bound) for bound in (low, high) if math.isfinite(bound)]
    first, last = (min(ends), max(ends)) if ends else (0.0, 0.0)
    size = max(abs(first), abs(last))
    step = _nice((last - first) / 4.0 if last - first > size * 1e-9 else size or 1.0)
    before, after = (math.floor(first / step) - 1) * step, (math.ceil(last / step) + 1) * step
    return (
        before if low == -math.inf or low >= high else _clamped(low),
        after if high == math.inf or low >= high else _clamped(high),
    )


def _clamped(value: float) -> float:
    return max(-_WIDEST, min(value, _WIDEST))


def _nice(size: float) -> float:
    """The nearest of 1, 2, 5, 10, … below a size, of any power of ten."""
    size = max(size, 1e-300)
    power = 10.0 ** math.floor(math.log10(size))
    return max((n * power for n in (1.0, 2.0, 5.0) if n * power <= size), default=power)


def column_of(value: float, visible: Range, width: int) -> int:
    """The character of a line of `width` that a value of the range is in."""
    low, high = visible
    share = (max(low, min(value, high)) - low) / (high - low)
    return min(int(share * width), width - 1)


def interval_line(cell: Cell, domain: Domain, width: int, visible: Range | None = None) -> list[Run]:
    """A line of `width` characters from end to end of the visible range."""
    low, high = visible or visible_range(cell, domain)
    signs = [FREE] * width
    for first, last in spans_of(cell):
        if last < low or first > high:
            continue
        start, stop = column_of(first, (low, high), width), column_of(last, (low, high), width)
        for at in range(start, stop + 1):
            signs[at] = HELD if signs[at] == FREE else signs[at]
        piece = _piece((first, last), domain)
        for at, value, is_in in ((start, first, piece.is_low_in), (stop, last, piece.is_high_in)):
            if low <= value <= high:
                signs[at] = END_IN if is_in or signs[at] == END_IN else END_OUT
    return runs((sign, sign != FREE) for sign in signs)


def runs(signs: Iterable[Run]) -> list[Run]:
    """Neighbours of one kind joined."""
    joined: list[Run] = []
    for text, is_accepted in signs:
        if joined and joined[-1][1] is is_accepted:
            joined[-1] = (joined[-1][0] + text, is_accepted)
        else:
            joined.append((text, is_accepted))
    return joined


def framed_line(cell: Cell, domain: Domain, width: int) -> list[Run]:
    """The line with the ends of its range next to it; a bound of the domain has a stop, an end that is only displayed has none."""
    low, high = visible = visible_range(cell, domain)
    left = _end(low, domain) + (" ├" if low == domain.minimum else "  ")
    right = ("┤ " if high == domain.maximum else "  ") + _end(high, domain)
    room = max(width - len(left) - len(right), 8)
    return runs([(left, False), *interval_line(cell, domain, room, visible), (right, False)])


def _end(value: float, domain: Domain) -> str:
    """An end of the line, in few digits."""
    return domain.type.spelling.write(float(f"{value:.6g}") if domain.type.is_decimal else value)


# ---- the dial


def dial(cell: Cell, width: int = DIAL_WIDTH, height: int = DIAL_HEIGHT) -> list[list[Run]]:
    """A dial in braille dots, `width` by `height` characters: ahead is up, left is positive, what the cell holds is filled."""
    spans, radius = spans_of(cell), min(width * 2, height * 4) / 2.0
    lines = []
    for row in range(height):
        line: list[Run] = []
        for column in range(width):
            bits, is_accepted = 0, False
            for y, x in ((y, x) for y in range(4) for x in range(2)):
                dot = dot_of(column * 2 + x, row * 4 + y, width, height)
                is_filled = dot[0] <= radius and holds_dot(spans, *dot)
                is_accepted |= is_filled
                if is_filled or radius - 1.0 < dot[0] <= radius:
                    bits |= _BRAILLE[y][x]
            line.append((chr(0x2800 + bits), is_accepted))
        lines.append(runs(line))
    return lines


def dot_of(x: int, y: int, width: int = DIAL_WIDTH, height: int = DIAL_HEIGHT) -> tuple[float, float]:
    """Where a dot of a dial is: how far from the middle, and at which angle."""
    right, up = x - (width * 2 - 1) / 2.0, (height * 4 - 1) / 2.0 - y
    return math.hypot(right, up), math.degrees(math.atan2(-right, up))


def holds_dot(spans: Spans, distance: float, degrees: float) -> bool:
    """Whether spans hold any of the angles under a dot, which is as wide as dots are apart; so a single angle is seen as a ray."""
    half = math.degrees(math.atan2(HALF_DOT, distance))
    return any(
        low <= degrees + turn + half and degrees + turn - half <= high for low, high in spans for turn in (-360.0, 0.0, 360.0)
    )


# ---- in words


def number_words(cell: Cell, domain: Domain, unit: str = "") -> str:
    """A set of numbers in words: "10.01 to 29.99 degrees, ends included"."""
    parts = pieces(cell, domain)
    if cell.is_any or spans_of(cell) in (EVERYTHING, (CIRCLE,)):
        return f"every {domain.type.value.removeprefix('a ').removeprefix('an ')}"
    if not parts:
        return "no number: the row never matches"
    unit = f" {unit or DEGREES}" if domain.type.is_circular or unit else ""
    if len(parts) == 1:
        return _alone(parts[0], unit, domain) + _outside(cell, domain)
    return " or ".join(_among(piece, domain) for piece in parts) + unit + _outside(cell, domain)


def _alone(piece: Piece, unit: str, domain: Domain) -> str:
    if piece.is_point and not piece.is_low_in:
        return f"every angle but {_bound_text(piece.low, domain)}{unit}"
    if piece.is_point or math.isinf(piece.low) or math.isinf(piece.high):
        return ("exactly " if piece.is_point else "") + _among(piece, domain) + unit
    low, high = _ends(piece, domain)
    if piece.is_low_in and piece.is_high_in:
        which = "ends included"
    elif piece.is_low_in or piece.is_high_in:
        which = f"{high if piece.is_low_in else low} excluded"
    else:
        which = "ends excluded"
    return f"{low} to {high}{unit}, {which}"


def _among(piece: Piece, domain: Domain) -> str:
    low, high = _ends(piece, domain)
    if piece.is_point:
        return low
    if math.isinf(piece.low):
        return f"up to {high}" if piece.is_high_in else f"below {high}"
    if math.isinf(piece.high):
        return f"{low} and more" if piece.is_low_in else f"above {low}"
    return f"{'' if piece.is_low_in else 'above '}{low} to {'' if piece.is_high_in else 'below '}{high}"


def _ends(piece: Piece, domain: Domain) -> tuple[str, str]:
    """The two ends as texts; an angle that runs through half a turn ends behind it."""
    return _bound_text(piece.low, domain), _bound_text(piece.high, domain)


def _bound_text(value: float, domain: Domain) -> str:
    """A number as a person would say it: the last bit of a sum left out."""
    return f"{value:.15g}" if domain.type.is_decimal else domain.type.spelling.write(value)


def _outside(cell: Cell, domain: Domain) -> str:
    """A warning when no value within the bounds of the domain is held."""
    low, high = domain.minimum, domain.maximum
    if any(first <= high and last >= low for first, last in spans_of(cell)):
        return ""
    within = (
        f"within {_bound_text(low, domain)} to {_bound_text(high, domain)}"
        if low > -math.inf
        else f"up to {_bound_text(high, domain)}"
    )
    return f"; nothing {within}" if high < math.inf else f"; nothing from {_bound_text(low, domain)} up"
