"""Cells as they would be after a slip: an end of a range moved, a bool flipped, a value or a tag left out.

An end moves inwards and outwards by one in the last digit that it is written with: `0.2..3` becomes `(0.2..3]`, which loses the
end itself, and `0.1..3`. Soft cells exclude nothing, and Any has no end: they stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from contextdb.cells import intervals
from contextdb.cells.domains import Domain
from contextdb.cells.intervals import Span, Spans
from contextdb.cells.sets import Cell, NumberSet, TagSet, ValueSet
from contextdb.cells.words import quoted

MOST_DIGITS = 9
"""So many digits behind the point an end moves by at least."""


@dataclass(frozen=True, slots=True)
class Mutated:
    """A cell after a slip."""

    what: str
    """What slipped, in a few words: "from 0.2", "up to 3", "+InAir", "True"."""
    cell: Cell
    is_end: bool = False
    """Whether it is an end of a range that moved."""


def mutated(cell: Cell, domain: Domain, is_wide: bool = False) -> Iterator[Mutated]:
    """What may become of a cell. With `is_wide` ends move so far that random facts fall between: a tenth of the range."""
    accepts = cell.accepts
    if cell.is_soft or accepts is None or accepts.is_empty:
        return
    if isinstance(accepts, NumberSet):
        yield from _moved_ends(accepts, domain, is_wide)
    elif isinstance(accepts, ValueSet):
        yield from _other_values(accepts, domain)
    elif isinstance(accepts, TagSet):
        yield from _fewer_tags(accepts)


def _other_values(accepts: ValueSet, domain: Domain) -> Iterator[Mutated]:
    names = [quoted(value) if isinstance(value, str) else str(value) for value in sorted(accepts.values)]
    if len(names) == 1 and not accepts.is_complement and len(domain.everything or ()) == 2:
        yield Mutated(names[0], Cell(ValueSet(frozenset(domain.everything or ()) - accepts.values)))
    elif len(names) > 1:
        for name, value in zip(names, sorted(accepts.values), strict=True):
            yield Mutated(name, Cell(ValueSet(accepts.values - {value}, accepts.is_complement)))
    yield Mutated(" ".join(["not", *names] if accepts.is_complement else names), Cell())


def _fewer_tags(accepts: TagSet) -> Iterator[Mutated]:
    words = [(f"+{quoted(tag)}", TagSet(accepts.needs - {tag}, accepts.bans)) for tag in sorted(accepts.needs)]
    words += [(f"-{quoted(tag)}", TagSet(accepts.needs, accepts.bans - {tag})) for tag in sorted(accepts.bans)]
    if accepts.is_complement:
        yield Mutated(f"not {' '.join(word for word, _ in words)}", Cell())
        return
    for word, tags in words:
        yield Mutated(word, Cell(tags if tags.needs or tags.bans else None))


def _moved_ends(accepts: NumberSet, domain: Domain, is_wide: bool) -> Iterator[Mutated]:
    lowest, highest = domain.ends
    for at, (low, high) in enumerate(accepts.spans):
        width = (high - low) / 10.0 if is_wide and math.isfinite(high - low) else 0.0
        for end, inward, words in ((low, 1.0, "from"), (high, -1.0, "up to")):
            if not math.isfinite(end) or (domain.type.is_circular and end in domain.ends):
                continue  # -180 and 180 are one angle, where a range goes on
            written, is_open = _written(end, inward)
            name = f"{words} {domain.type.spelling.write(written)}"
            for moved in _moves(end, written, inward, is_open, domain, width):
                if lowest <= moved <= highest and moved != end:
                    yield from _with_span(accepts, at, (moved, high) if inward > 0 else (low, moved), name, domain)


def _with_span(accepts: NumberSet, at: int, span: Span, name: str, domain: Domain) -> Iterator[Mutated]:
    spans: Spans = (*accepts.spans[:at], span, *accepts.spans[at + 1 :])
    moved = NumberSet(domain.type.fitted(intervals.union(spans)), accepts.is_circular)
    if moved.spans and moved != accepts:
        yield Mutated(name, Cell(moved), is_end=True)


def _written(end: float, inward: float) -> tuple[float, bool]:
    """The end as a person writes it, and whether it is open: 4.999999999999999 is below an open 5."""
    beyond = math.nextafter(end, -inward * math.inf)
    if len(repr(beyond)) + 4 <= len(repr(end)):
        return beyond, True
    short = round(end, MOST_DIGITS)
    return (short if math.isclose(short, end, rel_tol=1e-12) else end), False


def _moves(end: float, written: float, inward: float, is_open: bool, domain: Domain, width: float) -> list[float]:
    """Where an end goes: one step inwards, and one outwards."""
    if domain.type.is_whole:
        return [end + inward, end - inward]
    digits = _digits(written)
    step = max(10.0**-digits, width)
    inside, outside = (round(written + sign * step, digits + 3) for sign in (inward, -inward))
    further = math.nextafter(inside, inward * math.inf)
    if width:
        return [further, outside]
    return [further, written] if is_open else [math.nextafter(end, inward * math.inf), outside]


def _digits(number: float) -> int:
    """How many digits behind the point a number is written with."""
    text = repr(round(number, MOST_DIGITS))
    return 0 if "e" in text else len(text.partition(".")[2].rstrip("0"))
