"""When a foot touches the ground: while its heel or its toe rests on it.

    poses ─► heel and toe of each foot ─► where each is slow ─► stances, less those in the air

A point is slow against how fast it moves at its fastest within half a second: a runner's toe never rests as a walker's does. It is
no height above the ground that counts, which stairs have not, but how the point moves: a stance is a place from which it does not
sink further, and a foot that is held above the other one for as long as it is still is in the air.

F frames; places in metres, y up.

The last frame of a looping clip is the first of its next round. Each round continues where the one before ended, and faces as that
one did then: a clip that walks a quarter of a circle walks the whole of it in four.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips import quaternions
from contextdb.motion.clips.foot_bones import Foot
from contextdb.motion.clips.poses import Poses
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import Trajectory

Flags = NDArray[np.bool_]
Spans = list[tuple[int, int]]
"""First frame and the frame behind the last, ascending."""

SHORTEST_S = 0.07
"""A foot that rests or leaves the ground for less is taken not to: noise."""
SLOW_SHARE = 0.12
"""Of a point's top speed nearby: slower, it rests."""
FLAT_LESS_MPS = 0.2
"""A foot that stands flat is slower by so much than one that rests: held where it is, it does not pull at the leg."""
SLOWEST_MPS, FASTEST_MPS = 0.25, 0.8
"""Below the first every point rests, above the second none, whatever its top speed."""
NEARBY_S = 0.5
SPEED_S = 1.0 / 30.0
"""Speeds are measured over so long, so that the noise of capture at 120 frames a second makes none."""
SINKS_M, SINKS_S = 0.04, 0.15
"""A point that comes from so far below, so soon before it is slow, and sinks as far again had turned round in the air."""
RISES_M = 0.05
"""A foot whose heel and toe are this far above the lowest place of its stance is up, however slowly it rises."""
ABOVE_M = 0.1
"""A foot that is this far above the other one all the time is held up."""
HEEL_SHARE = 0.3
"""A heel is behind the ankle by this share of the way from ankle to toe."""


def ground_points(poses: Poses, foot: Foot) -> Floats:
    """Where heel and toe of a foot are: float64 [F, points, 3]; on a rig without a toe the ankle alone."""
    ankle = poses.positions[:, foot.joint]
    toe = _toe(poses, foot)
    if toe is None:
        return ankle[:, None] if foot.heel is None else poses.positions[:, [foot.heel, foot.joint]]
    heel = _heel(poses, foot, ankle, toe) if foot.heel is None else poses.positions[:, foot.heel]
    return np.stack((heel, toe), axis=1)


def stances(
    feet: tuple[Floats, Floats], rate: float, slowest_mps: float | None = None, *, flat: bool = False, rises_m: float = RISES_M
) -> tuple[Floats, Floats]:
    """When each of two feet is down, from the places [F, points, 3] of its heel and toe: seconds, float64 [n, 2] each.

    `slowest_mps` is the speed below which a point rests; by default it is a share of the speed of the point nearby.
    A foot that is `flat` rests on heel and toe at once. One that is `rises_m` above the lowest place of its stance is up.
    """
    n_frames = len(feet[0])
    if n_frames < 2:
        return np.zeros((n_frames, 2)), np.zeros((n_frames, 2))
    left, right = (points[:, :, 1].min(axis=1) for points in feet)
    intervals = [_foot_rests(points, rate, slowest_mps, flat) for points in feet]
    sides = (intervals[0], left, right), (intervals[1], right, left)
    return _seconds(_on_ground(*sides[0], rises_m), rate), _seconds(_on_ground(*sides[1], rises_m), rate)


# ---- heel and toe


def _toe(poses: Poses, foot: Foot) -> Floats | None:
    """The places of a toe: its joint, or where the foot's bone ends."""
    if foot.toe is not None:
        return poses.positions[:, foot.toe]
    ends = [np.array(end) for joint, end in poses.skeleton.end_sites if joint == foot.joint and any(end)]
    parent = int(poses.skeleton.parents[foot.joint])
    if not ends or parent < 0 or poses.n_frames == 0:
        return None
    shin = float(np.linalg.norm(poses.positions[0, foot.joint] - poses.positions[0, parent]))
    units = float(np.linalg.norm(poses.skeleton.offsets[foot.joint]))
    if units == 0.0:
        return None
    return poses.positions[:, foot.joint] + quaternions.rotate(poses.rotations[:, foot.joint], ends[0] * (shin / units))


def _heel(poses: Poses, foot: Foot, ankle: Floats, toe: Floats) -> Floats:
    """The places of the heel: a point of the foot's bone that is below and behind the ankle, as high as the toe, where the foot is
    flat."""
    rotations = poses.rotations[:, foot.joint]
    if len(ankle) < 2:
        return ankle
    speeds = _speeds(np.stack((ankle, toe), axis=1), poses.rate).max(axis=1)
    flat = np.flatnonzero(speeds <= max(SLOWEST_MPS / 2.0, float(speeds.min())))
    ahead = toe[flat] - ankle[flat]
    sole = np.stack((-HEEL_SHARE * ahead[:, 0], ahead[:, 1], -HEEL_SHARE * ahead[:, 2]), axis=-1)
    own = np.median(quaternions.rotate(quaternions.inverse(rotations[flat]), sole), axis=0)
    return ankle + quaternions.rotate(rotations, own)


# ---- when a point rests


def _foot_rests(points: Floats, rate: float, slowest_mps: float | None, flat: bool) -> Spans:
    """When a foot rests on heel or toe, or passes from one to the other."""
    each = [_rests(points[:, i], rate, slowest_mps, flat) for i in range(points.shape[1])]
    rests = np.logical_and.reduce(each) if flat else np.logical_or.reduce(each)
    shortest = SHORTEST_S * rate
    for first, stop in spans_of(~rests):
        if first > 0 and stop < len(rests) and stop - first < shortest:
            rests[first:stop] = True
    n = len(rests)  # a stance that the clip's ends cut may be short
    return [(first, stop) for first, stop in spans_of(rests) if stop - first >= shortest or first == 0 or stop == n]


def _rests(places: Floats, rate: float, slowest_mps: float | None, flat: bool) -> Flags:
    """Between which frames a point [F, 3] is slow, and not turning round in the air."""
    speeds = _speeds(places[:, None], rate)[:, 0]
    if slowest_mps is not None:
        slow = speeds <= slowest_mps
    else:
        top = _most_nearby(speeds, max(1, min(round(NEARBY_S * rate), len(speeds))))
        slow = speeds <= np.clip(SLOW_SHARE * top - (FLAT_LESS_MPS if flat else 0.0), SLOWEST_MPS, FASTEST_MPS)
    near = max(1, round(SINKS_S * rate))
    heights = places[:, 1]
    for first, stop in spans_of(slow):
        floor = heights[first : stop + 1].min() - SINKS_M
        sinks = heights[stop : stop + near + 1].min() < floor or stop == len(slow)
        if sinks and heights[max(0, first - near) : first + 1].min() < floor:
            slow[first:stop] = False
    return slow


def _speeds(points: Floats, rate: float) -> Floats:
    """How fast points [F, P, 3] move between each two frames, over about `SPEED_S`: [F - 1, P]."""
    n_frames = len(points)
    half = max(0, min(round(SPEED_S * rate) - 1, n_frames - 2)) / 2.0
    at = np.arange(n_frames - 1)
    before = np.maximum(at - int(np.ceil(half)), 0)
    after = np.minimum(at + 1 + int(np.floor(half)), n_frames - 1)
    long_s = ((after - before) / rate)[:, None]
    return np.asarray(np.linalg.norm(points[after] - points[before], axis=-1) / long_s)


def _most_nearby(values: Floats, reach: int) -> Floats:
    """The largest of the values [n] that are at most `reach` away."""
    most, width, span = np.pad(values, reach, mode="edge"), 2 * reach + 1, 1
    while 2 * span <= width:  # the largest of twice as many, from two halves side by side
        most, span = np.maximum(most[:-span], most[span:]), 2 * span
    rest = width - span
    return np.asarray(np.maximum(most[:-rest], most[rest:]) if rest else most)


def _on_ground(spans: Spans, own: Floats, other: Floats, rises_m: float) -> Spans:
    """The stances of a foot without what of them is in the air; `own` and `other` are the lowest heights of the two feet [F]."""
    low = np.zeros(len(own), np.bool_)
    for first, stop in spans:
        low[first : stop + 1] = own[first : stop + 1] <= own[first : stop + 1].min() + rises_m
    parts = [(a + first, b - 1 + first) for first, stop in spans for a, b in spans_of(low[first : stop + 1])]
    return [(a, b) for a, b in parts if (b > a) and (own - other)[a : b + 1].min() <= ABOVE_M]


def _seconds(spans: Spans, rate: float) -> Floats:
    return np.array(spans, np.float64).reshape(-1, 2) / rate


def spans_of(flags: Flags) -> Spans:
    """Where each run of True begins, and the index behind its end."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


# ---- a clip that loops, with what continues before and behind it: features at its ends then see the loop, and no end


def three_rounds(poses: Poses, path: Trajectory) -> tuple[Poses, slice]:
    """The poses of three rounds of a loop of at least one frame, and which frames of them are the middle round; `path` is the
    body's in these poses."""
    n_steps = poses.n_frames - 1
    turn = path.headings[-1] - path.headings[0]
    start, end = (np.array([x, 0.0, z]) for x, z in (path.positions[0], path.positions[-1]))
    before, after = _moved(poses, end, start, -turn), _moved(poses, start, end, turn)
    positions = np.concatenate((before.positions[:-1], poses.positions, after.positions[1:]))
    rotations = np.concatenate((before.rotations[:-1], poses.rotations, after.rotations[1:]))
    return Poses(poses.skeleton, poses.rate, positions, rotations), slice(n_steps, 2 * n_steps + 1)


def _moved(poses: Poses, origin: Floats, target: Floats, turn: float) -> Poses:
    """The poses turned about the upright axis through one place, and taken to another."""
    rotation = np.array([np.cos(turn / 2.0), 0.0, np.sin(turn / 2.0), 0.0])
    positions = quaternions.rotate(rotation, poses.positions - origin) + target
    return Poses(poses.skeleton, poses.rate, positions, quaternions.multiply(rotation, poses.rotations))
