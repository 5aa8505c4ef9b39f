"""The best frames of a search with what each channel and bias adds, and why the other frames were left out.

The costs come from `contextdb.motion.search.cost` and the reasons from the search's own `Filter`: the first candidate is the frame
that the search chooses, at the same cost to the last bit.

Source: the window "Top Candidates" of EA's diagnostics; the debugger of Remedy's talk.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import Fault, QueryError
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search import cost
from contextdb.motion.search.filters import Filter
from contextdb.motion.search.searched import Searched


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
