"""The search without boxes and without numba: every frame's total. What the fast search is measured and tested against, what it
falls back to where numba is missing, and where candidates and reasons come from.

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
) -> None:
    """Fill `bests` and `best_frames` with the lowest total and its frame, as `kernels.search` does: one, or one for each range."""
    why = chosen.why(layout.frame_ranges, kinds)
    frames = np.flatnonzero(why == LeftOut.NO)
    found = totals(layout, query, slices, weights, chosen, kinds, frames)
    near = (found <= within) & (found < np.inf)
    frames, found = frames[near], found[near]
    slots = np.zeros(len(frames), np.int64) if len(bests) == 1 else layout.frame_ranges[frames]
    order = np.lexsort((frames, frames != chosen.playing(layout.frame_ranges, kinds), found, slots))
    first = np.unique(slots[order], return_index=True)[1]
    bests[:], best_frames[:] = within, -1
    bests[slots[order][first]] = found[order][first]
    best_frames[slots[order][first]] = frames[order][first]
