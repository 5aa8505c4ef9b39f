"""What of the clips is played, and what never can be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.measuring.raw_clips import At
from contextdb.motion.output.samples import Flags
from contextdb.motion.search.database import MotionDatabase


class HasRanges(Protocol):
    """A motion database or a pose bank: frames in ranges."""

    @property
    def starts(self) -> Ints:
        """The first frame of each range."""

    @property
    def stops(self) -> Ints:
        """The frame behind the last of each."""

    @property
    def assets(self) -> Sequence[str]:
        """The asset of each."""

    @property
    def mirrored(self) -> Flags:
        """Whether each is mirrored."""

    @property
    def n_frames(self) -> int:
        """How many frames there are."""


def permutations_in(of: HasRanges) -> int:
    """How many ranges each clip has that show the same, one after the other."""
    return of.n_permutations if isinstance(of, MotionDatabase) else 1


def frames_used(
    playing: Sequence[At | None], entered: Flags, of: Mapping[str, HasRanges], rates: Mapping[str, float]
) -> dict[str, Flags]:
    """Which frames of each database are played: at each moment the nearest, and those passed since the moment before; of
    permutations, which show the same, those of the first.

    A database whose name is not known is the first that has the asset.
    """
    used = {name: np.zeros(each.n_frames, np.bool_) for name, each in of.items()}
    numbers = {
        name: {(each.assets[i], bool(each.mirrored[i])): i for i in range(0, len(each.assets), permutations_in(each))}
        for name, each in of.items()
    }
    last: tuple[str, int, int] | None = None
    for at, is_entered in zip(playing, entered.tolist(), strict=True):
        place = None if at is None else _place(at, numbers)
        if at is None or place is None:
            last = None
            continue
        name, number = place
        start, stop = int(of[name].starts[number]), int(of[name].stops[number])
        frame = min(start + max(int(at.time_s * rates[name] + 0.5 + 1e-6), 0), stop - 1)
        flags = used[name]
        if is_entered or last is None or last[:2] != (name, number):
            flags[frame] = True
        elif frame >= last[2]:
            flags[last[2] : frame + 1] = True
        else:
            flags[last[2] : stop] = flags[start : frame + 1] = True
        last = name, number, frame
    return used


def _place(at: At, numbers: Mapping[str, Mapping[tuple[str, bool], int]]) -> tuple[str, int] | None:
    for name in (at.database,) if at.database in numbers else numbers:
        if (number := numbers[name].get((at.asset, at.mirrored))) is not None:
            return name, number
    return None


def usable(database: MotionDatabase) -> Flags:
    """Which frames the markup allows to play at all: those that may be chosen, and those reached from them by playing on."""
    marks = database.marks
    kinds = np.asarray(marks.kinds)
    enters = (marks.left_out() == LeftOut.NO)[kinds]
    plays = np.asarray(marks.playable())[kinds]
    flags = np.zeros(database.n_frames, np.bool_)
    for number, (start, stop) in enumerate(zip(database.starts.tolist(), database.stops.tolist(), strict=True)):
        again = 2 if marks.looping[number] else 1
        reached = _reached(np.tile(enters[start:stop], again), np.tile(plays[start:stop], again))
        flags[start:stop] = reached.reshape(again, -1).any(axis=0)
    return flags


def _reached(enters: Flags, plays: Flags) -> Flags:
    """Which frames in a row can be entered, or follow one that can without a frame between that cannot play."""
    frames = np.arange(len(enters))
    last_entry = np.maximum.accumulate(np.where(enters & plays, frames, -1))
    last_stop = np.maximum.accumulate(np.where(plays, -1, frames))
    return np.asarray(last_entry > last_stop)
