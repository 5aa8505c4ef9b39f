"""Which rigs of a folder meet: clips of other bodies, names and units that can be put on the rig of which there are most clips."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from contextdb.errors import MotionError, plural, some
from contextdb.motion.clips.bone_names import cores_of
from contextdb.motion.clips.clip import Clip
from contextdb.motion.output.retargeting import retargeted


@dataclass(frozen=True)
class Meeting:
    """The clips that share a rig, by their numbers: those of the rig itself first, then the rigs that are put on it. `reason` says
    why it is not put on one before it."""

    rigs: tuple[tuple[int, ...], ...]
    reason: str = ""

    @property
    def members(self) -> list[int]:
        """All clips."""
        return [i for rig in self.rigs for i in rig]


def meetings(clips: Sequence[Clip], rigs: Sequence[Sequence[int]]) -> list[Meeting]:
    """What rigs become: each is put on the first one before it on which it can be."""
    met: list[Meeting] = []
    for members in rigs:
        reasons = [_why_not(clips[other.rigs[0][0]], clips[members[0]]) for other in met]
        if "" in reasons:
            at = reasons.index("")
            met[at] = replace(met[at], rigs=(*met[at].rigs, tuple(members)))
        else:
            met.append(Meeting((tuple(members),), next(iter(reasons), "")))
    return met


def notes_of(clips: Sequence[Clip], met: Sequence[Meeting]) -> list[str]:
    """Which rigs meet on one, and why others have databases of their own."""
    notes = []
    for each in met:
        first, *others = (clips[rig[0]].name for rig in each.rigs)
        if others:
            notes.append(
                f"{plural(len(each.rigs), 'rig')} meet on that of {first}; put on it: the clips of {some(others)} and their rigs."
            )
        if each.reason:
            n_clips = plural(len(each.members), "clip")
            notes.append(f"{first} and its rig ({n_clips}) have a database and a controller of their own: {each.reason}")
    return notes


def _why_not(rig: Clip, clip: Clip) -> str:
    """Why a clip of another body cannot be put on a rig; nothing where it can be."""
    if not rig.up == clip.up == "y":
        return "another axis points up."
    names = [{*cores_of(each.skeleton.names)} for each in (rig, clip)]
    if 2 * len(names[0] & names[1]) < min(map(len, names)):
        return f"most bones have other names than those of {rig.name}. rig_bones in contextdb.toml says which are the same."
    try:
        retargeted(replace(clip, values=clip.values[:1]), rig.skeleton, metres_per_unit=rig.metres_per_unit)
    except MotionError as error:
        return error.faults[0].found
    return ""
