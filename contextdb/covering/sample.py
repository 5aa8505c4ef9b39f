"""Coverage by samples: contexts drawn by their weights and looked up in masks, the same for the same seed.

Where little is covered, contexts are drawn out of the rows instead (Karp and Luby): a row by its measure, a context in it; the
share of draws whose row is the first that holds the context, times the sum of the rows' measures, is the covered share.

Source: Karp, Luby and Madras, "Monte-Carlo approximation algorithms for enumeration problems", Journal of Algorithms 10, 1989.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Words
from contextdb.core import count_holders
from contextdb.covering.draw import Drawer
from contextdb.covering.numbered import NumberedBoxes
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.report import wilson
from contextdb.covering.space import Sides, Space
from contextdb.covering.witness import Point

Codes = NDArray[np.int32]
Chunks = Iterator[tuple[Codes, NDArray[np.float64] | None]]
"""Contexts, int32 [N, factors] of classes, and the weight of each; None: all alike."""
CHUNK = 4096
MOST_SEEDS = 2000
MOST_FULL = 200
LITTLE = 0.1
"""Below this covered share contexts are drawn out of the rows."""
MANY_FACTORS = 500
"""From so many factors on a sample is so dear that fewer are drawn."""
MOST_WORDS = 1 << 36
"""So many words of bits are gone through for the usual samples: half a minute."""
MOST_CONTEXTS = 100_000
"""A space of so few classes is gone through whole, instead of sampled, for the overlap."""


@dataclass(frozen=True, eq=False)
class Counts:
    """What a set of contexts showed: weights per number of valid rows, weight of each box, points without a row."""

    n_contexts: int
    histogram: NDArray[np.float64]
    hits: NDArray[np.float64]
    uncovered: tuple[Point, ...]
    fullest: tuple[Point, ...]
    """Contexts of some measure with most valid rows, the fullest first."""


class Holders(NamedTuple):
    """What boxes hold N contexts."""

    counts: NDArray[np.int64]
    """int64 [N]: how many boxes hold each."""
    firsts: NDArray[np.int64]
    """int64 [N]: the first of them; -1 where there is none."""
    hits: NDArray[np.float64]
    """float64 [boxes]: what the contexts in each box weigh together."""


@dataclass(frozen=True, eq=False)
class Sampler:
    """Masks of the rows of a space for each class, to look contexts up in."""

    space: Space
    progress: Progress = SILENT
    drawer: Drawer | None = None
    """Draws the contexts where boxes cannot tell which can happen."""

    @cached_property
    def masks(self) -> tuple[Words, NDArray[np.int64]]:
        """uint64 [classes of all factors, words], and where each factor's begin."""
        return _masks(self.space, self.space.numbered, slice(None), self.progress)

    @cached_property
    def _impossible(self) -> tuple[Words, NDArray[np.int64]]:
        boxes = NumberedBoxes.of(self.space.full, self.space.impossible)
        return _masks(self.space, boxes, slice(None), self.progress)

    def holders(self, codes: Codes, weights: NDArray[np.float64] | None = None) -> Holders:
        """What boxes hold contexts. Where their masks do not fit into memory, those of a part of the boxes are made at a time."""
        n_boxes, most = len(self.space.boxes), self.space.n_fitting
        if self.space.is_fitting:
            return lookup(codes, self.masks, n_boxes, weights)
        whole = Holders(np.zeros(len(codes), np.int64), np.full(len(codes), -1), np.zeros(n_boxes))
        for first in range(0, n_boxes, most):
            part = slice(first, min(first + most, n_boxes))
            own = lookup(codes, _masks(self.space, self.space.numbered, part, self.progress), part.stop - first, weights)
            is_first = (whole.firsts < 0) & (own.firsts >= 0)
            whole.firsts[is_first] = own.firsts[is_first] + first
            whole.counts[:] += own.counts
            whole.hits[part] = own.hits
        return whole

    def gathered(self, chunks: Chunks) -> Chunks:
        """The contexts; all at once where masks are made part by part."""
        if self.space.is_fitting:
            yield from chunks
        elif parts := list(chunks):
            codes, weights = [codes for codes, _ in parts], [own for _, own in parts if own is not None]
            yield np.concatenate(codes), np.concatenate(weights) if weights else None

    def held(self, codes: Codes) -> NDArray[np.bool_]:
        """Which boxes hold each of N contexts: bool [N, boxes]."""
        words, starts = self.masks
        bits = np.full((len(codes), bitmask.n_words(len(self.space.boxes))), ~np.uint64(0))
        for f in range(codes.shape[1]):
            bits &= words[starts[f] + codes[:, f]]
        return np.unpackbits(bits.view(np.uint8), axis=1, bitorder="little", count=len(self.space.boxes)).astype(np.bool_)

    def sampled(self, n_samples: int, rng: np.random.Generator) -> Counts:
        """Look random possible contexts up; those drawn that are impossible do not count."""
        return self._counted(self.random_contexts(n_samples, rng))

    def all_contexts(self) -> Counts | None:
        """Look every class of the space up, by its weight; None where there are too many."""
        every = self.every_context()
        return None if every is None else self._counted(every)

    def random_contexts(self, n_samples: int, rng: np.random.Generator) -> Chunks:
        """Random contexts, a few thousand at a time, all of one weight; those in impossible boxes are among them."""
        if self.drawer is not None:
            drawer = self.drawer
            return ((drawer.draw(min(CHUNK, n_samples - at), rng), None) for at in range(0, n_samples, CHUNK))
        sums = [np.cumsum(f.weights) for f in self.space.factors]
        return ((self._draw(sums, min(CHUNK, n_samples - at), rng), None) for at in range(0, n_samples, CHUNK))

    def every_context(self) -> Chunks | None:
        """One context of each class of the space with its weight, a few thousand at a time; None where there are too many,
        or where only draws tell what can happen."""
        if self.drawer is not None:
            return None
        sizes = [len(f.weights) for f in self.space.factors]
        total = math.prod(sizes)
        return self._grid(sizes, total) if total <= MOST_CONTEXTS else None

    def _grid(self, sizes: list[int], total: int) -> Chunks:
        for at in range(0, total, CHUNK):
            numbers = np.arange(at, min(at + CHUNK, total))
            codes, shares = np.zeros((len(numbers), len(sizes)), np.int32), np.ones(len(numbers))
            for f, size in enumerate(sizes):
                codes[:, f] = numbers % size
                numbers = numbers // size
                shares *= self.space.factors[f].weights[codes[:, f]]
            yield codes, shares

    def _draw(self, sums: list[NDArray[np.float64]], n: int, rng: np.random.Generator) -> Codes:
        codes = np.zeros((n, len(sums)), np.int32)
        for f, cumulative in enumerate(sums):
            if len(cumulative) > 1:
                codes[:, f] = _drawn(cumulative, rng.random(n))
        return codes

    def _counted(self, chunks: Chunks) -> Counts:
        histogram, hits = np.zeros(1), np.zeros(len(self.space.boxes))
        uncovered: dict[Point, None] = {}
        fullest: dict[Point, int] = {}
        n_contexts = 0
        for codes, shares in self.gathered(chunks):
            self.progress.check()
            possible = self.is_possible(codes)
            codes = codes[possible]
            weights = np.ones(len(codes)) if shares is None else shares[possible]
            counts, _, held = self.holders(codes, weights)
            n_contexts += len(codes)
            histogram = _summed(histogram, np.bincount(counts, weights).astype(np.float64))
            hits += held
            for i in np.flatnonzero(counts == 0).tolist() if len(uncovered) < MOST_SEEDS else ():
                uncovered[tuple(codes[i].tolist())] = None
            fullest = _fullest(fullest, codes, np.where(weights > 0.0, counts, 0))
        return Counts(n_contexts, histogram, hits, tuple(uncovered), tuple(fullest))

    def is_possible(self, codes: Codes) -> NDArray[np.bool_]:
        """Which contexts are in no impossible box."""
        if not self.space.impossible:
            return np.ones(len(codes), np.bool_)
        return np.equal(lookup(codes, self._impossible, len(self.space.impossible)).counts, 0)

    def out_of_rows(self, n_samples: int, rng: np.random.Generator) -> tuple[float, float, float]:
        """The covered and possible share of the whole space and its 99 % interval, by contexts drawn out of the rows."""
        volumes = self.space.volumes
        total = float(volumes.sum())
        if total == 0.0:
            return 0.0, 0.0, 0.0
        n_first, chunk = 0, CHUNK if self.space.is_fitting else max(1, n_samples)
        for at in range(0, n_samples, chunk):
            n = min(chunk, n_samples - at)
            drawn = _drawn(np.cumsum(volumes), rng.random(n))
            codes = self._draw_inside(drawn, rng)
            firsts = self.holders(codes).firsts
            n_first += int((firsts == drawn)[self.is_possible(codes)].sum())
        low, high = wilson(n_first, n_samples)
        return min(1.0, total * n_first / n_samples), min(1.0, total * low), min(1.0, total * high)

    def _draw_inside(self, drawn: NDArray[np.int64], rng: np.random.Generator) -> Codes:
        codes = np.zeros((len(drawn), len(self.space.factors)), np.int32)
        for f, factor in enumerate(self.space.factors):
            self.progress.check()
            if len(factor.weights) == 1:
                continue
            uniform = rng.random(len(drawn))
            of_box, sides = self.space.numbered.numbers[f], self.space.numbered.sides[f]
            for number in np.unique(of_box[drawn]).tolist():
                members = np.flatnonzero(of_box[drawn] == number)
                inside = np.where(bitmask.flags_of(sides[number], len(factor.weights)), factor.weights, 0.0)
                codes[members, f] = _drawn(np.cumsum(inside), uniform[members])
        return codes


def samples_of(asked: int | None, usual: int, space: Space) -> int:
    """How many samples are drawn: as many as were asked for. When none were, the usual number, and of a space with more than
    `MANY_FACTORS` factors as many fewer as it has more, since each sample takes longer; so too where boxes are very many."""
    if asked is not None:
        return asked
    n_factors = max(1, len(space.factors))
    most = MOST_WORDS // (n_factors * max(1, bitmask.n_words(len(space.boxes))))
    return min(usual, usual * MANY_FACTORS // n_factors, most)


def lookup(
    codes: Codes, masks: tuple[Words, NDArray[np.int64]], n_boxes: int, weights: NDArray[np.float64] | None = None
) -> Holders:
    """The boxes that hold each context, and what the contexts that each box holds weigh together, 1 each by default."""
    holders = Holders(np.zeros(len(codes), np.int64), np.zeros(len(codes), np.int64), np.zeros(n_boxes))
    count_holders(codes, masks[1], masks[0], weights, *holders)
    return holders


def _fullest(known: dict[Point, int], codes: Codes, counts: NDArray[np.int64]) -> dict[Point, int]:
    """The contexts with most valid rows, those known and more, the fullest first; of equals the earlier."""
    best = np.argsort(-counts, kind="stable")[:MOST_FULL]
    points = known | {tuple(codes[i].tolist()): int(counts[i]) for i in best.tolist() if counts[i] > 1}
    return dict(sorted(points.items(), key=lambda item: -item[1])[:MOST_FULL])


def _masks(space: Space, boxes: NumberedBoxes, part: slice, progress: Progress) -> tuple[Words, NDArray[np.int64]]:
    """The masks of a part of some boxes, and where each factor's begin."""
    starts = np.cumsum([0, *(len(f.weights) for f in space.factors)])
    parts = []
    for f, factor in enumerate(space.factors):
        progress.check()
        of_box = boxes.numbers[f][part]
        turns = np.zeros((len(factor.weights) + 1, bitmask.n_words(len(of_box))), np.uint64)
        for number, side in enumerate(boxes.sides[f]):
            bits = bitmask.pack(of_box == number)
            for first, stop in bitmask.runs_of(side):
                turns[first] ^= bits
                turns[stop] ^= bits
        parts.append(np.bitwise_xor.accumulate(turns, axis=0)[:-1])
    return (np.concatenate(parts) if parts else np.zeros((0, 0), np.uint64)), starts[:-1]


def _summed(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """The sum of two histograms of any lengths."""
    joint = np.zeros(max(len(one), len(other)))
    joint[: len(one)] += one
    joint[: len(other)] += other
    return joint


def _drawn(sums: NDArray[np.float64], uniform: NDArray[np.float64]) -> NDArray[np.int64]:
    """Where uniform numbers fall among weights whose sums are given; never on one of weight 0."""
    last = int(np.searchsorted(sums, sums[-1], "left"))
    return np.asarray(np.minimum(np.searchsorted(sums, uniform * sums[-1], "right"), last), np.int64)


# ---- shares of boxes out of samples, where only samples know what can happen


@dataclass(eq=False)
class SampledShares:
    """The share of N sampled contexts, all of which can happen, that a box holds and others do not; never exact."""

    space: Space
    codes: Codes
    """int32 [N, factors]."""
    _taken: NDArray[np.bool_] = field(init=False)
    _n_taken: int = 0

    def __post_init__(self) -> None:
        self._taken = np.zeros(len(self.codes), np.bool_)

    @classmethod
    def of(cls, sampler: Sampler, n_samples: int, rng: np.random.Generator) -> SampledShares:
        """The shares in so many draws."""
        chunks = [codes[sampler.is_possible(codes)] for codes, _ in sampler.random_contexts(n_samples, rng)]
        empty = np.zeros((0, len(sampler.space.factors)), np.int32)
        return cls(sampler.space, np.concatenate([empty, *chunks]))

    def __call__(self, box: Sides, without: Sequence[Sides]) -> tuple[float, bool]:
        """The share; the boxes of `without` may only grow in number from one call to the next, unless there are none."""
        held = self._held(box)
        if without:
            for other in without[self._n_taken :]:
                self._taken |= self._held(other)
            self._n_taken = len(without)
            held = held & ~self._taken
        return (float(held.mean()) if len(held) else 0.0), False

    def _held(self, box: Sides) -> NDArray[np.bool_]:
        flags = np.ones(len(self.codes), np.bool_)
        for f, side in box.items():
            flags &= bitmask.flags_of(side, len(self.space.factors[f].weights))[self.codes[:, f]]
        return flags
