"""Poses in a file that other tools read: .bvh, or .npz of numpy. An edge: this touches the disk."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from contextdb.cells.arguments import require_path
from contextdb.disk import write_atomic
from contextdb.errors import Fault, FileError, Place
from contextdb.motion.clips.clip import write_bvh
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.stream import Pose
from contextdb.motion.output.track import clip_of_poses, pose_arrays

BVH, NPZ = ".bvh", ".npz"
A_POSE_FILE = f"a name that ends in {BVH} or {NPZ}"


def write_poses(poses: Sequence[Pose], bank: PoseBank, path: str | PathLike[str], rate: float) -> None:
    """Write poses as BVH, or as the arrays of `pose_arrays`, by the ending of the name. The same poses give the same bytes.

    Raises
    ------
    FileError
        The name has another ending, or the disk refuses; the old file is then whole.
    ContextError
        An argument of another type.
    """
    target = pose_file(path)
    if target.suffix == BVH:
        write_bvh(clip_of_poses(poses, bank, rate, name=target.stem), target)
        return
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in pose_arrays(poses, bank, rate).items():
            entry = io.BytesIO()
            np.lib.format.write_array(entry, np.asanyarray(array), allow_pickle=False)
            about = zipfile.ZipInfo(f"{name}.npy")  # of no date, unlike those of numpy.savez
            about.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(about, entry.getvalue())
    write_atomic(target, whole.getvalue())


def pose_file(path: str | PathLike[str]) -> Path:
    """A file that poses can be written to; raises FileError for another ending."""
    target = require_path(path)
    if target.suffix not in (BVH, NPZ):
        raise FileError(Fault("poses cannot be written to such a file.", A_POSE_FILE, place=Place(str(target))))
    return target
