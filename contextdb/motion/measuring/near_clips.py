"""Clips that lie within a bar of another clip, so that they add little: near-duplicates.

Of a clip some frames a second are compared with every frame of every other clip, mirrored ones too, at the cost of a search without
biases. What 95 % of them cost at most, each with the nearest frame of one other clip, says how far the clip lies from that clip.
Of the permutations of a clip the first is compared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.ranges import frames_between
from contextdb.motion.search.cost import weights_of_features
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.layout import Features

NEAR_COST = 0.02
"""A clip of which 95 % of the frames cost no more with another clip is near it; frames that have nothing in common cost about 2."""
PERCENTILE = 95.0
PLACES = 4
"""Costs are told with so many places: further ones depend on how a machine adds up, and would choose among equally near clips."""
EVERY_S = 0.2
"""A frame is compared of each so many seconds."""


@dataclass(frozen=True)
class Near:
    """A clip and the one that it lies nearest to."""

    asset: str
    other: str
    is_mirrored: bool
    """Whether it is the other one mirrored that is near."""
    cost: float
    """What 95 % of its frames cost at most with the nearest frame of the other."""

    def to_json(self) -> dict[str, object]:
        return {"asset": self.asset, "other": self.other, "mirrored": self.is_mirrored, "cost": self.cost}


Tell = Callable[[int, int, str], None]


def near_clips(database: MotionDatabase, most: float = NEAR_COST, progress: Tell | None = None) -> list[Near]:
    """The clips that lie within a cost of another, the nearest first; of two that lie within each other both are there."""
    firsts = np.arange(0, len(database.starts), database.n_permutations)
    filled = firsts[database.stops[firsts] > database.starts[firsts]]
    if database.schema is None or not len(filled):
        return []
    starts, stops = database.starts[filled], database.stops[filled]
    weights = weights_of_features(database.slices, database.cost_weights)
    frames = np.asarray(database.features[frames_between(starts, stops)] * np.sqrt(weights), np.float32)
    first = np.cumsum(stops - starts) - (stops - starts)
    squares = (frames * frames).sum(axis=1)
    step = max(1, round(EVERY_S * database.schema.rate))
    plain = [at for at, number in enumerate(filled.tolist()) if not database.mirrored[number]]
    pairs = []
    for done, at in enumerate(plain, 1):
        asset = database.assets[filled[at]]
        sampled = frames[first[at] : first[at] + stops[at] - starts[at] : step]
        far = np.round(np.percentile(_least_costs(sampled, frames, squares, first), PERCENTILE, axis=0), PLACES)
        far[[database.assets[number] == asset for number in filled.tolist()]] = np.inf
        best = int(np.argmin(far))
        if far[best] <= most:
            other = int(filled[best])
            pairs.append(Near(asset, database.assets[other], bool(database.mirrored[other]), float(far[best])))
        if progress is not None:
            progress(done, len(plain), asset)
    return sorted(pairs, key=lambda near: (near.cost, near.asset))


def _least_costs(queries: Features, frames: Features, squares: Features, first: Ints) -> Features:
    """What each asked frame [A, F] costs with the nearest of each range, of frames [N, F] whose ranges begin at `first`: [A, R]."""
    costs = queries @ frames.T
    costs *= -2.0
    costs += squares
    least = np.minimum.reduceat(costs, first, axis=1) + (queries * queries).sum(axis=1)[:, None]
    return np.asarray(np.maximum(least, 0.0), np.float32)
