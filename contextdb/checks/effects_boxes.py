"""What two boxes of cells have in common."""

from __future__ import annotations

from collections.abc import Mapping

from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import Accepted, Cell, NumberSet, TagSet, ValueSet, format_cell, parse_cell
from contextdb.cells.plain_ends import cuts_of, plain


def meet(one: Mapping[str, str], other: Mapping[str, str], conditions: Mapping[str, Condition]) -> dict[str, str] | None:
    """A box that holds what both hold, as cells; None where that is nothing. Cells are not soft."""
    found: dict[str, str] = {}
    for name in (name for name in conditions if name in one or name in other):
        if not (name in one and name in other):
            found[name] = one[name] if name in one else other[name]  # as somebody wrote it
            continue
        domain = conditions[name].domain
        mine, yours = (parse_cell(box[name], domain).accepts for box in (one, other))
        both = mine if yours is None else yours if mine is None else _both(mine, yours)
        if both is not None and both.is_empty:
            return None
        found[name] = format_cell(Cell(both and plain(both, cuts_of(mine, yours))), domain)
    return found


def _both(one: Accepted, other: Accepted) -> Accepted:
    if isinstance(one, NumberSet) and isinstance(other, NumberSet):
        spans = [(max(a, c), min(b, d)) for a, b in one.spans for c, d in other.spans]
        return NumberSet(tuple(sorted(span for span in spans if span[0] <= span[1])), one.is_circular)
    if isinstance(one, ValueSet) and isinstance(other, ValueSet):
        return _both_values(one, other)
    assert isinstance(one, TagSet)
    assert isinstance(other, TagSet)
    return _both_tags(one, other)


def _both_values(one: ValueSet, other: ValueSet) -> ValueSet:
    if one.is_complement and other.is_complement:
        return ValueSet(one.values | other.values, True)
    if one.is_complement or other.is_complement:
        kept, gone = (other, one) if one.is_complement else (one, other)
        return ValueSet(kept.values - gone.values)
    return ValueSet(one.values & other.values)


def _both_tags(one: TagSet, other: TagSet) -> TagSet:
    """What both hold; with a complement, which no cell can always say, the least box round it that a cell can."""
    if not one.is_complement and not other.is_complement:
        return TagSet(one.needs | other.needs, one.bans | other.bans)
    kept, rest = (other, one) if one.is_complement else (one, other)
    needs, bans = rest.needs - kept.needs, rest.bans - kept.bans
    if not kept.is_complement and len(needs) + len(bans) <= 1:
        return TagSet(kept.needs | bans, kept.bans | needs) if needs or bans else TagSet(frozenset(), is_complement=True)
    return kept
