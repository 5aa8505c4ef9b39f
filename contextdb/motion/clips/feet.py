"""Footfalls: when each foot is down, and the questions that locomotion asks of it.

A footfall is a time, a footstep a place (not here). A foot is either down or up; down it is an interval of seconds.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004: two times for each foot and cycle, from which follow "is my foot
down or up, how long is it till the next transition, and what fraction of the way through the current state am I".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from contextdb.cells.arguments import require_kind, require_number, require_pair, require_text
from contextdb.errors import MotionError, no_such
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.contacts import ground_points, stances
from contextdb.motion.clips.foot_bones import UNDECLARED, Foot, FootBones
from contextdb.motion.clips.poses import Poses, poses_of
from contextdb.motion.clips.quaternions import Floats

ContactMark = Sequence[tuple[float, float, bool]]
"""Stretches of seconds that are marked by hand, each with whether the foot is down in it."""
ContactMarks = tuple[ContactMark | None, ContactMark | None]
"""Those of the left and of the right foot; None of a foot without."""
NO_MARKS: ContactMarks = (None, None)
ALIKE_S = 0.05
"""A mark whose ends are so near to those of a stance that is detected says the same."""
TOE_MPS, TOE_RISES_M = 0.6, 0.04
"""A toe stands that is slower, and no higher over the lowest place of its stance."""
LONGEST_STEP_S = 1.5
"""A foot that stays down, or up, for longer stands and takes no step."""


@dataclass(frozen=True, eq=False)
class Footfalls:
    """When each foot is down within a clip."""

    duration_s: float
    """Seconds from the clip's first frame to its last."""
    down: Mapping[str, Floats]
    """Seconds at which the foot comes down and goes up, ascending, from 0 to `duration_s`: float64 [n, 2]."""

    @property
    def feet(self) -> tuple[str, ...]:
        """The bones of the feet, left first."""
        return tuple(self.down)

    def is_down(self, foot: str, time_s: float) -> bool:
        intervals = self._of(foot)
        return bool(((intervals[:, 0] <= time_s) & (time_s <= intervals[:, 1])).any())

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
            raise MotionError(no_such("foot", foot, self.feet))
        return self.down[foot]


def footfalls(clip: Clip, feet: tuple[str, str] | None = None, *, slowest_mps: float | None = None) -> Footfalls:
    """Find when each foot of a clip is down: where its heel or its toe rests on the ground, for at least 0.07 s.

    Parameters
    ----------
    clip : Clip
    feet : (left bone, right bone), optional
        Default: the sided bones whose names hold "foot" or "ankle", else the ends of the legs.
    slowest_mps : float, optional
        A heel or toe that moves faster is up. Default: 12 % of its top speed within half a second, from 0.25 to 0.8.

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
    limit = None if slowest_mps is None else require_number(slowest_mps, "slowest_mps")
    return footfalls_of(poses_of(clip), FootBones(feet), slowest_mps=limit)


def footfalls_of(
    poses: Poses, bones: FootBones = UNDECLARED, marks: ContactMarks = NO_MARKS, *, slowest_mps: float | None = None
) -> Footfalls:
    """As `footfalls`, of poses in the world. Of a foot that has marks these count, and nothing is looked for."""
    feet = bones.feet_in(poses.skeleton)
    left, right = (ground_points(poses, foot) for foot in feet)
    return _with_marks(feet, stances((left, right), poses.rate, slowest_mps), marks, max(0, poses.n_frames - 1) / poses.rate)


def held_feet_of(poses: Poses, bones: FootBones = UNDECLARED, marks: ContactMarks = NO_MARKS) -> Footfalls:
    """When each foot can be held where it is: it stands flat, heel and toe on the ground, or its toe does, from touch-down to lift,
    and the foot rolls about it.

    A mark holds its foot all the time; but one that only says when the foot rests, as it is detected too, changes nothing.
    """
    feet = bones.feet_in(poses.skeleton)
    points, duration_s = tuple(ground_points(poses, foot) for foot in feet), max(0, poses.n_frames - 1) / poses.rate
    flat = stances((points[0], points[1]), poses.rate, flat=True)
    toes = stances((points[0][:, -1:], points[1][:, -1:]), poses.rate, TOE_MPS, rises_m=TOE_RISES_M)
    rests = stances((points[0], points[1]), poses.rate)
    down = {}
    for i, foot in enumerate(feet):
        parts = [*flat[i].tolist(), *(toes[i].tolist() if foot.toe is not None else ())]
        held, mark = marked([(begin, end, True) for begin, end in parts], duration_s), marks[i]
        down[foot.bone] = held if mark is None else _held(marked(mark, duration_s), rests[i], held)
    return Footfalls(duration_s, down)


def _held(marked: Floats, rests: Floats, detected: Floats) -> Floats:
    """The marked intervals [n, 2], in place of those that are detected to rest too what of them can be held."""
    held: list[list[float]] = []
    for interval in marked:
        is_found = (np.abs(rests - interval) <= ALIKE_S).all(axis=1).any()
        middles = detected.mean(axis=1)
        inside = detected[(interval[0] <= middles) & (middles <= interval[1])]
        held += inside.tolist() if is_found else [interval.tolist()]
    return np.array(held, np.float64).reshape(-1, 2)


def _with_marks(feet: tuple[Foot, Foot], detected: tuple[Floats, Floats], marks: ContactMarks, duration_s: float) -> Footfalls:
    down = {
        foot.bone: intervals if mark is None else marked(mark, duration_s)
        for foot, intervals, mark in zip(feet, detected, marks, strict=True)
    }
    return Footfalls(duration_s, down)


def rounds_of(marks: ContactMarks, n_rounds: int, duration_s: float) -> ContactMarks:
    """The marks of a clip that plays several times, one behind the other."""
    left, right = (
        mark
        and [(a + i * duration_s, min(b, duration_s) + i * duration_s, is_down) for i in range(n_rounds) for a, b, is_down in mark]
        for mark in marks
    )
    return left, right


def marked(mark: ContactMark, duration_s: float) -> Floats:
    """The intervals [n, 2] in which a foot is down by its marks, within a clip: where one says so and none says that it is up."""
    edges = sorted({0.0, duration_s, *(float(np.clip(t, 0.0, duration_s)) for begin, end, _ in mark for t in (begin, end))})
    down: list[list[float]] = []
    for begin, end in pairwise(edges):
        marked_down = [is_down for first, last, is_down in mark if first <= (begin + end) / 2.0 <= last]
        if marked_down and all(marked_down):
            if down and down[-1][1] == begin:
                down[-1][1] = end
            else:
                down.append([begin, end])
    return np.array(down, np.float64).reshape(-1, 2)


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
    phases = np.zeros((len(times_s), 2))
    for i, state in enumerate(states):
        at = which == i
        phases[at] = _phase_in(state, typical[state.is_down], times_s[at])
    return phases


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
