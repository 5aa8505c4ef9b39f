"""Move through a range as time passes: on to its end, over the end of a looping one, never into excluded frames.

Frame i of a range is at i / rate seconds. The last frame of a looping range is its first once more, as in clips of game engines, so
that a range of n frames lasts (n - 1) / rate seconds, looping or not. A moment between two frames counts as the nearer of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from contextdb.motion.records import quickly_made
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.layout import Features
from contextdb.motion.selection.root_motion import NO_MOTION, RootMotion, motion_between

TOLERANCE_S = 1e-6
"""Times that are nearer than this are the same: sums of time steps are rounded."""


@quickly_made
@dataclass(frozen=True, slots=True)
class Move:
    """A playhead moved on, to `time_s` since the start of its range and a frame counted over the whole database.

    `spans` are the frames (start, stop) that were passed, the one arrived at among them; `n_loops` says how often it went over the
    end of a looping range, `motion` how the range moved the body meanwhile. `is_ended`: it could not move on all the way, as what
    follows is the end of the range or an excluded frame.
    """

    time_s: float
    frame: int
    spans: tuple[tuple[int, int], ...]
    n_loops: int = 0
    is_ended: bool = False
    motion: RootMotion = NO_MOTION


@dataclass(frozen=True)
class Playhead:
    """A range of a database, and how its frames follow each other, `rate` a second."""

    database: MotionDatabase
    range: int
    rate: float

    @classmethod
    def of(cls, database: MotionDatabase, range_number: int, rate: float) -> Playhead:
        """A range's; `rate` is that of a database that does not know its own."""
        return cls(database, range_number, rate_of(database, rate))

    @cached_property
    def start(self) -> int:
        return int(self.database.starts[self.range])

    @cached_property
    def stop(self) -> int:
        """The frame behind the last."""
        return int(self.database.stops[self.range])

    @cached_property
    def last_s(self) -> float:
        """Seconds from the first frame to the last."""
        return (self.stop - self.start - 1) / self.rate

    @cached_property
    def path(self) -> Features | None:
        """Where the body is in each frame [n, 3]; None where the database does not know."""
        return None if self.database.root is None else self.database.root[self.start : self.stop]

    @cached_property
    def asset(self) -> str:
        return self.database.assets[self.range]

    @cached_property
    def mirrored(self) -> bool:
        return bool(self.database.mirrored[self.range])

    @cached_property
    def permutation_s(self) -> float | None:
        """How many seconds ahead its permuted channels look; None without permutations."""
        return self.database.permutation_s(self.range)

    @cached_property
    def is_looping(self) -> bool:
        """Whether the range continues at its start when it ends."""
        return bool(self.database.marks.looping[self.range]) and self.stop - self.start > 1

    def frame_at(self, time_s: float) -> int:
        """The frame nearest to a moment, the later of two that are equally near."""
        nearest = math.floor((time_s + TOLERANCE_S) * self.rate + 0.5)
        frame, last = self.start + nearest, self.stop - 1
        return self.start if nearest < 0 else frame if frame < last else last

    def moved(self, time_s: float, dt_s: float) -> Move:
        """Where playing on from a moment for some time leads."""
        time_s = min(time_s, self.last_s)
        wanted_s = time_s + dt_s
        first = self.frame_at(time_s) + 1
        if wanted_s <= self.last_s + TOLERANCE_S:
            return self._leg(time_s, min(wanted_s, self.last_s), first)
        to_end = self._leg(time_s, self.last_s, first)
        if to_end.is_ended or not self.is_looping or self._free_until(self.start, self.start + 1) == self.start:
            return replace(to_end, is_ended=True)
        n_loops = math.ceil((wanted_s - TOLERANCE_S) / self.last_s) - 1
        return self._loops(to_end, n_loops, min(wanted_s - n_loops * self.last_s, self.last_s))

    def _loops(self, to_end: Move, n_loops: int, rest_s: float) -> Move:
        """From the end of a looping range, over it some times, and on to a moment."""
        move = replace(to_end, n_loops=n_loops)
        if n_loops > 1:
            whole = self._leg(0.0, self.last_s, self.start)
            if whole.is_ended:
                return _joined(replace(to_end, n_loops=1), whole)
            move = _joined(move, replace(whole, motion=whole.motion.repeated(n_loops - 1)))
        return _joined(move, self._leg(0.0, rest_s, self.start))

    def _leg(self, from_s: float, to_s: float, first: int) -> Move:
        """From one moment of the range to a later one, over the frames from `first` on; or until an excluded frame."""
        stop = self.frame_at(to_s) + 1
        free = self._free_until(first, stop)
        if free < stop:
            to_s = max(from_s, (free - 1 - self.start) / self.rate)
        return Move(to_s, free - 1, ((first, free),) if free > first else (), 0, free < stop, self._motion(from_s, to_s))

    def _free_until(self, first: int, stop: int) -> int:
        """The first of some frames that may not be played on to; `stop` if all may."""
        marks = self.database.marks
        if marks.are_all_playable:
            return max(first, stop)
        return first + int(np.argmin(np.append(marks.playable()[marks.kinds[first:stop]], False)))

    def _motion(self, from_s: float, to_s: float) -> RootMotion:
        return NO_MOTION if self.path is None else motion_between(self.path, from_s * self.rate, to_s * self.rate)


def rate_of(database: MotionDatabase, rate: float) -> float:
    """Frames a second of a database; `rate` where it does not know its own."""
    return rate if database.schema is None else database.schema.rate


def _joined(move: Move, then: Move) -> Move:
    """A move and what follows it."""
    return replace(then, spans=move.spans + then.spans, n_loops=move.n_loops, motion=move.motion.then(then.motion))
