"""A tree of questions that tells which asset was recorded: what pairs say first, before their boxes are merged into rows.

N pairs, F features. A feature is a fact as classes: the different numbers in order, the values, or whether a tag is in the set. A
question is whether a class is below another, or is one value. Questions are worth their bits: a part of the tree goes where a list
of exceptions to one asset would be shorter, so that single wrong pairs are exceptions and random assets are nothing at all.

Source: Quinlan and Rivest, "Inferring decision trees using the minimum description length principle", 1989.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Flags

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
