"""Plain motion matching, as a peer: a search by brute force every 0.1 s, and the rules of orangeduck/Motion-Matching.

It jumps when another frame costs less than playing on. Frames within 20 of 60 of the playing one are no candidates, nor are those
near the end of their range; there is no bias, no history, no filter. Its features are those of the database that it is compared
with, normalised and weighted alike.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.motion import Action, Decision, MotionDatabase
from contextdb.motion.selection.decision import Playing, Recorder
from contextdb.motion.selection.playhead import Move, Playhead
from contextdb.motion.selection.root_motion import NO_MOTION

SEARCH_S, AROUND_S, END_S = 0.1, 1.0 / 3.0, 1.0 / 3.0


class PlainMatching:
    """Chooses what one character plays; `update` is called as a controller's."""

    recorder: Recorder | None = None

    def __init__(self, database: MotionDatabase) -> None:
        self.database = database
        assert database.schema is not None, "a built database has one"
        self.rate = database.schema.rate
        self.weights = np.sqrt(np.concatenate([np.full(c.n_features, c.weight) for c in database.schema.channels]))
        self.features = self._weighted(database.raw_many(np.arange(database.n_frames)))
        self.may_enter = np.ones(database.n_frames, np.bool_)
        for start, stop in zip(database.starts.tolist(), database.stops.tolist(), strict=True):
            self.may_enter[max(start, stop - round(END_S * self.rate)) : stop] = False
        self.playing: Playing | None = None
        self.tick, self.time_s, self.since_s = 0, 0.0, 0.0

    def upcoming(self, dt_s: float) -> Playing | None:
        """What plays in some seconds if it plays on."""
        move = self._moved(dt_s)
        return None if move is None or self.playing is None else self._at(self.playing.range, move.frame, move.time_s)

    def update(self, dt_s: float, query: ArrayLike, *, body: Any = None) -> Decision:
        """Play on or jump."""
        move, before = self._moved(dt_s), self.upcoming(dt_s)
        self.time_s, self.since_s = self.time_s + dt_s, self.since_s + dt_s
        is_ended = move is None or move.is_ended
        action = Action.LOOP if move is not None and move.n_loops else Action.CONTINUE
        playing = before
        if is_ended or self.since_s >= SEARCH_S - 1e-6:
            self.since_s = 0.0
            costs = np.square(self.features - self._weighted(np.asarray(query))).sum(axis=1)
            own = np.inf if is_ended or playing is None else costs[playing.frame]
            costs[~self.may_enter] = np.inf
            if playing is not None:
                around = round(AROUND_S * self.rate)
                costs[max(playing.frame - around, 0) : playing.frame + around] = np.inf
            best = int(np.argmin(costs))
            if costs[best] < own:
                action = Action.START if playing is None else Action.JUMP
                number = int(np.searchsorted(self.database.stops, best, side="right"))
                playing = self._at(number, best, (best - int(self.database.starts[number])) / self.rate)
        decision = Decision(
            self.tick,
            self.time_s,
            action,
            "",
            True,
            playing,
            before,
            continuing_cost=None if is_ended else 0.0,
            root_motion=NO_MOTION if move is None else move.motion,
            body=(*body.position, body.heading),
        )
        self.playing, self.tick = playing, self.tick + 1
        if self.recorder is not None:
            self.recorder.record(decision)
        return decision

    def _at(self, number: int, frame: int, time_s: float) -> Playing:
        return Playing("loco", self.database.assets[number], number, frame, time_s, bool(self.database.mirrored[number]))

    def _moved(self, dt_s: float) -> Move | None:
        """What plays, some time later."""
        return (
            None
            if self.playing is None
            else Playhead.of(self.database, self.playing.range, self.rate).moved(self.playing.time_s, dt_s)
        )

    def _weighted(self, raw: Any) -> NDArray[np.float32]:
        """Features normalised and weighted."""
        return np.asarray(self.database.normalisation.apply(raw) * self.weights, np.float32)
