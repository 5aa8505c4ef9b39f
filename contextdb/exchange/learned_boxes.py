"""The fewest boxes that say of recorded pairs which asset they have: boxes of a tree, each made as wide as other assets allow.

A box of the tree widens: it loses what it says of a fact, else its ends move, as long as no pair of another asset comes into it. Of
the wide boxes of an asset the fewest are taken that hold all its pairs. Pairs that the tree lists as exceptions do not count, until
a box of their own asset holds them.

N pairs, F features. A feature is a fact as classes: the different numbers in order, the values, or whether a tag is in the set. A
question is whether a class is below another, or is one value. Questions are worth their bits: a part of the tree goes where a list
of exceptions to one asset would be shorter, so that single wrong pairs are exceptions and random assets are nothing at all.

Source: Quinlan and Rivest, "Inferring decision trees using the minimum description length principle", 1989.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Flags
from contextdb.covering.fewest import fewest

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
                bits.append(bitmask.to_int(bitmask.pack(mine.inside(sides))))
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


# ---- a tree of questions that tells which asset was recorded: what pairs say first, before their boxes are merged into rows


Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Feature:
    """A fact of all pairs, as classes."""

    condition: str
    codes: Ints
    """int64 [N]."""
    n_classes: int
    is_ordered: bool
    is_circular: bool = False
    tag: str | None = None
    """The tag that class 1 has, of a condition of tags."""

    @property
    def full(self) -> Flags:
        return np.ones(self.n_classes, np.bool_)


@dataclass(frozen=True, eq=False)
class Leaf:
    """A box of the tree, and the asset that most of its pairs have."""

    sides: tuple[Flags, ...]
    """For each feature the classes in it."""
    label: int
    pairs: Ints


@dataclass(frozen=True)
class _Part:
    leaves: tuple[Leaf, ...]
    bits: float


def leaves_of(features: Sequence[Feature], labels: Ints) -> list[Leaf]:
    """The boxes of the tree of some pairs, which together hold all of them."""
    grower = _Grower(features, labels)
    return list(grower.part(np.arange(len(labels)), tuple(feature.full for feature in features)).leaves)


@dataclass(eq=False)
class _Grower:
    features: Sequence[Feature]
    labels: Ints

    def __post_init__(self) -> None:
        self.n_labels = int(self.labels.max(initial=0)) + 1
        self.label_bits = math.log2(self.n_labels + 1)
        self.question_bits = 1.0 + math.log2(sum(feature.n_classes for feature in self.features) + 1)

    def part(self, pairs: Ints, sides: tuple[Flags, ...]) -> _Part:
        counts = np.bincount(self.labels[pairs], minlength=self.n_labels)
        label = int(counts.argmax())
        wrong = len(pairs) - int(counts[label])
        leaf_bits = 1.0 + self.label_bits + _chosen_bits(wrong, len(pairs)) + wrong * self.label_bits
        leaf = _Part((Leaf(sides, label, pairs),), leaf_bits)
        if leaf_bits <= self.question_bits + 2.0 * (1.0 + self.label_bits):  # the best of questions would not pay
            return leaf
        question = self._question(pairs)
        if question is None:
            return leaf
        f, side = question
        is_in = side[self.features[f].codes[pairs]]
        parts = [
            self.part(pairs[within], (*sides[:f], sides[f] & own, *sides[f + 1 :]))
            for within, own in ((is_in, side), (~is_in, ~side))
        ]
        bits = self.question_bits + sum(part.bits for part in parts)
        return _Part(tuple(leaf for part in parts for leaf in part.leaves), bits) if bits < leaf_bits else leaf

    def _question(self, pairs: Ints) -> tuple[int, Flags] | None:
        """The feature and the classes that part the pairs best; None where no question parts them."""
        best: tuple[float, int, int] | None = None
        labels = self.labels[pairs]
        for f, feature in enumerate(self.features):
            codes = feature.codes[pairs]
            present, which = np.unique(codes, return_inverse=True)
            if len(present) < 2:
                continue
            cells = which.reshape(-1) * self.n_labels + labels
            counts = np.bincount(cells, minlength=len(present) * self.n_labels).reshape(len(present), -1).astype(np.float64)
            whole = counts.sum(axis=0)
            below = np.cumsum(counts, axis=0)[:-1] if feature.is_ordered else counts
            bits = _entropy(below) + _entropy(whole - below)
            at = int(bits.argmin())
            if best is None or bits[at] < best[0] - 1e-9:
                best = float(bits[at]), f, int(present[at])
        if best is None:
            return None
        _, f, last = best
        classes = np.arange(self.features[f].n_classes)
        return f, (classes <= last if self.features[f].is_ordered else classes == last)


def _chosen_bits(n: int, of: int) -> float:
    """Bits that tell which n of so many."""
    share = n / max(of, 1)
    return 0.0 if share in (0.0, 1.0) else -of * (share * math.log2(share) + (1.0 - share) * math.log2(1.0 - share))


def _entropy(counts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bits that tell which label each of the counted pairs has: float64 [rows]."""
    total = counts.sum(axis=1)
    return np.asarray(_xlogx(total) - _xlogx(counts).sum(axis=1))


def _xlogx(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(x * np.log2(np.maximum(x, 1.0)))
