"""Clips from arrays of numpy: `.npz` files of joint rotations, of joint positions, or of AMASS. Pickles are never loaded.

    names, parents, offsets, rotations, positions, rate     those of `Clip.from_arrays`; metres, y up
    positions [F, J, 3], bones [J], parents [J], rate       joints in the world, as `write_poses` writes them
    positions or joints [F, 22, 3]                          the joints of SMPL, as HumanML3D has them; 20 frames a second
    poses, trans, mocap_framerate, offsets                  AMASS, z up; it holds no body, so that offsets [22, 3] are brought along

`metres_per_unit` and `up` may be arrays of a file too. The members that are needed are read, and no more bytes than a file says.

Source: Mahmood and others, "AMASS: Archive of Motion Capture as Surface Shapes", ICCV 2019; Guo and others, "Generating Diverse and
Natural 3D Human Motions from Text", CVPR 2022; the fit of rotations is Kabsch's, 1976.
"""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import ClipError, ContextDBError, Fault, Place, in_quotes, some
from contextdb.motion.clips import joint_arrays, quaternions
from contextdb.motion.clips.clip import MOST_RATE, UPS, Clip
from contextdb.motion.clips.poses import TO_Y_UP
from contextdb.motion.clips.quaternions import Floats

MOST_BYTES = 1 << 30
"""An array that takes more is refused."""
SMPL = (
    "Pelvis L_Hip R_Hip Spine1 L_Knee R_Knee Spine2 L_Ankle R_Ankle Spine3 L_Foot R_Foot Neck L_Collar R_Collar Head "
    "L_Shoulder R_Shoulder L_Elbow R_Elbow L_Wrist R_Wrist"
)
SMPL_NAMES = tuple(SMPL.split())
SMPL_PARENTS = np.array([-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19])
HUMANML3D_RATE = 20.0
RATES = ("rate", "fps", "mocap_framerate", "mocap_frame_rate")
LIKE_PARENT = 1e-3
"""The weight with which a bone is turned as its parent is, where its children leave that open."""
ACCEPTED = (
    "arrays positions [frames, joints, 3], bones, parents and rate; or those of Clip.from_arrays; or poses and trans of AMASS"
)
Arrays = dict[str, NDArray[Any]]


def read(content: bytes, name: str, file: str) -> Clip:
    """The clip of an `.npz` file. Raises ClipError where the file is damaged, or its arrays are no clip."""
    try:
        return _clip(_Archive(content), name)
    except ContextDBError as error:
        raise ClipError(*(fault.at(Place(file)) for fault in error.faults)) from None


class _Archive:
    """The arrays of an `.npz` file, each read when it is wanted."""

    def __init__(self, content: bytes) -> None:
        try:
            self.members = zipfile.ZipFile(io.BytesIO(content))
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
            raise _refused(f"the file is damaged, or no .npz file ({type(error).__name__}).") from None
        self.names = {info.filename.removesuffix(".npy"): info for info in self.members.infolist()}

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def array(self, name: str) -> NDArray[Any]:
        if name not in self:
            raise _refused(f"there is no array {in_quotes(name)}; the file holds {some(sorted(self.names)) or 'none'}.")
        info = self.names[name]
        if info.file_size > MOST_BYTES:
            raise _refused(f"the array {in_quotes(name)} takes {info.file_size:,} bytes.", f"at most {MOST_BYTES:,}")
        try:
            with self.members.open(info) as member:
                data = member.read(MOST_BYTES + 1)
        except (zipfile.BadZipFile, zlib.error, OSError, EOFError, RuntimeError, NotImplementedError, ValueError) as error:
            raise _refused(f"the array {in_quotes(name)} is damaged ({type(error).__name__}).") from None
        return _array(data, name)

    def numbers(self, name: str) -> Floats:
        array = self.array(name)
        if array.dtype.kind not in "fiub":
            raise _refused(f"the array {in_quotes(name)} is of {array.dtype}.", "numbers")
        return array.astype(np.float64)

    def number(self, name: str) -> float:
        array = self.numbers(name)
        if array.size != 1 or not np.isfinite(array).all():
            raise _refused(f"the array {in_quotes(name)} is {list(array.shape)}, or not finite.", "one number")
        return float(array.ravel()[0])


def _array(data: bytes, name: str) -> NDArray[Any]:
    """The array of the bytes of a `.npy` file, which must hold as many as its header says."""
    stream = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(stream)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, is_fortran, dtype = header(stream)
    except Exception as error:  # what a damaged header ends in depends on where it is damaged
        raise _refused(f"the array {in_quotes(name)} is damaged ({type(error).__name__}).") from None
    if dtype.hasobject:
        raise _refused(f"the array {in_quotes(name)} is a pickle, which is never loaded.", "numbers and texts")
    size = math.prod(shape) * dtype.itemsize
    rest = data[stream.tell() :]
    if size != len(rest) or any(n < 0 for n in shape):
        raise _refused(f"the array {in_quotes(name)} has {len(rest):,} bytes, and {size:,} by its shape.")
    return np.frombuffer(rest, dtype).reshape(shape, order="F" if is_fortran else "C") if size else np.zeros(shape, dtype)


def _clip(archive: _Archive, name: str) -> Clip:
    if "poses" in archive and "trans" in archive:
        return _amass(archive, name)
    if "rotations" in archive:
        return _of_rotations(archive, name)
    places = archive.numbers("joints" if "joints" in archive and "positions" not in archive else "positions")
    if places.ndim != 3 or places.shape[2] != 3 or not np.isfinite(places).all():
        raise _refused(f"the positions are {list(places.shape)}, or not all finite.", "finite numbers, [frames, joints, 3]")
    names, parents = _bones(archive, places.shape[1])
    if faults := list(joint_arrays.tree_faults(names, parents)):
        raise ClipError(*faults)
    if not len(places):
        raise _refused("the clip has no frame.", "at least one")
    is_smpl = not any(key in archive for key in ("bones", "names"))
    rate = _rate(archive, HUMANML3D_RATE if is_smpl else None)
    return of_positions(names, parents.astype(np.int64), _upright(archive, places), rate, name)


def _bones(archive: _Archive, n_joints: int) -> tuple[list[str], NDArray[Any]]:
    """The names and parents of joints; those of SMPL where the file has 22 and names none."""
    key = next((key for key in ("bones", "names") if key in archive), None)
    if key is None:
        if n_joints != len(SMPL_NAMES):
            raise _refused(f"{n_joints} joints have no names.", "an array bones, or the 22 joints of SMPL")
        return list(SMPL_NAMES), SMPL_PARENTS
    names = archive.array(key)
    if names.dtype.kind != "U" or names.shape != (n_joints,):
        raise _refused(f"the array {in_quotes(key)} is {names.dtype} {list(names.shape)}.", f"{n_joints} texts")
    return [str(each) for each in names.tolist()], archive.array("parents")


def _rate(archive: _Archive, usual: float | None = None) -> float:
    key = next((key for key in RATES if key in archive), None)
    if key is None and usual is not None:
        return usual
    rate = archive.number(key or RATES[0])
    if not 1.0 <= rate <= MOST_RATE:
        raise _refused(f"the rate is {rate:g}.", f"frames a second, 1 to {MOST_RATE:g}")
    return rate


def _upright(archive: _Archive, places: Floats) -> Floats:
    """Positions in metres, y up."""
    unit = archive.number("metres_per_unit") if "metres_per_unit" in archive else 1.0
    up = str(archive.array("up")) if "up" in archive else "y"
    if not 1e-9 < unit < 1e9 or up not in UPS:
        raise _refused(f"metres_per_unit is {unit:g}, up is {in_quotes(up)}.", f"a number above 0, and {some(UPS)}")
    return np.asarray(quaternions.rotate(TO_Y_UP[up], places * unit))


def _of_rotations(archive: _Archive, name: str) -> Clip:
    key = "names" if "names" in archive else "bones"
    names = [str(each) for each in archive.array(key).ravel().tolist()]
    still, turns, places = (archive.numbers(each) for each in ("offsets", "rotations", "positions"))
    return Clip.from_arrays(names, archive.array("parents"), still, turns, places, _rate(archive), name=name)


def _amass(archive: _Archive, name: str) -> Clip:
    """AMASS, of the joints of the body alone: hands and face are left out."""
    poses, trans, rate = archive.numbers("poses"), archive.numbers("trans"), _rate(archive)
    n = len(SMPL_NAMES)
    if poses.ndim != 2 or poses.shape[1] < 3 * n:
        raise _refused(f"the poses are {list(poses.shape)}.", f"[frames, {3 * n} or more]: an axis times an angle a joint")
    joint_arrays.require_numbers(trans, "trans", (len(poses), 3))
    joint_arrays.require_numbers(poses, "poses", (None, poses.shape[1]))
    if "offsets" not in archive:
        raise ClipError(
            Fault(
                'AMASS holds no lengths of bones: there is no array "offsets".',
                f"offsets [{n}, 3] in metres, y up: each joint at rest against its parent, the first against the origin",
                'np.savez("with_offsets.npz", **np.load("amass.npz"), offsets=offsets)',
            )
        )
    offsets = archive.numbers("offsets")[:n]
    joint_arrays.require_numbers(offsets, "offsets", (n, 3))
    vectors = poses[:, : 3 * n].reshape(-1, n, 3)
    angles = np.linalg.norm(vectors, axis=-1, keepdims=True)
    axes = vectors / np.maximum(angles, 1e-12)
    rotations = np.concatenate((np.cos(angles / 2.0), np.sin(angles / 2.0) * axes), axis=-1)
    turn = TO_Y_UP["z"]
    rotations[:, 0] = quaternions.multiply(turn, rotations[:, 0])
    root = quaternions.rotate(turn, trans + offsets[0])
    return Clip.from_arrays(SMPL_NAMES, SMPL_PARENTS, offsets, rotations, root, rate, name=name)


def of_positions(names: list[str], parents: NDArray[np.int64], places: Floats, rate: float, name: str) -> Clip:
    """A clip of joints in the world [F, J, 3], in metres, y up; their pose of reference is that of the first frame.

    Bones are turned as their children lie, and as their parents where that leaves it open; joints are where the array has them.
    """
    above = np.maximum(parents, 0)
    apart = places - places[:, above]
    offsets = np.where(parents[:, None] < 0, 0.0, apart[0])
    world = np.zeros((*places.shape[:2], 4))
    for joint in joint_arrays.depth_first(parents).tolist():
        children = np.flatnonzero(parents == joint)
        like = np.eye(3) if parents[joint] < 0 else quaternions.matrices(world[:, parents[joint]])
        size = max(float((offsets[children] ** 2).sum()), 1e-12)
        fit = np.einsum("fci,cj->fij", apart[:, children], offsets[children]) + LIKE_PARENT * size * like
        left, _, right = np.linalg.svd(fit)
        left[..., 2] *= np.sign(np.linalg.det(left @ right))[:, None]
        world[:, joint] = quaternions.from_matrices(left @ right)
    parent_turns = np.where(parents[:, None] < 0, np.array([1.0, 0.0, 0.0, 0.0]), world[:, above])
    back = quaternions.inverse(parent_turns)
    local = quaternions.rotate(back, np.where(parents[:, None] < 0, places, apart))
    return Clip.from_arrays(names, parents, offsets, quaternions.multiply(back, world), local, rate, name=name)


def _refused(problem: str, accepted: str = ACCEPTED) -> ClipError:
    return ClipError(Fault(problem, accepted))
