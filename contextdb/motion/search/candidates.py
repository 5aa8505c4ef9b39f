"""The best frames of a search with what each channel and bias adds, and why the other frames were left out.

The costs come from `contextdb.motion.search.cost` and the reasons from the search's own `Filter`: the first candidate is the frame
that the search chooses, at the same cost to the last bit.

Source: the window "Top Candidates" of EA's diagnostics; the debugger of Remedy's talk.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_kind, require_many, require_real, require_whole
from contextdb.errors import Fault, QueryError
from contextdb.motion import arguments
from contextdb.motion.arguments import Flags
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.markup.marks import Marks
from contextdb.motion.search import cost
from contextdb.motion.search.filters import NO_BIAS, Biases, Filter
from contextdb.motion.search.hit import Hit
from contextdb.motion.search.layout import Features, Layout


@dataclass(frozen=True)
class Candidate:
    """One frame of a search."""

    asset: str
    range: int
    frame: int
    time_s: float | None
    """Seconds since the start of the asset; None for a database made from features."""
    mirrored: bool
    cost: float
    """The total, its biases in it."""
    channels: dict[str, float]
    """What each channel adds."""
    biases: dict[str, float]
    """What else is added, as far as it is not 0: "base", "looping", "penalty" (soft cells), "tags", "modifier" (markup), "given"
    and "continuing"."""
    left_out: LeftOut
    """Why it may not be chosen; LeftOut.NO if it may."""
    permutation_s: float | None = None
    """How many seconds ahead its permuted channels look; None for a database without permutations."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """The best frames of a search, and what became of all others."""

    rows: tuple[Candidate, ...]
    """Cheapest first."""
    counts: dict[LeftOut, int]
    """How many frames of ranges were left out for each reason."""
    why: NDArray[np.uint8]
    """`LeftOut` of every frame; frames between ranges count as of an asset that is not valid: uint8 [N]."""

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Candidate]:
        return iter(self.rows)


def of(database: Searched, query: Floats, chosen: Filter, k: int, with_left_out: bool) -> Candidates:
    """The k best frames for a normalised query."""
    if isinstance(k, bool) or not isinstance(k, (int, np.integer)) or k < 0:
        raise QueryError(Fault(f"{k!r} candidates were requested.", "a whole number, 0 or more"))
    lay, kinds = database.layout, database.marks.kinds
    why = chosen.why(lay.frame_ranges, kinds)
    in_ranges = lay.frames
    frames = in_ranges if with_left_out else in_ranges[why[in_ranges] == LeftOut.NO]
    totals = _totals(database, query, chosen, frames)
    is_other = frames != chosen.playing(lay.frame_ranges, kinds)
    best = _least_first(totals, is_other, k)
    counted = np.bincount(why[in_ranges], minlength=len(LeftOut))
    counts: dict[LeftOut, int] = {reason: int(counted[reason]) for reason in LeftOut if reason != LeftOut.NO and counted[reason]}
    return Candidates(tuple(_candidates(database, query, chosen, frames[best], totals[best], why)), counts, why)


def with_left_out(database: Searched, query: Floats, chosen: Filter, k: int) -> Candidates:
    """The k best frames for a normalised query, and those of the k cheapest of all that are left out, cheapest first."""
    best, every = of(database, query, chosen, k, False), of(database, query, chosen, k, True)
    left_out = [row for row in every if row.left_out is not LeftOut.NO]
    return replace(best, rows=tuple(sorted((*best, *left_out), key=lambda row: row.cost)))


def of_frames(
    database: Searched, wanted: Floats, chosen: Filter, frames: Ints, totals: Floats, why: NDArray[np.uint8]
) -> list[Candidate]:
    """Some frames, their totals and the reason of every frame known; `wanted` is a normalised query."""
    return list(_candidates(database, wanted, chosen, frames, totals, why))


def _totals(database: Searched, query: Floats, chosen: Filter, frames: Ints) -> Floats:
    """Cost and bias of some frames, each in a range, added as the search adds them: float64 [len(frames)]."""
    lay, kinds = database.layout, database.marks.kinds
    biases = chosen.range_biases[lay.ranges_of(frames)] + chosen.kinds.biases[kinds[frames]]
    if len(chosen.frame_biases):
        biases += chosen.frame_biases[frames]
    if chosen.current >= 0:
        biases[frames == chosen.playing(lay.frame_ranges, kinds)] += chosen.continuing
    return np.asarray(cost.costs(lay, frames, query, database.slices, database.cost_weights) + biases)


def _least_first(totals: Floats, is_other: NDArray[np.bool_], k: int) -> Ints:
    """Where the k least totals are, in order; on a tie the current frame is first, then the lowest."""
    n = len(totals)
    near = np.arange(n)
    if k < n:
        near = np.flatnonzero(totals <= np.partition(totals, k)[k]) if k else near[:0]
    order = np.lexsort((near, is_other[near], totals[near]))
    return np.asarray(near[order][:k])


def _candidates(
    database: Searched, query: Floats, chosen: Filter, frames: Ints, totals: Floats, why: NDArray[np.uint8]
) -> Iterator[Candidate]:
    by_channel = (
        cost.channel_costs(database.layout, frames, query, database.slices, database.cost_weights)
        if len(frames)
        else np.empty((0, 0))
    )
    for i, (frame, total) in enumerate(zip(frames.tolist(), totals.tolist(), strict=True)):
        at = int(database.layout.frame_ranges[frame])
        rate = None if database.schema is None else database.schema.rate
        yield Candidate(
            asset=database.assets[at],
            range=at,
            frame=frame,
            time_s=None if rate is None else (frame - int(database.starts[at])) / rate,
            mirrored=bool(database.mirrored[at]),
            cost=total,
            channels=dict(zip(database.channel_names, by_channel[:, i].tolist(), strict=True)),
            biases=_biases(database, chosen, frame, at),
            left_out=LeftOut(int(why[frame])),
            permutation_s=database.permutation_s(at),
        )


def _biases(database: Searched, chosen: Filter, frame: int, at: int) -> dict[str, float]:
    """The parts of a frame's bias that are not 0; `at` is its range."""
    marks, kind = database.marks, int(database.marks.kinds[frame])
    looping = database.biases.looping if marks.looping[at] else 0.0
    modifier = float(marks.kind_biases[kind])
    is_playing = chosen.playing(database.layout.frame_ranges, database.marks.kinds) == frame
    parts = {
        "base": database.biases.base,
        "looping": looping,
        "penalty": float(chosen.range_biases[at]) - (database.biases.base + looping),
        "tags": float(chosen.kinds.biases[kind]) - modifier,
        "modifier": modifier,
        "given": float(chosen.frame_biases[frame]) if len(chosen.frame_biases) else 0.0,
        "continuing": chosen.continuing if is_playing else 0.0,
    }
    return {name: part for name, part in parts.items() if part}


# ---- what a motion database holds, and what is known of each frame. `MotionDatabase` says what each part is, and searches


@dataclass(frozen=True, eq=False)
class Searched:
    """The parts of a motion database."""

    layout: Layout
    starts: Ints
    stops: Ints
    assets: tuple[str, ...]
    mirrored: Flags
    channel_names: tuple[str, ...]
    slices: tuple[slice, ...]
    weights: Floats
    normalisation: Normalisation
    marks: Marks
    biases: Biases = NO_BIAS
    root: Features | None = None
    schema: FeatureSchema | None = None

    @cached_property
    def n_permutations(self) -> int:
        """How many ranges each clip has, as it is and as many mirrored; they follow one another."""
        return 1 if self.schema is None else len(self.schema.permutation_s)

    def permutation_s(self, range_number: int) -> float | None:
        """How many seconds ahead the permuted channels of a range look; None for a database without permutations."""
        if self.schema is None or self.schema.permutations is None:
            return None
        return self.schema.permutation_s[range_number % self.n_permutations]

    @cached_property
    def cost_weights(self) -> Floats:
        """What each channel's squared differences are multiplied by in a cost: float64 [C].

        The weights divided by the sum of weight x features over all channels, so that a cost is a weighted mean and means the same
        for every schema. Of a database made from features the weights themselves.
        """
        return self.weights if self.schema is None else cost.shares_of(self.slices, self.weights)

    @property
    def n_frames(self) -> int:
        """How many frames there are, those between ranges included."""
        return self.layout.n_frames

    @property
    def n_features(self) -> int:
        """How many features a frame has."""
        return self.layout.n_features

    @property
    def feature_names(self) -> tuple[str, ...]:
        """The name of each feature."""
        return tuple(f"feature {i}" for i in range(self.n_features)) if self.schema is None else self.schema.feature_names

    @property
    def features(self) -> Features:
        """The features as rows: float32 [N, F], gathered again; frames between ranges hold zeros."""
        features = np.zeros((self.n_frames, self.n_features), np.float32)
        features[self.layout.frames] = self.layout.take(self.layout.frames)
        return features

    def raw(self, frame: Hit | int) -> Floats:
        """The features of one frame in the schema's units, as a query has them: float64 [F]. Raises QueryError for a frame
        that is in no range."""
        return self.normalisation.undo(self.layout.take(np.array([self._number(frame)]))[0])

    def raw_many(self, frames: Sequence[int] | NDArray[np.integer]) -> Floats:
        """The features of many frames in the schema's units, the poses of a crowd: float64 [Q, F]. Raises QueryError for a
        frame that is in no range."""
        given = require_many(frames, "frames", "a list of frames")
        numbers = np.array([arguments.frame_of(frame, self.n_frames, "frame") for frame in given], np.int64)
        for frame in numbers[~self.layout.are_in_ranges(numbers)].tolist():
            self._number(frame)
        return self.normalisation.undo(self.layout.take(numbers))

    def time_s(self, hit: Hit) -> float:
        """Seconds from the start of the hit's range to its frame. Raises QueryError for a hit of nothing, and for a database of
        arrays."""
        require_kind(hit, Hit, "hit", "a Hit of this database")
        if self.schema is None or not hit:
            raise QueryError(Fault("there is no time to return.", "a hit of this database, built from clips"))
        return (hit.frame - int(self.starts[hit.range])) / self.schema.rate

    def frame_at(self, range_number: int, time_s: float) -> int:
        """The frame of a range that is nearest to a time since the range's start, inside the range. Raises QueryError where there
        is no such range, or no time, and for a database of arrays."""
        range_number, time_s = require_whole(range_number, "range_number"), require_real(time_s, "time_s")
        if self.schema is None or not 0 <= range_number < len(self.assets) or not math.isfinite(time_s):
            problem = f"there is no frame at {time_s!r} s of range {range_number}."
            raise QueryError(Fault(problem, "a range of this database, built from clips, and seconds"))
        start, stop = int(self.starts[range_number]), int(self.stops[range_number])
        return min(max(start, start + round(time_s * self.schema.rate)), stop - 1)

    def range_of(self, frame: int) -> int:
        """The range that holds a frame, or -1 for a frame between ranges. Raises ContextError for no whole number."""
        return self.layout.range_of(require_whole(frame, "frame"))

    def _number(self, frame: Hit | int) -> int:
        number = arguments.frame_of(frame.frame if isinstance(frame, Hit) else frame, self.n_frames, "frame")
        if self.range_of(number) < 0:
            raise QueryError(Fault(f"frame {number} is in no range: nothing is known of it.", "a frame of a range"))
        return number
