"""The fewest boxes that say of recorded pairs which asset they have: boxes of a tree, each made as wide as other assets allow.

A box of the tree widens: it loses what it says of a fact, else its ends move, as long as no pair of another asset comes into it. Of
the wide boxes of an asset the fewest are taken that hold all its pairs. Pairs that the tree lists as exceptions do not count, until
a box of their own asset holds them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Flags
from contextdb.covering.fewest import fewest
from contextdb.exchange.learned_tree import Feature, Ints, Leaf, leaves_of

ROUNDS = 4
STEPS = 2_000


@dataclass(frozen=True, eq=False)
class LearnedBox:
    """A box, and the asset of the pairs in it."""

    label: int
    sides: tuple[Flags, ...]
    """For each feature the classes in it."""
    cores: tuple[Flags, ...]
    """Those of them that a pair of the asset in the box has."""

    def holds(self, features: Sequence[Feature]) -> Flags:
        """Which pairs are in it."""
        return _Pairs.of(features, np.arange(len(features[0].codes) if features else 0)).inside(self.sides)


def learned_boxes(features: Sequence[Feature], labels: Ints) -> list[LearnedBox]:
    """Few boxes that say of N pairs which asset they have, those of most pairs first."""
    leaves = leaves_of(features, labels)
    counts = np.zeros(len(labels), np.bool_)
    for leaf in leaves:
        counts[leaf.pairs[labels[leaf.pairs] == leaf.label]] = True
    boxes: list[LearnedBox] = []
    for _ in range(ROUNDS):
        boxes = [
            box
            for label in dict.fromkeys(leaf.label for leaf in leaves)
            for box in _of_label(label, leaves, features, labels, counts)
        ]
        held = np.zeros(len(labels), np.bool_)
        for box in boxes:
            held |= box.holds(features) & (labels == box.label)
        if not (held & ~counts).any():
            break
        counts |= held
    return sorted(boxes, key=lambda box: -int(box.holds(features).sum()))


def _of_label(label: int, leaves: Sequence[Leaf], features: Sequence[Feature], labels: Ints, counts: Flags) -> Iterator[LearnedBox]:
    """The fewest wide boxes of an asset."""
    own = np.flatnonzero(counts & (labels == label))
    near = _Pairs.of(features, np.flatnonzero(counts & (labels != label)))
    mine = _Pairs.of(features, own)
    candidates: list[tuple[Flags, ...]] = []
    bits: list[int] = []
    known: set[bytes] = set()
    for leaf in leaves:
        if leaf.label != label:
            continue
        for is_backwards in (False, True):
            sides = near.widened(_clean(leaf.sides, mine, near), features, is_backwards)
            key = b"".join(side.tobytes() for side in sides)
            if key not in known:
                known.add(key)
                candidates.append(sides)
                bits.append(_bits(mine.inside(sides)))
    numbers, _ = fewest(bits, STEPS)
    for sides in (candidates[i] for i in numbers):
        inside = mine.inside(sides)
        cores = tuple(np.isin(np.arange(len(side)), codes[inside]) for side, codes in zip(sides, mine.codes, strict=True))
        yield LearnedBox(label, sides, cores)


def _clean(sides: tuple[Flags, ...], mine: _Pairs, others: _Pairs) -> tuple[Flags, ...]:
    """A box of the tree; where pairs of other assets have come into it, what its own pairs span of it."""
    if not others.inside(sides).any():
        return sides
    inside = mine.inside(sides)
    spanned = []
    for side, codes, is_ordered in zip(sides, mine.codes, mine.is_ordered, strict=True):
        here = codes[inside]
        classes = np.arange(len(side))
        within = (classes >= here.min()) & (classes <= here.max()) if is_ordered else np.isin(classes, here)
        spanned.append(side & within if len(here) else side)
    return tuple(spanned)


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Some pairs, by the classes of their facts."""

    codes: list[Ints]
    is_ordered: list[bool]

    @classmethod
    def of(cls, features: Sequence[Feature], numbers: Ints) -> _Pairs:
        return cls([feature.codes[numbers] for feature in features], [feature.is_ordered for feature in features])

    def inside(self, sides: Sequence[Flags]) -> Flags:
        flags = np.ones(len(self.codes[0]) if self.codes else 0, np.bool_)
        for side, codes in zip(sides, self.codes, strict=True):
            flags &= side[codes]
        return flags

    def widened(self, sides: tuple[Flags, ...], features: Sequence[Feature], is_backwards: bool) -> tuple[Flags, ...]:
        """A box as wide as it can be without any of these pairs: first without what it says of a fact, then with further ends."""
        outside = np.zeros(len(self.codes[0]) if self.codes else 0, np.int64)  # of how many sides each pair is outside
        for side, codes in zip(sides, self.codes, strict=True):
            outside += ~side[codes]
        wide = list(sides)
        order = [f for f, side in enumerate(sides) if not side.all()]
        for f in reversed(order) if is_backwards else order:
            blocking = (outside == 1) & ~wide[f][self.codes[f]]
            if not blocking.any():
                outside -= ~wide[f][self.codes[f]]
                wide[f] = features[f].full
        for f in reversed(order) if is_backwards else order:
            blocked = np.zeros(features[f].n_classes, np.bool_)
            is_out = ~wide[f][self.codes[f]]
            blocked[self.codes[f][(outside == is_out) & is_out | (outside == 0)]] = True
            wider = _further(wide[f], blocked, features[f])
            outside -= is_out & wider[self.codes[f]]
            wide[f] = wider
        return tuple(wide)


def _further(side: Flags, blocked: Flags, feature: Feature) -> Flags:
    """A side with all classes that are not blocked; of numbers those that hang together with it."""
    free = side | ~blocked
    if not feature.is_ordered:
        return free
    numbers = np.flatnonzero(side)
    if not len(numbers):
        return side
    n = len(side)
    stops = np.flatnonzero(~free)
    if not len(stops):
        return free
    low, high = int(numbers[0]), int(numbers[-1])
    before, after = stops[stops < low], stops[stops > high]
    first = int(before[-1]) + 1 if len(before) else 0
    last = int(after[0]) - 1 if len(after) else n - 1
    wider = side.copy()
    wider[first:low] = wider[high + 1 : last + 1] = True
    if feature.is_circular and first == 0 and last < n - 1:
        wider[int(after[-1]) + 1 :] = True
    if feature.is_circular and last == n - 1 and first > 0:
        wider[: int(before[0])] = True
    return wider


def _bits(flags: NDArray[np.bool_]) -> int:
    return int.from_bytes(np.packbits(flags, bitorder="little").tobytes(), "little")
