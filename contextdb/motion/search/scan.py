"""The search without numba: the totals of frames, of every one or of those whose box may hold the best. What the fast search is
measured and tested against, what it falls back to where numba is missing, and where candidates and reasons come from.

N frames, R ranges. Costs come from `contextdb.motion.search.cost`, masks and biases from the same `Filter` as the fast search's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search import cost
from contextdb.motion.search.filters import Filter
from contextdb.motion.search.layout import Layout

MANY = 512
"""Of so many frames and fewer the totals are worked out at once, without a look at their boxes."""
SEEDS = 32
"""So many frames, those of the lowest bounds, are compared first."""
ROUNDED = 1e-12
"""More than rounding can take away from a bound, or add to a total, of its size."""


def totals(
    layout: Layout,
    query: Floats,
    slices: tuple[slice, ...],
    weights: Floats,
    chosen: Filter,
    kinds: NDArray[np.integer],
    frames: Ints,
) -> Floats:
    """Cost and bias of some frames, each in a range: float64 [len(frames)]; `kinds` is the kind of every frame."""
    if not len(frames):
        return np.empty(0)
    biases = chosen.biases(layout.frame_ranges, kinds)[frames]
    return np.asarray(cost.costs(layout, frames, query, slices, weights) + biases)


def least(
    layout: Layout,
    query: Floats,
    slices: tuple[slice, ...],
    weights: Floats,
    chosen: Filter,
    kinds: NDArray[np.integer],
    within: float,
    bests: Floats,
    best_frames: Ints,
    many: int = MANY,
) -> None:
    """Fill `bests` and `best_frames` with the lowest total and its frame, as `kernels.search` does: one, or one for each range.

    Of more than `many` frames, those whose box cannot hold the best are left out first.
    """
    why = chosen.why(layout.frame_ranges, kinds)
    frames = np.flatnonzero(why == LeftOut.NO)
    if len(frames) > many and (len(bests) == 1 or within < np.inf):
        frames = _near(layout, query, slices, weights, chosen, kinds, frames, within)
    found = totals(layout, query, slices, weights, chosen, kinds, frames)
    near = (found <= within) & (found < np.inf)
    frames, found = frames[near], found[near]
    slots = np.zeros(len(frames), np.int64) if len(bests) == 1 else layout.frame_ranges[frames]
    order = np.lexsort((frames, frames != chosen.playing(layout.frame_ranges, kinds), found, slots))
    first = np.unique(slots[order], return_index=True)[1]
    bests[:], best_frames[:] = within, -1
    bests[slots[order][first]] = found[order][first]
    best_frames[slots[order][first]] = frames[order][first]


def _near(
    layout: Layout,
    query: Floats,
    slices: tuple[slice, ...],
    weights: Floats,
    chosen: Filter,
    kinds: NDArray[np.integer],
    frames: Ints,
    within: float,
) -> Ints:
    """Of some frames those whose total may be the lowest of all, or at most `within`, by the bounds of their boxes."""
    biases = chosen.biases(layout.frame_ranges, kinds)[frames]
    bounds = _bounds(layout, query, cost.weights_of_features(slices, weights))[layout.frame_boxes[frames]]
    lowest = bounds * (1.0 - ROUNDED) + biases - ROUNDED * np.abs(biases)
    if within == np.inf:
        seeds = frames[np.argpartition(lowest, min(SEEDS, len(frames) - 1))[:SEEDS]]
        within = float(totals(layout, query, slices, weights, chosen, kinds, seeds).min())
    return np.asarray(frames[lowest <= within + ROUNDED * abs(within)])


def _bounds(layout: Layout, query: Floats, feature_weights: Floats) -> Floats:
    """What the frames of each box cost at least, without their biases: float64 [B]."""
    wanted = query[layout.order][:, None]
    apart = np.maximum(layout.lows - wanted, wanted - layout.highs)
    np.maximum(apart, 0.0, out=apart)
    apart *= apart
    found = np.einsum("gfl,f->gl", apart, feature_weights[layout.order])
    return np.asarray(found.reshape(-1)[: len(layout.box_starts)])
