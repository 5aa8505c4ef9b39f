"""Poses in a file that other tools read: .bvh, .npz of numpy, or .glb, which is glTF. An edge: this touches the disk."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from contextdb.cells.arguments import require_path
from contextdb.disk import write_atomic
from contextdb.errors import Fault, FileError, MotionError, Place
from contextdb.motion.clips.clip import write_bvh
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.stream import Pose
from contextdb.motion.output.track import checked_poses, clip_of_poses, pose_arrays
from contextdb.motion.storage.glb import glb_of, require_gltf

BVH, NPZ, GLB = ".bvh", ".npz", ".glb"
A_POSE_FILE = f"a name that ends in {BVH}, {NPZ} or {GLB}"


def write_poses(poses: Sequence[Pose], bank: PoseBank, path: str | PathLike[str], rate: float) -> None:
    """Write poses by the ending of the name: BVH, the arrays of `pose_arrays`, or glTF. The same poses give the same bytes.

    A `.bvh` has the rig in centimetres and angles in degrees; a `.glb` has a node for each joint and one animation of them, in
    metres, and needs pygltflib.

    Raises
    ------
    FileError
        The name has another ending, or the disk refuses; the old file is then whole.
    MotionError
        A `.glb` of no pose, or without pygltflib.
    ContextError
        An argument of another type.
    """
    target = pose_file(path)
    if target.suffix == BVH:
        write_bvh(clip_of_poses(poses, bank, rate, name=target.stem), target)
        return
    if target.suffix == GLB:
        write_atomic(target, glb_of_poses(poses, bank, rate, target.stem))
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


def glb_of_poses(poses: Sequence[Pose], bank: PoseBank, rate: float, name: str = "poses") -> bytes:
    """Poses as the bytes of a `.glb` file.

    Raises
    ------
    MotionError
        No pose, or pygltflib is not installed.
    ContextError
        An argument of another type.
    """
    listed = checked_poses(poses, bank, rate)
    if not listed:
        raise MotionError(Fault("there is no pose to write as glTF.", "at least one"))
    return glb_of(listed, bank, rate, name)


def pose_file(path: str | PathLike[str]) -> Path:
    """A file that poses can be written to; raises FileError for another ending, MotionError for glTF without pygltflib."""
    target = require_path(path)
    if target.suffix not in (BVH, NPZ, GLB):
        raise FileError(Fault("poses cannot be written to such a file.", A_POSE_FILE, place=Place(str(target))))
    if target.suffix == GLB:
        require_gltf()
    return target
