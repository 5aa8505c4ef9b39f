"""The search without numba: all frames by one product of matrices in float32, and the few that may be best in float64. What the
fast search is measured and tested against, what it falls back to where numba is missing, and where totals of candidates come from.

    Σ w (x - q)² = Σ w x² - 2 Σ w x q + Σ w q²,  x and q counted from the mean frame

One query of many frames is compared with groups of them first.

N frames, n of them in ranges, F features, Q queries, R ranges. Exact costs come from `contextdb.motion.search.cost`, masks and
biases from the same `Filter` as the fast search's.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.search import cost
from contextdb.motion.search.filters import Filter, Kinds
from contextdb.motion.search.groups import SIZE, Groups
from contextdb.motion.search.layout import Features, Layout
from contextdb.motion.search.many_filters import ManyFilters

UNIT = 6e-8
"""The greatest relative rounding error of one float32 operation."""
MOST = 1e36
"""Where totals may be larger, float32 may end: every frame is then scored in float64."""
AT_ONCE = 32
"""So many queries are multiplied at once."""
SMALL = 200_000
"""So few numbers are all multiplied: groups of them would spare less than they take."""
FEW = 3
"""The exact costs of so few frames are computed one by one."""
NOWHERE = np.empty(0, np.int64)
MOST_KINDS = 16
"""So many tag filters are kept as what they add to frames."""


class Added(NamedTuple):
    """What a filter adds, inf where no frame may be chosen: to places, to the products of places, and to those of groups at least.

    `least` is the least of these biases, and `largest` the largest that forbids nothing, whatever its sign.
    """

    biases: Features
    to_places: Features
    to_groups: Features
    least: float
    largest: float

    @classmethod
    def of(cls, biases: Features, groups: Groups, largest: float) -> Added:
        """From the biases of places."""
        of_groups = biases.reshape(-1, SIZE).min(axis=1)
        return cls(biases, biases + groups.squares, of_groups + groups.centre_squares, float(of_groups.min()), largest)


@dataclass(eq=False)
class Scan:
    """The frames of one database, ready for a product with queries. Made once, they take as much memory again as the features."""

    layout: Layout
    kinds: NDArray[np.integer]
    slices: tuple[slice, ...]
    weights: Floats
    small: int = SMALL
    _added: dict[int, tuple[Kinds, Added]] = field(default_factory=dict)

    def totals(self, query: Floats, chosen: Filter, frames: Ints) -> Floats:
        """Cost and bias of some frames, each in a range: float64 [len(frames)]."""
        if not len(frames):
            return np.empty(0)
        biases = chosen.range_biases[self.layout.ranges_of(frames)] + chosen.kinds.biases[self.kinds[frames]]
        if len(chosen.frame_biases):
            biases += chosen.frame_biases[frames]
        if chosen.current >= 0:
            biases[frames == chosen.playing(self.layout.frame_ranges, self.kinds)] += chosen.continuing
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

    def best(self, query: Floats, chosen: Filter) -> tuple[int, int, float]:
        """For one normalised query [F] the best frame's range, its number, -1 for none, and its total, inf for none."""
        plays = chosen.playing(self.layout.frame_ranges, self.kinds) if chosen.current >= 0 else -1
        if not len(self.layout.box_starts):
            return -1, -1, math.inf
        every, added = self._groups, self._added_of(chosen)
        point = (query - every.mean) * every.roots
        size = float(point @ point)
        error = self._rounded * (every.greatest + size + added.largest)
        if not (error < MOST * UNIT and _are_small(chosen)):
            frames = self._allowed(chosen)
            return self._best_of(frames[frames != plays], plays, query, chosen)
        narrow = point.astype(np.float32)
        biases = (chosen.range_biases if chosen.is_whole else np.where(chosen.ranges, chosen.range_biases, np.inf))[self._order]
        if every.points.size <= self.small:
            near, row = None, (every.points @ narrow).ravel()
            row += added.to_places
            row += biases.astype(np.float32).repeat(every.n_places)
        else:
            near = self._near_groups(narrow, size, biases, chosen.skips, plays, added, 2.0 * error)
            rows = every.products(near, narrow)
            rows += added.to_places.reshape(-1, SIZE).take(near, 0)
            rows += biases.astype(np.float32).take(every.ranges.take(near))[:, None]
            row = rows.ravel()
        if chosen.skips or plays >= 0:
            for start, stop in _spans(every.frames_of(near), chosen.skips, plays):
                row[start:stop] = np.inf
        best = row.min(initial=np.inf)
        places = (row <= best + error).nonzero()[0] if best < np.inf else NOWHERE
        if near is not None:
            places = SIZE * near[places // SIZE] + places % SIZE
        return self._best_of(every.frames[places], plays, query, chosen)

    def _near_groups(
        self, narrow: Features, size: float, biases: Floats, skips: Iterable[Skip], plays: int, added: Added, error: float
    ) -> Ints:
        """The groups, ascending, that may hold the best frame for a point; `biases` are those of ranges, in their order."""
        every = self._groups
        far = (narrow[None] @ every.centres).ravel()[: len(every.radii)]
        far += added.to_groups
        parts = [slice(start // SIZE, -(-stop // SIZE)) for start, stop in _spans(every.frames, skips, plays)]
        biased = far + biases.astype(np.float32).repeat(every.n_groups)
        for part in parts:
            biased[part] = np.inf  # a frame of it may be forbidden
        seed, best = int(biased.argmin()), math.inf
        if biased[seed] < math.inf:
            row = every.product(seed, narrow) + added.to_places[seed * SIZE : (seed + 1) * SIZE]
            best = float(row.min()) + float(biases[every.ranges[seed]])
        for part in parts:
            far[part] = -np.inf
        left = best + size + error - added.least - biases if best < math.inf else np.where(biases < np.inf, MOST, 0.0)
        reach = np.sqrt(np.maximum(left, 0.0)).astype(np.float32).repeat(every.n_groups)
        reach += every.radii
        reach *= reach
        reach += added.least - size
        return (far <= reach).nonzero()[0]

    def _best_of(self, frames: Ints, plays: int, query: Floats, chosen: Filter) -> tuple[int, int, float]:
        """What `best` gives of some frames that may be chosen, ascending, and of the one that plays on beside them, if not -1."""
        if len(frames) > FEW:
            frames = frames[[self.totals(query, chosen, frames).argmin()]]
        found = -1, -1, math.inf
        for frame in ([plays] if plays >= 0 else []) + frames.tolist():
            box, lane = self.layout.place_of(frame)
            own_range = int(self.layout.box_ranges[box])
            bias = float(chosen.range_biases[own_range]) + float(chosen.kinds.biases[self.kinds[frame]])
            if len(chosen.frame_biases):
                bias += float(chosen.frame_biases[frame])
            if frame == plays:
                bias += chosen.continuing
            total = cost.cost_of(self.layout, box, lane, query, self.slices, self._weights) + bias
            if total < found[2]:
                found = own_range, frame, total
        return found

    def least_of_many(self, queries: Floats, filters: ManyFilters) -> tuple[Ints, Ints, Floats]:
        """For each normalised query [Q, F] the best frame's range, its number, -1 for none, and its total, inf for none."""
        n = len(queries)
        ranges, frames, found = np.full(n, -1, np.int64), np.full(n, -1, np.int64), np.full(n, np.inf)
        if not n or not len(self.layout.box_starts):
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
        every, added = self._groups, self._added_of(filters.shared)
        wanted = (queries - every.mean) * every.roots
        sizes = np.einsum("qf,qf->q", wanted, wanted).tolist()
        largest = added.largest + _largest(filters.range_biases)
        of_ranges = self._added_to_ranges(filters)
        narrow, points = wanted.astype(np.float32), every.points.transpose(0, 2, 1)
        found: list[Ints] = []
        for i, size in enumerate(sizes):
            if i % AT_ONCE == 0:
                products = narrow[i : i + AT_ONCE] @ points
            scale = every.greatest + size + largest
            if not scale < MOST:
                found.append(self._allowed(filters.one(i)))
                continue
            row, plays = products[:, i % AT_ONCE].ravel(), int(playing[i])
            row += added.to_places
            if of_ranges is not None:
                row += of_ranges[i % len(of_ranges)].repeat(every.n_places)
            for start, stop in _spans(every.frames, filters.skips[i] if filters.skips else (), plays):
                row[start:stop] = np.inf
            best = row[row.argmin()]
            near = every.frames[(row <= best + self._rounded * scale).nonzero()[0]] if best < np.inf else every.frames[:0]
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

    def _added_of(self, shared: Filter) -> Added:
        """What a filter adds, whatever its ranges, skips and the frame that plays."""
        kinds, every = shared.kinds, self._groups
        if id(kinds) not in self._added:
            if len(self._added) >= MOST_KINDS:
                self._added.clear()
            own = np.where(kinds.allowed, kinds.biases, np.inf).astype(np.float32)[self.kinds[every.frames]]
            self._added[id(kinds)] = kinds, Added.of(own, every, _largest(kinds.biases))
        known = self._added[id(kinds)][1]
        if not len(shared.frames) and not len(shared.frame_biases):
            return known
        own, largest = known.biases.copy(), known.largest
        if len(shared.frames):
            own[~shared.frames[every.frames]] = np.inf
        if len(shared.frame_biases):
            own += shared.frame_biases[every.frames].astype(np.float32)
            largest += _largest(shared.frame_biases)
        return Added.of(own, every, largest)

    # ---- what does not change between searches

    @cached_property
    def _groups(self) -> Groups:
        return Groups.of(self.layout, cost.weights_of_features(self.slices, self.weights))

    @cached_property
    def _order(self) -> Ints | slice:
        """Takes what is given for each range in the order of their frames."""
        order = self.layout.range_order
        return slice(None) if np.array_equal(order, np.arange(len(self.layout.range_boxes))) else order

    @cached_property
    def _weights(self) -> list[float]:
        return list(self.weights.tolist())

    @cached_property
    def _rounded(self) -> float:
        """More than float32 may put two totals apart, of the greatest numbers in them."""
        return (4 * self.layout.n_features + 64) * UNIT


def _spans(frames: Ints, skips: Iterable[Skip], plays: int) -> list[tuple[int, int]]:
    """The places among some frames, ascending, that skips forbid, and those of the one that plays on, which is compared apart."""
    spans = [(skip.start, skip.stop) for skip in skips]
    if plays >= 0:
        spans.append((plays, plays + 1))
    return [tuple(frames.searchsorted(span).tolist()) for span in spans]


def _are_small(chosen: Filter) -> bool:
    """Whether float32 can hold the biases of ranges that forbid nothing."""
    biases = chosen.range_biases
    return chosen.least_of_ranges > -MOST and bool(biases.max(initial=0.0) < MOST or _largest(biases) < MOST)


def _largest(biases: Floats) -> float:
    """The largest bias that forbids nothing, whatever its sign."""
    low, high = float(biases.min()), float(biases.max())
    if high == np.inf:
        high = float(biases.max(where=biases < np.inf, initial=0.0))
    return max(abs(low), abs(high))
