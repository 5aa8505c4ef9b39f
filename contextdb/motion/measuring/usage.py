"""What of the clips is played, and what never can be."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from contextdb.errors import Fault, MotionError, in_quotes
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.measuring.raw_clips import At
from contextdb.motion.output.samples import Flags
from contextdb.motion.ranges import frames_between
from contextdb.motion.search.cost import weights_of_features
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.layout import Features


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


# ---- transitions between states that have no clip, by the names of clips: a pattern such as `{from}_to_{to}` says which they
# are
#
# A state is what some clip's name has in the place of `{from}` or `{to}`. Names say nothing more: a state that no transition
# names is none, and one way of going from a state to another is enough. Source of the pattern: the transitions of Forsyth's talk,
# seed 003.


PATTERN = "{from}_to_{to}"
ACCEPTED = '{from} and {to}, each once, with text between them, such as "{from}_to_{to}"'


@dataclass(frozen=True)
class TransitionCoverage:
    """The states that transitions join, and the pairs of them, from and to, that have a clip and that have none."""

    pattern: str
    states: tuple[str, ...] = ()
    present: tuple[tuple[str, str], ...] = ()
    missing: tuple[tuple[str, str], ...] = ()

    def name_of(self, pair: tuple[str, str]) -> str:
        """The name that the clip of a pair would have."""
        return self.pattern.replace("{from}", pair[0]).replace("{to}", pair[1])

    def to_json(self) -> dict[str, object]:
        return {
            "pattern": self.pattern,
            "states": list(self.states),
            "present": [list(pair) for pair in self.present],
            "missing": [{"from": pair[0], "to": pair[1], "clip": self.name_of(pair)} for pair in self.missing],
        }


def transitions_of(names: Iterable[str], pattern: str = PATTERN) -> TransitionCoverage:
    """The transitions among some clips. What is before `{from}`, between and behind `{to}` is compared to the letter; a name that
    fits in several ways is divided where the pattern fits first. Raises MotionError where the pattern has not both places, each
    once, with text between."""
    fits = re.compile(_expression(pattern), re.DOTALL)
    pairs = {(match["a"], match["b"]): None for name in names if (match := fits.fullmatch(name))}
    present = [pair for pair in pairs if pair[0] != pair[1]]
    states = tuple(sorted({state for pair in present for state in pair}))
    missing = ((a, b) for a in states for b in states if a != b and (a, b) not in pairs)
    return TransitionCoverage(pattern, states, tuple(sorted(present)), tuple(missing))


def _expression(pattern: str) -> str:
    before, separator, rest = pattern.partition("{from}")
    between, found_too, behind = rest.partition("{to}")
    if not (separator and found_too and between) or any("{from}" in part or "{to}" in part for part in (before, between, behind)):
        raise MotionError(Fault(f"{in_quotes(pattern)} is not a pattern of transitions.", ACCEPTED, in_quotes(PATTERN)))
    return f"{re.escape(before)}(?P<a>.+?){re.escape(between)}(?P<b>.+){re.escape(behind)}"


# ---- clips that lie within a bar of another clip, so that they add little: near-duplicates
#
# Of a clip some frames a second are compared with every frame of every other clip, mirrored ones too, at the cost of a search
# without biases. What 95 % of them cost at most, each with the nearest frame of one other clip, says how far the clip lies from
# that clip. Of the permutations of a clip the first is compared.


NEAR_COST = 0.02
"""A clip of which 95 % of the frames cost no more with another clip is near it; frames that have nothing in common cost about 2."""
PERCENTILE = 95.0
PLACES = 4
"""Costs are told with so many places: further ones depend on how a machine adds up, and would choose among equally near clips."""
EVERY_S = 0.2
"""A frame is compared of each so many seconds."""


@dataclass(frozen=True)
class Near:
    """A clip and the one that it lies nearest to."""

    asset: str
    other: str
    is_mirrored: bool
    """Whether it is the other one mirrored that is near."""
    cost: float
    """What 95 % of its frames cost at most with the nearest frame of the other."""

    def to_json(self) -> dict[str, object]:
        return {"asset": self.asset, "other": self.other, "mirrored": self.is_mirrored, "cost": self.cost}


Tell = Callable[[int, int, str], None]


def near_clips(database: MotionDatabase, most: float = NEAR_COST, progress: Tell | None = None) -> list[Near]:
    """The clips that lie within a cost of another, the nearest first; of two that lie within each other both are there."""
    firsts = np.arange(0, len(database.starts), database.n_permutations)
    filled = firsts[database.stops[firsts] > database.starts[firsts]]
    if database.schema is None or not len(filled):
        return []
    starts, stops = database.starts[filled], database.stops[filled]
    weights = weights_of_features(database.slices, database.cost_weights)
    frames = np.asarray(database.features[frames_between(starts, stops)] * np.sqrt(weights), np.float32)
    first = np.cumsum(stops - starts) - (stops - starts)
    squares = (frames * frames).sum(axis=1)
    step = max(1, round(EVERY_S * database.schema.rate))
    plain = [at for at, number in enumerate(filled.tolist()) if not database.mirrored[number]]
    pairs = []
    for done, at in enumerate(plain, 1):
        asset = database.assets[filled[at]]
        sampled = frames[first[at] : first[at] + stops[at] - starts[at] : step]
        far = np.round(np.percentile(_least_costs(sampled, frames, squares, first), PERCENTILE, axis=0), PLACES)
        far[[database.assets[number] == asset for number in filled.tolist()]] = np.inf
        best = int(np.argmin(far))
        if far[best] <= most:
            other = int(filled[best])
            pairs.append(Near(asset, database.assets[other], bool(database.mirrored[other]), float(far[best])))
        if progress is not None:
            progress(done, len(plain), asset)
    return sorted(pairs, key=lambda near: (near.cost, near.asset))


def _least_costs(queries: Features, frames: Features, squares: Features, first: Ints) -> Features:
    """What each asked frame [A, F] costs with the nearest of each range, of frames [N, F] whose ranges begin at `first`: [A, R]."""
    costs = queries @ frames.T
    costs *= -2.0
    costs += squares
    least = np.minimum.reduceat(costs, first, axis=1) + (queries * queries).sum(axis=1)[:, None]
    return np.asarray(np.maximum(least, 0.0), np.float32)
