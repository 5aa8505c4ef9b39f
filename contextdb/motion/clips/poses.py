"""Poses: where every joint of a clip is, in metres, y up.

    Clip ─► LocalPoses (each joint against its parent) ─► resampled ─► Poses (all joints in the world, by forward kinematics)

F frames, J joints. Rotations are unit quaternions (w, x, y, z). The world is right-handed with y up; a body that faces +z has its
left at +x. A file's position channel stands instead of the joint's offset on that axis, as files with six channels on every joint
need it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from contextdb.cells.arguments import require_kind, require_real
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.clip import Clip, Up
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import POSITIONS, Skeleton

LEAST_RATE, MOST_RATE = 1e-3, 1e5
"""Frames a second."""
SAME_RATE = 1e-4
"""Rates this near, as a share, are the same: files print 1/30 s as 0.033333."""
ROUNDED = 0.05
"""Of a frame: a last frame that is missing by so little is there: 600 steps of 0.00833333 s are meant to be 5 s."""
TO_Y_UP: dict[Up, Floats] = {
    "y": np.array([1.0, 0.0, 0.0, 0.0]),
    "z": np.array([math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0]),
    "x": np.array([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]),
}
"""For each axis that may point up in a file, the rotation of the file's world into one with y up."""


@dataclass(frozen=True, eq=False)
class LocalPoses:
    """Each joint against its parent: positions [F, J, 3] in metres, rotations [F, J, 4], frames `rate` a second."""

    skeleton: Skeleton
    rate: float
    positions: Floats
    rotations: Floats


@dataclass(frozen=True, eq=False)
class Poses:
    """Each joint in the world: positions [F, J, 3] in metres, rotations [F, J, 4], frames `rate` a second."""

    skeleton: Skeleton
    rate: float
    positions: Floats
    rotations: Floats

    @property
    def n_frames(self) -> int:
        return len(self.positions)


def poses_of(clip: Clip, rate: float | None = None) -> Poses:
    """Where all joints of a clip are in each frame, at the clip's own rate or another.

    Raises ContextError for what is no clip, or no rate above 0.
    """
    local = local_poses(clip)
    return forward_kinematics(local if rate is None else resampled(local, rate))


def local_poses(clip: Clip) -> LocalPoses:
    """Each joint of a clip against its parent, in metres and y up. Raises ContextError for what is no clip."""
    require_kind(clip, Clip, "clip", "a Clip")
    positions = _positions(clip) * clip.metres_per_unit
    rotations = _rotations(clip)
    turn = TO_Y_UP[clip.up]
    positions[:, 0] = quaternions.rotate(turn, positions[:, 0])
    rotations[:, 0] = quaternions.multiply(turn, rotations[:, 0])
    return LocalPoses(clip.skeleton, clip.rate, positions, rotations)


def forward_kinematics(local: LocalPoses) -> Poses:
    """Place all joints in the world: the root first, then level by level, all frames and all joints of a level at once.

    Raises ContextError for what are no local poses.
    """
    require_kind(local, LocalPoses, "local", "LocalPoses")
    positions, rotations = local.positions.copy(), local.rotations.copy()
    for joints in local.skeleton.levels[1:]:
        parents = local.skeleton.parents[joints]
        turned = rotations[:, parents]
        positions[:, joints] = positions[:, parents] + quaternions.rotate(turned, local.positions[:, joints])
        rotations[:, joints] = quaternions.multiply(turned, local.rotations[:, joints])
    return Poses(local.skeleton, local.rate, positions, rotations)


def resampled(local: LocalPoses, rate: float) -> LocalPoses:
    """The same motion with `rate` frames a second, from its first frame on; positions and rotations are blended between frames.

    Raises ContextError for what are no local poses, or no rate above 0.
    """
    require_kind(local, LocalPoses, "local", "LocalPoses")
    rate = require_real(rate, "rate", LEAST_RATE, MOST_RATE)
    n_frames = len(local.positions)
    if n_frames < 2 or abs(local.rate / rate - 1.0) < SAME_RATE:
        return LocalPoses(local.skeleton, rate, local.positions, local.rotations)
    n_wanted = math.floor((n_frames - 1) / local.rate * rate + ROUNDED) + 1
    at = np.minimum(np.arange(n_wanted) * (local.rate / rate), n_frames - 1)
    before = np.minimum(at.astype(np.int64), n_frames - 2)
    shares = (at - before)[:, None, None]
    positions = local.positions[before] * (1.0 - shares) + local.positions[before + 1] * shares
    rotations = quaternions.blend(local.rotations[before], local.rotations[before + 1], shares)
    return LocalPoses(local.skeleton, rate, positions, rotations)


def _positions(clip: Clip) -> Floats:
    """Each joint's offset, or what its position channels say instead: [F, J, 3] in the file's units."""
    skeleton = clip.skeleton
    positions = np.repeat(skeleton.offsets[None], clip.n_frames, axis=0)
    for joint, (start, channels) in enumerate(zip(skeleton.channel_starts.tolist(), skeleton.channels, strict=True)):
        for column, channel in enumerate(channels, start=start):
            if channel in POSITIONS:
                positions[:, joint, POSITIONS.index(channel)] = clip.values[:, column]
    return positions


def _rotations(clip: Clip) -> Floats:
    """Each joint's rotation: [F, J, 4]. Joints whose rotation channels are alike are turned together."""
    alike: dict[tuple[str, ...], list[tuple[int, list[int]]]] = {}
    for joint, (start, channels) in enumerate(zip(clip.skeleton.channel_starts.tolist(), clip.skeleton.channels, strict=True)):
        turns = [(channel[0].lower(), start + i) for i, channel in enumerate(channels) if channel not in POSITIONS]
        alike.setdefault(tuple(axis for axis, _ in turns), []).append((joint, [column for _, column in turns]))
    rotations = np.empty((clip.n_frames, clip.skeleton.n_joints, 4))
    for axes, members in alike.items():
        columns = np.array([columns for _, columns in members], np.int64).reshape(len(members), len(axes))
        rotations[:, [joint for joint, _ in members]] = quaternions.from_euler(axes, np.deg2rad(clip.values[:, columns]))
    return rotations
