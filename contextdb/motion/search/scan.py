"""The search without numba: all frames by one product of matrices in float32, and the few that may be best in float64. What the
fast search is measured and tested against, what it falls back to where numba is missing, and where totals of candidates come from.

    Σ w (x - q)² = Σ w x² - 2 Σ w x q + Σ w q²,  x and q counted from the mean frame c

N frames, n of them in ranges, F features, Q queries, R ranges. Exact costs come from `contextdb.motion.search.cost`, masks and
biases from the same `Filter` as the fast search's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search import cost
from contextdb.motion.search.filters import Filter, Kinds
from contextdb.motion.search.layout import Features, Layout
from contextdb.motion.search.many_filters import ManyFilters

UNIT = 6e-8
"""The greatest relative rounding error of one float32 operation."""
MOST = 1e36
"""Where totals may be larger, float32 may end: every frame is then scored in float64."""
PIECE = 7000
"""The features are kept in pieces of so many numbers: each product fits the nearest cache, and BLAS starts no threads for it."""
AT_ONCE = 32
"""So many queries are multiplied at once."""
MOST_KINDS = 16
"""So many tag filters are kept as what they add to frames."""


@dataclass(eq=False)
class Scan:
    """The frames of one database, ready for a product with queries. Made once, they take as much memory again as the features."""

    layout: Layout
    kinds: NDArray[np.integer]
    slices: tuple[slice, ...]
    weights: Floats
    _added: dict[int, tuple[Kinds, Features, float]] = field(default_factory=dict)

    def totals(self, query: Floats, chosen: Filter, frames: Ints) -> Floats:
        """Cost and bias of some frames, each in a range: float64 [len(frames)]."""
        if not len(frames):
            return np.empty(0)
        biases = chosen.biases(self.layout.frame_ranges, self.kinds)[frames]
        return np.asarray(cost.costs(self.layout, frames, query, self.slices, self.weights) + biases)

    def least(self, query: Floats, chosen: Filter, within: float) -> tuple[Ints, Ints, Floats]:
        """The lowest total of each range, if it is at most `within`: the ranges, the frames and the totals. Of every frame."""
        frames = self._allowed(chosen)
        found = self.totals(query, chosen, frames)
        near = (found <= within) & (found < np.inf)
        frames, found = frames[near], found[near]
        ranges = self.layout.frame_ranges[frames]
        order = np.lexsort((frames, frames != chosen.playing(self.layout.frame_ranges, self.kinds), found, ranges))
        own, first = np.unique(ranges[order], return_index=True)
        return own, frames[order][first], found[order][first]

    def least_of_many(self, queries: Floats, filters: ManyFilters) -> tuple[Ints, Ints, Floats]:
        """For each normalised query [Q, F] the best frame's range, its number, -1 for none, and its total, inf for none."""
        n = len(queries)
        ranges, frames, found = np.full(n, -1, np.int64), np.full(n, -1, np.int64), np.full(n, np.inf)
        if not n or not len(self._frames):
            return ranges, frames, found
        playing = self._playing(filters)
        with np.errstate(over="ignore", invalid="ignore"):
            near = self._near(queries, filters, playing)
        of, own = np.arange(n).repeat([len(each) for each in near]), np.concatenate(near)
        lay, shared, biases = self.layout, filters.shared, filters.range_biases
        own_ranges, is_playing = lay.ranges_of(own), own == playing[of]
        added = biases[0][own_ranges] if len(biases) == 1 else biases[of, own_ranges]
        added = added + shared.kinds.biases[self.kinds[own]]
        if len(shared.frame_biases):
            added += shared.frame_biases[own]
        if is_playing.any():
            added[is_playing] += shared.continuing
        total = cost.costs(lay, own, queries[of] if n > 1 else queries[0], self.slices, self.weights) + added
        order = np.lexsort((own, ~is_playing, total, of))[::-1] if len(own) > 1 else slice(None)
        of, own, own_ranges, total = of[order], own[order], own_ranges[order], total[order]
        if not total.max(initial=0.0) < np.inf:
            of, own, own_ranges, total = (each[total < np.inf] for each in (of, own, own_ranges, total))
        ranges[of], frames[of], found[of] = own_ranges, own, total  # the last of each counts, which is its lowest
        return ranges, frames, found

    def _near(self, queries: Floats, filters: ManyFilters, playing: Ints) -> list[Ints]:
        """For each query the frames that may be the best: those whose total in float32 is the lowest, as far as it can tell."""
        apart = queries - self._centre
        weighted = apart * self._feature_weights
        sizes = np.einsum("qf,qf->q", apart, weighted).tolist()
        added, largest = self._added_to_frames(filters.shared)
        largest += _largest(filters.range_biases)
        of_ranges = self._added_to_ranges(filters)
        narrow, points = (-2.0 * weighted).astype(np.float32), self._points
        found: list[Ints] = []
        for i, size in enumerate(sizes):
            if i % AT_ONCE == 0:
                products = narrow[i : i + AT_ONCE] @ points
            scale = self._greatest + size + largest
            if not scale < MOST:
                found.append(self._allowed(filters.one(i)))
                continue
            row, plays = products[:, i % AT_ONCE].ravel(), int(playing[i])
            row += added
            if of_ranges is not None:
                row[: len(self._frames)] += of_ranges[i % len(of_ranges)].repeat(self._lengths)
            for skip in filters.skips[i] if filters.skips else ():
                row[slice(*self._frames.searchsorted((skip.start, skip.stop)))] = np.inf
            if plays >= 0:
                row[self._frames.searchsorted(plays)] = np.inf
            best = row[row.argmin()]
            near = self._frames[(row <= best + self._rounded * scale).nonzero()[0]] if best < np.inf else self._frames[:0]
            found.append(near if plays < 0 else np.append(near, plays))
        return found

    def _allowed(self, chosen: Filter) -> Ints:
        return np.flatnonzero(chosen.why(self.layout.frame_ranges, self.kinds) == LeftOut.NO)

    def _playing(self, filters: ManyFilters) -> Ints:
        """The frame of each query that plays on if it may, else -1."""
        found = filters.currents.copy()
        for i in (found >= 0).nonzero()[0].tolist():
            found[i] = filters.one(i).playing(self.layout.frame_ranges, self.kinds)
        return found

    def _added_to_ranges(self, filters: ManyFilters) -> Features | None:
        """The biases of ranges, in the order of their frames, inf where one may not play; None where they are all the same."""
        biases, ranges = filters.range_biases, filters.ranges
        if ranges.all():
            if biases.min() == biases.max() < np.inf:
                return None
        else:
            biases = np.where(ranges, biases, np.inf)
        return biases.astype(np.float32)[:, self.layout.range_order]

    def _added_to_frames(self, shared: Filter) -> tuple[Features, float]:
        """What is added to the products of all frames, inf where one may not be chosen; and the largest of the biases in it."""
        kinds = shared.kinds
        if id(kinds) not in self._added:
            if len(self._added) >= MOST_KINDS:
                self._added.clear()
            own = np.where(kinds.allowed, kinds.biases, np.inf).astype(np.float32)
            added = self._squares.copy()
            added[: len(self._frames)] += own[self.kinds[self._frames]]
            self._added[id(kinds)] = kinds, added, _largest(kinds.biases)
        _, added, largest = self._added[id(kinds)]
        if len(shared.frames) or len(shared.frame_biases):
            added = added.copy()
        if len(shared.frames):
            added[: len(self._frames)][~shared.frames[self._frames]] = np.inf
        if len(shared.frame_biases):
            added[: len(self._frames)] += shared.frame_biases[self._frames].astype(np.float32)
            largest += _largest(shared.frame_biases)
        return added, largest

    # ---- what does not change between searches

    @cached_property
    def _frames(self) -> Ints:
        """The frames that are in ranges, ascending: [n]."""
        return self.layout.frames

    @cached_property
    def _lengths(self) -> Ints:
        """How many frames each range has, in the order of their frames."""
        return np.bincount(self.layout.box_ranges, self.layout.box_sizes)[self.layout.range_order].astype(np.int64)

    @cached_property
    def _feature_weights(self) -> Floats:
        return cost.weights_of_features(self.slices, self.weights)

    @cached_property
    def _centre(self) -> Floats:
        """The mean frame: the nearer features are to 0, the less is rounded away."""
        return np.asarray(self.layout.take(self._frames).mean(axis=0, dtype=np.float64))

    @cached_property
    def _points(self) -> Features:
        """The features from the centre, in W columns each: [ceil(n / W), F, W]; what fills up is 0."""
        n, n_features = len(self._frames), self.layout.n_features
        width = max(16, PIECE // max(1, n_features) // 16 * 16)
        points = np.zeros((-(-n // width), n_features, width), np.float32)
        for i, piece in enumerate(points):
            own = self.layout.take(self._frames[i * width : (i + 1) * width]) - self._centre
            piece[:, : len(own)] = own.T
        return points

    @cached_property
    def _squares(self) -> Features:
        """The weighted squares of the features; inf for what fills up."""
        squares = [self._feature_weights @ piece.astype(np.float64) ** 2 for piece in self._points]
        found = np.concatenate(squares).astype(np.float32)
        found[len(self._frames) :] = np.inf
        return found

    @cached_property
    def _greatest(self) -> float:
        return float(self._squares[: len(self._frames)].max())

    @cached_property
    def _rounded(self) -> float:
        """More than float32 may put two totals apart, of the greatest numbers in them."""
        return (4 * self.layout.n_features + 64) * UNIT


def _largest(biases: Floats) -> float:
    """The largest bias that forbids nothing, whatever its sign."""
    low, high = float(biases.min()), float(biases.max())
    if high == np.inf:
        high = float(biases.max(where=biases < np.inf, initial=0.0))
    return max(abs(low), abs(high))
