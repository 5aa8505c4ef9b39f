"""The clips of a folder: of its databases, where it is a project, else every BVH file in it and below."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from contextdb.disk import path_in_quotes
from contextdb.errors import ContextDBError, Fault, FileError, Place, in_quotes, plural
from contextdb.motion.clips.clip import CENTIMETRE, Clip, Up, load_bvh
from contextdb.motion.clips.doubts import LEAST_BODY_M, LYING_SHARE, UNITS, USUAL_BODY_M, measure
from contextdb.motion.storage.clip_files import paths_of
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.database_settings import DatabaseSettings
from contextdb.motion.storage.rigs import Rig
from contextdb.tables.project import SCHEMA_FILE, folder_of, read_folder_schema

MARKUP = "marks.csv"
Databases = Mapping[str, DatabaseSettings]
Tell = Callable[[int, int, str], None]
"""Takes how many clips are done of how many, and the name of the next."""
Wanted = Callable[[Databases], Databases]
"""What leaves of the databases of a project those that are wanted: one or more."""
LEAST_USUAL_M, MOST_USUAL_M = 0.9, 2.6
"""How tall a body is, in a unit that may be right."""
SAME_UNIT = 2.0
"""Bodies whose bones are at most so many times as long as the first one's are in its unit; an inch is 2.54 cm."""
MOST_SEEN = 8
"""So many clips of a rig are looked at for the axis that points up."""
MOST_RATE = 1e6
"""Frames a second: speeds of a clip that has more of them are no numbers to reckon with."""


@dataclass
class FolderClips:
    """The clips of a folder in the order of their paths; `left_out` says what is wrong with files that are no clips, `notes` what
    was taken for granted, `config` what the project says of motion (nothing of a folder of clips)."""

    folder: Path
    clips: list[Clip] = field(default_factory=list)
    paths: list[Path] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    config: MotionConfig = field(default_factory=MotionConfig)


def clips_of(
    path: str | Path, metres_per_unit: float | None, up: Up | None, tell: Tell, wants: Wanted | None = None
) -> FolderClips:
    """Read the clips of a folder; of a project with `wants` those of the databases that it leaves of all. Raises ContextDBError
    where there is no such folder, no clip in it, or two clips of one name."""
    folder = folder_of(Path(path), f"a folder of clips, or of tables with {SCHEMA_FILE}")
    found = FolderClips(folder)
    if (folder / SCHEMA_FILE).is_file():
        schema = read_folder_schema(folder)
        found.config = MotionConfig.from_dict(schema.motion, file=schema.file)
    if wants is not None and found.config.databases:
        found.config = replace(found.config, databases=wants(found.config.databases))
    files = _files(found, metres_per_unit, up)
    if not files:
        raise FileError(Fault("there is no BVH file in this folder or below it.", "*.bvh", place=Place(str(folder))))
    first: dict[str, Path] = {}
    twice = []
    for file in files:
        if first.setdefault(file.stem, file) is not file:
            both = f"{path_in_quotes(first[file.stem])} and {path_in_quotes(file)}"
            twice.append(Fault(f"two clips are named {in_quotes(file.stem)}: {both}.", "a different name for each asset"))
    if twice:
        raise FileError(*twice)
    for i, (file, (unit, axis, rig)) in enumerate(files.items()):
        tell(i, len(files), file.stem)
        _read(found, file, CENTIMETRE if unit is None else unit, axis, rig)
    if not found.config.databases:
        rigs = _rigs(found.clips)
        if up is None:
            _guess_axes(found, rigs)
        if metres_per_unit is None:
            _guess_units(found, rigs)
    return found


def clips_below(folder: Path) -> list[Path]:
    """The BVH files in a folder and below it, if any; a folder is none, whatever its name."""
    return sorted(Path(at) / name for at, _, names in os.walk(folder) for name in names if name.lower().endswith(".bvh"))


def bvh_files(folder: Path) -> list[Path]:
    """The same, one or more. Raises FileError where there is none."""
    files = clips_below(folder)
    if not files:
        raise FileError(Fault("there is no BVH file in this folder or below it.", "*.bvh", place=Place(str(folder))))
    return files


def _files(found: FolderClips, unit: float | None, up: Up | None) -> dict[Path, tuple[float | None, Up, Rig | None]]:
    """The files with unit, axis and rig; of a file in several databases those of the first."""
    files: dict[Path, tuple[float | None, Up, Rig | None]] = {}
    for settings in found.config.databases.values():
        rig = Rig.of(settings, found.folder, found.config.file)
        for file in paths_of(settings, found.folder, found.config.file):
            files.setdefault(file, (settings.metres_per_unit if unit is None else unit, up or settings.up, rig))
    if found.config.databases:
        return files
    return dict.fromkeys(bvh_files(found.folder), (unit, up or "y", None))


def _read(found: FolderClips, file: Path, unit: float, up: Up, rig: Rig | None) -> None:
    try:
        clip = load_bvh(file, metres_per_unit=unit, up=up)
        clip = clip if rig is None or not clip.n_frames else rig.clip(clip)
    except ContextDBError as error:
        found.left_out += [str(fault) for fault in error.faults]
        return
    if clip.n_frames == 0:
        found.left_out.append(f"{file}: the clip has no frame (Frames: 0).")
        return
    if clip.rate > MOST_RATE:
        told = f"the frame time is {clip.frame_time_s!r} s."
        found.left_out.append(str(Fault(told, f"{1.0 / MOST_RATE:g} or more", place=Place(str(file)))))
        return
    found.clips.append(clip)
    found.paths.append(file)


def _rigs(clips: Sequence[Clip]) -> list[list[int]]:
    """The clips of each rig, by their numbers: bones of the same names, in the same unit."""
    rigs: dict[tuple[str, ...], list[tuple[float, list[int]]]] = {}
    for i, clip in enumerate(clips):
        length = float(np.linalg.norm(clip.skeleton.offsets[1:], axis=1).sum())
        sizes = rigs.setdefault(clip.skeleton.names, [])
        alike = next((members for size, members in sizes if size <= SAME_UNIT * length and length <= SAME_UNIT * size), None)
        if alike is None:
            sizes.append((length, [i]))
        else:
            alike.append(i)
    return [members for sizes in rigs.values() for _, members in sizes]


def _guess_axes(found: FolderClips, rigs: Sequence[Sequence[int]]) -> None:
    """Take clips in which bodies lie for such with another axis up, where they stand with it, rig by rig, and tell of it."""
    others: tuple[Up, ...] = ("z", "x")
    for members in rigs:
        seen = [found.clips[i] for i in members[:: math.ceil(len(members) / MOST_SEEN)]]
        up = next((up for up in others if not _lie([replace(clip, up=up) for clip in seen])), None) if _lie(seen) else None
        if up is None:
            continue
        about = f"{found.clips[members[0]].name} and its rig ({plural(len(members), 'clip')}) would lie if y pointed up"
        found.notes.append(f"{about}: {up} is taken to point up. --up says otherwise.")
        for i in members:
            found.clips[i] = replace(found.clips[i], up=up)


def _lie(clips: Sequence[Clip]) -> bool:
    """Whether the body lies in most of some clips."""
    return sum(measure(clip).lying >= LYING_SHARE for clip in clips) > len(clips) / 2


def _guess_units(found: FolderClips, rigs: Sequence[Sequence[int]]) -> None:
    """Take clips of an unlikely size for such in another unit, rig by rig, and tell of it."""
    for members in rigs:
        first = found.clips[members[0]]
        size = measure(first).size_m
        if LEAST_USUAL_M <= size <= MOST_USUAL_M or size <= 0.0:
            continue
        unit = min(UNITS, key=lambda unit: abs(math.log(size * unit / CENTIMETRE / USUAL_BODY_M)))
        about = f"{first.name} and its rig ({plural(len(members), 'clip')}) would be {size:.2g} m tall in centimetres"
        if not LEAST_USUAL_M <= size * unit / CENTIMETRE <= MOST_USUAL_M:
            found.notes.append(f"{about}; --metres-per-unit says what a unit is. Expected: from {LEAST_BODY_M:g} m.")
            continue
        found.notes.append(f"{about}: a unit of {unit:g} m ({UNITS[unit]}) is taken. --metres-per-unit says otherwise.")
        for i in members:
            found.clips[i] = replace(found.clips[i], metres_per_unit=unit)


def below(paths: Sequence[Path], folder: Path) -> list[str] | None:
    """Paths as patterns of a contextdb.toml in a folder name them; None where one is elsewhere."""
    root = Path(os.path.abspath(folder))
    try:
        return [Path(os.path.abspath(path)).relative_to(root).as_posix() for path in paths]
    except ValueError:
        return None
