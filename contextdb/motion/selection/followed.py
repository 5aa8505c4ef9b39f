"""A controller that follows another one, on another machine: what that plays takes the place of a search."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contextdb.motion.clips.ground_place import GroundPlace
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.selection.chooser import ASK, CAUSE, CHOSEN, DECIDE, WINNER, Chooser, Plays
from contextdb.motion.selection.controller import Asked, Controller, prepared
from contextdb.motion.selection.decided import CAUSES, Told, decision_of
from contextdb.motion.selection.decision import Decision
from contextdb.motion.selection.trigger import Trigger

NEAR = 1
"""A copy that is so many frames off is not put right: it would jump."""
NOT_SEARCHED = (-1.0, -2.0, 0.0)
"""What a database has found that was not searched."""


class Followed(NamedTuple):
    """What the other one plays: its database and range by number, the frame of the database, whether it was entered just now, and
    how its row plays, as the core has it."""

    database: int
    range: int
    frame: int
    is_new: bool
    play: Floats

    def is_met_by(self, chooser: Chooser, moved: Floats) -> bool:
        """Whether what would play on is that, but for a frame."""
        d, at, frame = (int(value) for value in moved[0, :3].tolist())
        database = chooser.databases[self.database]
        if self.is_new or database is None or (d, at) != (self.database, self.range):
            return False
        n_frames, apart = int(database.stops[at] - database.starts[at]), abs(frame - self.frame)
        return min(apart, n_frames - apart if database.marks.looping[at] else apart) <= NEAR

    def plays(self, chooser: Chooser) -> Plays:
        """How it plays, as the answer of a table would say it."""
        of = np.full((1, chooser.n_ranges), -1, np.int64)
        of[0, chooser.ranges_at[self.database].start + self.range] = 0
        return Plays(self.play[None], of)


def follow(controller: Controller, dt_s: float, query: Floats, followed: Followed | None, body: GroundPlace | None) -> Decision:
    """Move what plays on by some time and enter what another controller plays, unless that plays here too; None lets it play on.
    The query, which only the play rate goes by, and the time are checked."""
    chooser = controller.chooser
    enters = followed is not None and not followed.is_met_by(chooser, chooser.move(controller.row, dt_s)[0])
    asked = Asked(None, [None], [None], [None], [None], [enters], [False])
    updates = prepared([controller], dt_s, query[None], asked, [0])
    updates.found[:] = NOT_SEARCHED
    row = updates.decisions[0]
    if followed is not None and enters:
        updates = updates._replace(given=updates.given._replace(plays=followed.plays(chooser)))
        updates.run(ASK)
        row[WINNER] = followed.database
        row[CHOSEN] = followed.database, followed.range, followed.frame, 0.0
        updates.found[0, followed.database] = followed.range, followed.frame, 0.0
    else:
        updates.run(ASK)
        if CAUSES[int(row[CAUSE])] is Trigger.DUE:
            row[CAUSE] = 0.0
    updates.run(DECIDE)
    decision = decision_of(updates, 0, controller.playing, Told(query, None, body, None, 0, None, enters, False))
    controller.take(updates, 0, decision)
    return decision
