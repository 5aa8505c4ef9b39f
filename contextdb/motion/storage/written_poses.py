"""Poses in a file that other tools read: .bvh, or .npz of numpy, which is read again. An edge: this touches the disk."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_path
from contextdb.disk import read_bytes, write_atomic
from contextdb.errors import ArtefactError, Fault, FileError, Place, in_quotes
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


WANTED = {
    "positions": "T J 3",
    "bones": "J",
    "parents": "J",
    "root": "T 3",
    "asset": "T",
    "time_s": "T",
    "mirrored": "T",
    "jumped": "T",
    "forced": "T",
    "rate": "",
}
"""The arrays of a file of poses, and their shapes."""
TEXTS = ("bones", "asset")


def read_pose_arrays(path: str | PathLike[str]) -> dict[str, NDArray[Any]]:
    """Read the arrays of a `.npz` file of poses.

    Raises
    ------
    ArtefactError
        The file is none, damaged, or its arrays do not fit together; with the reason.
    FileError
        The file cannot be read.
    """
    file = require_path(path)
    raw = read_bytes(file)
    try:
        with np.load(io.BytesIO(raw), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except Exception as error:  # what a damaged archive ends in depends on where it is damaged
        raise _refused(f"the file is damaged, or no {NPZ} file ({type(error).__name__}).", str(file)) from None
    return checked_pose_arrays(arrays, str(file))


def checked_pose_arrays(given: Mapping[str, NDArray[Any]], file: str = "") -> dict[str, NDArray[Any]]:
    """The arrays of poses, of the file of a name. Raises ArtefactError where one is missing, or they do not fit together."""
    if missing := [name for name in WANTED if not isinstance(given.get(name), np.ndarray)]:
        raise _refused(f"there is no array {in_quotes(missing[0])}.", file)
    arrays = {name: given[name] for name in WANTED}
    sizes: dict[str, int] = {}
    for name, shape in WANTED.items():
        array, letters = arrays[name], shape.split()
        pairs = zip(letters, array.shape, strict=False)
        wanted = tuple(int(letter) if letter.isdecimal() else sizes.setdefault(letter, n) for letter, n in pairs)
        if array.ndim != len(letters) or array.shape != wanted:
            raise _refused(f"the array {in_quotes(name)} has shape {array.shape}, not [{', '.join(letters)}].", file)
        if array.dtype.kind != "U" if name in TEXTS else array.dtype.kind not in "fiub":
            raise _refused(f"the array {in_quotes(name)} is of {array.dtype}.", file)
    numbers = ("positions", "root", "time_s", "rate")
    if not all(np.isfinite(arrays[name]).all() for name in numbers) or not float(arrays["rate"]) > 0.0:
        raise _refused("the numbers are not finite, or the rate is not above 0.", file)
    return arrays


def _refused(found: str, file: str) -> ArtefactError:
    accepted = "poses that `contextdb motion run --poses FILE.npz` wrote"
    return ArtefactError(Fault(found, accepted, "to write them again", Place(file or None), "bad-artefact"))
