"""A clip as it is looked at before anything is proposed for it: its joints against its body, its speed, its feet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from contextdb.errors import MotionError, plural, some
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.bone_names import cores_of
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.feet import Footfalls
from contextdb.motion.clips.poses import Poses, poses_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.clips.trajectory import Trajectory, root_trajectory
from contextdb.motion.markup.reserved import ReservedTag
from contextdb.motion.output.retargeting import retargeted
from contextdb.motion.preparing.clip_facts import ENDS_S, SLOW_SHARE, STANDING_MPS, Moments, falls_of, require_finite, step_of
from contextdb.motion.preparing.proposal import ClipHead, Kind, Proposal

NEAR_MS = 1e-6
"""Times that differ by less are the same."""
LOOP_M, LOOP_MPS = 0.03, 0.3
"""A clip loops where its joints are so near at both ends, and so alike in speed: root mean squares."""
LOOP_SHARE = 0.15
"""Of the body's speed: so unlike may these speeds be, where that is more."""
ENTRY_S = 0.2
"""The entry zone of a start and of a turn."""


@dataclass(frozen=True, eq=False)
class Look:
    """A clip as it is looked at."""

    clip: Clip
    poses: Poses
    path: Trajectory
    falls: Footfalls | None

    @classmethod
    def at(cls, clip: Clip) -> Look:
        """Look at a clip of one frame or more."""
        assert not isinstance(clip, ClipHead), "its motion is forgotten"
        poses = poses_of(clip)
        require_finite(clip, poses)
        return cls(clip, poses, root_trajectory(poses), falls_of(poses))

    @cached_property
    def own(self) -> Floats:
        """Where the joints are against the body's place on the ground and its heading: [F, J, 3]."""
        frames = np.arange(self.poses.n_frames)
        return self.seen(frames, frames)

    def seen(self, frames: Ints, body: Ints) -> Floats:
        """Where the joints are in some frames, as the body sees them from its place in others: [frames, J, 3]."""
        origin = np.stack((self.path.positions[body, 0], np.zeros(len(body)), self.path.positions[body, 1]), axis=-1)
        half = -self.path.headings[body] / 2.0
        turn = np.stack((np.cos(half), np.zeros_like(half), np.sin(half), np.zeros_like(half)), axis=-1)
        return quaternions.rotate(turn[:, None, :], self.poses.positions[frames] - origin[:, None])

    @cached_property
    def own_speeds(self) -> Floats:
        """How fast they move there: [F, J, 3]."""
        if self.poses.n_frames < 3:
            return np.zeros_like(self.own)
        return np.asarray(np.gradient(self.own, 1.0 / self.poses.rate, axis=0, edge_order=2))

    @cached_property
    def speeds(self) -> Floats:
        """How fast the body goes over the ground about each frame, over a fifth of a second: [F]."""
        n, last = max(1, round(ENDS_S * self.poses.rate / 2.0)), self.poses.n_frames - 1
        at = np.arange(last + 1)
        before, behind = np.maximum(at - n, 0), np.minimum(at + n, last)
        moved = np.linalg.norm(self.path.positions[behind] - self.path.positions[before], axis=-1)
        return np.asarray(moved * self.poses.rate / np.maximum(behind - before, 1))

    @cached_property
    def moments(self) -> Moments:
        return Moments.of(self.path, step_of(self.falls))

    @property
    def rate(self) -> float:
        """Frames a second."""
        return self.poses.rate

    @property
    def stands_mps(self) -> float:
        """Slower than this it stands."""
        return min(STANDING_MPS, SLOW_SHARE * self.usual_mps)

    @property
    def loop_mps(self) -> float:
        """How alike in speed its ends must be for it to loop: the faster a body goes, the faster its limbs change."""
        return max(LOOP_MPS, LOOP_SHARE * self.usual_mps)

    @property
    def usual_mps(self) -> float:
        return float(np.median(self.moments.speeds))

    def proposal(self, kind: Kind, tag: str | None, first: int | None, last: int | None, reason: str, measure: float) -> Proposal:
        """A proposal about frames from `first` to `last`."""
        begin, end = span_of_frames(first, last, self.rate)
        if tag == ReservedTag.EXCLUDED:
            begin, end = span_about_frames(first, last, self.rate)
        value = None
        if tag == ReservedTag.NEXT_NATURAL_ONLY and begin is not None and end is not None:
            value = min(ENTRY_S, math.floor(100.0 * (end - begin)) / 100.0)  # no longer than the span
        return Proposal(self.clip.name, kind, tag, begin, end, value, reason, round(measure, 4))


def span_of_frames(first: int | None, last: int | None, rate: float) -> tuple[float | None, float | None]:
    """The seconds of a span that holds these frames and, below 1,000 frames a second, no other: rounded outwards to 0.001 s."""
    begin = None if first is None else math.floor(1000.0 * first / rate + NEAR_MS) / 1000.0
    end = None if last is None else math.ceil(1000.0 * last / rate - NEAR_MS) / 1000.0
    return begin, end


def span_about_frames(first: int | None, last: int | None, rate: float) -> tuple[float | None, float | None]:
    """The seconds between the frames beside these: at another rate, all that these have a part in."""
    begin = None if first is None else math.floor(1000.0 * (first - 1) / rate + NEAR_MS + 1.0) / 1000.0
    end = None if last is None else math.ceil(1000.0 * (last + 1) / rate - NEAR_MS - 1.0) / 1000.0
    return begin, end


# ---- which rigs of a folder meet: clips of other bodies, names and units that can be put on the rig of which there are most
# clips


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
