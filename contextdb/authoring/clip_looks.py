"""What the clips of a folder show, looked at here, on all cores or on Dask: in chunks, so that no more of them are in memory.

    ClipAt ─► the clip, read ─► Seen: its head, its measures, and what is asked for: facts of a row, proposals of marks

A clip itself is forgotten once it was looked at; its head stays. An edge: this touches the disk.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from contextdb.disk.engines import Engines
from contextdb.disk.own_files import (
    has_own,
    is_own_folder,
    make_own_folder,
    own_names,
    read_own,
    remove_own,
    remove_own_folder,
    write_own,
)
from contextdb.errors import ContextDBError, Fault, FileError, Place
from contextdb.motion.clips.clip import MOST_RATE, Clip, Unit, Up
from contextdb.motion.clips.clip_measures import Measures, measure
from contextdb.motion.clips.on_the_spot import ground_motion, with_ground_motion
from contextdb.motion.clips.source import ClipSource, clip_name
from contextdb.motion.preparing.clip_facts import ClipFacts, facts_of
from contextdb.motion.preparing.proposal import PREPARING, ClipHead, KeptClip, Kind, key_of
from contextdb.motion.preparing.proposals import look_for
from contextdb.motion.storage.building import CACHE_FOLDER
from contextdb.motion.storage.clip_files import Rig

CHUNK = 16
"""So many of many clips are looked at together."""
MANY = 64
"""For more clips it is worth to start workers."""


@dataclass(frozen=True)
class ClipAt:
    """A clip in a file, and how it is read; see `ClipSource.clip`."""

    file: Path
    take: str
    unit: Unit
    up: Up
    rig: Rig | None = None
    is_by_feet: bool = False

    @property
    def name(self) -> str:
        return clip_name(self.file, self.take)

    def source(self) -> ClipSource:
        return ClipSource.of(self.file)

    def clip(self, source: ClipSource) -> Clip:
        """The clip as its file has it. Raises ContextDBError."""
        return source.clip(self.take, metres_per_unit=self.unit, up=self.up)


@dataclass(frozen=True)
class Looks:
    """What is asked about each clip: the facts of its row, and marks of some kinds; `known` are those that are known already."""

    facts: bool = False
    kinds: tuple[Kind, ...] = ()
    known: Mapping[str, KeptClip] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Seen:
    """What a clip shows. `faults` say why it could not be looked at, though it could be read; `states_unit` whether its format says
    its unit and axis."""

    head: ClipHead
    notes: tuple[str, ...]
    states_unit: bool
    measures: Measures
    facts: ClipFacts | None = None
    proposals: KeptClip | None = None
    faults: tuple[Fault, ...] = ()


LeftOut = tuple[str, ...]
"""Why a file is no clip."""


def chunks_of(clips: Sequence[ClipAt]) -> list[tuple[ClipAt, ...]]:
    """The clips in chunks: of few clips each by itself."""
    size = CHUNK if len(clips) > MANY else 1
    return [tuple(clips[i : i + size]) for i in range(0, len(clips), size)]


def look_at_chunk(looks: Looks, chunk: tuple[ClipAt, ...]) -> list[Seen | LeftOut]:
    """What some clips show."""
    return [look_at(looks, clip) for clip in chunk]


def look_at(looks: Looks, at: ClipAt) -> Seen | LeftOut:
    """What a clip shows, or why it is none."""
    try:
        source = at.source()
        plain = at.clip(source)
        notes = [f"{at.file}: {note}" for note in plain.notes]
        clip = _on_its_way(plain, at.is_by_feet, notes)
        clip = clip if at.rig is None or not clip.n_frames else at.rig.clip(clip)
    except ContextDBError as error:
        return tuple(str(fault) for fault in error.faults)
    if clip.n_frames == 0:
        return (f"{at.file}: the clip has no frame (Frames: 0).",)
    if clip.rate > MOST_RATE:
        problem = f"the frame time is {clip.frame_time_s!r} s."
        return (str(Fault(problem, f"{1.0 / MOST_RATE:g} or more", place=Place(str(at.file)))),)
    facts, proposals, faults = None, None, tuple[Fault, ...]()
    try:
        facts = facts_of(clip) if looks.facts else None
        proposals = _proposals(clip, looks) if looks.kinds else None
    except ContextDBError as error:
        faults = error.faults
    head = ClipHead.of(clip, key_of(clip) if proposals is None else proposals.key)
    return Seen(head, tuple(notes), source.format.states_unit, measure(clip), facts, proposals, faults)


def _proposals(clip: Clip, looks: Looks) -> KeptClip:
    known, key = looks.known.get(clip.name), key_of(clip)
    own = KeptClip(key) if known is None or known.key != key else KeptClip(key, dict(known.found), known.shape)
    look_for(own, clip, looks.kinds)
    return own


def _on_its_way(clip: Clip, is_by_feet: bool, notes: list[str]) -> Clip:
    """A clip, with the motion of its feet where that is asked for; one that runs on the spot is noted."""
    motion = ground_motion(clip)
    if motion is None:
        return clip
    about = f"{clip.name} runs on the spot: its standing feet are those of {motion.speed_mps:.2f} m/s"
    if is_by_feet:
        notes.append(f"{about}, which its root is given.")
        return with_ground_motion(clip, motion)
    notes.append(f'{about}. root = "feet" in [databases.NAME], or --root-from feet, gives its root this motion.')
    return clip


# ---- what was seen of many clips, kept on disk while the others are looked at, so that a run that was killed goes on where
# it stopped. .contextdb-cache/seen/KEY.json the clips of one chunk The key is a digest of what was asked and of the files:
# their sizes and times, as they were before they were read. The folder goes when a run comes to its end. A file that is
# missing or cannot be read is as if it were not there. An edge: this touches the disk

VERSION = 1
SUFFIX = ".json"


@dataclass(frozen=True)
class SavedLooks:
    """The chunks in the cache of a folder."""

    folder: Path

    @classmethod
    def of(cls, folder: Path) -> SavedLooks:
        """Those of a folder of clips."""
        return cls(folder / CACHE_FOLDER / "seen")

    def key(self, looks: Looks, chunk: Sequence[ClipAt]) -> str:
        """What is asked about which clips as they are now."""
        questions = [VERSION, PREPARING, looks.facts, list(looks.kinds)]
        clips = [
            [str(at.file), at.take, at.unit, at.up, at.is_by_feet, at.rig.digest if at.rig else "", *_stamp(at.file)]
            for at in chunk
        ]
        return hashlib.blake2b(json.dumps([questions, clips]).encode(), digest_size=16).hexdigest()

    def get(self, key: str) -> list[Seen | LeftOut] | None:
        """What was seen of a chunk; None where that is not known."""
        with suppress(FileError, OSError, ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError):
            if is_own_folder(self.folder.parent) and has_own(self.folder / f"{key}{SUFFIX}"):
                return [_read(each) for each in json.loads(read_own(self.folder / f"{key}{SUFFIX}"))]
        return None

    def put(self, key: str, seen: Sequence[Seen | LeftOut]) -> None:
        """Keep what was seen of a chunk, unless something kept a clip from being looked at, which is said anew each time."""
        if any(isinstance(each, Seen) and each.faults for each in seen):
            return
        with suppress(FileError, OSError):
            make_own_folder(self.folder.parent)
            make_own_folder(self.folder, is_ignored=False)
            write_own(self.folder / f"{key}{SUFFIX}", json.dumps([_written(each) for each in seen]).encode(), syncs=False)

    def remove(self) -> None:
        with suppress(FileError, OSError):
            if not is_own_folder(self.folder.parent):
                return
            for name in own_names(self.folder):
                if name.endswith(SUFFIX):
                    remove_own(self.folder / name)
            remove_own_folder(self.folder)


def look_at_all(
    clips: Sequence[ClipAt], looks: Looks, engines: Engines, saved: SavedLooks | None = None
) -> Iterator[tuple[int, Seen | LeftOut]]:
    """What each clip shows, with its number, in any order; of many clips what was seen before is not looked at again."""
    is_much = len(clips) > MANY
    chunks = list(enumerate(chunks_of(clips)))
    size = len(chunks[0][1]) if chunks else 1
    keys = {i: saved.key(looks, chunk) for i, chunk in chunks} if saved is not None and is_much else {}
    left = []
    for i, chunk in chunks:
        known = saved.get(keys[i]) if saved is not None and keys else None
        if known is None:
            left.append((i, chunk))
        else:
            yield from enumerate(known, size * i)
    for k, seen in engines(look_at_chunk, looks, [chunk for _, chunk in left], named_chunk, is_much=is_much):
        i = left[k][0]
        if saved is not None and keys:
            saved.put(keys[i], seen)
        yield from enumerate(seen, size * i)


def named_chunk(chunk: Sequence[ClipAt]) -> str:
    """What a chunk is called where it was lost."""
    return f"{chunk[0].file} to {chunk[-1].file}" if len(chunk) > 1 else str(chunk[0].file)


def _stamp(file: Path) -> list[int]:
    try:
        status = os.stat(file)
    except OSError:
        return [0, 0]
    return [status.st_size, status.st_mtime_ns]


def _written(seen: Seen | LeftOut) -> object:
    if not isinstance(seen, Seen):
        return list(seen)
    plain = {"notes": seen.notes, "states_unit": seen.states_unit, "head": seen.head.to_json(), "measures": seen.measures.to_json()}
    facts = None if seen.facts is None else seen.facts.to_json()
    return {**plain, "facts": facts, "proposals": None if seen.proposals is None else seen.proposals.to_json()}


def _read(document: object) -> Seen | LeftOut:
    if isinstance(document, list):
        return tuple(map(str, document))
    assert isinstance(document, dict)
    facts, proposals = document["facts"], document["proposals"]
    return Seen(
        ClipHead.of_json(document["head"]),
        tuple(document["notes"]),
        bool(document["states_unit"]),
        Measures.of_json(document["measures"]),
        None if facts is None else ClipFacts.of_json(facts),
        None if proposals is None else KeptClip.of_json(proposals),
    )
