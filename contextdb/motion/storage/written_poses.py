"""Poses in a file that other tools read: .bvh, .npz of numpy, .glb (glTF) or .usda (USD). An edge: this touches the disk.

Source: Pixar, OpenUSD, the schemas of UsdSkel.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_mapping, require_path
from contextdb.disk import read_bytes, write_atomic
from contextdb.errors import ArtefactError, ContextError, Fault, FileError, MotionError, Place, in_quotes
from contextdb.motion.clips.clip import write_bvh
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.stream import Pose
from contextdb.motion.output.track import checked_poses, clip_of_poses, local_tracks, pose_arrays
from contextdb.motion.storage.glb import glb_of, require_gltf

BVH, NPZ, GLB, USDA = ".bvh", ".npz", ".glb", ".usda"
POSE_FILES = (BVH, NPZ, GLB, USDA)
A_POSE_FILE = f"a name that ends in {BVH}, {NPZ}, {GLB} or {USDA}"


def write_poses(poses: Sequence[Pose], bank: PoseBank, path: str | PathLike[str], rate: float, *, has_body: bool = False) -> None:
    """Write poses by the ending of the name: BVH, the arrays of `pose_arrays`, glTF, or USD. The same poses give the same bytes.

    A `.bvh` has the rig in centimetres and angles in degrees; a `.glb` has a node for each joint and one animation of them, in
    metres, and needs pygltflib; a `.usda` has a skeleton and its animation, in metres. `has_body` puts one skin of capsules on the
    joints of a `.glb`. Raises FileError where the name has another ending, or the disk refuses; the old file is then whole;
    MotionError for a `.glb` or `.usda` of no pose, or without pygltflib; ContextError for an argument of another type.
    """
    target = pose_file(path, has_body=has_body)
    if target.suffix == BVH:
        write_bvh(clip_of_poses(poses, bank, rate, name=target.stem), target)
        return
    if target.suffix == GLB:
        write_atomic(target, glb_of_poses(poses, bank, rate, target.stem, has_body=has_body))
        return
    if target.suffix == USDA:
        listed = _some_poses(poses, bank, rate, "USD")
        write_atomic(target, usda_of(*local_tracks(listed, bank.skeleton), bank.skeleton, rate))
        return
    write_arrays(pose_arrays(poses, bank, rate), target)


def write_arrays(arrays: Mapping[str, NDArray[Any]], path: str | PathLike[str]) -> None:
    """Write arrays by their names into a `.npz` file, as `numpy.load` reads it. The same arrays give the same bytes. Raises
    FileError where the name has another ending, or the disk refuses; the old file is then whole; ContextError for an argument of
    another type."""
    target, whole = require_path(path), io.BytesIO()
    given = require_mapping(arrays, "arrays", "a mapping of names to arrays")
    wrong = [name for name, array in given.items() if not isinstance(name, str) or np.asanyarray(array).dtype.hasobject]
    if wrong:
        raise ContextError(Fault(f"{wrong[0]!r} is not an array of numbers or texts.", "a mapping of names to arrays"))
    if target.suffix != NPZ:
        raise FileError(Fault("arrays cannot be written to such a file.", f"a name that ends in {NPZ}", place=Place(str(target))))
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in given.items():
            entry = io.BytesIO()
            np.lib.format.write_array(entry, np.asanyarray(array), allow_pickle=False)
            about = zipfile.ZipInfo(f"{name}.npy")  # of no date, unlike those of numpy.savez
            about.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(about, entry.getvalue())
    write_atomic(target, whole.getvalue())


def glb_of_poses(poses: Sequence[Pose], bank: PoseBank, rate: float, name: str = "poses", *, has_body: bool = False) -> bytes:
    """Poses as the bytes of a `.glb` file; with `has_body` a skin of capsules on them.

    Raises MotionError where there is no pose, or pygltflib is not installed; ContextError for an argument of another type.
    """
    return glb_of(_some_poses(poses, bank, rate, "glTF"), bank, rate, name, has_body=has_body)


def _some_poses(poses: Sequence[Pose], bank: PoseBank, rate: float, what: str) -> list[Pose]:
    """At least one pose."""
    listed = checked_poses(poses, bank, rate)
    if not listed:
        raise MotionError(Fault(f"there is no pose to write as {what}.", "at least one"))
    return listed


def pose_file(path: str | PathLike[str], *, has_body: bool = False) -> Path:
    """A file that poses can be written to; raises FileError for another ending, or one that has no body; MotionError for glTF
    without pygltflib."""
    target = require_path(path)
    if target.suffix not in POSE_FILES:
        raise FileError(Fault("poses cannot be written to such a file.", A_POSE_FILE, place=Place(str(target))))
    if has_body and target.suffix != GLB:
        raise FileError(Fault("such a file has no body of capsules.", f"a name that ends in {GLB}", place=Place(str(target))))
    if target.suffix == GLB:
        require_gltf()
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
    """Read the arrays of a `.npz` file of poses. Raises ArtefactError where the file is none, damaged, or its arrays do not fit
    together; with the reason; FileError where the file cannot be read."""
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


def _refused(problem: str, file: str) -> ArtefactError:
    accepted = "poses that `contextdb motion run --poses FILE.npz` wrote"
    return ArtefactError(Fault(problem, accepted, "to write them again", Place(file or None), "bad-artefact"))


# ---- poses as USD: a skeleton and its animation, as text, in one `.usda` file. Metres, y up. Needs nothing but numpy


def usda_of(rotations: Floats, translations: Floats, rig: Skeleton, rate: float) -> bytes:
    """The bytes of a file, for at least one pose: rotations [T, J, 4] and translations [T, J, 3] of joints against their parents.
    Names that USD cannot have get "_" in place of other letters."""
    joints = _list(f'"{path}"' for path in _paths(rig))
    rest = np.tile(np.eye(4), (rig.n_joints, 1, 1))
    rest[:, 3, :3] = rig.offsets
    world = rest.copy()
    for joint, parent in enumerate(rig.parents.tolist()):
        world[joint, 3, :3] += world[parent, 3, :3] if parent >= 0 else 0.0
    lines = [
        "#usda 1.0",
        "(",
        '    defaultPrim = "Body"\n    metersPerUnit = 1\n    upAxis = "Y"',
        f"    timeCodesPerSecond = {rate!r}\n    startTimeCode = 0\n    endTimeCode = {len(rotations) - 1}",
        ")",
        'def SkelRoot "Body"\n{',
        '    def Skeleton "Skeleton" (prepend apiSchemas = ["SkelBindingAPI"])\n    {',
        f"        uniform token[] joints = {joints}",
        f"        uniform matrix4d[] bindTransforms = {_matrices(world)}",
        f"        uniform matrix4d[] restTransforms = {_matrices(rest)}",
        "        rel skel:animationSource = </Body/Animation>\n    }",
        '    def SkelAnimation "Animation"\n    {',
        f"        uniform token[] joints = {joints}",
        f"        half3[] scales = {_list(['(1, 1, 1)'] * rig.n_joints)}",
        f"        float3[] translations.timeSamples = {_samples(translations)}",
        f"        quatf[] rotations.timeSamples = {_samples(rotations)}",
        "    }\n}",
    ]
    return "\n".join([*lines, ""]).encode()


def _paths(rig: Skeleton) -> list[str]:
    """Each joint with those above it, as USD names them."""
    paths: list[str] = []
    for name, parent in zip(rig.names, rig.parents.tolist(), strict=True):
        plain = re.sub(r"^(?=\d|$)|\W", "_", name, flags=re.ASCII)
        path = f"{paths[parent]}/{plain}" if parent >= 0 else plain
        while path in paths:
            path += "_"
        paths.append(path)
    return paths


def _samples(values: Floats) -> str:
    return "{ " + ", ".join(f"{i}: {_list(map(_tuple, frame.tolist()))}" for i, frame in enumerate(values)) + " }"


def _matrices(matrices: Floats) -> str:
    return _list("( " + ", ".join(map(_tuple, matrix)) + " )" for matrix in matrices.tolist())


def _tuple(numbers: Sequence[float]) -> str:
    return f"({', '.join(f'{number:.9g}' for number in numbers)})"


def _list(items: Iterable[str]) -> str:
    return f"[{', '.join(items)}]"
