"""One context out of a box of cells, to try: plain values, as facts are written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.grammar import parse_cell
from contextdb.cells.intervals import Span
from contextdb.cells.sets import Cell, NumberSet, TagSet, ValueSet
from contextdb.cells.words import quoted


def facts_inside(cells: Mapping[str, str], conditions: Sequence[Condition]) -> dict[str, str]:
    """A fact for each condition that the cells restrict, so that all of them hold; the others are left out. Raises CellError where
    a cell cannot be read."""
    facts: dict[str, str] = {}
    for condition in conditions:
        if condition.name in cells:
            fact = _fact(parse_cell(cells[condition.name], condition.domain), condition.domain)
            if fact is not None:
                facts[condition.name] = fact
    return facts


def _fact(cell: Cell, domain: Domain) -> str | None:
    """A value that a cell holds; None where it holds everything or nothing."""
    accepts = cell.accepts
    if accepts is None or accepts.is_empty:
        return None
    if isinstance(accepts, NumberSet):
        return domain.type.spelling.write(_round_number(max(accepts.spans, key=_length), domain))
    return _tags(accepts) if isinstance(accepts, TagSet) else _value(accepts, domain)


def _length(span: Span) -> float:
    return span[1] - span[0]


def _round_number(span: Span, domain: Domain) -> float:
    """The number of fewest digits near the middle of a span; near its end where it has only one."""
    low, high = max(span[0], domain.minimum), min(span[1], domain.maximum)
    if low > high:
        low, high = span
    if math.isinf(low) and math.isinf(high):
        return 0.0
    low, high = (high - 2.0 if math.isinf(low) else low), (low + 2.0 if math.isinf(high) else high)
    middle = low + (high - low) / 2.0
    for digits in range(17):
        if low <= round(middle, digits) <= high:
            return round(middle, digits)
    return middle


def _value(accepts: ValueSet, domain: Domain) -> str:
    known = domain.everything or tuple(sorted(map(str, accepts.values)))
    for value in known:
        if accepts.holds(value):
            return str(value) if domain.type.is_truth else quoted(str(value))
    name = "other"
    while not accepts.holds(name):
        name += "_"
    return name


def _tags(accepts: TagSet) -> str:
    """A set of tags with just those that are needed; one that is banned where only the complement of a ban is requested."""
    tags = sorted(accepts.needs)
    if accepts.is_complement:
        tags = [] if accepts.needs else sorted(accepts.bans)[:1]
    return " ".join(map(quoted, tags)) or '""'
