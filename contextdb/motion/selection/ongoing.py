"""What a character plays, moved on by one update, before any search."""

from __future__ import annotations

from dataclasses import dataclass

from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Playing
from contextdb.motion.selection.playhead import Move, Playhead
from contextdb.motion.selection.selector import Selector
from contextdb.records import quickly_made


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
        at = None if playing is None or database is None else _range_of(playing, database)
        if playing is None or database is None or at is None:
            return None
        head = Playhead.of(database, at, rate)
        head = last if last is not None and _is_same(last, head) else head
        move = head.moved(playing.time_s, dt_s)
        return cls(playing_at(playing.database, head, move.frame, move.time_s), head, move)

    @property
    def database(self) -> str:
        """The name of the database."""
        return self.playing.database


def playing_at(database: str, head: Playhead, frame: int, time_s: float) -> Playing:
    """What plays at a moment of a range."""
    at = head.range
    return Playing(database, head.database.assets[at], at, frame, time_s, bool(head.database.mirrored[at]))


def _is_same(one: Playhead, other: Playhead) -> bool:
    return one.database is other.database and one.range == other.range and one.rate == other.rate


def _range_of(playing: Playing, database: MotionDatabase) -> int | None:
    """The range that plays, also in a database that was built again."""
    at, assets = playing.range, database.assets
    is_there = 0 <= at < len(assets) and assets[at] == playing.asset and database.mirrored[at] == playing.mirrored
    if is_there and database.stops[at] > database.starts[at]:
        return at
    near = range(playing.range, min(playing.range + 1, len(database.assets)))
    same = (i for i in (*near, *range(len(database.assets))) if database.assets[i] == playing.asset)
    return next((i for i in same if database.mirrored[i] == playing.mirrored and database.stops[i] > database.starts[i]), None)
