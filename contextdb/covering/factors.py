"""Factors: one condition's domain as a few classes, each with its share of the domain.

A factor has K classes; a set of classes is a Python integer whose bit k is class k. `weights` is float64 [K] and sums to 1.

    ValueFactor    bool, enum, text: a class for each value; text has one more, for every text that no cell names
    NumberFactor   int, number, angle: the spans of doubles that the column's ends cut the domain into
    TagFactor      tags: the answers to "has the fact this tag?" for tags that hang together; a condition may have several

Measures, before weights: a value counts 1; an int span its whole numbers; a number or angle span its length, so that a single
point counts 0 and is a class all the same. Where a domain is not bounded, what lies beyond the outermost ends that cells name
counts half the length between those ends, and at least 1; `assumed` says so. Declared tags are in a context or not with even
chances, each by itself.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import compress, pairwise
from operator import and_
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells import intervals
from contextdb.cells.domains import Domain
from contextdb.cells.grammar import format_cell
from contextdb.cells.intervals import Span
from contextdb.cells.kinds import Kind
from contextdb.cells.sets import Accepted, Cell, NumberSet, TagMeet, TagSet, ValueSet, tags_above
from contextdb.compiled.classes import Value
from contextdb.errors import Fault, TableError, plural

Weights = NDArray[np.float64]
MOST_ANSWERS = 1 << 14
"""Tags that hang together may answer in so many ways at most."""


@dataclass(frozen=True, eq=False)
class ValueFactor:
    """The values of a bool, enum or text."""

    values: tuple[Value, ...]
    has_others: bool
    weights: Weights
    assumed: str = ""

    @classmethod
    def of(cls, accepted: Iterable[Accepted], domain: Domain) -> ValueFactor:
        """The declared values; for text those that cells name, and one class for all others."""
        values: tuple[Value, ...] = domain.everything or tuple(_named(accepted))
        has_others = domain.type.is_open
        n_classes = max(1, len(values) + has_others)
        assumed = f"{plural(len(values), 'text')} that cells name and any other text count the same" if has_others else ""
        return cls(values, has_others, np.full(n_classes, 1.0 / n_classes), assumed)

    def classes(self, accepts: Accepted) -> int:
        assert isinstance(accepts, ValueSet)
        held = bitmask.int_of(sorted(self._class_of[value] for value in accepts.values if value in self._class_of))
        return ((1 << len(self.values) + self.has_others) - 1) ^ held if accepts.is_complement else held

    @cached_property
    def _class_of(self) -> dict[Value, int]:
        return {value: k for k, value in enumerate(self.values)}

    def accepts(self, classes: int) -> Accepted:
        flags = bitmask.flags_of(classes, len(self.weights))
        is_complement = self.has_others and bool(flags[-1])
        return ValueSet(frozenset(compress(self.values, (flags != is_complement).tolist())), is_complement)


@dataclass(frozen=True, eq=False)
class NumberFactor:
    """Spans of doubles, ascending and without a hole, that make up the domain; for int of whole numbers."""

    spans: tuple[Span, ...]
    kind: Kind
    weights: Weights
    assumed: str = ""

    @classmethod
    def of(cls, accepted: Iterable[Accepted], domain: Domain) -> NumberFactor:
        """Cut the domain at every end of the sets."""
        spans = _cut([s for a in accepted if isinstance(a, NumberSet) for s in a.spans], domain)
        lengths, assumed = _measures(spans, domain.type)
        total = math.fsum(lengths)
        weights = np.array(lengths) / total if total > 0.0 else np.full(len(spans), 1.0 / len(spans))
        return cls(tuple(spans), domain.type, weights, assumed)

    @property
    def cuts(self) -> list[float]:
        return self._ends[0]

    @cached_property
    def _ends(self) -> tuple[list[float], list[float]]:
        return [low for low, _ in self.spans], [high for _, high in self.spans]

    def classes(self, accepts: Accepted) -> int:
        """The classes that a set holds whole."""
        assert isinstance(accepts, NumberSet)
        lows, highs = self._ends
        held = 0
        for low, high in accepts.spans:
            first, stop = bisect_left(lows, low), bisect_right(highs, high)
            held |= (1 << max(first, stop)) - (1 << first)
        return held

    def accepts(self, classes: int) -> Accepted:
        spans = list(compress(self.spans, bitmask.flags_of(classes, len(self.spans)).tolist()))
        return NumberSet(self.kind.fitted(intervals.union(spans)), self.kind.is_circular)


@dataclass(frozen=True, eq=False)
class TagFactor:
    """What a set of tags answers for some tags: bit i of `answers[k]` says that class k has tag i (itself or one under it)."""

    tags: tuple[str, ...]
    answers: tuple[int, ...]
    weights: Weights
    assumed: str = ""

    @classmethod
    def of(cls, tags: Sequence[str], declared: Iterable[str]) -> TagFactor:
        """Every answer that a set of declared tags can give, with its chance."""
        chances: dict[int, float] = {0: 1.0}
        at = {tag: i for i, tag in enumerate(tags)}
        for tag in declared:
            effect = sum(1 << at[above] for above in tags_above(tag) if above in at)
            if not effect:
                continue
            after: dict[int, float] = {}
            for answer, chance in chances.items():
                after[answer] = after.get(answer, 0.0) + chance / 2.0
                after[answer | effect] = after.get(answer | effect, 0.0) + chance / 2.0
            chances = after
            if len(chances) > MOST_ANSWERS:
                raise TableError(
                    Fault(
                        f"{plural(len(tags), 'tag')} that depend on each other have too many combinations of answers.",
                        f"{MOST_ANSWERS:,}",
                    )
                )
        answers = tuple(sorted(chances))
        return cls(tuple(tags), answers, np.array([chances[a] for a in answers]))

    def classes(self, accepts: Accepted) -> int:
        """The classes that a set holds, of those of its tags that are here."""
        assert isinstance(accepts, TagSet)
        if isinstance(accepts, TagMeet):
            return reduce(and_, (self.classes(part) for part in accepts.parts))
        needs, bans = self._mask(accepts.needs), self._mask(accepts.bans)
        held = [(a & needs == needs and not a & bans) is not accepts.is_complement for a in self.answers]
        return sum(1 << k for k, is_held in enumerate(held) if is_held)

    def widest(self, first: int, allowed: int) -> int:
        """The classes of a conjunction of tags that holds class `first` and lies in `allowed`, as wide as leaving tags out makes
        it."""
        literals = list(range(len(self.tags)))
        for tag in range(len(self.tags)):
            fewer = [t for t in literals if t != tag]
            if not self._alike(first, fewer) & ~allowed:
                literals = fewer
        return self._alike(first, literals)

    def accepts(self, classes: int) -> TagSet:
        """The shortest conjunction that holds just these classes, which must be one."""
        held = [a for k, a in enumerate(self.answers) if classes >> k & 1]
        always, never = ~0, ~0
        for answer in held:
            always &= answer
            never &= ~answer
        needs = [i for i in range(len(self.tags)) if always >> i & 1]
        bans = [i for i in range(len(self.tags)) if never >> i & 1]
        for literals in (needs, bans):
            for i in list(literals):
                literals.remove(i)
                if self.classes(self._tag_set(needs, bans)) != classes:
                    literals.append(i)
        return self._tag_set(needs, bans)

    def _tag_set(self, needs: Sequence[int], bans: Sequence[int]) -> TagSet:
        return TagSet(frozenset(self.tags[i] for i in needs), frozenset(self.tags[i] for i in bans))

    def _alike(self, first: int, literals: Sequence[int]) -> int:
        mask = sum(1 << i for i in literals)
        return sum(1 << k for k, a in enumerate(self.answers) if a & mask == self.answers[first] & mask)

    def _mask(self, tags: Iterable[str]) -> int:
        at = {tag: i for i, tag in enumerate(self.tags)}
        return sum(1 << at[t] for t in tags if t in at)


Factor = ValueFactor | NumberFactor | TagFactor
Name = TypeVar("Name", bound=Hashable)


def heads(names: Iterable[Name], joined: Iterable[Iterable[Name]]) -> dict[Name, Name]:
    """For each name one of its group, the same for all of the group; names that are joined are of one group."""
    group = {name: name for name in names}

    def head(name: Name) -> Name:
        while group[name] != name:
            group[name] = group[group[name]]
            name = group[name]
        return name

    for members in joined:
        for one, other in pairwise(members):
            group[head(other)] = head(one)
    return {name: head(name) for name in group}


def tag_factors(accepted: Sequence[Accepted], domain: Domain) -> list[TagFactor]:
    """A factor for each group of tags that hang together: one above the other, or in one cell that begins with "not"."""
    sets = [a for a in accepted if isinstance(a, TagSet) and not a.is_empty]
    named = {t for s in sets for t in s.needs | s.bans}
    tags = sorted(named)
    declared = domain.values if domain.values is not None else tags
    over = {tag: [t for t in tags_above(tag) if t in named] for tag in dict.fromkeys((*tags, *declared))}
    head_of = heads(tags, (*over.values(), *(sorted(s.needs | s.bans) for s in sets if s.is_complement)))
    members_of: dict[str, list[str]] = {}
    for tag in tags:
        members_of.setdefault(head_of[tag], []).append(tag)
    declared_of: dict[str, list[str]] = {}
    for tag in declared:
        if over[tag]:
            declared_of.setdefault(head_of[over[tag][0]], []).append(tag)
    return [TagFactor.of(members, declared_of.get(one, ())) for one, members in members_of.items()]


def weighted(factor: Factor, parts: Mapping[int, float]) -> Factor:
    """The factor with other weights: each set of classes gets a weight, spread over it as before."""
    weights = np.zeros(len(factor.weights))
    for classes, weight in parts.items():
        flags = bitmask.flags_of(classes, len(weights))
        inside = np.where(flags, factor.weights, 0.0)
        spread = inside if inside.sum() > 0.0 else flags.astype(np.float64)
        weights += weight * spread / spread.sum()
    total = weights.sum()
    if isinstance(factor, ValueFactor):
        return ValueFactor(factor.values, factor.has_others, weights / total)
    assert isinstance(factor, NumberFactor)
    return NumberFactor(factor.spans, factor.kind, weights / total)


def _named(accepted: Iterable[Accepted]) -> list[Value]:
    return list(dict.fromkeys(v for a in accepted if isinstance(a, ValueSet) for v in sorted(a.values)))


def _whole_domain(domain: Domain) -> Span:
    span = domain.ends
    whole = domain.type.fitted((span,))
    if not whole or span[0] > span[1]:
        low, high = map(domain.type.spelling.write, span)
        raise TableError(Fault(f"no {domain.kind} is between min {low} and max {high}.", "a domain that is not empty"))
    return whole[0]


def _cut(spans: Sequence[Span], domain: Domain) -> list[Span]:
    first, last = _whole_domain(domain)
    is_int = domain.type.is_whole
    starts = {first}
    for low, high in spans:
        after = math.inf if high == math.inf else intervals.above(high)
        after = max(after, high + 1.0) if is_int else after
        starts.update(s for s in (low, after) if first < s <= last and (s is not after or high < math.inf))
    ordered = sorted(starts)
    ends = [min(intervals.below(s), s - 1.0) if is_int else intervals.below(s) for s in ordered[1:]]
    return list(zip(ordered, [*ends, last], strict=True))


def _measures(spans: Sequence[Span], kind: Kind) -> tuple[list[float], str]:
    """How much each span counts, and what was assumed for that."""
    if len(spans) == 1:
        return [1.0], ""
    margin = margin_of(spans, kind)
    lengths = [_length(spans, at, kind, margin) for at in range(len(spans))]
    endless = [s for s in (spans[0], spans[-1]) if math.inf in map(abs, s) and s[0] != s[1]]
    texts = [format_cell(Cell(NumberSet((s,))), Domain(kind.name)) for s in endless]
    return lengths, ", ".join(f"{text} counts {margin:.6g}" for text in texts)


def margin_of(spans: Sequence[Span], kind: Kind) -> float:
    """How much counts beyond the outermost ends that cells name, where a domain of more than one span has no bound."""
    low = spans[1][0] if spans[0][0] == -math.inf else spans[0][0]
    high = spans[-2][1] if spans[-1][1] == math.inf else spans[-1][1]
    margin = max(1.0, min((high - low) / 2.0, 1e300))
    return float(math.floor(margin)) if kind.is_whole else margin


def _length(spans: Sequence[Span], at: int, kind: Kind, margin: float) -> float:
    low, high = spans[at]
    if math.isinf(low) or math.isinf(high):
        return 0.0 if low == high else margin
    if kind.is_whole:
        return high - low + 1.0
    if low == high:
        return 0.0
    if at + 1 < len(spans):
        high = spans[at + 1][0]
    elif kind.is_circular:
        high = 180.0
    if at > 0 and spans[at - 1][0] == spans[at - 1][1]:
        low = spans[at - 1][0]
    return max(0.0, high - low) if math.isfinite(high - low) else 1e300
