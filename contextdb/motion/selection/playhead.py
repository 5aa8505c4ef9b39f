"""A range whose frames follow each other: which frame is at a moment of it. How it plays on is in the core's controller.h.

Frame i of a range is at i / rate seconds. The last frame of a looping range is its first once more, as in clips of game engines, so
that a range of n frames lasts (n - 1) / rate seconds, looping or not. A moment between two frames counts as the nearer of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.chooser import PLAYING, Chooser
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.decision import Playing
from contextdb.motion.selection.root_motion import RootMotion
from contextdb.motion.selection.selector import Entry, Selector

TOLERANCE_S = 1e-6
"""Times that are nearer than this are the same: sums of time steps are rounded."""


class Move(NamedTuple):
    """A playhead moved on, to `time_s` since the start of its range and a frame counted over the whole database.

    `spans` are the frames (start, stop) that were passed, the one arrived at among them; `n_loops` says how often it went over the
    end of a looping range, `motion` how the range moved the body meanwhile. `is_ended`: it could not move on all the way, as what
    follows is the end of the range or an excluded frame.
    """

    time_s: float
    frame: int
    spans: tuple[tuple[int, int], ...]
    n_loops: int
    is_ended: bool
    motion: RootMotion


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
    def asset(self) -> str:
        return self.database.assets[self.range]

    @cached_property
    def mirrored(self) -> bool:
        return bool(self.database.mirrored[self.range])

    @cached_property
    def permutation_s(self) -> float | None:
        """How many seconds ahead its permuted channels look; None without permutations."""
        return self.database.permutation_s(self.range)

    def frame_at(self, time_s: float) -> int:
        """The frame nearest to a moment, the later of two that are equally near."""
        nearest = math.floor((time_s + TOLERANCE_S) * self.rate + 0.5)
        frame, last = self.start + nearest, self.stop - 1
        return self.start if nearest < 0 else frame if frame < last else last

    def moved(self, time_s: float, dt_s: float) -> Move:
        """Where playing on from a moment for some time leads."""
        chooser = self._chooser
        row = chooser.begun()
        row[0, PLAYING] = 0.0, self.range, self.frame_at(time_s), time_s
        (_, _, frame, at_s, n_loops, is_ended, *motion, n_spans), spans = np.split(chooser.move(row, dt_s)[0][0], [10])
        passed = tuple((int(start), int(stop)) for start, stop in spans.reshape(-1, 2)[: int(n_spans)])
        return Move(float(at_s), int(frame), passed, int(n_loops), bool(is_ended), RootMotion(*map(float, motion)))

    @cached_property
    def _chooser(self) -> Chooser:
        return Chooser(Selector([Entry("", self.database)]), ControllerSettings(rate=self.rate))


def rate_of(database: MotionDatabase, rate: float) -> float:
    """Frames a second of a database; `rate` where it does not know its own."""
    return rate if database.schema is None else database.schema.rate


def playing_at(database: str, head: Playhead, frame: int, time_s: float) -> Playing:
    """What plays at a moment of a range."""
    return Playing(database, head.asset, head.range, frame, time_s, head.mirrored, head.permutation_s)
