"""Legs of a rig, and where their feet come down next.

For each frame of a bank and each foot: how far the foot is through its swing, from 0 where it is down to 1 where it comes down, and
where it will come down, seen from the body in that frame. A foot that comes down no more in its clip ends where the clip leaves it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips import quaternions
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.clips.trajectory import to_own_frame

Flags = NDArray[np.bool_]

LEAST_BEND, LEFT = 1e-3, np.array([1.0, 0.0, 0.0])
"""A knee whose sine is less on the mean does not bend."""


@dataclass(frozen=True, eq=False, slots=True)
class Leg:
    """Hip, knee and ankle [3], and the joint that stands: the toe, or the ankle."""

    joints: Ints
    toe: int


def leg_of(rig: Skeleton, foot: str) -> Leg | None:
    """The leg of a foot; None where it has no hip and knee of its own."""
    ankle = rig.index(foot)
    above = rig.ancestors(ankle)
    if len(above) < 3:
        return None
    below = [joint for joint in range(rig.n_joints) if rig.parents[joint] == ankle]
    toes = [joint for joint in below if "toe" in rig.names[joint].casefold() or "ball" in rig.names[joint].casefold()]
    return Leg(np.array([above[1], above[0], ankle], np.int64), (toes or [ankle])[0])


def hinge_of(rig: Skeleton, leg: Ints, knees: Floats) -> Floats:
    """The axis that a knee bends about, against its hip [3]: the mean of poses, of whose knees the rotations are [N, 4].

    Of a knee that never bends the axis to the left.
    """
    thigh, shin = rig.offsets[leg[1]], rig.offsets[leg[2]]
    axis = np.cross(thigh, quaternions.rotate(knees, np.broadcast_to(shin, (len(knees), 3)))).mean(axis=0)
    size = float(np.linalg.norm(axis))
    return np.asarray(axis / size) if size > LEAST_BEND * np.linalg.norm(thigh) * np.linalg.norm(shin) else LEFT


def legs_of(rig: Skeleton, feet: Sequence[str]) -> Ints:
    """The hip, knee, ankle and what stands of each foot, all -1 for one without a leg: [F, 4]."""
    legs = [leg_of(rig, foot) for foot in feet]
    return np.array([[-1] * 4 if leg is None else [*leg.joints.tolist(), leg.toe] for leg in legs], np.int64).reshape(-1, 4)


def hinges_of(rig: Skeleton, legs: Ints, rotations: NDArray[np.floating]) -> Floats:
    """The axis that the knee of each leg bends about in some poses, whose rotations are [N, J, 4]: [F, 3]."""
    each = [LEFT if leg[0] < 0 else hinge_of(rig, leg[:3], rotations[:, leg[1]].astype(np.float64)) for leg in legs]
    return np.array(each, np.float64).reshape(-1, 3)


def steps_of(root: NDArray[np.floating], toes: Floats, contacts: Flags, spans: Sequence[tuple[int, int, bool]]) -> Floats:
    """Share of the swing, and metres to the left and ahead to where the foot comes down: float64 [N, n feet, 3].

    `root` [N, 3], `toes` against it [N, n feet, 3], which feet are down [N, n feet], and the first frame of each range, its
    steps to the last, and whether it loops.
    """
    steps = np.zeros(toes.shape)
    for start, n_steps, loops in spans:
        part = slice(start, start + n_steps + 1)
        for foot in range(toes.shape[1]):
            steps[part, foot] = _steps(np.asarray(root[part], np.float64), toes[part, foot], contacts[part, foot], loops)
    return steps


def _steps(root: Floats, toes: Floats, is_down: Flags, loops: bool) -> Floats:
    """Of one foot in one range: [n, 3]."""
    n, laps = len(root), int(loops and len(root) > 1)
    path, period = laps_about(root, laps), max(len(root) - 1, 1)
    frames = np.arange(len(path))
    around = frames % period if laps else frames
    down = is_down[around]
    sin, cos = np.sin(path[:, 2]), np.cos(path[:, 2])
    left, ahead = toes[around, 0], toes[around, 2]
    places = path[:, :2] + np.column_stack((cos * left + sin * ahead, cos * ahead - sin * left))
    last = np.maximum.accumulate(np.where(down, frames, 0))
    following = np.minimum.accumulate(np.where(down, frames, len(path) - 1)[::-1])[::-1]
    shares = (frames - last) / np.maximum(following - last, 1)
    own = slice(laps * period, laps * period + n)
    ways = to_own_frame(places[following[own]] - path[own, :2], path[own, 2])
    return np.column_stack((np.where(down[own], 0.0, shares[own]), ways))


def eased(share: float) -> float:
    """From 0 to 1 without a step in the change: 3 s² - 2 s³."""
    share = min(max(share, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


# ---- where a clip goes and how fast: means about each frame, as a body sways with each step, and so does its facing


SPEED_S, WAY_S = 0.25, 0.5
"""So many seconds before and behind a frame."""
LEAST_M = 1e-9


def travels(root: NDArray[np.floating], starts: Ints, stops: Ints, looping: NDArray[np.bool_], rate: float) -> Floats:
    """Metres a second to the left and ahead of the mean facing, and by how many radians the facing differs from the mean: [N, 3],
    of roots [N, 3]: x, z and heading."""
    travelled = np.zeros((len(root), 3))
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
        travelled[start:stop] = np.column_stack((own * speeds[:, None], path[frames, 2] - mean))
    return travelled


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
