"""What it would cost to play on: the cost of one frame in a search, to the last bit what the search itself makes of it."""

from __future__ import annotations

import math

import numpy as np

from contextdb.motion import arguments, cost
from contextdb.motion.database import MotionDatabase
from contextdb.motion.filters import Filter
from contextdb.motion.quaternions import Floats


def continuing_cost(database: MotionDatabase, query: Floats, chosen: Filter) -> float | None:
    """The cost of a filter's current frame, the continuing bias in it; None when there is none or it may not play on.

    Parameters
    ----------
    query : float64 array, shape (F,)
        In the schema's units.
    chosen : Filter
        Made by `database.filter` with the current frame.
    """
    frame = chosen.current
    at = database.range_of(frame) if frame >= 0 else -1
    if at < 0 or not chosen.ranges[at] or (len(chosen.frames) and not chosen.frames[frame]):
        return None
    kind = int(database.marks.kinds[frame])
    if not chosen.kinds.playable[kind]:
        return None
    bias = float(chosen.range_biases[at] + chosen.kinds.biases[kind])
    if len(chosen.frame_biases):
        bias += float(chosen.frame_biases[frame])
    wanted = database.normalisation.apply(arguments.query_of(query, database.feature_names))
    found = float(cost.costs(database.layout, np.array([frame]), wanted, database.slices, database.weights)[0])
    total = found + (bias + chosen.continuing)
    return total if total < math.inf else None
