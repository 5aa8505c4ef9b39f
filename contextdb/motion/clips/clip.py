"""A clip: one animation as its file says it, with what the file leaves open, its unit and which way is up.

Values stay in the file's units and in degrees, so that writing a clip loses nothing; `contextdb.motion.clips.poses` turns them into
metres with y up. F frames, C channels.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from os import PathLike, fspath
from typing import Any, Literal, TextIO, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.cells.arguments import require_kind, require_many_of, require_path, require_real, require_text, require_whole
from contextdb.disk import read_bytes, write_atomic
from contextdb.errors import ClipError, ContextError, Fault, FileError, Place, in_quotes, mend_for, some
from contextdb.files.strangers import line_of
from contextdb.motion.clips import bvh, joint_arrays
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton

Up = Literal["y", "z", "x"]
UPS: tuple[Up, ...] = get_args(Up)

BY_SIZE: Literal["size"] = "size"
Unit = float | Literal["size"]
"""Metres, or to be taken from the size of each body."""
CENTIMETRE = 0.01
"""What one unit of most BVH files is, in metres; the format itself does not say."""
MOST_RATE = 1e6
"""Frames a second; more are no number to reckon speeds with."""
MOST_DIGITS = 17
"""A double has no more."""


@dataclass(frozen=True, eq=False)
class Clip:
    """One animation.

    Attributes
    ----------
    name : str
        The asset's name; for a file, its stem.
    skeleton : Skeleton
        Joints, offsets in the file's units, and which channels each column of `values` is.
    frame_time_s : float
        Seconds between two frames.
    values : float64 array, shape (F, C)
        Read-only. Angles in degrees, positions in the file's units.
    metres_per_unit : float
        What one unit of offsets and positions is.
    up : "y", "z" or "x"
        The file's axis that points up.
    notes : tuple of str
        What the reader left out of the file or took for granted, in sentences.
    """

    name: str
    skeleton: Skeleton
    frame_time_s: float
    values: Floats
    metres_per_unit: float = CENTIMETRE
    up: Up = "y"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        faults = list(_faults(self))
        if faults:
            raise ClipError(*(fault.at(Place(self.name)) for fault in faults))
        values = self.values.view()
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    @classmethod
    def from_arrays(
        cls,
        names: Sequence[str],
        parents: ArrayLike,
        offsets: ArrayLike,
        rotations: ArrayLike,
        positions: ArrayLike,
        rate: float,
        *,
        name: str = "clip",
    ) -> Clip:
        """Make a clip of joints as arrays: metres, y up, in any order.

        Parameters
        ----------
        names : J str
        parents : int array, shape (J,)
            The number of each joint's parent, -1 of the one root.
        offsets : float array, shape (J, 3)
            Where each joint is against its parent in the pose of reference, in which no joint is turned.
        rotations : float array, shape (F, J, 4)
            Each joint against its parent, as quaternions (w, x, y, z) of any length above 0.
        positions : float array, shape (F, 3) or (F, J, 3)
            Where the root is; or where each joint is against its parent, the root in the world.
        rate : float
            Frames a second.
        name : str

        Returns
        -------
        Clip
            In centimetres, as `write_bvh` writes it. A joint has positions of its own where it does not stay at its offset.

        Raises
        ------
        ClipError
            The arrays do not fit together, are not finite, or the parents are no tree.
        ContextError
            An argument of another type.
        """
        listed = require_many_of(names, str, "names", "a list of texts")
        rate = require_real(rate, "rate", 1.0 / bvh.LONGEST_FRAME_S, MOST_RATE)
        tree, still, turns, places = (_array(each) for each in (parents, offsets, rotations, positions))
        try:
            skeleton, values = _of_arrays(listed, tree, still, turns, places)
        except ClipError as error:
            raise ClipError(*(fault.at(Place(name)) for fault in error.faults)) from None
        return cls(name, skeleton, 1.0 / rate, values)

    @property
    def n_frames(self) -> int:
        """How many frames the clip has."""
        return len(self.values)

    @property
    def duration_s(self) -> float:
        """Seconds from the first frame to the last."""
        return max(0, self.n_frames - 1) * self.frame_time_s

    @property
    def rate(self) -> float:
        """Frames a second."""
        return 1.0 / self.frame_time_s


def load_bvh(path: str | PathLike[str], *, metres_per_unit: float = CENTIMETRE, up: Up = "y", name: str | None = None) -> Clip:
    """Read one BVH file.

    Parameters
    ----------
    path : path
        A UTF-8 text, with or without a byte order mark.
    metres_per_unit : float
        What one unit of the file is; the format does not say. Default: a centimetre.
    up : "y", "z" or "x"
        The file's axis that points up.
    name : str, optional
        The clip's name. Default: the file's, without its ending.

    Raises
    ------
    ClipError
        The text is no BVH: with its line, what was read, what is accepted and the nearest mend.
    FileError
        The file cannot be opened; where it is missing, with the nearest name there is.
    ContextError
        `path` is none.
    """
    place = require_path(path)
    file = str(path)
    try:
        raw = read_bytes(place)
    except FileError as error:
        raise FileError(*(replace(fault, rule="file") for fault in error.faults), errno=error.errno) from None
    return parse_bvh(text_of(raw, file), place.stem if name is None else name, file=file, metres_per_unit=metres_per_unit, up=up)


def parse_bvh(text: str, name: str, *, file: str | None = None, metres_per_unit: float = CENTIMETRE, up: Up = "y") -> Clip:
    """The clip of a BVH text; `file` is the text's name in messages. Raises ClipError, with each line that cannot be read."""
    require_text(text, "text")
    skeleton, frame_time_s, values = bvh.read(text, file)
    return Clip(name, skeleton, frame_time_s, values, metres_per_unit, up)


def write_bvh(clip: Clip, target: str | PathLike[str] | TextIO, *, digits: int = 6) -> None:
    """Write a clip as BVH to a path or an open text file.

    Reading it again gives the same motion, to so many digits behind the point. The unit and the axis that points up are not in the
    format: read the file with the same ones. Raises FileError where the disk refuses; the old file is then whole; ContextError
    where `clip` is none, `target` neither a path nor an open file, or `digits` no whole number from 0 to 17.
    """
    require_kind(clip, Clip, "clip", "a Clip")
    digits = require_whole(digits, "digits")
    if not 0 <= digits <= MOST_DIGITS:
        raise ContextError(Fault(f"{digits} digits behind the point.", f"0 to {MOST_DIGITS}"))
    if not hasattr(target, "write"):
        require_path(target, "target")
    text = bvh.write(clip.skeleton, clip.frame_time_s, clip.values, digits)
    if not isinstance(target, (str, PathLike)):
        target.write(text)
        return
    write_atomic(fspath(target), text.encode())


def _array(given: ArrayLike) -> NDArray[Any]:
    """An array of numbers, or an empty one in place of what is none."""
    try:
        array = np.asarray(given)
    except ValueError:
        return np.zeros(0)
    return array if array.dtype.kind in "iuf" else np.zeros(0)


def _of_arrays(
    names: list[str], parents: NDArray[Any], offsets: NDArray[Any], rotations: NDArray[Any], positions: NDArray[Any]
) -> tuple[Skeleton, Floats]:
    faults = list(joint_arrays.tree_faults(names, parents))
    if faults:
        raise ClipError(*faults)
    n = len(names)
    still, turns, places = (np.asarray(each, np.float64) for each in (offsets, rotations, positions))
    joint_arrays.require_numbers(still, "offsets", (n, 3))
    joint_arrays.require_numbers(turns, "rotations", (None, n, 4))
    if places.ndim == 2:
        root = int(np.flatnonzero(parents < 0)[0])
        joint_arrays.require_numbers(places, "positions", (len(turns), 3))
        places, moved = np.repeat(still[None], len(turns), axis=0), places
        places[:, root] = moved
    joint_arrays.require_numbers(places, "positions", (len(turns), n, 3))
    lengths = np.linalg.norm(turns, axis=-1, keepdims=True)
    if not lengths.all():
        raise ClipError(Fault("a rotation is 0 in all four numbers.", "quaternions (w, x, y, z) of any length above 0"))
    order = joint_arrays.depth_first(parents.astype(np.int64))
    places, still, turns = places[:, order], still[order], (turns / lengths)[:, order]
    moving = joint_arrays.moving_joints(still, places)
    rank = np.argsort(order)
    above = np.where(parents[order] < 0, -1, rank[np.maximum(parents[order], 0)]).astype(np.int64)
    channels = joint_arrays.channels_of(n, moving)
    skeleton = Skeleton(tuple(names[joint] for joint in order), above, still / CENTIMETRE, channels)
    return skeleton, joint_arrays.values_of(turns, places / CENTIMETRE, moving)


def text_of(raw: bytes, file: str) -> str:
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise _no_text("the file is UTF-16", 1, file)
    if b"\0" in raw:
        raise _no_text("the file is binary: it holds a zero byte", line_of(raw, raw.index(b"\0")), file)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _no_text(f"byte 0x{raw[error.start]:02x} is not UTF-8", line_of(raw, error.start), file) from error


def _no_text(problem: str, line: int, file: str) -> ClipError:
    return ClipError(
        Fault(f"{problem}.", "a BVH file in UTF-8 text, which starts with the word HIERARCHY", place=Place(file, line))
    )


def _faults(clip: Clip) -> Iterable[Fault]:
    """What is wrong with a clip made in Python, or with the unit and axis given for a file."""
    unit = clip.metres_per_unit
    require_kind(clip.skeleton, Skeleton, "skeleton", "a Skeleton")
    require_kind(clip.values, np.ndarray, "values", "a float64 array, frames x channels")
    require_kind(unit, Real, "metres_per_unit", "a number above 0")
    require_kind(clip.frame_time_s, Real, "frame_time_s", "a number above 0")
    require_text(clip.name, "name")
    if not math.isfinite(unit) or unit <= 0.0:
        yield Fault(f"metres_per_unit is {unit!r}.", "a number above 0, such as 0.01 for centimetres")
    if clip.up not in UPS:
        yield Fault(f"the axis that points up is {in_quotes(str(clip.up))}.", some(UPS), mend_for(str(clip.up), UPS))
    if not 0.0 < clip.frame_time_s <= bvh.LONGEST_FRAME_S:
        yield Fault(f"the frame time is {clip.frame_time_s!r} s.", f"more than 0 and at most {bvh.LONGEST_FRAME_S:g}")
    wanted = clip.skeleton.n_channels
    if clip.values.ndim != 2 or clip.values.shape[1] != wanted or not np.isfinite(clip.values).all():
        shape = " x ".join(map(str, clip.values.shape))
        yield Fault(f"the values are {shape}, or not all finite.", f"finite numbers, frames x {wanted} channels")
