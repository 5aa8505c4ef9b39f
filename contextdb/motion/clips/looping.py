"""A clip that loops, with what continues before and behind it: features at its ends then see the loop, and no end.

The last frame of a looping clip is the first of its next round. Each round continues where the one before ended, and faces as that
one did then: a clip that walks a quarter of a circle walks the whole of it in four.
"""

from __future__ import annotations

import numpy as np

from contextdb.motion.clips import quaternions
from contextdb.motion.clips.poses import Poses
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import Trajectory


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
