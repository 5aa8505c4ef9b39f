"""The sets that cells hold, and their algebra: complement, meet and union.

A `NumberSet` is spans of doubles, a `ValueSet` some values or all but some, a `TagSet` what a set of tags must have and must not
have. Two sets of one condition are of one type. Numbers and values meet and join exactly. Tags do not: no single cell says what
`+A -B` and `not +C -D` have in common. So there are two ways to meet, which differ for tags alone:

    meet_exactly       a `TagMeet`, which is exact and no cell
    meet_plainly       of plain sets only, whose meet is plain

Nothing here knows a text.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import product
from operator import add

from contextdb.cells import intervals
from contextdb.cells.domains import Domain
from contextdb.cells.intervals import EVERYTHING, Spans, wrap_angle
from contextdb.cells.kinds import Family


@dataclass(frozen=True, slots=True)
class NumberSet:
    """Numbers, as spans; angles are wrapped before they are looked up."""

    spans: Spans
    is_circular: bool = False

    def holds(self, value: float) -> bool:
        return intervals.holds(self.spans, wrap_angle(value) if self.is_circular else value)

    @property
    def is_empty(self) -> bool:
        return not self.spans


@dataclass(frozen=True, slots=True)
class ValueSet:
    """Some of the values of a bool, enum or text, or (for text) all but some."""

    values: frozenset[bool | str]
    is_complement: bool = False

    def holds(self, value: bool | str) -> bool:
        return (value in self.values) is not self.is_complement

    @property
    def is_empty(self) -> bool:
        return not self.values and not self.is_complement


@dataclass(frozen=True, slots=True)
class TagSet:
    """The sets of tags that have all of `needs` and none of `bans`, or (complement) all other sets."""

    needs: frozenset[str]
    bans: frozenset[str] = frozenset()
    is_complement: bool = False

    def holds(self, tags: frozenset[str]) -> bool:
        covered = covered_by(tags)
        return (self.needs <= covered and self.bans.isdisjoint(covered)) is not self.is_complement

    @property
    def is_contradiction(self) -> bool:
        """Whether a needed tag stands under a banned one, so that no set of tags can have all `needs` and no `bans`."""
        return not self.bans.isdisjoint(covered_by(self.needs))

    @property
    def is_empty(self) -> bool:
        return not (self.needs or self.bans) if self.is_complement else self.is_contradiction


Accepted = NumberSet | ValueSet | TagSet
SET_OF: dict[Family, type[Accepted]] = {Family.NUMBERS: NumberSet, Family.VALUES: ValueSet, Family.TAGS: TagSet}
"""The sets of a family of types."""


@dataclass(frozen=True, slots=True)
class Cell:
    """What a row accepts for a condition: `accepts` is None for Any. `penalty` makes the cell soft; with `per` it is the cost of so
    much of a distance, and grows."""

    accepts: Accepted | None = None
    penalty: float | None = None
    per: float | None = None

    @property
    def is_any(self) -> bool:
        return self.accepts is None

    @property
    def is_soft(self) -> bool:
        """Whether a row that does not match is kept, at a cost."""
        return self.penalty is not None

    @property
    def is_empty(self) -> bool:
        return self.accepts is not None and self.accepts.is_empty

    def holds(self, value: object) -> bool:
        """Whether the value, of the cell's own kind, is accepted; a penalty changes nothing here."""
        return self.accepts is None or self.accepts.holds(value)  # type: ignore[arg-type]


ANY = Cell()


def covers(tag: str, tags: frozenset[str]) -> bool:
    """Whether a set of tags has `tag`, itself or through a tag under it: Move covers Move.Run."""
    return tag in tags or any(t.startswith(tag + ".") for t in tags)


def covered_by(tags: Iterable[str]) -> frozenset[str]:
    """Every tag that a set of tags has: its own, and those above them."""
    return frozenset(above for tag in tags for above in tags_above(tag))


def tags_above(tag: str) -> Iterator[str]:
    """A tag and those above it: Move.Run and Move."""
    yield tag
    at = tag.rfind(".")
    while at > 0:
        yield tag[:at]
        at = tag.rfind(".", 0, at)


@dataclass(frozen=True, slots=True)
class TagMeet(TagSet):
    """The sets of tags that are in all of `parts`, of which at most one is no complement.

    `needs` and `bans` are all tags that the parts name; it counts as a complement, so that nobody takes them for a plain set.
    """

    parts: tuple[TagSet, ...] = ()

    @classmethod
    def of(cls, parts: Sequence[TagSet]) -> TagMeet:
        needs, bans = (frozenset[str]().union(*sets) for sets in ([p.needs for p in parts], [p.bans for p in parts]))
        return cls(needs, bans, True, tuple(parts))

    def holds(self, tags: frozenset[str]) -> bool:
        return all(part.holds(tags) for part in self.parts)

    @property
    def is_empty(self) -> bool:
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
    return all(covers(tag, plain.needs) for tag in part.needs) and all(is_banned(tag, plain) for tag in part.bans)


def is_banned(tag: str, plain: TagSet) -> bool:
    """Whether no set of tags of a plain set has the tag: the tag, or one above it, is banned."""
    return any(above in plain.bans for above in tags_above(tag))


_OF_ONE_TYPE = "sets of one condition are of one type"


def meet(cells: Sequence[Cell]) -> Cell:
    """The cell that holds what all of some cells hold.

    Soft cells are left out where one is not soft; where all are, the meet is soft too, at the sum of their penalties, and does not
    grow with a distance.
    """
    specified = [c for c in cells if not c.is_any]
    if not specified:
        return ANY
    if len(specified) == 1:
        return specified[0]
    hard = [c for c in specified if not c.is_soft]
    accepted = None
    for cell in hard or specified:
        accepted = cell.accepts if accepted is None or cell.accepts is None else meet_exactly(accepted, cell.accepts)
    penalty = reduce(add, (c.penalty or 0.0 for c in specified))  # one after the other: `sum` rounds otherwise from Python 3.12 on
    return Cell(accepted, None if hard else penalty)


def meet_exactly(one: Accepted, other: Accepted) -> Accepted:
    """What two sets have in common; of tags as a `TagMeet` where no plain set is it."""
    return _meet(one, other, _tags_exactly)


def meet_plainly(one: Accepted, other: Accepted) -> Accepted:
    """What two sets have in common; sets of tags must not be complements."""
    return _meet(one, other, _plain_tags)


def _meet(one: Accepted, other: Accepted, of_tags: Callable[[TagSet, TagSet], TagSet]) -> Accepted:
    if isinstance(one, NumberSet) and isinstance(other, NumberSet):
        spans = ((max(a, c), min(b, d)) for a, b in one.spans for c, d in other.spans)
        return NumberSet(intervals.union(spans), one.is_circular)
    if isinstance(one, ValueSet) and isinstance(other, ValueSet):
        if one.is_complement and other.is_complement:
            return ValueSet(one.values | other.values, True)
        named, rest = (other, one) if one.is_complement else (one, other)
        return ValueSet(frozenset(v for v in named.values if rest.holds(v)))
    assert isinstance(one, TagSet), _OF_ONE_TYPE
    assert isinstance(other, TagSet), _OF_ONE_TYPE
    return of_tags(one, other)


def _tags_exactly(one: TagSet, other: TagSet) -> TagSet:
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


def _plain_tags(one: TagSet, other: TagSet) -> TagSet:
    return TagSet(one.needs | other.needs, one.bans | other.bans)


def union(one: NumberSet | ValueSet, other: NumberSet | ValueSet) -> NumberSet | ValueSet:
    """What either of two sets holds; of tags no single set says that."""
    if isinstance(one, NumberSet) and isinstance(other, NumberSet):
        return NumberSet(intervals.union((*one.spans, *other.spans)), one.is_circular)
    assert isinstance(one, ValueSet), _OF_ONE_TYPE
    assert isinstance(other, ValueSet), _OF_ONE_TYPE
    named = one.values | other.values
    if not (one.is_complement or other.is_complement):
        return ValueSet(named)
    return ValueSet(frozenset(v for v in named if not (one.holds(v) or other.holds(v))), True)


def complement(accepts: Accepted | None, domain: Domain, is_bounded: bool = True) -> Accepted:
    """The values of a domain that a set does not hold; without its bounds where `is_bounded` is False."""
    if domain.type.is_numeric:
        spans = accepts.spans if isinstance(accepts, NumberSet) else EVERYTHING
        low, high = domain.ends if is_bounded or domain.type.is_circular else EVERYTHING[0]
        return NumberSet(domain.type.fitted(intervals.complement(spans, low, high)), domain.type.is_circular)
    if domain.type.is_tags:
        tags = accepts if isinstance(accepts, TagSet) else TagSet(frozenset())
        return TagSet(tags.needs, tags.bans, not tags.is_complement)
    inner = accepts if isinstance(accepts, ValueSet) else ValueSet(frozenset(), True)
    everything = domain.everything
    if everything is None:
        return ValueSet(inner.values, not inner.is_complement)
    return ValueSet(frozenset(v for v in everything if not inner.holds(v)))


def plain_parts(tags: TagSet, truth: bool = True) -> list[TagSet]:
    """Plain sets that together hold what a set of tags holds, or (not `truth`) what it does not."""
    if tags.is_complement is not truth:
        return [TagSet(tags.needs, tags.bans)]
    lacking = [TagSet(frozenset(), frozenset((need,))) for need in sorted(tags.needs)]
    return lacking + [TagSet(frozenset((ban,))) for ban in sorted(tags.bans)]
