"""Clips that run on the spot: how the body would move if its standing feet stood, and the same clip with that motion.

A foot that stands moves against the hips as the ground under a treadmill does: where the hips stay and the ground goes by, the
body's speed is the other way round; a ground that turns under it is a body that turns. The motion may change: it is taken to be a
line between moments `KNOT_S` apart that bends little, fitted to all standing toes. Metres, seconds, y up; F frames; a body that
faces +z has its left at +x.

Source: the fit is one of least squares with weights that leave out what does not fit, Huber 1964.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from contextdb.errors import MotionError
from contextdb.motion.clips import joint_arrays, quaternions
from contextdb.motion.clips.clip import CENTIMETRE, Clip
from contextdb.motion.clips.foot_bones import UNDECLARED, FootBones
from contextdb.motion.clips.poses import Poses, local_poses, poses_of
from contextdb.motion.clips.quaternions import Floats

LEAST_MPS = 0.3
"""A ground that goes by more slowly is a foot that slides."""
LOW_M, STILL_MPS = 0.02, 0.15
"""A toe stands that is at most so much above its lowest place, and moves up or down at most so fast."""
FEWEST = 2
"""Frames in which each foot stands, from which a motion is taken."""
STAYS = 0.25
"""Of the speed of the ground: hips that move slower than this stay."""
KNOT_S = 0.4
BENDS_MPS = 0.25
"""By so much, on the whole, a speed differs from the mean of those one knot before and behind."""
TOE_MPS = 0.1
"""How well a standing toe shows the speed of the ground."""
TURN_STEP_S = 0.1
TURN_S = 0.5
"""So long before and behind a moment feet show how the body turns: about a step of each."""
ROUNDS = 6


Shown = tuple[Floats, Floats, Floats, Floats]
"""What a toe shows where it stands: frames [n], places against the middle of the hips, velocities [n, 2], how fast it turns [n]."""


@dataclass(frozen=True, slots=True)
class GroundMotion:
    """How a body on the spot would move, as seen by it: metres a second along x and z [F, 2], and radians a second, positive to
    the left [F]."""

    velocities: Floats
    turns_radps: Floats

    @property
    def speed_mps(self) -> float:
        """The mean speed over the ground."""
        return float(np.linalg.norm(self.velocities, axis=1).mean())


def ground_motion(clip: Clip, feet: FootBones = UNDECLARED) -> GroundMotion | None:
    """How the body of a clip on the spot would move; None of a clip whose hips move along, or whose feet stand or are unknown."""
    if clip.n_frames < FEWEST:
        return None
    poses = poses_of(clip)
    try:
        toes = [foot.joint if foot.toe is None else foot.toe for foot in feet.feet_in(poses.skeleton)]
    except MotionError:
        return None
    hips = poses.positions[:, poses.skeleton.hips][:, [0, 2]]
    shown = list(_shown(poses, toes, hips))
    if min(len(frames) for frames, _, _, _ in shown) < FEWEST:
        return None
    if min(float(np.linalg.norm(speeds, axis=1).mean()) for _, _, speeds, _ in shown) < LEAST_MPS:
        return None
    motion = _fitted(shown, clip.n_frames, clip.rate)
    travel = float(np.linalg.norm(hips[-1] - hips[0])) / clip.duration_s
    return motion if travel < STAYS * motion.speed_mps else None


def _shown(poses: Poses, toes: list[int], hips: Floats) -> Iterator[Shown]:
    """What each toe shows."""
    middle = hips.mean(axis=0)
    for toe in toes:
        places = poses.positions[:, toe]
        speeds = np.gradient(places, 1.0 / poses.rate, axis=0)
        stands = (places[:, 1] < places[:, 1].min() + LOW_M) & (np.abs(speeds[:, 1]) < STILL_MPS)
        inside = np.flatnonzero(stands[1:-1] & stands[:-2] & stands[2:]) + 1  # where a foot comes or goes, it is not the ground's
        turned = quaternions.multiply(poses.rotations[inside + 1, toe], quaternions.inverse(poses.rotations[inside - 1, toe]))
        yaws = quaternions.rotation_vectors(turned)[..., 1] * poses.rate / 2.0
        yield inside.astype(np.float64), places[inside][:, [0, 2]] - middle, speeds[inside][:, [0, 2]], yaws


def _fitted(shown: Sequence[Shown], n_frames: int, rate: float) -> GroundMotion:
    """The motion that the ground under standing toes shows: its turn first, and with that its velocity."""
    n_knots = max(2, round((n_frames - 1) / rate / KNOT_S) + 1)
    every = np.linspace(0.0, n_knots - 1.0, n_frames)
    turns = _turns(shown, n_frames, rate)
    rows, grounds = [], []
    for frames, places, speeds, _ in shown:
        at, share = frames.astype(np.int64), 1.0 / np.sqrt(len(frames))  # both feet count alike
        rows.append(_blends(every[at], n_knots) * share)
        grounds.append(-(speeds + turns[at, None] * places[:, ::-1] * [1.0, -1.0]) * share)
    bends = np.diff(np.eye(n_knots), 2, axis=0) * (TOE_MPS / BENDS_MPS / np.sqrt(n_frames))
    matrix, target = np.concatenate((*rows, bends)), np.concatenate((*grounds, np.zeros((len(bends), 2))))
    sizes = np.concatenate([np.full(len(each), np.sqrt(len(each))) for each in rows])
    n, weights = len(sizes), np.ones(len(matrix))
    solution: Floats = np.zeros((n_knots, 2))
    for _ in range(ROUNDS):
        solution = np.asarray(np.linalg.lstsq(matrix * weights[:, None], target * weights[:, None], rcond=None)[0])
        apart = np.linalg.norm(matrix @ solution - target, axis=1)[:n] * sizes
        weights[:n] = 1.0 / np.sqrt(np.maximum(apart / TOE_MPS, 1.0))
    return GroundMotion(_blends(every, n_knots) @ solution, turns)


def _turns(shown: Sequence[Shown], n_frames: int, rate: float) -> Floats:
    """How fast the body turns in each frame [F]: the middle of what each foot shows about it, as steps twist feet either way."""
    every, reach = np.arange(n_frames), TURN_S * rate
    knots = every[:: max(1, round(TURN_STEP_S * rate))]
    feet = []
    for frames, _, _, yaws in shown:
        apart = np.abs(knots[:, None] - frames)
        near = apart <= np.maximum(reach, np.sort(apart, axis=1)[:, [FEWEST - 1]])
        feet.append([np.median(yaws[each]) for each in near])
    return -np.interp(every, knots, np.mean(feet, axis=0))


def _blends(at: Floats, n_knots: int) -> Floats:
    """How much of each knot is in the value at some moments, in knots: [N, n_knots]."""
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(at[:, None] - np.arange(n_knots))))


def by_feet(clip: Clip) -> Clip:
    """The clip with the motion of its standing feet, where it runs on the spot; else itself."""
    motion = ground_motion(clip)
    return clip if motion is None else with_ground_motion(clip, motion)


def with_ground_motion(clip: Clip, motion: GroundMotion) -> Clip:
    """The same clip, its root moved and turned as its body would move; in centimetres, y up."""
    local = local_poses(clip)
    hips = poses_of(clip).positions[:, clip.skeleton.hips].mean(axis=0) * [1.0, 0.0, 1.0]
    turns = quaternions.about_axis("y", _summed(motion.turns_radps, clip.rate))
    path = _summed(quaternions.rotate(turns, np.insert(motion.velocities, 1, 0.0, axis=1)), clip.rate)
    positions, rotations = local.positions.copy(), local.rotations.copy()
    positions[:, 0] = hips + path + quaternions.rotate(turns, positions[:, 0] - hips)
    rotations[:, 0] = quaternions.multiply(turns, rotations[:, 0])
    offsets = clip.skeleton.offsets * clip.metres_per_unit
    moving = sorted({*joint_arrays.moving_joints(offsets, positions)})
    scale = clip.metres_per_unit / CENTIMETRE
    ends = tuple((joint, (x * scale, y * scale, z * scale)) for joint, (x, y, z) in clip.skeleton.end_sites)
    channels = joint_arrays.channels_of(clip.skeleton.n_joints, moving)
    skeleton = replace(clip.skeleton, offsets=offsets / CENTIMETRE, channels=channels, end_sites=ends)
    values = joint_arrays.values_of(rotations, positions / CENTIMETRE, moving)
    return Clip(clip.name, skeleton, clip.frame_time_s, values, notes=clip.notes)


def _summed(rates: Floats, rate: float) -> Floats:
    """What rates of change [F, ...] add up to, from 0 at the first frame."""
    return np.concatenate((np.zeros((1, *rates.shape[1:])), np.cumsum((rates[1:] + rates[:-1]) / 2.0, axis=0))) / rate
