"""What the clips of a folder show, looked at here, on all cores or on Dask: in chunks, so that no more of them are in memory.

    ClipAt ─► the clip, read ─► Seen: its head, its measures, and what is asked for: facts of a row, proposals of marks

A clip itself is forgotten once it was looked at; its head stays. An edge: this touches the disk.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from contextdb.errors import ContextDBError, Fault, Place
from contextdb.motion.clips.clip import MOST_RATE, Clip, Unit, Up
from contextdb.motion.clips.clip_measures import Measures, measure
from contextdb.motion.clips.on_the_spot import ground_motion, with_ground_motion
from contextdb.motion.clips.source import ClipSource, clip_name
from contextdb.motion.preparing.clip_facts import ClipFacts, facts_of
from contextdb.motion.preparing.proposal import ClipHead, KeptClip, Kind, key_of
from contextdb.motion.preparing.proposals import look_for
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
        """The file, read."""
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
