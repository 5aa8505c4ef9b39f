"""Where a clip goes and how fast: means about each frame, for a body sways with each step, and so does the way it faces.

The speed is the mean of half a second, about one step; the way and the facing are those of a second, about two. N frames.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.clips.trajectory import to_own_frame

SPEED_S, WAY_S = 0.25, 0.5
"""So many seconds before and behind a frame."""
LEAST_M = 1e-9


def travels(root: NDArray[np.floating], starts: Ints, stops: Ints, looping: NDArray[np.bool_], rate: float) -> Floats:
    """Metres a second to the left and ahead of the mean facing, and by how many radians the facing differs from the mean: [N, 3],
    of roots [N, 3]: x, z and heading."""
    found = np.zeros((len(root), 3))
    short, long = (max(1, round(seconds * rate)) for seconds in (SPEED_S, WAY_S))
    for start, stop, loops in zip(starts.tolist(), stops.tolist(), looping.tolist(), strict=True):
        n = stop - start
        if n < 2:
            continue
        laps = math.ceil(long / (n - 1)) if loops else 0
        path = laps_about(np.asarray(root[start:stop], np.float64), laps)
        frames = np.arange(n) + laps * (n - 1)
        speeds = np.linalg.norm(_ways(path, frames, short), axis=-1) * rate
        ways = _ways(path, frames, long)
        mean = _mean(path[:, 2], frames, long)
        own = to_own_frame(ways / np.maximum(np.linalg.norm(ways, axis=-1), LEAST_M)[:, None], mean)
        found[start:stop] = np.column_stack((own * speeds[:, None], path[frames, 2] - mean))
    return found


def laps_about(path: Floats, laps: int) -> Floats:
    """The path [n, 3] of a loop with some laps before it and behind it; without laps the path as it is."""
    if not laps:
        return path
    steps = to_own_frame(np.diff(path[:, :2], axis=0), path[:-1, 2])
    turns = np.tile(np.diff(path[:, 2]), 2 * laps + 1)
    headings = np.concatenate(([0.0], np.cumsum(turns)))
    over = to_own_frame(np.tile(steps, (2 * laps + 1, 1)), -headings[:-1])
    return np.column_stack((np.concatenate((np.zeros((1, 2)), np.cumsum(over, axis=0))), headings))


def _ways(path: Floats, frames: Ints, reach: int) -> Floats:
    """How far each frame's neighbours are apart, a frame: [n, 2]."""
    low, high = np.maximum(frames - reach, 0), np.minimum(frames + reach, len(path) - 1)
    return np.asarray((path[high, :2] - path[low, :2]) / (high - low)[:, None])


def _mean(values: Floats, frames: Ints, reach: int) -> Floats:
    """The mean from a frame's one neighbour to the other, [n]: by trapezes, so that a whole period has the mean that it has."""
    low, high = np.maximum(frames - reach, 0), np.minimum(frames + reach, len(values) - 1)
    summed = np.concatenate(([0.0], np.cumsum((values[1:] + values[:-1]) / 2.0)))
    return np.asarray((summed[high] - summed[low]) / (high - low))
