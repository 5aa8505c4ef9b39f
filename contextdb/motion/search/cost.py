"""The cost of frames against a query, by channel. The choice and its explanation both come from here.

C channels. Features are float32, costs float64, and every frame's sum is made in the same order, so that equal frames have equal
costs to the last bit and a tie is a tie.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.search.layout import Layout

FRAMES_AT_ONCE = 8192
"""Frames are gathered in blocks of this many, so that memory stays small and a block stays in the processor's cache."""

FEW = 64
"""Of so few frames the sums are made in one go, with what comes before the last thrown away."""


def channel_costs(layout: Layout, frames: Ints, query: Floats, slices: Sequence[slice], weights: Floats) -> Floats:
    """Each channel's weight times its squared differences: [C, len(frames)]; `query` is normalised, [F] or one for each frame."""
    block = layout.take(frames).T.astype(np.float64, order="C")
    block -= np.atleast_2d(query).T
    block *= block
    costs = np.empty((len(weights), len(frames)))
    for row, columns, weight in zip(costs, slices, weights.tolist(), strict=True):
        np.multiply(_sum(block[columns]), weight, out=row)
    return costs


def costs(layout: Layout, frames: Ints, query: Floats, slices: Sequence[slice], weights: Floats) -> Floats:
    """The cost of each frame without its bias: [len(frames)]; `query` as in `channel_costs`."""
    total = np.empty(len(frames))
    for start in range(0, len(frames), FRAMES_AT_ONCE):
        block = slice(start, start + FRAMES_AT_ONCE)
        own = query[block] if query.ndim == 2 else query
        total[block] = _sum(channel_costs(layout, frames[block], own, slices, weights))
    return total


def _sum(rows: Floats) -> Floats:
    """The sum of rows [n, F], added one by one: numpy's own sum may choose another order for another F."""
    if len(rows) and rows.shape[1] <= FEW:
        return rows[0] if len(rows) == 1 else np.asarray(np.add.accumulate(rows, 0)[-1])
    total = np.zeros(rows.shape[1])
    for row in rows:
        total += row
    return total


def shares_of(slices: Sequence[slice], weights: Floats) -> Floats:
    """The weights [C] divided by the sum of weight x features over all channels: with them a cost is a weighted mean."""
    relative = weights / weights.max()
    return np.asarray(relative / weights_of_features(slices, relative).sum())


def weights_of_features(slices: Sequence[slice], weights: Floats) -> Floats:
    """The weight of each feature, from that of its channel: float64 [F]."""
    return np.repeat(weights, [columns.stop - columns.start for columns in slices])
