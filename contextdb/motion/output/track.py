"""Poses one after another: as a clip, to write as BVH, and as arrays.

T ticks, J joints.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_kind, require_many_of, require_real
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.clip import CENTIMETRE, Clip
from contextdb.motion.clips.joint_arrays import channels_of, values_of
from contextdb.motion.clips.poses import LEAST_RATE, MOST_RATE
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.stream import Pose


def clip_of_poses(poses: Sequence[Pose], bank: PoseBank, rate: float, *, name: str = "poses") -> Clip:
    """Poses as a clip of the bank's rig, in centimetres, y up: for `write_bvh`.

    Parameters
    ----------
    poses : sequence of Pose
        Of a stream of this bank.
    bank : PoseBank
    rate : float
        Poses a second.
    name : str

    Raises
    ------
    ContextError
        An argument of another type.
    """
    return clip_of_rig(checked_poses(poses, bank, rate), bank.skeleton, bank.moving.tolist(), rate, name)


def clip_of_rig(poses: list[Pose], rig: Skeleton, moving: Iterable[int], rate: float, name: str) -> Clip:
    """The same of a rig with offsets in metres, of which some joints move against their parents beside the first."""
    return clip_of_tracks(*local_tracks(poses, rig), rig, moving, rate, name)


def clip_of_tracks(rotations: Floats, translations: Floats, rig: Skeleton, moving: Iterable[int], rate: float, name: str) -> Clip:
    """The same of joints against their parents: rotations [T, J, 4], translations [T, J, 3] in metres, the first in the world."""
    placed = sorted({0, *moving})
    ends = tuple((joint, (x / CENTIMETRE, y / CENTIMETRE, z / CENTIMETRE)) for joint, (x, y, z) in rig.end_sites)
    skeleton = Skeleton(rig.names, rig.parents, rig.offsets / CENTIMETRE, channels_of(rig.n_joints, placed), ends)
    return Clip(name, skeleton, 1.0 / rate, values_of(rotations, translations / CENTIMETRE, placed))


def pose_arrays(poses: Sequence[Pose], bank: PoseBank, rate: float) -> dict[str, NDArray[Any]]:
    """Poses as arrays, those of a `.npz` file.

    Returns
    -------
    dict
        `positions` float32 [T, J, 3], metres, y up, of the joints `bones` [J] below `parents` int64 [J]; `root` float64 [T, 3], x,
        z and heading; `asset` [T], empty where nothing plays, `time_s` float64, `mirrored`, `jumped` and `forced` bool [T]; and
        `rate`, poses a second.

    Raises
    ------
    ContextError
        An argument of another type.
    """
    listed, rig = checked_poses(poses, bank, rate), bank.skeleton
    playing = [pose.playing for pose in listed]
    return {
        "positions": np.array([pose.positions for pose in listed], np.float32).reshape(-1, rig.n_joints, 3),
        "bones": np.array(rig.names),
        "parents": rig.parents,
        "root": np.array([pose.root for pose in listed], np.float64).reshape(-1, 3),
        "asset": np.array(["" if each is None else each.asset for each in playing], np.str_),
        "time_s": np.array([0.0 if each is None else each.time_s for each in playing], np.float64),
        "mirrored": np.array([each is not None and each.mirrored for each in playing], np.bool_),
        "jumped": np.array([pose.is_jump for pose in listed], np.bool_),
        "forced": np.array([pose.is_forced for pose in listed], np.bool_),
        "rate": np.array(rate, np.float64),
    }


def checked_poses(poses: object, bank: object, rate: object) -> list[Pose]:
    """Poses, refused where they or what goes with them are of another type."""
    require_kind(bank, PoseBank, "bank", "a PoseBank")
    require_real(rate, "rate", LEAST_RATE, MOST_RATE)
    return require_many_of(poses, Pose, "poses", "a list of Pose")


def local_tracks(poses: list[Pose], rig: Skeleton) -> tuple[Floats, Floats]:
    """Local rotations of poses [T, J, 4] and translations [T, J, 3], the first joint's in the world."""
    rotations = np.array([pose.rotations for pose in poses], np.float64).reshape(-1, rig.n_joints, 4)
    translations = np.array([pose.translations for pose in poses], np.float64).reshape(-1, rig.n_joints, 3)
    roots = np.array([pose.root for pose in poses], np.float64).reshape(-1, 3)
    turns = quaternions.about_axis("y", roots[:, 2])
    ground = np.stack((roots[:, 0], np.zeros(len(roots)), roots[:, 1]), axis=-1)
    translations[:, 0] = ground + quaternions.rotate(turns, translations[:, 0])
    rotations[:, 0] = quaternions.multiply(turns, rotations[:, 0])
    return rotations, translations
