"""What a recorded search could choose from, for another database, table or bias than the recorded one.

R ranges, N frames. A range is known by its asset, whether it is mirrored, and how many ranges of the same come before it.

N frames of the database, C channels. The sums of each channel are stored, so that another weight only weighs them again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.arguments import ValidRanges
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.markup.tag_filter import TagFilter
from contextdb.motion.search import cost
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Biases, Filter
from contextdb.motion.search.hit import Hit
from contextdb.motion.selection.selector import with_tags
from contextdb.motion.trace.stock import UNKNOWN, Queryable

Key = tuple[str, bool, int]


def with_biases(database: MotionDatabase, chosen: Filter, old: Biases) -> Filter:
    """A filter of a database that had other biases; what was added beside stays."""
    looping = database.marks.looping
    biases = _own(looping, database.biases) + (chosen.range_biases - _own(looping, old))
    return chosen._replace(range_biases=biases, continuing=database.biases.continuing)


def filter_by_table(database: MotionDatabase, chosen: Filter, table: Queryable, context: Mapping[str, object]) -> Filter:
    """A filter with the ranges that a table's answer lets play, and what its soft cells cost; costs given beside are gone."""
    own = database.filter(table.query(dict(context), unknown=UNKNOWN))
    return chosen._replace(ranges=own.ranges, is_whole=own.is_whole, range_biases=own.range_biases)


def moved_to(
    database: MotionDatabase, chosen: Filter, about: Mapping[str, Any], tags: TagFilter | None
) -> tuple[MotionDatabase, Filter]:
    """A filter of the database that `about` tells of, for another one; and that one, knowing the tags that are requested.

    Assets that the recorded database did not have may play only where all might.
    """
    starts, stops = np.array(about["starts"], np.int64), np.array(about["stops"], np.int64)
    old = {key: i for i, key in enumerate(_keys(about["assets"], about["mirrored"]))}
    at = np.array([old.get(key, -1) for key in _keys(database.assets, database.mirrored.tolist())], np.int64)
    flags = np.where(at >= 0, chosen.ranges[at] if len(old) else False, chosen.is_whole)
    added = chosen.range_biases - _own(np.array(about["looping"], np.bool_), Biases(**about["biases"]))
    biases = _own(database.marks.looping, database.biases) + np.where(at >= 0, added[at] if len(old) else 0.0, 0.0)
    here = _Moved(starts, stops, database, {int(i): new for new, i in enumerate(at.tolist()) if i >= 0})
    if tags is not None:
        names = [*tags.include, *tags.every, *tags.exclude, *(tag for tag, _ in (*tags.prefer, *tags.avoid))]
        database = with_tags(database, names)
    flagged = here.of_frames(chosen.frames, True) if len(chosen.frames) else None
    own = database.filter(
        ValidRanges(np.asarray(flags, np.bool_), biases),
        tags=tags,
        current=here.frame(chosen.current),
        bias=here.of_frames(chosen.frame_biases, 0.0) if len(chosen.frame_biases) else None,
        skip=tuple(here.skips(chosen.skips)),
    )
    return database, own if flagged is None else own._replace(frames=flagged)


def _own(looping: NDArray[np.bool_], biases: Biases) -> Floats:
    """What a database itself adds to its ranges."""
    return np.where(looping, biases.base + biases.looping, biases.base)


def _keys(assets: Sequence[str], mirrored: Sequence[bool]) -> Iterator[Key]:
    seen: dict[tuple[str, bool], int] = {}
    for asset, is_mirrored in zip(assets, mirrored, strict=True):
        n = seen[asset, is_mirrored] = seen.get((asset, is_mirrored), -1) + 1
        yield asset, is_mirrored, n


class _Moved:
    """From the frames of one database to those of another with the same assets."""

    def __init__(self, starts: Any, stops: Any, database: MotionDatabase, ranges: Mapping[int, int]) -> None:
        self.starts, self.stops, self.database, self.ranges = starts, stops, database, ranges

    def frame(self, frame: int) -> int:
        """A frame; -1 where its range is gone."""
        old = next(iter(np.flatnonzero((self.starts <= frame) & (frame < self.stops)).tolist()), -1)
        new = self.ranges.get(old)
        if new is None:
            return -1
        first, stop = int(self.database.starts[new]), int(self.database.stops[new])
        return min(first + frame - int(self.starts[old]), stop - 1)

    def skips(self, skips: Sequence[Skip]) -> Iterator[Skip]:
        """Spans of frames; those of ranges that are gone are left away."""
        for skip in skips:
            first, last = self.frame(skip.start), self.frame(skip.stop - 1)
            if 0 <= first <= last:
                yield replace(skip, start=first, stop=last + 1)

    def of_frames(self, values: NDArray[Any], otherwise: object) -> NDArray[Any]:
        """A value for each frame; frames that there were not have another."""
        moved = np.full(self.database.n_frames, otherwise, values.dtype)
        for old, new in self.ranges.items():
            first, start = int(self.database.starts[new]), int(self.starts[old])
            n = min(int(self.database.stops[new]) - first, int(self.stops[old]) - start)
            moved[first : first + n] = values[start : start + n]
        return moved


# ---- one database in a recorded search, repeated: what every frame costs, channel by channel, and why it may not be chosen


@dataclass(frozen=True, eq=False)
class ReaskedSearch:
    """One database in a search repeated."""

    name: str
    database: MotionDatabase
    query: Floats
    """In the schema's units: float64 [F]."""
    chosen: Filter
    """What could be chosen from."""
    _sums: dict[str, Floats] = field(default_factory=dict, repr=False)

    @cached_property
    def hit(self) -> Hit:
        """What the search chooses."""
        return self.database.search_filtered(self.query, self.chosen)

    @property
    def sums(self) -> Floats:
        """The squared differences of each channel, not weighed: float64 [C, N]; 0 for frames between ranges."""
        if "sums" not in self._sums:
            lay, database = self.database.layout, self.database
            wanted, ones = database.normalised(self.query), np.ones(len(database.slices))
            sums, frames = np.zeros((len(ones), lay.n_frames)), lay.frames
            for start in range(0, len(frames), cost.FRAMES_AT_ONCE):
                block = frames[start : start + cost.FRAMES_AT_ONCE]
                sums[:, block] = cost.channel_costs(lay, block, wanted, database.slices, ones)
            self._sums["sums"] = sums
        return self._sums["sums"]

    @property
    def channels(self) -> Floats:
        """What each channel adds to the cost of each frame: float64 [N, C]."""
        return np.asarray((self.database.cost_weights[:, None] * self.sums).T)

    @cached_property
    def biases(self) -> Floats:
        """What else is added: float64 [N]."""
        return self.chosen.biases(self.database.layout.frame_ranges, self.database.marks.kinds)

    @cached_property
    def costs(self) -> Floats:
        """The cost of each frame, its biases in it, to the last bit the search's: float64 [N]; infinite between ranges."""
        total = np.zeros(self.database.n_frames)
        for weight, added in zip(self.database.cost_weights, self.sums, strict=True):
            total += weight * added
        return np.asarray(np.where(self.database.layout.frame_ranges >= 0, total + self.biases, np.inf))

    @cached_property
    def left_out(self) -> NDArray[np.uint8]:
        """Why each frame may not be chosen, as `LeftOut`: uint8 [N]."""
        return self.chosen.why(self.database.layout.frame_ranges, self.database.marks.kinds)

    def best_of_range(self, at: int) -> int:
        """The best frame of a range, one that may be chosen before all that may not; -1 for a range without frames."""
        own = np.arange(int(self.database.starts[at]), int(self.database.stops[at]))
        if not len(own):
            return -1
        return int(own[np.lexsort((own, self.costs[own], self.left_out[own] != LeftOut.NO))[0]])

    def with_weights(self, weights: Mapping[str, float]) -> ReaskedSearch:
        """The same with other weights; the sums of the channels are shared."""
        return ReaskedSearch(self.name, self.database.with_weights(weights), self.query, self.chosen, self._sums)

    def with_filter(self, chosen: Filter) -> ReaskedSearch:
        """The same with something else to choose from."""
        return ReaskedSearch(self.name, self.database, self.query, chosen, self._sums)
