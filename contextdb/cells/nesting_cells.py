"""The meet of two cells: what a row accepts when a cell of its own table and one of the table around it must both hold.

Sets of numbers, values and plain tags meet in a set that one cell can say. Tags with a `not` before several of them do not:
`TagMeet` is their meet. Soft cells exclude nothing, so they leave the meet as it is, and their penalties add up elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

from contextdb.cells import intervals
from contextdb.cells.grammar import ANY, Accepted, Cell, NumberSet, TagSet, ValueSet, covers


@dataclass(frozen=True, slots=True)
class TagMeet(TagSet):
    """The sets of tags that are in all of `parts`, of which at most one is no complement.

    `needs` and `bans` are all tags that the parts name; it counts as a complement, so that nobody takes them for a plain set.
    """

    parts: tuple[TagSet, ...] = ()

    @classmethod
    def of(cls, parts: Sequence[TagSet]) -> TagMeet:
        """The meet of some sets."""
        needs, bans = (frozenset[str]().union(*sets) for sets in ([p.needs for p in parts], [p.bans for p in parts]))
        return cls(needs, bans, True, tuple(parts))

    def holds(self, tags: frozenset[str]) -> bool:
        """Whether a set of tags is in every part."""
        return all(part.holds(tags) for part in self.parts)

    @property
    def is_empty(self) -> bool:
        """Whether no set of tags is in every part."""
        return not self.meets(TagSet(frozenset()))

    def meets(self, plain: TagSet) -> bool:
        """Whether some set of tags is in every part and in a plain set too."""
        start = [plain, *(p for p in self.parts if not p.is_complement)]
        needs, bans = (frozenset[str]().union(*sets) for sets in ([p.needs for p in start], [p.bans for p in start]))
        ways = [
            [*((n, True) for n in sorted(p.needs)), *((b, False) for b in sorted(p.bans))] for p in self.parts if p.is_complement
        ]
        for broken in product(*ways):  # of each part that must fail, one tag that makes it fail
            lacking = frozenset(tag for tag, was_needed in broken if was_needed)
            having = frozenset(tag for tag, was_needed in broken if not was_needed)
            if not TagSet(needs | having, bans | lacking).is_contradiction:
                return True
        return False

    def holds_all_of(self, plain: TagSet) -> bool:
        """Whether every set of tags in a plain set is in every part."""
        return all(_is_inside(plain, part) for part in self.parts)


def _is_inside(plain: TagSet, part: TagSet) -> bool:
    """Whether all of a plain set is in a set of tags."""
    if part.is_complement:
        return TagSet(plain.needs | part.needs, plain.bans | part.bans).is_contradiction
    return all(covers(tag, plain.needs) for tag in part.needs) and all(_is_banned(tag, plain) for tag in part.bans)


def _is_banned(tag: str, plain: TagSet) -> bool:
    return any(tag == ban or tag.startswith(ban + ".") for ban in plain.bans)


def meet(cells: Sequence[Cell]) -> Cell:
    """The cell that holds what all of some cells hold.

    Soft cells are left out where one is not soft; where all are, the meet is soft too, at the sum of their penalties.
    """
    said = [c for c in cells if not c.is_any]
    if not said:
        return ANY
    hard = [c for c in said if not c.is_soft]
    found = (hard or said)[0].accepts
    for cell in (hard or said)[1:]:
        found = _both(found, cell.accepts)
    return Cell(found, None if hard else sum(c.penalty or 0.0 for c in said))


def _both(one: Accepted | None, other: Accepted | None) -> Accepted:
    if isinstance(one, NumberSet) and isinstance(other, NumberSet):
        spans = ((max(a, c), min(b, d)) for a, b in one.spans for c, d in other.spans)
        return NumberSet(intervals.union(spans), one.is_circular)
    if isinstance(one, ValueSet) and isinstance(other, ValueSet):
        return _both_values(one, other)
    assert isinstance(one, TagSet), "cells of one condition hold sets of one type"
    assert isinstance(other, TagSet), "cells of one condition hold sets of one type"
    return _both_tags(one, other)


def _both_values(one: ValueSet, other: ValueSet) -> ValueSet:
    if one.is_complement and other.is_complement:
        return ValueSet(one.values | other.values, True)
    named = one if not one.is_complement else other
    return ValueSet(frozenset(v for v in named.values if one.holds(v) and other.holds(v)))


def _both_tags(one: TagSet, other: TagSet) -> TagSet:
    parts = [_plainer(part) for whole in (one, other) for part in (whole.parts if isinstance(whole, TagMeet) else (whole,))]
    plain = [p for p in parts if not p.is_complement]
    needs, bans = (frozenset[str]().union(*sets) for sets in ([p.needs for p in plain], [p.bans for p in plain]))
    rest = list(dict.fromkeys(p for p in parts if p.is_complement))
    joined = [TagSet(needs, bans)] if needs or bans or not rest else []
    return (joined + rest)[0] if len(joined + rest) == 1 else TagMeet.of([*joined, *rest])


def _plainer(part: TagSet) -> TagSet:
    """A complement of one tag as the plain set that it is: `not +InAir` is `-InAir`."""
    if part.is_complement and len(part.needs) + len(part.bans) == 1:
        return TagSet(part.bans, part.needs)
    return part
