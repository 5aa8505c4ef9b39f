"""A clip: one animation as its file says it, with what the file leaves open, its unit and which way is up.

Values stay in the file's units and in degrees, so that writing a clip loses nothing; `contextdb.motion.clips.poses` turns them into
metres with y up. F frames, C channels.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from numbers import Real
from os import PathLike, fspath
from typing import Literal, TextIO, get_args

import numpy as np

from contextdb.cells.arguments import require_kind, require_many, require_path, require_text, require_whole
from contextdb.disk import read_bytes, write_atomic
from contextdb.errors import ClipError, ContextError, Fault, FileError, Place, in_quotes, mend_for, some
from contextdb.files.strangers import line_of
from contextdb.motion.clips import bvh
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton

Up = Literal["y", "z", "x"]
UPS: tuple[Up, ...] = get_args(Up)

CENTIMETRE = 0.01
"""What one unit of most BVH files is, in metres; the format itself does not say."""
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
    """

    name: str
    skeleton: Skeleton
    frame_time_s: float
    values: Floats
    metres_per_unit: float = CENTIMETRE
    up: Up = "y"

    def __post_init__(self) -> None:
        faults = list(_faults(self))
        if faults:
            raise ClipError(*(fault.at(Place(self.name)) for fault in faults))
        values = self.values.view()
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

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
        The text is no BVH: with its line, what was found, what is accepted and the nearest mend.
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


def load_clips(paths: Iterable[str | PathLike[str]], *, metres_per_unit: float = CENTIMETRE, up: Up = "y") -> list[Clip]:
    """Read several BVH files; raises one ClipError with the faults of all that are broken or cannot be read."""
    clips = []
    faults: list[Fault] = []
    for path in require_many(paths, "paths", "a list of paths"):
        try:
            clips.append(load_bvh(path, metres_per_unit=metres_per_unit, up=up))
        except (ClipError, FileError) as error:
            faults.extend(error.faults)
    if faults:
        raise ClipError(*faults)
    return clips


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


def text_of(raw: bytes, file: str) -> str:
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise _no_text("the file is UTF-16", 1, file)
    if b"\0" in raw:
        raise _no_text("the file is binary: it holds a zero byte", line_of(raw, raw.index(b"\0")), file)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _no_text(f"byte 0x{raw[error.start]:02x} is not UTF-8", line_of(raw, error.start), file) from error


def _no_text(found: str, line: int, file: str) -> ClipError:
    return ClipError(Fault(f"{found}.", "a BVH file in UTF-8 text, which starts with the word HIERARCHY", place=Place(file, line)))


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
