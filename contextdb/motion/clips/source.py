"""Files of clips in any format: what a file holds, the names of its clips, and each of them.

    path ─► ClipSource(bytes, format) ─► names ─► Clip

What a file holds is asked of its bytes, not of its ending. Nothing after this knows formats. A file of one animation is a clip of
the file's name; of a file with several each is `FILE:TAKE`.
"""

from __future__ import annotations

import html
import os
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from os import PathLike
from pathlib import Path
from time import monotonic

import numpy as np

from contextdb.cells.arguments import require_many, require_path
from contextdb.console import announce_very_large, announced_while
from contextdb.disk import read_bytes
from contextdb.errors import ClipError, ContextDBError, Fault, FileError, Place, in_quotes, mend_for, some
from contextdb.motion.clips import gltf, npz
from contextdb.motion.clips.clip import BY_SIZE, CENTIMETRE, Clip, Unit, Up, parse_bvh, text_of
from contextdb.motion.clips.clip_measures import unit_by_size
from contextdb.motion.clips.joint_worlds import numbered
from contextdb.motion.clips.parser_process import parser

TAKE = ":"
"""Between the name of a file and that of one of its takes."""
ONE_TAKE: tuple[str, ...] = ()


@dataclass(frozen=True)
class Format:
    """A format of clips."""

    name: str
    endings: tuple[str, ...]
    is_format: Callable[[bytes], bool]
    """Whether the bytes begin as such a file does."""
    takes: Callable[[bytes, str], tuple[str, ...]]
    """The names of its animations; none where the file is one clip."""
    read: Callable[[ClipSource, str, str, float, Up], Clip]
    """The clip."""
    states_unit: bool = True
    """Whether a file says its unit and which axis points up, so that settings of both are about other files."""
    whole: Callable[[bytes, Path], bytes] = lambda content, path: content
    """The bytes with those of other files that it needs."""
    version: int = 1
    """One more whenever the same file would give another clip."""


@dataclass(frozen=True)
class ClipSource:
    """A file of clips: its bytes, and what they are."""

    path: Path
    content: bytes
    format: Format
    opened_s: float = field(default_factory=monotonic, compare=False)

    @classmethod
    def of(cls, path: str | PathLike[str]) -> ClipSource:
        """A file; raises FileError where it cannot be opened, ClipError where it is of no format of clips."""
        place, start = require_path(path), monotonic()
        try:
            content = read_bytes(place)
        except FileError as error:
            raise FileError(*(replace(fault, rule="file") for fault in error.faults), errno=error.errno) from None
        form = format_of(content, str(path))
        announce_very_large(str(path), len(content))
        with announced_while(str(path), start):
            return cls(place, form.whole(content, place), form, start)

    @property
    def file(self) -> str:
        return str(self.path)

    @cached_property
    def takes(self) -> tuple[str, ...]:
        """The names of its animations, where it has several."""
        with announced_while(self.file, self.opened_s):
            takes = self.format.takes(self.content, self.file)
        return takes if len(takes) > 1 else ONE_TAKE

    @property
    def names(self) -> list[str]:
        return [clip_name(self.path, take) for take in self.takes or ("",)]

    def clip(self, take: str = "", name: str | None = None, *, metres_per_unit: Unit = CENTIMETRE, up: Up = "y") -> Clip:
        """The clip of a take; "size" is the unit in which its body is of a usual size, where the format does not say one. Raises
        ClipError where it cannot be read, or there are several takes and none of this name."""
        takes = self.takes
        if takes and take not in takes:
            problem = f"the file has {len(takes)} takes, and none is named {in_quotes(take)}."
            raise ClipError(Fault(problem, some(takes), mend_for(take, takes), Place(self.file)))
        if take and not takes:
            problem = f"the file has one clip, and no take {in_quotes(take)}."
            raise ClipError(Fault(problem, "the file without a take", place=Place(self.file)))
        plain = CENTIMETRE if metres_per_unit == BY_SIZE else metres_per_unit
        with announced_while(self.file, self.opened_s), np.errstate(all="ignore"):  # readers refuse what is not finite
            clip = self.format.read(self, clip_name(self.path, take) if name is None else name, take, plain, up)
        if metres_per_unit != BY_SIZE or self.format.states_unit:
            return clip
        return replace(clip, metres_per_unit=unit_by_size(clip) or CENTIMETRE)


def clip_name(path: Path, take: str) -> str:
    """The name of a file's clip."""
    return f"{path.stem}{TAKE}{take}" if take else path.stem


def take_at(text: str) -> tuple[str | None, str]:
    """The file and the take of `FILE` or `FILE:TAKE`; None and "" of a name that is no file's."""
    parts = _FILE.fullmatch(text)
    return (None, "") if parts is None else (parts[1], parts[2] or "")


def format_of(content: bytes, file: str) -> Format:
    """The format of a file, by how it begins; by its ending where that says nothing."""
    if content[:2] in PICKLES and content[-1:] == b".":
        raise ClipError(Fault("the file is a pickle, which is never loaded.", "arrays in .npz", UNPICKLE, Place(file)))
    begins = next((each for each in FORMATS if each.is_format(content)), None)
    ends = next((each for each in FORMATS if Path(file).suffix.casefold() in each.endings), BVH)
    return begins or ends


def takes_of(path: Path) -> tuple[str, ...]:
    """The takes of a file with several, which may have to be opened; none of one that cannot be read: whoever reads it says why."""
    if path.suffix.casefold() in (*BVH.endings, *NPZ.endings):
        return ONE_TAKE
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return ONE_TAKE
    return _takes_of(path, status.st_size, status.st_mtime_ns, status.st_ino)


@lru_cache(maxsize=1 << 16)
def _takes_of(path: Path, *_state: int) -> tuple[str, ...]:
    """The takes of a file in a state: several questions about a project ask for them."""
    try:
        return ClipSource.of(path).takes
    except (ClipError, FileError):
        return ONE_TAKE


def load_clips(paths: Iterable[str | PathLike[str]], *, metres_per_unit: float = CENTIMETRE, up: Up = "y") -> list[Clip]:
    """Read the clips of several files, of any format; of a file with several takes all, in order, of `FILE:TAKE` that one.

    `metres_per_unit` and `up` are about files whose format does not say either. Raises one ClipError with the faults of all that
    are broken or cannot be read.
    """
    return [clip for _, clip in clips_by_file(paths, metres_per_unit, up)]


def clips_by_file(paths: Iterable[str | PathLike[str]], metres_per_unit: float, up: Up) -> list[tuple[str, Clip]]:
    """The same, each with the name of its file."""
    clips = []
    faults: list[Fault] = []
    for path in require_many(paths, "paths", "a list of paths"):
        try:
            file, wanted = _file_and_take(path)
            source = ClipSource.of(file)
            for take in (wanted,) if wanted else source.takes or ("",):
                clip = source.clip(take, metres_per_unit=metres_per_unit, up=up)
                clips.append((f"{source.file}{TAKE}{wanted}" if wanted else source.file, clip))
        except (ClipError, FileError) as error:
            faults.extend(error.faults)
    if faults:
        raise ClipError(*faults)
    return clips


def _file_and_take(path: str | PathLike[str]) -> tuple[str | PathLike[str], str]:
    """A path, and the take that is named after it; of a file whose own name looks so none."""
    file, take = take_at(os.fspath(require_path(path)))
    return (path, "") if not take or file is None or os.path.exists(path) else (file, take)


PICKLES = (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05")
UNPICKLE = 'to convert it, where you trust it: data = pickle.load(open("FILE.pkl", "rb")); np.savez("FILE.npz", **data)'


def _one_take(content: bytes, file: str) -> tuple[str, ...]:
    return ONE_TAKE


def _read_bvh(source: ClipSource, name: str, take: str, metres_per_unit: float, up: Up) -> Clip:
    text = text_of(source.content, source.file)
    return parse_bvh(text, name, file=source.file, metres_per_unit=metres_per_unit, up=up)


def _read_npz(source: ClipSource, name: str, take: str, metres_per_unit: float, up: Up) -> Clip:
    return npz.read(source.content, name, source.file)


def _read_gltf(source: ClipSource, name: str, take: str, metres_per_unit: float, up: Up) -> Clip:
    return gltf.read(source.content, source.takes.index(take) if take else 0, name, source.file)


# ---- FBX and USD files as clips: how they begin, their takes, and the clip of one. They are read by a child process

BINARY_FBX = b"Kaydara FBX Binary"
_ASCII_FBX = re.compile(rb"\s*;\s*FBX|\s*FBXHeaderExtension\s*:")
_ASCII_TAKE = re.compile(rb'AnimationStack:\s{0,9}-?\d{1,20},\s{0,9}"(?:AnimStack::)?([^"]{0,300})"')
_BINARY_TAKE = re.compile(rb"AnimationStackL.{8}S.{4}([^\0]{0,300}?)\0\x01AnimStack", re.DOTALL)
_OLD_TAKE = re.compile(rb'Take:\s{0,9}"([^"]{1,300})"\s{0,9}\{')
MOST_INDENT = 64


def is_fbx(content: bytes) -> bool:
    """Whether bytes begin as FBX, binary or in ASCII."""
    return content.startswith(BINARY_FBX) or _ASCII_FBX.match(content[:256]) is not None


def fbx_takes(content: bytes, file: str) -> tuple[str, ...]:
    """The names of the takes as they stand in the bytes, in order, without reading the file; doubled ones with their number."""
    if content.startswith(BINARY_FBX):
        matches = _BINARY_TAKE.findall(content)
    else:
        matches = _at_lines(_ASCII_TAKE, content) or _at_lines(_OLD_TAKE, content)
    names = [" ".join(html.unescape(match.decode("utf-8", "replace")).split()) or "take" for match in matches]
    return numbered(names)


def _at_lines(pattern: re.Pattern[bytes], content: bytes) -> list[bytes]:
    """The first group of each match with nothing but white space before it in its line: 20 times as fast as a pattern with `^`."""
    groups = []
    for match in pattern.finditer(content):
        before = content[max(match.start() - MOST_INDENT, 0) : match.start()]
        _, line_end, indent = before.rpartition(b"\n")
        if not indent.strip() and (line_end or len(before) < MOST_INDENT):
            groups.append(match[1])
    return groups


def is_usd(content: bytes) -> bool:
    """Whether bytes begin as USD, as a text or as a crate."""
    return content.startswith((b"#usda", b"PXR-USDC"))


def usd_takes(content: bytes, file: str) -> tuple[str, ...]:
    """None: a stage is one clip."""
    return ()


def _read_scene(kind: str, source: ClipSource, name: str, take: str, metres_per_unit: float, up: Up) -> Clip:
    """The clip of a take of "fbx" or "usd". Raises ClipError."""
    worlds = parser(kind).worlds(source.content, source.takes.index(take) if take else 0, source.file)
    try:
        return worlds.clip(name)
    except ContextDBError as error:
        raise ClipError(*(fault.at(Place(source.file)) for fault in error.faults)) from None
    except ValueError as error:
        raise ClipError(Fault(f"the joints are no body ({error}).", "a skeleton", place=Place(source.file))) from None


BVH = Format("BVH", (".bvh",), lambda content: content[:64].lstrip()[:9].upper() == b"HIERARCHY", _one_take, _read_bvh, False)
NPZ = Format("arrays", (".npz",), lambda content: content.startswith(b"PK\x03\x04"), _one_take, _read_npz)
GLTF = Format("glTF", (".glb", ".gltf"), gltf.is_gltf, gltf.takes, _read_gltf, whole=gltf.packed)
FBX = Format("FBX", (".fbx",), is_fbx, fbx_takes, partial(_read_scene, "fbx"))
USD = Format("USD", (".usd", ".usda", ".usdc"), is_usd, usd_takes, partial(_read_scene, "usd"))
FORMATS = (BVH, FBX, GLTF, USD, NPZ)
ENDINGS = tuple(ending for each in FORMATS for ending in each.endings)
_FILE = re.compile(f"(.+?(?:{'|'.join(map(re.escape, ENDINGS))}))(?:{TAKE}(.*))?", re.IGNORECASE | re.DOTALL)
