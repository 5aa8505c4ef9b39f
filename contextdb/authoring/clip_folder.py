"""The clips of a folder: of its databases, where it is a project, else every file of clips in it and below."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from contextdb.authoring.clip_looks import ClipAt, LeftOut, Looks, SavedLooks, Seen, look_at_all
from contextdb.disk import path_in_quotes
from contextdb.disk.boundary import inside
from contextdb.disk.engines import Engines, here
from contextdb.errors import Fault, FileError, MotionError, Place, in_quotes, plural, some
from contextdb.motion.clips.clip import CENTIMETRE, Clip, Unit, Up
from contextdb.motion.clips.clip_measures import UNITS, Measures, measure, unit_of
from contextdb.motion.clips.doubts import LEAST_BODY_M, LYING_SHARE
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.clips.source import ENDINGS, clip_name, takes_of
from contextdb.motion.preparing.clip_facts import ClipFacts
from contextdb.motion.preparing.look import Meeting
from contextdb.motion.preparing.proposal import ClipHead, KeptClip
from contextdb.motion.storage.clip_files import Rig, named_takes
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.database_settings import DatabaseSettings
from contextdb.tables.project import SCHEMA_FILE, folder_of, read_folder_schema

MARKUP = "marks.csv"
CLIPS_OR_TABLES = f"a folder of clips, or of tables with {SCHEMA_FILE}"
Databases = Mapping[str, DatabaseSettings]
NO_LOOKS = Looks()
Tell = Callable[[int, int, str], None]
"""Takes how many clips are done of how many, and the name of the last."""
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
    seen: list[Seen] = field(default_factory=list)
    places: list[ClipAt] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    config: MotionConfig = field(default_factory=MotionConfig)

    @property
    def clips(self) -> list[ClipHead]:
        return [seen.head for seen in self.seen]

    def facts(self) -> list[ClipFacts]:
        """What each clip shows. Raises MotionError where one could not be looked at."""
        if faults := [fault for seen in self.seen for fault in seen.faults]:
            raise MotionError(*faults)
        return [seen.facts for seen in self.seen if seen.facts is not None]

    def proposals(self) -> dict[str, KeptClip]:
        """What marks are for each clip, by its name. Raises MotionError where one could not be looked at."""
        if faults := [fault for seen in self.seen for fault in seen.faults]:
            raise MotionError(*faults)
        return {seen.head.name: seen.proposals for seen in self.seen if seen.proposals is not None}

    @property
    def is_by_feet(self) -> bool:
        """Whether standing feet move the roots of clips on the spot."""
        return any(at.is_by_feet for at in self.places)

    @property
    def paths(self) -> list[Path]:
        return [at.file for at in self.places]


def clips_of(
    path: str | Path,
    metres_per_unit: float | None,
    up: Up | None,
    tell: Tell,
    wants: Wanted | None = None,
    looks: Looks = NO_LOOKS,
    engines: Engines = here,
    root: str | None = None,
) -> FolderClips:
    """Look at the clips of a folder; of a project with `wants` at those of the databases that it leaves of all. Raises
    ContextDBError where there is no such folder, no clip in it, or two clips of one name.

    `root` is that of databases, in the place of what a project says.
    """
    folder = folder_of(Path(path), CLIPS_OR_TABLES)
    folder_clips = FolderClips(folder)
    if (folder / SCHEMA_FILE).is_file():
        schema = read_folder_schema(folder)
        folder_clips.config = MotionConfig.from_dict(schema.motion, file=schema.file)
    if wants is not None and folder_clips.config.databases:
        folder_clips.config = replace(folder_clips.config, databases=wants(folder_clips.config.databases))
    files = _files(folder_clips, metres_per_unit, up, root)
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
    wanted = [
        ClipAt(file, take, CENTIMETRE if unit is None else unit, axis, rig, is_by_feet)
        for (file, take), (unit, axis, rig, is_by_feet) in files.items()
    ]
    results: list[Seen | LeftOut] = [()] * len(wanted)
    saved = SavedLooks.of(folder)
    for n_done, (i, seen) in enumerate(look_at_all(wanted, looks, engines, saved), start=1):
        results[i] = seen
        tell(n_done, len(wanted), wanted[i].name)
    rigs: dict[object, Skeleton] = {}
    for at, seen in zip(wanted, results, strict=True):
        if isinstance(seen, Seen):
            folder_clips.places.append(at)
            folder_clips.seen.append(_of_one_rig(seen, rigs))
        else:
            folder_clips.left_out += seen
    if not folder_clips.config.databases:
        _guess(folder_clips, up is None, metres_per_unit is None, looks, engines, saved)
    saved.remove()
    folder_clips.notes[:0] = [note for seen in folder_clips.seen for note in seen.notes]
    return folder_clips


def _of_one_rig(seen: Seen, rigs: dict[object, Skeleton]) -> Seen:
    """The same with a skeleton that many clips share, where it is equal: each came from a worker by itself."""
    own = seen.head.skeleton
    skeleton = rigs.setdefault((own.names, own.parents.tobytes(), own.offsets.tobytes(), own.channels, own.end_sites), own)
    return seen if skeleton is own else replace(seen, head=replace(seen.head, skeleton=skeleton))


def _guess(clips: FolderClips, guesses_axes: bool, guesses_units: bool, looks: Looks, engines: Engines, saved: SavedLooks) -> None:
    """Choose what files leave open, and look again at clips that are read in another way then."""
    rigs = _rigs(clips.clips, [i for i, seen in enumerate(clips.seen) if not seen.states_unit])
    before = list(clips.places)
    if guesses_axes:
        _guess_axes(clips, rigs)
    if guesses_units:
        _guess_units(clips, rigs)
    changed = [i for i, (old, new) in enumerate(zip(before, clips.places, strict=True)) if old != new]
    for k, seen in look_at_all([clips.places[i] for i in changed], looks, engines, saved):
        if isinstance(seen, Seen):
            clips.seen[changed[k]] = seen


def facts_on_rigs(clips: FolderClips, meetings: Iterable[Meeting], looks: Looks, engines: Engines) -> None:
    """Look again for the facts of clips that are put on the rig of others, as they are there."""
    places: dict[int, ClipAt] = {}
    for meeting in meetings:
        (first, *_), *others = meeting.rigs
        head = clips.seen[first].head
        rig = Rig(head.skeleton, head.metres_per_unit, {}, (), "")
        places |= {i: replace(clips.places[i], rig=rig) for members in others for i in members}
    numbers = [*places]
    for k, seen in look_at_all([*places.values()], looks, engines):
        if isinstance(seen, Seen):
            clips.seen[numbers[k]] = replace(clips.seen[numbers[k]], facts=seen.facts, faults=seen.faults)


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


def _files(clips: FolderClips, unit: float | None, up: Up | None, root: str | None) -> dict[tuple[Path, str], Read]:
    """The files and takes with how each is read; of a file in several databases as the first has it."""
    files: dict[tuple[Path, str], Read] = {}
    for settings in clips.config.databases.values():
        rig = Rig.of(settings, clips.folder, clips.config.file)
        for _, file, take in named_takes(settings, clips.folder, clips.config.file):
            own = settings.metres_per_unit if unit is None else unit
            files.setdefault((file, take), (own, up or settings.up, rig, (root or settings.root) == "feet"))
    if clips.config.databases:
        return files
    takes = ((file, take) for file in clips_below(clips.folder, needs=True) for take in takes_of(file) or ("",))
    return dict.fromkeys(takes, (unit, up or "y", None, root == "feet"))


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
        some = members[:: math.ceil(len(members) / MOST_SEEN)]
        if not _lie(clips.seen[i].measures for i in some):
            continue
        read = [at.clip(at.source()) for at in (clips.places[i] for i in some)]
        up = next((up for up in others if not _lie(measure(replace(clip, up=up)) for clip in read)), None)
        if up is None:
            continue
        about = f"{clips.seen[members[0]].head.name} and its rig ({plural(len(members), 'clip')}) would lie if y pointed up"
        clips.notes.append(f"{about}: {up} is taken to point up. --up says otherwise.")
        for i in members:
            clips.places[i] = replace(clips.places[i], up=up)


def _lie(measures: Iterable[Measures]) -> bool:
    """Whether the body lies in most of some clips."""
    lying = [each.lying >= LYING_SHARE for each in measures]
    return sum(lying) > len(lying) / 2


def _guess_units(clips: FolderClips, rigs: Sequence[Sequence[int]]) -> None:
    """Take clips of an unlikely size for such in another unit, rig by rig, and tell of it."""
    for members in rigs:
        first = clips.seen[members[0]]
        size, unit = first.measures.size_m, unit_of(first.measures)
        if size <= 0.0 or unit == CENTIMETRE:
            continue
        about = f"{first.head.name} and its rig ({plural(len(members), 'clip')}) would be {size:.2g} m tall in centimetres"
        if unit is None:
            clips.notes.append(f"{about}; --metres-per-unit says what a unit is. Expected: from {LEAST_BODY_M:g} m.")
            continue
        clips.notes.append(f"{about}: a unit of {unit:g} m ({UNITS[unit]}) is taken. --metres-per-unit says otherwise.")
        for i in members:
            clips.places[i] = replace(clips.places[i], unit=unit)


def below(paths: Sequence[Path], folder: Path) -> list[str] | None:
    """Paths as patterns of a contextdb.toml in a folder name them; None where one is elsewhere."""
    root = Path(os.path.abspath(folder))
    try:
        return [Path(os.path.abspath(path)).relative_to(root).as_posix() for path in paths]
    except ValueError:
        return None
