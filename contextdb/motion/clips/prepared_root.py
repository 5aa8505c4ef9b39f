"""The path of a body, of raw capture whose hips sway: ahead from the hips, sideways from the feet, heading by hips and chest.

    hips, moved sideways to the middle of both feet ─► in bends evened out over a cycle ─► a local parabola about each frame ─► path

A local parabola keeps bends, and evens out what goes to and fro within it. The feet do not step alike in a bend: what is left of
their steps there is evened out over a cycle, against the heading, in which the bend is straight. Where the body stands or nearly
does, the parabola becomes as narrow as a frame, so that a start, a stop and a turn on the spot stay when they are. Joints do not
move in the world: what leaves the path is in the pose, between path and hips. F frames; metres, y up.

Source: the README of Motion-Matching-Prep; the parabola is a Savitzky-Golay filter whose weights are a Gaussian.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contextdb.errors import MotionError
from contextdb.motion.clips.foot_bones import FootBones
from contextdb.motion.clips.poses import Poses
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton, sided_pairs
from contextdb.motion.clips.trajectory import Trajectory, ahead_of, heading_vectors, headings_of, rates_of_change, unbroken

FULL_MPS = 0.5
"""A body that goes no slower than this is smoothed in full."""
FULL_RADPS = 0.5
"""One that turns no slower than this goes in a bend."""
CONSTANT, PARABOLA = 0, 2
REACH = 3.0
"""Standard deviations within which frames count."""
CYCLE = 2.0
"""Times as wide is the Gaussian in which a whole cycle evens out."""
NARROWEST = 0.5
"""Frames of standard deviation where a body stands."""
FEWEST_FRAMES = 5


def prepared_path(poses: Poses, path: Trajectory, smooth_s: float, feet: FootBones, *, is_facing_given: bool = False) -> Trajectory:
    """A path of the hips, as `root_trajectory` gives it, as a path of the body.

    `smooth_s` is the standard deviation of the Gaussian in seconds: what goes to and fro within four of them is evened out. A rig
    without feet keeps its hips sideways too. With `is_facing_given` the path's headings stay those of the bones that were said, and
    are not taken from the chest too.
    """
    parts = []
    for own in unbroken(path):
        part = replace(poses, positions=poses.positions[own], rotations=poses.rotations[own])
        hips = Trajectory(path.rate, path.positions[own], path.headings[own])
        parts.append(_prepared(part, hips, smooth_s, feet, is_facing_given))
    positions, headings = (np.concatenate([getattr(part, name) for part in parts]) for name in ("positions", "headings"))
    return Trajectory(path.rate, positions, np.unwrap(headings), path.now)


def _prepared(poses: Poses, path: Trajectory, smooth_s: float, feet: FootBones, is_facing_given: bool) -> Trajectory:
    """The path of a body that is nowhere put elsewhere."""
    if len(path.headings) < FEWEST_FRAMES:
        return path
    widest = max(NARROWEST, smooth_s * path.rate)
    headings = path.headings if is_facing_given else _body_headings(poses, path.headings)
    even = _fitted(np.column_stack((path.positions, headings)), np.full(len(headings), widest), PARABOLA)
    shares = _shares(np.linalg.norm(rates_of_change(even[:, :2], path.rate), axis=-1) / FULL_MPS, widest)
    turns = np.abs(rates_of_change(even[:, 2], path.rate)) / FULL_RADPS
    positions = path.positions + _sideways(poses, path.positions, headings, feet, shares * _shares(turns, 0.0), CYCLE * widest)
    bends = shares * np.clip(2.0 * turns - 1.0, 0.0, 1.0)
    positions += bends[:, None] * (_along(positions, even[:, 2], path.rate, CYCLE * widest) - positions)
    smooth = _fitted(np.column_stack((positions, headings)), np.maximum(widest * shares, NARROWEST), PARABOLA)
    return Trajectory(path.rate, smooth[:, :2], smooth[:, 2])


def _body_headings(poses: Poses, of_hips: Floats) -> Floats:
    """Between hips and chest, which turn against each other with each step."""
    pair = _chest_pair(poses.skeleton)
    if pair is None:
        return of_hips
    of_chest = headings_of(ahead_of(poses, pair))
    apart = (of_chest - of_hips + np.pi) % (2.0 * np.pi) - np.pi
    return np.unwrap(of_hips + apart / 2.0)


def _chest_pair(skeleton: Skeleton) -> tuple[int, int] | None:
    """The sided joints nearest the hips that do not hang on them: shoulders or arms."""
    pairs = [(skeleton.index(left), skeleton.index(right)) for left, right in sided_pairs(skeleton.names)]
    candidates = []
    for left, right in pairs:
        above = skeleton.ancestors(left)
        meet = next((joint for joint in skeleton.ancestors(right) if joint in above), skeleton.hips)
        is_trunk = skeleton.hips in skeleton.ancestors(meet)
        if is_trunk and not np.array_equal(skeleton.offsets[left], skeleton.offsets[right]):
            candidates.append((left, right))
    return min(candidates, key=lambda pair: (skeleton.depths[pair[0]], pair[0]), default=None)


def _sideways(poses: Poses, hips: Floats, headings: Floats, bones: FootBones, bends: Floats, cycle: float) -> Floats:
    """From the hips to the middle of both feet, as far as it is sideways: [F, 2].

    In a bend the feet are nearer its middle all the time: there only what changes within a cycle counts.
    """
    try:
        feet = bones.feet_in(poses.skeleton)
    except MotionError:
        return np.zeros_like(hips)
    soles = [[joint for joint in (foot.joint, foot.toe) if joint is not None] for foot in feet]
    middle = np.mean([poses.positions[:, joints][..., [0, 2]].mean(axis=1) for joints in soles], axis=0)
    left = heading_vectors(headings + np.pi / 2.0)
    metres = ((middle - hips) * left).sum(axis=-1, keepdims=True)
    lasting = _fitted(metres, np.full(len(metres), cycle), CONSTANT)
    return np.asarray((metres - bends[:, None] * lasting) * left)


def _along(positions: Floats, headings: Floats, rate: float, cycle: float) -> Floats:
    """Positions evened out over a cycle along their bend: its speeds against the heading, and how far it is from them: [F, 2]."""
    ways = np.stack((heading_vectors(headings + np.pi / 2.0), heading_vectors(headings)), axis=1)
    deviations = np.full(len(headings), cycle)
    speeds = _fitted(np.einsum("fwd,fd->fw", ways, rates_of_change(positions, rate)), deviations, CONSTANT)
    steps = np.einsum("fwd,fw->fd", ways, speeds) / rate
    bend = np.concatenate((np.zeros((1, 2)), np.cumsum((steps[1:] + steps[:-1]) / 2.0, axis=0)))
    return bend + _fitted(positions - bend, deviations, CONSTANT)


def _shares(values: Floats, reach: float) -> Floats:
    """Values as shares of 0 to 1, by the least so many frames about each: [F]."""
    n = int(np.ceil(reach))
    around = np.lib.stride_tricks.sliding_window_view(np.pad(values, n, mode="edge"), 2 * n + 1)
    return np.asarray(np.minimum(1.0, around.min(axis=-1)))


def _fitted(values: Floats, deviations: Floats, degree: int) -> Floats:
    """For each frame of [F, D] the middle of the polynomial through its neighbours that fits best, near ones most."""
    n = len(values)
    reach = min(n - 1, int(np.ceil(REACH * deviations.max())))
    steps = np.arange(-reach, reach + 1)
    at = np.arange(n)[:, None] + steps
    weights = np.exp(-0.5 * (steps / deviations[:, None]) ** 2) * ((at >= 0) & (at < n))
    powers = np.vander(steps / reach, degree + 1, increasing=True)
    moments = np.einsum("fk,ki,kj->fij", weights, powers, powers)
    shares = np.linalg.solve(moments, np.broadcast_to(np.eye(degree + 1, 1), (n, degree + 1, 1)))
    kernel = weights * (powers @ shares[:, :, 0].T).T
    return np.asarray(np.einsum("fk,fkd->fd", kernel, values[np.clip(at, 0, n - 1)]))
