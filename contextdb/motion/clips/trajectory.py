"""The path of a body over the ground: where it is and which way it faces, in frames, seconds and metres along the path.

A ground position is (x, z) in metres. A heading is an angle in radians: 0 faces +z, and it grows towards +x, which is to the left.
Headings are unwrapped: they go on past π, so that blending two neighbours never turns the long way round.

In the body's own frame the first coordinate is metres to its left, the second metres ahead.

Q paths of F frames.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from contextdb.cells.arguments import require_kind, require_many_of, require_pair, require_real, require_text
from contextdb.errors import Fault, QueryError
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.poses import LEAST_RATE, MOST_RATE, Poses
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.records import quickly_made

MOST_SMOOTH_S = MOST_REACH_S = 3600.0
"""An hour: more is a slip."""
STANDING_MPS = 0.05
"""Slower than this at its end, a path is taken to end there; faster, to go straight on."""
FASTEST_MPS = 15.0
"""A body does not go faster."""
JUMP_RATIO = 4.0
NEAR_STEPS = 3
"""Where it does, and more so many times faster than it mostly goes so many frames before and behind, it is put elsewhere."""
LEAST_DEVIATION = 0.1
"""In frames: under a narrower Gaussian the neighbours' weight is lost in rounding."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A path: `rate` frames a second.

    Attributes
    ----------
    rate : float
        Frames a second.
    positions : float64 array, shape (F, 2)
        On the ground, metres.
    headings : float64 array, shape (F,)
        Radians, unwrapped.
    now : int
        The frame that counts as time 0, for a path that a game wishes for.
    """

    rate: float
    positions: Floats
    headings: Floats
    now: int = 0

    @cached_property
    def velocities(self) -> Floats:
        """Metres a second over the ground: [F, 2]; central differences, one-sided at the ends."""
        return rates_of_change(self.positions, self.rate)

    @cached_property
    def lengths(self) -> Floats:
        """Metres along the path from its first frame: [F]."""
        steps = np.linalg.norm(np.diff(self.positions, axis=0), axis=-1)
        return np.concatenate(([0.0], np.cumsum(steps)))


@dataclass(frozen=True, eq=False)
class PathPoints:
    """What a path is at some points: positions [N, 2], headings [N], velocities [N, 2]."""

    positions: Floats
    headings: Floats
    velocities: Floats


def root_trajectory(
    poses: Poses, root: str | None = None, facing: tuple[str, str] | None = None, facing_smooth_s: float = 0.0
) -> Trajectory:
    """The path of a body: its hips put on the ground, facing at right angles to the line from its right to its left thigh.

    Parameters
    ----------
    poses : Poses
        With at least one frame.
    root : str, optional
        The bone whose place counts. Default: the one above both thighs.
    facing : (left bone, right bone), optional
        The line to face across. Default: the sided pair of bones nearest the root. A skeleton without sides faces where its root
        bone's own z axis points.
    facing_smooth_s : float
        The standard deviation, in seconds, of a Gaussian over the headings of each frame's neighbours on both sides alike: it evens
        out the sway of each step and delays no turn, but begins and ends one sooner and later. Default: 0, none.

    Raises
    ------
    MotionError
        The skeleton has no such bone.
    ContextError
        `poses` are none, `facing` is no pair, or `facing_smooth_s` no number from 0 up.
    """
    require_kind(poses, Poses, "poses", "Poses")
    if facing is not None:
        require_pair(facing, "facing", "the names of two bones, left and right")
    if root is not None:
        require_text(root, "root")
    require_real(facing_smooth_s, "facing_smooth_s", 0.0, MOST_SMOOTH_S)
    skeleton = poses.skeleton
    hips = skeleton.hips if root is None else skeleton.index(root)
    pair = skeleton.facing_pair if facing is None else (skeleton.index(facing[0]), skeleton.index(facing[1]))
    if pair is None:
        ahead = quaternions.rotate(poses.rotations[:, hips], np.array([0.0, 0.0, 1.0]))[:, [0, 2]]
    else:
        ahead = ahead_of(poses, pair)
    headings = smoothed(headings_of(ahead), facing_smooth_s * poses.rate)
    return Trajectory(poses.rate, poses.positions[:, hips][:, [0, 2]], headings)


def steady_path(
    speed_mps: float, turn_dps: float = 0.0, *, strafe_deg: float = 0.0, reach_s: float = 2.0, rate: float = 30.0
) -> Trajectory:
    """A path at one speed and one rate of turning, through the origin facing ahead at time 0, as far back as ahead.

    Parameters
    ----------
    speed_mps : float
        Metres a second over the ground.
    turn_dps : float
        Degrees a second, positive to the left.
    strafe_deg : float
        Direction of travel against the facing, positive to the left: 0 walks ahead, 180 backwards.
    reach_s : float
        Seconds before and after time 0.
    rate : float
        Frames a second.

    Raises
    ------
    ContextError
        One of them is no finite number, or `rate` is not above 0.
    """
    speed_mps, turn_dps = require_real(speed_mps, "speed_mps"), require_real(turn_dps, "turn_dps")
    strafe_deg = require_real(strafe_deg, "strafe_deg")
    rate, reach_s = require_real(rate, "rate", LEAST_RATE, MOST_RATE), require_real(reach_s, "reach_s", 0.0, MOST_REACH_S)
    now = round(reach_s * rate)
    seconds = (np.arange(2 * now + 1) - now) / rate
    headings = np.deg2rad(turn_dps) * seconds
    # The mean velocity over [0, t] on a circle points half the turn ahead, shortened by sinc; np.sinc(x) is sin(πx)/(πx).
    chords = speed_mps * seconds * np.sinc(headings / 2.0 / np.pi)
    positions = chords[:, None] * heading_vectors(headings / 2.0 + np.deg2rad(strafe_deg))
    return Trajectory(rate, positions, headings, now)


def after_seconds(path: Trajectory, frames: Floats, seconds: float) -> PathPoints:
    """The path some seconds after (or, negative, before) each of `frames`.

    Beyond its ends a path goes straight on at its last velocity and heading.
    """
    return _at_frames(path, frames + seconds * path.rate)


def along_path(path: Trajectory, frames: Floats, metres: float) -> PathPoints:
    """The path some metres further along (or, negative, back) from each of `frames`.

    Beyond its ends a path goes straight on if it was moving there. One that ended standing has no points further on: its end
    counts.
    """
    lengths = path.lengths
    every = np.arange(len(lengths), dtype=np.float64)
    wanted = np.interp(frames, every, lengths) + metres
    inside = np.interp(wanted, lengths, every)
    beyond = np.clip(wanted - lengths[-1], 0.0, None), np.clip(wanted, None, 0.0)
    if metres == 0.0:  # where a body stands, many frames have one length
        inside = frames
    first, last = (np.linalg.norm(path.velocities[i]) for i in (0, -1))
    after = beyond[0] * path.rate / last if last > STANDING_MPS else 0.0
    before = beyond[1] * path.rate / first if first > STANDING_MPS else 0.0
    return _at_frames(path, inside + after + before)


def heading_vectors(headings: Floats) -> Floats:
    """Unit vectors on the ground, (sin, cos): [...] radians to [..., 2]."""
    return np.stack((np.sin(headings), np.cos(headings)), axis=-1)


def to_own_frame(vectors: Floats, headings: Floats) -> Floats:
    """Ground vectors [..., 2] as (metres to the left, metres ahead) of bodies with the given headings [...]."""
    sines, cosines = np.sin(headings), np.cos(headings)
    x, z = vectors[..., 0], vectors[..., 1]
    return np.stack((cosines * x - sines * z, sines * x + cosines * z), axis=-1)


def smoothed(values: Floats, deviation: float) -> Floats:
    """Values [F] under a Gaussian of a standard deviation in frames: even about each frame, so that nothing is delayed.

    At the ends the values are taken to go on as they came, turned about the end point, so that a steady change stays what it is.
    """
    if deviation < LEAST_DEVIATION or len(values) < 2:
        return values
    reach = math.ceil(3.0 * deviation)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / deviation) ** 2)
    return np.convolve(np.pad(values, reach, mode="reflect", reflect_type="odd"), weights / weights.sum(), mode="valid")


def rates_of_change(values: Floats, rate: float) -> Floats:
    """Change a second of values [F, ...]: central differences, one-sided at the ends, 0 for a single frame."""
    if len(values) < 2:
        return np.zeros_like(values)
    return np.asarray(np.gradient(values, 1.0 / rate, axis=0))


def unbroken(path: Trajectory) -> list[slice]:
    """The frames of each part of a path, in order: between two parts the body is put elsewhere, as behind a pose of reference."""
    speeds = np.linalg.norm(np.diff(path.positions, axis=0), axis=-1) * path.rate
    cuts = [0]
    for step in np.flatnonzero(speeds > FASTEST_MPS).tolist():
        near = speeds[max(0, step - NEAR_STEPS) : step + NEAR_STEPS + 1]
        if speeds[step] > JUMP_RATIO * np.median(near):
            cuts.append(step + 1)
    return [slice(*ends) for ends in pairwise([*cuts, len(path.positions)])]


def _at_frames(path: Trajectory, frames: Floats) -> PathPoints:
    """The path at fractional frames, also before its first and behind its last."""
    last = len(path.headings) - 1
    inside = np.clip(frames, 0.0, float(last))
    beyond_s = (frames - inside) / path.rate
    velocities = _blended(path.velocities, inside)
    positions = _blended(path.positions, inside) + velocities * beyond_s[:, None]
    return PathPoints(positions, _blended(path.headings, inside), velocities)


def _blended(values: Floats, frames: Floats) -> Floats:
    """Values [F, ...] at fractional frames inside the path: [N, ...]."""
    before = np.minimum(frames.astype(np.int64), max(0, len(values) - 2))
    after = np.minimum(before + 1, len(values) - 1)
    shares = (frames - before).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(values[before] * (1.0 - shares) + values[after] * shares)


def ahead_of(poses: Poses, pair: tuple[int, int]) -> Floats:
    """At right angles to the line from a right to a left joint: ground vectors [F, 2]."""
    left = poses.positions[:, pair[0]] - poses.positions[:, pair[1]]
    return np.stack((-left[:, 2], left[:, 0]), axis=-1)


def headings_of(ahead: Floats) -> Floats:
    """Unwrapped headings of ground vectors [F, 2]; where one is too short to point anywhere, the last that did counts."""
    points = np.flatnonzero(np.linalg.norm(ahead, axis=-1) > 1e-6)
    if not len(points):
        return np.zeros(len(ahead))
    latest = points[np.maximum(np.searchsorted(points, np.arange(len(ahead)), side="right") - 1, 0)]
    return np.unwrap(np.arctan2(ahead[latest, 0], ahead[latest, 1]))


# ---- the paths of a crowd: as `contextdb.motion.clips.trajectory` has one, at one moment of each


@quickly_made
@dataclass(frozen=True, eq=False, slots=True)
class ManyTrajectories:
    """Paths of one rate and one length, with their present at one frame.

    Raises
    ------
    QueryError
        Shapes that do not fit each other, or a present outside the paths.
    """

    rate: float
    """Frames a second."""
    positions: Floats
    """On the ground, metres: float64 [Q, F, 2]."""
    headings: Floats
    """Radians, unwrapped: float64 [Q, F]."""
    now: int = 0
    """The frame that counts as time 0."""

    def __post_init__(self) -> None:
        shape = np.shape(self.headings)
        if len(shape) != 2 or np.shape(self.positions) != (*shape, 2) or not 0 <= self.now < shape[1]:
            problem = (
                f"positions of shape {np.shape(self.positions)} and headings of shape {shape}, with the present at {self.now}."
            )
            raise QueryError(Fault(problem, "(paths, frames, 2) and (paths, frames), and a present among the frames"))

    @classmethod
    def of(cls, paths: Sequence[Trajectory]) -> ManyTrajectories:
        """Single paths together; they have one rate, one length and one present."""
        paths = require_many_of(paths, Trajectory, "paths", "a list of Trajectory")
        if not paths:
            return cls(1.0, np.zeros((0, 1, 2)), np.zeros((0, 1)))
        first = paths[0]
        for i, path in enumerate(paths):
            if (path.rate, len(path.headings), path.now) != (first.rate, len(first.headings), first.now):
                problem = f"path {i} has {len(path.headings)} frames at {path.rate:g} a second and its present at {path.now}."
                accepted = f"as path 0: {len(first.headings)} frames at {first.rate:g} a second, the present at {first.now}"
                raise QueryError(Fault(problem, accepted))
        positions, headings = np.array([path.positions for path in paths]), np.array([path.headings for path in paths])
        return cls(first.rate, positions, headings, first.now)

    def __len__(self) -> int:
        return len(self.headings)

    def __getitem__(self, i: int) -> Trajectory:
        return Trajectory(self.rate, self.positions[i], self.headings[i], self.now)
