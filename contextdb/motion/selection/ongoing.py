"""What a character plays, moved on by one update, before any search."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.records import quickly_made
from contextdb.motion.search import cost
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Filter
from contextdb.motion.selection.decision import Playing
from contextdb.motion.selection.playhead import Move, Playhead, rate_of
from contextdb.motion.selection.selector import Selector


@quickly_made
@dataclass(frozen=True, slots=True)
class Ongoing:
    """What plays, where it has moved on to, and how."""

    playing: Playing
    head: Playhead
    move: Move

    @classmethod
    def of(
        cls, playing: Playing | None, selector: Selector, rate: float, dt_s: float, last: Playhead | None = None
    ) -> Ongoing | None:
        """What plays, some time later; None if nothing does, or if its database is not loaded or no longer holds it.

        `rate` is that of databases that do not know theirs; `last` is the playhead of the update before, which is mostly this one.
        """
        database = None if playing is None else selector.databases.get(playing.database)
        if playing is None or database is None:
            return None
        if last is not None and _still_plays(last, playing, database, rate):
            head = last
        else:
            at = _range_of(playing, database)
            if at is None:
                return None
            head = Playhead.of(database, at, rate)
        move = head.moved(playing.time_s, dt_s)
        return cls(playing_at(playing.database, head, move.frame, move.time_s), head, move)

    @property
    def database(self) -> str:
        return self.playing.database

    def cheapest(self, query: Floats, chosen: Filter) -> Ongoing:
        """The same in the permutation of its clip that costs least to play on in; on a tie in that which plays.

        `chosen` is a filter of its database; one that lets the asset not play is asked for its costs alone.
        """
        database, at = self.head.database, self.head.range
        frames = np.array([start for start, _ in database.in_permutations(at, self.move.frame, self.move.frame + 1)])
        ranges = at - at % len(frames) + np.arange(len(frames))
        costs = cost.costs(database.layout, frames, database.normalised(query), database.slices, database.cost_weights)
        costs += chosen.range_biases[ranges]
        if len(chosen.frame_biases):
            costs += chosen.frame_biases[frames]
        if len(chosen.frames):
            costs[~chosen.frames[frames]] = np.inf
        if chosen.ranges[at]:
            costs[~chosen.ranges[ranges]] = np.inf
        best = int(np.lexsort((ranges != at, costs))[0])
        head = replace(self.head, range=int(ranges[best]))
        playing = playing_at(self.database, head, int(frames[best]), self.playing.time_s)
        return replace(self, playing=playing, head=head, move=replace(self.move, frame=int(frames[best])))


def playing_at(database: str, head: Playhead, frame: int, time_s: float) -> Playing:
    """What plays at a moment of a range."""
    return Playing(database, head.asset, head.range, frame, time_s, head.mirrored, head.permutation_s)


def _still_plays(last: Playhead, playing: Playing, database: MotionDatabase, rate: float) -> bool:
    is_range = last.database is database and last.range == playing.range and last.rate == rate_of(database, rate)
    return is_range and last.asset == playing.asset and last.mirrored == playing.mirrored and last.stop > last.start


def _range_of(playing: Playing, database: MotionDatabase) -> int | None:
    """The range that plays, also in a database that was built again."""
    at, assets = playing.range, database.assets
    is_there = 0 <= at < len(assets) and assets[at] == playing.asset and database.mirrored[at] == playing.mirrored
    if is_there and database.stops[at] > database.starts[at]:
        return at
    near = range(playing.range, min(playing.range + 1, len(database.assets)))
    same = (i for i in (*near, *range(len(database.assets))) if database.assets[i] == playing.asset)
    return next((i for i in same if database.mirrored[i] == playing.mirrored and database.stops[i] > database.starts[i]), None)
