"""What it would cost to play on: the cost of one frame in a search, to the last bit what the search itself makes of it."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Filter


def continuing_cost(database: MotionDatabase, query: Floats, chosen: Filter) -> float | None:
    """The cost of the current frame of a filter that `database.filter` made with it, the continuing bias in it; None when there is
    none or it may not play on. `query` float64 [F] is checked, and in the schema's units."""
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
    wanted = database.normalisation.apply(query)
    total = _cost(database, frame, wanted) + (bias + chosen.continuing)
    return total if total < math.inf else None


def _cost(database: MotionDatabase, frame: int, query: Floats) -> float:
    """The cost of one frame for a normalised query: the sums of `search.cost`, in their order, without their arrays."""
    values, wanted = database.layout.take(np.array([frame]))[0].tolist(), query.tolist()
    squares = [(value - want) * (value - want) for value, want in zip(values, wanted, strict=True)]
    return _sum(
        weight * _sum(squares[columns]) for columns, weight in zip(database.slices, database.cost_weights.tolist(), strict=True)
    )


def _sum(values: Iterable[float]) -> float:
    """A sum added one by one, each step rounded: Python's own keeps what is rounded away, from 3.12 on."""
    total = 0.0
    for value in values:
        total += value
    return total
