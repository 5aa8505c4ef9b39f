"""Footfalls: when each foot is down, and the questions that locomotion asks of it.

A footfall is a time, a footstep a place (not here). A foot is either down or up; down it is an interval of seconds.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004: two times for each foot and cycle, from which follow "is my foot
down or up, how long is it till the next transition, and what fraction of the way through the current state am I".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_kind, require_number, require_pair, require_text
from contextdb.errors import Fault, MotionError, in_quotes, nearest, some
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.poses import Poses, poses_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton, sided_pairs

FOOT_WORDS = ("foot", "ankle")
SHORTEST_S = 0.07
"""A foot that rests or leaves the ground for less is taken not to: noise."""
LONGEST_STEP_S = 1.5
"""A foot that stays down, or up, for longer stands and takes no step."""


@dataclass(frozen=True, eq=False)
class Footfalls:
    """When each foot is down within a clip.

    Attributes
    ----------
    duration_s : float
        Seconds from the clip's first frame to its last.
    down : mapping of foot to float64 array, shape (n, 2)
        Seconds at which the foot comes down and goes up, ascending, from 0 to `duration_s`.
    """

    duration_s: float
    down: Mapping[str, Floats]

    @property
    def feet(self) -> tuple[str, ...]:
        """The bones of the feet, left first."""
        return tuple(self.down)

    def is_down(self, foot: str, time_s: float) -> bool:
        """Whether the foot is down."""
        intervals = self._of(foot)
        return bool(((intervals[:, 0] <= time_s) & (time_s <= intervals[:, 1])).any())

    def until_change_s(self, foot: str, time_s: float) -> float:
        """Seconds until the foot next comes down or goes up; infinite when it does neither before the clip ends."""
        later = self._changes(foot)
        later = later[later > time_s]
        return float(later[0]) - time_s if len(later) else math.inf

    def share_of_state(self, foot: str, time_s: float) -> float:
        """How much of the time for which the foot is now down, or now up, has passed: 0 to 1. The clip's ends count as changes."""
        changes = np.concatenate(([0.0], self._changes(foot), [self.duration_s]))
        begin = changes[changes <= time_s].max(initial=0.0)
        end = changes[changes > time_s].min(initial=self.duration_s)
        return float(np.clip((time_s - begin) / (end - begin), 0.0, 1.0)) if end > begin else 0.0

    def _changes(self, foot: str) -> Floats:
        """The times within the clip at which the foot comes down or goes up."""
        times = np.sort(self._of(foot).ravel())
        return times[(times > 0.0) & (times < self.duration_s)]

    def _of(self, foot: str) -> Floats:
        if require_text(foot, "foot") not in self.down:
            near = nearest(foot, self.feet)
            raise MotionError(Fault(f"there is no foot {in_quotes(foot)}.", some(self.feet), in_quotes(near) if near else ""))
        return self.down[foot]


def footfalls(clip: Clip, feet: tuple[str, str] | None = None, *, slowest_mps: float = 0.2, highest_m: float = 0.15) -> Footfalls:
    """Find when each foot of a clip is down: where it is slow and low, for at least 0.07 s.

    Parameters
    ----------
    clip : Clip
    feet : (left bone, right bone), optional
        Default: the sided bones whose names hold "foot" or "ankle".
    slowest_mps : float
        A foot that moves faster, from frame to frame, is up.
    highest_m : float
        A foot higher above its lowest place in the clip is up.

    Raises
    ------
    MotionError
        The skeleton has no such bones, or none that look like feet.
    ContextError
        `clip` is none, `feet` is no pair, or a limit no number from 0 up.
    """
    require_kind(clip, Clip, "clip", "a Clip")
    if feet is not None:
        require_pair(feet, "feet", "the names of two bones, left and right")
    slowest_mps, highest_m = require_number(slowest_mps, "slowest_mps"), require_number(highest_m, "highest_m")
    bones = feet_of(clip.skeleton) if feet is None else feet
    return footfalls_of(poses_of(clip), bones, slowest_mps=slowest_mps, highest_m=highest_m)


def footfalls_of(
    poses: Poses, feet: tuple[str, str] | None = None, *, slowest_mps: float = 0.2, highest_m: float = 0.15
) -> Footfalls:
    """As `footfalls`, of poses in the world."""
    bones = feet_of(poses.skeleton) if feet is None else feet
    joints = [poses.skeleton.index(bone) for bone in bones]
    if poses.n_frames == 0:
        return Footfalls(0.0, {bone: np.zeros((0, 2)) for bone in bones})
    places, frame_time_s = poses.positions[:, joints], 1.0 / poses.rate
    found = {bone: _intervals(places[:, i], frame_time_s, slowest_mps, highest_m) for i, bone in enumerate(bones)}
    return Footfalls((poses.n_frames - 1) * frame_time_s, found)


def feet_of(skeleton: Skeleton) -> tuple[str, str]:
    """The sided bones, left first, whose names hold "foot" or "ankle"; a MotionError asks for them when there are none."""
    pairs = sided_pairs(skeleton.names)
    found = next((pair for word in FOOT_WORDS for pair in pairs if word in pair[0].casefold()), None)
    if found is None:
        raise MotionError(Fault("no pair of bones is named like feet.", f"feet=(left, right), of {some(skeleton.names)}"))
    return found


def phases(falls: Footfalls, times_s: Floats) -> Floats:
    """How far each foot is through its step at some times: float64 [times, 4], sine and cosine of the left foot, then the right.

    The angle grows evenly from 0, when the foot comes down, to π, when it goes up, and on to 2π, when it comes down again: a walk
    and a run have the same phases though their feet are down for different shares. A state that the clip's beginning or end cuts
    off is taken to be as long as the middle one of its kind, and no shorter than what is seen of it.

    A foot that neither comes down nor goes up has no phase: 0, 0. So has one in the middle of a state longer than 1.5 s, which is
    standing and no step; towards the step before and the one behind, within 0.75 s, the values grow to those of the phase there.
    """
    states = {foot: _states(falls, foot) for foot in falls.feet}
    typical = {
        is_down: _middle([s.end_s - s.begin_s for listed in states.values() for s in listed if s.is_down == is_down and s.is_whole])
        for is_down in (True, False)
    }
    return np.concatenate([_phase(states[foot], typical, times_s) for foot in falls.feet], axis=1)


@dataclass(frozen=True, slots=True)
class _State:
    """A stretch of time in which a foot is down, or up; not whole when the clip's beginning or end cuts it."""

    begin_s: float
    end_s: float
    is_down: bool
    is_cut_before: bool
    is_cut_behind: bool

    @property
    def is_whole(self) -> bool:
        return not (self.is_cut_before or self.is_cut_behind)


def _states(falls: Footfalls, foot: str) -> list[_State]:
    """All states of a foot, from the clip's beginning to its end."""
    edges = [0.0, *falls._changes(foot).tolist(), falls.duration_s]
    last = len(edges) - 2
    return [
        _State(begin, end, falls.is_down(foot, (begin + end) / 2.0), i == 0, i == last)
        for i, (begin, end) in enumerate(pairwise(edges))
    ]


def _middle(lengths: list[float]) -> float:
    return float(np.median(lengths)) if lengths else 0.0


def _phase(states: list[_State], typical: Mapping[bool, float], times_s: Floats) -> Floats:
    """Sine and cosine of one foot's phase: [times, 2]."""
    begins = np.array([state.begin_s for state in states])
    which = np.clip(np.searchsorted(begins, times_s, side="right") - 1, 0, len(states) - 1)
    found = np.zeros((len(times_s), 2))
    for i, state in enumerate(states):
        at = which == i
        found[at] = _phase_in(state, typical[state.is_down], times_s[at])
    return found


def _phase_in(state: _State, typical_s: float, times_s: Floats) -> Floats:
    """Sine and cosine of the phase at times within one state: [times, 2]."""
    if state.is_cut_before and state.is_cut_behind:
        return np.zeros((len(times_s), 2))
    long_s = state.end_s - state.begin_s
    full_s = long_s if state.is_whole else max(long_s, typical_s)
    since, until = times_s - state.begin_s, state.end_s - times_s
    if state.is_cut_before:
        since = full_s - until
    elif state.is_cut_behind:
        until = full_s - since
    sign = 1.0 if state.is_down else -1.0
    if full_s > LONGEST_STEP_S:
        after = 0.0 if state.is_cut_before else np.clip(1.0 - 2.0 * since / LONGEST_STEP_S, 0.0, None)
        ahead = 0.0 if state.is_cut_behind else np.clip(1.0 - 2.0 * until / LONGEST_STEP_S, 0.0, None)
        return np.stack((np.zeros(len(times_s)), np.broadcast_to(sign * (after - ahead), len(times_s))), axis=-1)
    angles = np.pi * since / full_s
    return sign * np.stack((np.sin(angles), np.cos(angles)), axis=-1)


def _intervals(places: Floats, frame_time_s: float, slowest_mps: float, highest_m: float) -> Floats:
    """The intervals of seconds [n, 2] in which a foot that takes these places [F, 3] is down."""
    if len(places) < 2:
        return np.zeros((1, 2))
    is_low = places[:, 1] - places[:, 1].min() <= highest_m
    is_slow = np.linalg.norm(np.diff(places, axis=0), axis=-1) <= slowest_mps * frame_time_s
    is_down = is_slow & is_low[1:] & is_low[:-1]
    shortest = SHORTEST_S / frame_time_s
    for first, after in _spans(~is_down):
        if first > 0 and after < len(is_down) and after - first < shortest:
            is_down[first:after] = True
    n = len(is_down)  # a stance that the clip's ends cut may be short
    found = [(first, after) for first, after in _spans(is_down) if after - first >= shortest or first == 0 or after == n]
    return np.array(found, np.float64).reshape(-1, 2) * frame_time_s


def _spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Where each run of True begins, and the index behind its end."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
