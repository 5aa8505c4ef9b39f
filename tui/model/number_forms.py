"""Change the text of a cell of numbers: move the number under the caret, or write the same set in the other form.

Texts are changed as texts, so that what is not touched stays as it is written; what comes out always reads.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from decimal import Decimal
from functools import cache

from contextdb.cells.domains import Domain
from contextdb.cells.grammar import format_cell, parse_cell, reads
from contextdb.cells.sets import Cell, NumberSet
from contextdb.cells.words import format_number

from .interval_picture import Piece, pieces

_CENTRE_MARK = re.compile(r",|±|\+-")


def step_of(domain: Domain, value: float) -> Decimal:
    """By how much a number is moved: 1 for whole numbers and degrees, else a power of ten near a hundredth of the domain."""
    if domain.type.is_whole or domain.type.is_circular:
        return Decimal(1)
    width = domain.maximum - domain.minimum
    if math.isfinite(width) and width > 0.0:
        return Decimal(10) ** math.floor(math.log10(width / 50.0))
    return Decimal(1) if abs(value) >= 10.0 else Decimal("0.1")


def nudged(text: str, caret: int, domain: Domain, steps: int) -> tuple[str, int] | None:
    """The text with the number at the caret moved by so many steps, and where the caret is then.

    The number is the one under the caret, or the last one before it. A number within the bounds of the domain stays within them, an
    angle continues through half a turn. None where there is no number, or the text would not read or hold nothing.
    """
    if not reads(text, domain):
        return None
    matches = [m for m in _numbers(domain.type.spelling.number).finditer(text) if "inf" not in m[1]]
    if not matches:
        return None
    number = next((m for m in matches if m.start(1) <= caret <= m.end(1)), None)
    number = number or next((m for m in reversed(matches) if m.end(1) < caret), matches[0])
    moved = _moved(number[1], domain, steps)
    changed = text[: number.start(1)] + moved + text[number.end(1) :]
    if not reads(changed, domain) or parse_cell(changed, domain).is_empty > parse_cell(text, domain).is_empty:
        return None
    return changed, number.start(1) + len(moved)


@cache
def _numbers(number: str) -> re.Pattern[str]:
    """The numbers in a text; the "-" of "20 +-5" is no sign."""
    return re.compile(rf"(?:(?<=\+)-)?({number})")


def _moved(text: str, domain: Domain, steps: int) -> str:
    if domain.type.is_spelt:
        return _next_spelt(text, domain, steps)
    old, value = Decimal(text), float(text)
    new = old + step_of(domain, value) * steps
    low, high = (Decimal(-180), Decimal(180)) if domain.type.is_circular else (_bound(domain.minimum), _bound(domain.maximum))
    if low <= old <= high and not low <= new <= high:
        new = new + (360 if new < low else -360) if domain.type.is_circular else max(low, min(new, high))
    if "." in text and not text.endswith("0"):  # no zeros stay that nobody wrote: 1 follows 0.9, and 3.50 follows 3.40
        new = new.normalize()
    return f"{new:f}" if -30 < new.adjusted() < 30 else str(new)


def _next_spelt(text: str, domain: Domain, steps: int) -> str:
    kind, old = domain.type, domain.type.spelling.read(text)
    first, last = (domain.minimum, domain.maximum) if domain.minimum <= old <= domain.maximum else kind.limits
    return kind.spelling.write(max(kind.limits[0], first, min(old + steps, last, kind.limits[1])))


def _bound(value: float) -> Decimal:
    return Decimal(format_number(value))


def other_form(text: str, domain: Domain) -> str | None:
    """The same set with bounds where the text has centre and tolerance, and the other way round.

    None where the two are not equal to the last bit, or the set cannot be written so.
    """
    if not reads(text, domain):
        return None
    cell = parse_cell(text, domain)
    if not isinstance(cell.accepts, NumberSet) or cell.is_empty or text.casefold().lstrip().startswith("not"):
        return None
    written = format_cell(cell, domain) if _CENTRE_MARK.search(text) else _centred(cell, domain)
    return written if written and written != text and reads(written, domain) and parse_cell(written, domain) == cell else None


def _centred(cell: Cell, domain: Domain) -> str | None:
    parts = [_centre_of(piece, domain) for piece in pieces(cell, domain)]
    if None in parts:
        return None
    tail = format_cell(replace(cell, accepts=None), domain).removeprefix("Any")
    return " | ".join(part for part in parts if part) + tail


def _centre_of(piece: Piece, domain: Domain) -> str | None:
    """Centre and tolerance in decimal arithmetic; in double arithmetic the sum may differ by a bit, and then there is none."""
    if not (piece.is_low_in and piece.is_high_in and math.isfinite(piece.low) and math.isfinite(piece.high)):
        return None
    low, high = Decimal(f"{piece.low:.15g}"), Decimal(f"{piece.high:.15g}")
    if domain.type.is_circular and high < low:
        high += 360
    centre, tolerance = (low + high) / 2, (high - low) / 2
    if domain.type.is_circular and centre > 180:
        centre -= 360
    if domain.type.is_whole and not float(centre).is_integer():
        return None
    return f"{domain.type.spelling.write(float(centre))}, {format_number(float(tolerance))}"
