"""The clips of a folder: of its databases, where it is a project, else every file of clips in it and below."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from contextdb.disk import path_in_quotes
from contextdb.disk.boundary import inside
from contextdb.errors import ContextDBError, Fault, FileError, Place, in_quotes, plural, some
from contextdb.motion.clips.clip import CENTIMETRE, MOST_RATE, Clip, Unit, Up
from contextdb.motion.clips.clip_measures import UNITS, measure, unit_by_size
from contextdb.motion.clips.doubts import LEAST_BODY_M, LYING_SHARE
from contextdb.motion.clips.on_the_spot import ground_motion, with_ground_motion
from contextdb.motion.clips.source import ENDINGS, ClipSource, clip_name, takes_of
from contextdb.motion.storage.clip_files import named_takes
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.database_settings import DatabaseSettings
from contextdb.motion.storage.rigs import Rig
from contextdb.tables.project import SCHEMA_FILE, folder_of, read_folder_schema

MARKUP = "marks.csv"
Databases = Mapping[str, DatabaseSettings]
Tell = Callable[[int, int, str], None]
"""Takes how many clips are done of how many, and the name of the next."""
Read = tuple[Unit | None, Up, Rig | None, bool]
"""A clip's unit, axis, rig, and whether feet move its root."""
Wanted = Callable[[Databases], Databases]
"""What leaves of the databases of a project those that are wanted: one or more."""
SAME_UNIT = 2.0
"""Bodies whose bones are at most so many times as long as the first one's are in its unit; an inch is 2.54 cm."""
MOST_SEEN = 8
"""So many clips of a rig are looked at for the axis that points up."""


@dataclass
class FolderClips:
    """The clips of a folder in the order of their paths; `left_out` says what is wrong with files that are no clips, `notes` what
    was taken for granted, `config` what the project says of motion (nothing of a folder of clips)."""

    folder: Path
    clips: list[Clip] = field(default_factory=list)
    paths: list[Path] = field(default_factory=list)
    without_unit: list[int] = field(default_factory=list)
    """Clips of formats that say neither a unit nor which axis points up."""
    left_out: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    config: MotionConfig = field(default_factory=MotionConfig)


def clips_of(
    path: str | Path, metres_per_unit: float | None, up: Up | None, tell: Tell, wants: Wanted | None = None
) -> FolderClips:
    """Read the clips of a folder; of a project with `wants` those of the databases that it leaves of all. Raises ContextDBError
    where there is no such folder, no clip in it, or two clips of one name."""
    folder = folder_of(Path(path), f"a folder of clips, or of tables with {SCHEMA_FILE}")
    folder_clips = FolderClips(folder)
    if (folder / SCHEMA_FILE).is_file():
        schema = read_folder_schema(folder)
        folder_clips.config = MotionConfig.from_dict(schema.motion, file=schema.file)
    if wants is not None and folder_clips.config.databases:
        folder_clips.config = replace(folder_clips.config, databases=wants(folder_clips.config.databases))
    files = _files(folder_clips, metres_per_unit, up)
    if not files:
        raise FileError(_none_below(folder))
    first: dict[str, Path] = {}
    twice = []
    for file, take in files:
        name = clip_name(file, take)
        if first.setdefault(name, file) is not file:
            both = f"{path_in_quotes(first[name])} and {path_in_quotes(file)}"
            twice.append(Fault(f"two clips are named {in_quotes(name)}: {both}.", "a different name for each asset"))
    if twice:
        raise FileError(*twice)
    for i, ((file, take), (unit, axis, rig, is_by_feet)) in enumerate(files.items()):
        tell(i, len(files), clip_name(file, take))
        _read(folder_clips, file, take, CENTIMETRE if unit is None else unit, axis, rig, is_by_feet)
    if not folder_clips.config.databases:
        rigs = _rigs(folder_clips.clips, folder_clips.without_unit)
        if up is None:
            _guess_axes(folder_clips, rigs)
        if metres_per_unit is None:
            _guess_units(folder_clips, rigs)
    return folder_clips


def clips_below(folder: Path, *, needs: bool = False) -> list[Path]:
    """The files of clips in a folder and below it; a folder is none, whatever its name. Raises FileError where a link
    leads out of the folder, or there is none and one is needed."""
    files = sorted(Path(at) / name for at, _, names in os.walk(folder) for name in names if name.lower().endswith(ENDINGS))
    if needs and not files:
        raise FileError(_none_below(folder))
    return [inside(path, folder) for path in files]


def _none_below(folder: Path) -> Fault:
    return Fault(
        "there is no file of clips in this folder or below it.", some(f"*{each}" for each in ENDINGS), place=Place(str(folder))
    )


def _files(clips: FolderClips, unit: float | None, up: Up | None) -> dict[tuple[Path, str], Read]:
    """The files and takes with how each is read; of a file in several databases as the first has it."""
    files: dict[tuple[Path, str], Read] = {}
    for settings in clips.config.databases.values():
        rig = Rig.of(settings, clips.folder, clips.config.file)
        for _, file, take in named_takes(settings, clips.folder, clips.config.file):
            own = settings.metres_per_unit if unit is None else unit
            files.setdefault((file, take), (own, up or settings.up, rig, settings.root == "feet"))
    if clips.config.databases:
        return files
    takes = ((file, take) for file in clips_below(clips.folder, needs=True) for take in takes_of(file) or ("",))
    return dict.fromkeys(takes, (unit, up or "y", None, False))


def _read(clips: FolderClips, file: Path, take: str, unit: Unit, up: Up, rig: Rig | None, is_by_feet: bool) -> None:
    try:
        source = ClipSource.of(file)
        clip = source.clip(take, metres_per_unit=unit, up=up)
        clips.notes += [f"{file}: {note}" for note in clip.notes]
        clip = _on_its_way(clips, clip, is_by_feet)
        clip = clip if rig is None or not clip.n_frames else rig.clip(clip)
    except ContextDBError as error:
        clips.left_out += [str(fault) for fault in error.faults]
        return
    if clip.n_frames == 0:
        clips.left_out.append(f"{file}: the clip has no frame (Frames: 0).")
        return
    if clip.rate > MOST_RATE:
        problem = f"the frame time is {clip.frame_time_s!r} s."
        clips.left_out.append(str(Fault(problem, f"{1.0 / MOST_RATE:g} or more", place=Place(str(file)))))
        return
    if not source.format.states_unit:
        clips.without_unit.append(len(clips.clips))
    clips.clips.append(clip)
    clips.paths.append(file)


def _on_its_way(clips: FolderClips, clip: Clip, is_by_feet: bool) -> Clip:
    """A clip, with the motion of its feet where that is asked for; one that runs on the spot is reported."""
    motion = ground_motion(clip)
    if motion is None:
        return clip
    about = f"{clip.name} runs on the spot: its standing feet are those of {motion.speed_mps:.2f} m/s"
    if is_by_feet:
        clips.notes.append(f"{about}, which its root is given.")
        return with_ground_motion(clip, motion)
    clips.notes.append(f'{about}. root = "feet" in [databases.NAME] gives its root this motion.')
    return clip


def _rigs(clips: Sequence[Clip], numbers: Iterable[int]) -> list[list[int]]:
    """Some clips of each rig, by their numbers: bones of the same names, in the same unit."""
    rigs: dict[tuple[str, ...], list[tuple[float, list[int]]]] = {}
    for i in numbers:
        clip = clips[i]
        length = float(np.linalg.norm(clip.skeleton.offsets[1:], axis=1).sum())
        sizes = rigs.setdefault(clip.skeleton.names, [])
        alike = next((members for size, members in sizes if size <= SAME_UNIT * length and length <= SAME_UNIT * size), None)
        if alike is None:
            sizes.append((length, [i]))
        else:
            alike.append(i)
    return [members for sizes in rigs.values() for _, members in sizes]


def _guess_axes(clips: FolderClips, rigs: Sequence[Sequence[int]]) -> None:
    """Take clips in which bodies lie for such with another axis up, where they stand with it, rig by rig, and tell of it."""
    others: tuple[Up, ...] = ("z", "x")
    for members in rigs:
        seen = [clips.clips[i] for i in members[:: math.ceil(len(members) / MOST_SEEN)]]
        up = next((up for up in others if not _lie([replace(clip, up=up) for clip in seen])), None) if _lie(seen) else None
        if up is None:
            continue
        about = f"{clips.clips[members[0]].name} and its rig ({plural(len(members), 'clip')}) would lie if y pointed up"
        clips.notes.append(f"{about}: {up} is taken to point up. --up says otherwise.")
        for i in members:
            clips.clips[i] = replace(clips.clips[i], up=up)


def _lie(clips: Sequence[Clip]) -> bool:
    """Whether the body lies in most of some clips."""
    return sum(measure(clip).lying >= LYING_SHARE for clip in clips) > len(clips) / 2


def _guess_units(clips: FolderClips, rigs: Sequence[Sequence[int]]) -> None:
    """Take clips of an unlikely size for such in another unit, rig by rig, and tell of it."""
    for members in rigs:
        first = clips.clips[members[0]]
        size, unit = measure(first).size_m, unit_by_size(first)
        if size <= 0.0 or unit == CENTIMETRE:
            continue
        about = f"{first.name} and its rig ({plural(len(members), 'clip')}) would be {size:.2g} m tall in centimetres"
        if unit is None:
            clips.notes.append(f"{about}; --metres-per-unit says what a unit is. Expected: from {LEAST_BODY_M:g} m.")
            continue
        clips.notes.append(f"{about}: a unit of {unit:g} m ({UNITS[unit]}) is taken. --metres-per-unit says otherwise.")
        for i in members:
            clips.clips[i] = replace(clips.clips[i], metres_per_unit=unit)


def below(paths: Sequence[Path], folder: Path) -> list[str] | None:
    """Paths as patterns of a contextdb.toml in a folder name them; None where one is elsewhere."""
    root = Path(os.path.abspath(folder))
    try:
        return [Path(os.path.abspath(path)).relative_to(root).as_posix() for path in paths]
    except ValueError:
        return None
