"""A controller that follows another one, on another machine: what that plays takes the place of a search.

What a packet is, and when a copy jumps for it, is the core's: see `contextdb/core/follow.h`.
"""

from __future__ import annotations

import numpy as np

from contextdb.errors import ContextError, Fault
from contextdb.motion.clips.ground_place import GroundPlace
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.selection.chooser import ASK, CAUSE, CHOSEN, DECIDE, WINNER, Plays
from contextdb.motion.selection.controller import Asked, Controller, Decided, prepared
from contextdb.motion.selection.decided import CAUSES, Asker, Question, decision_of
from contextdb.motion.selection.events import Event
from contextdb.motion.selection.trigger import Trigger

N_FOLLOWED, ENTERS, PLAY = 13, 4, slice(5, 13)
"""What a packet says: a `cdbm_followed` of the core; its first numbers are database, range and frame."""
NOT_SEARCHED = (-1.0, -2.0, 0.0)
"""What a database has found that was not searched."""
NO_PACKET = Fault("these bytes tell nothing that a character of these databases plays.", "what its owner's `pack` gives, or none")


def follow(
    controller: Controller, dt_s: float, query: Floats, packet: bytes, body: GroundPlace | None, event: Event | None = None
) -> Decided:
    """Move what plays on by some time and enter what another controller plays, unless that plays here too; no bytes let it play on.
    The query and the time are checked; by the query and the event only the play rate goes. Raises ContextError for what is no
    packet, QueryError for what is no event."""
    chooser, followed = controller.chooser, np.empty(N_FOLLOWED)
    if not isinstance(packet, bytes) or not chooser.core.read_packet(packet, chooser.move(controller.row, dt_s)[0], followed):
        raise ContextError(NO_PACKET)
    enters, (d, at, frame) = bool(followed[ENTERS]), (int(number) for number in followed[:3].tolist())
    asked = Asked.of_one(force=enters)
    updates = prepared([controller], dt_s, query[None], asked, [0])
    updates.found[:] = NOT_SEARCHED
    row = updates.decisions[0]
    if enters:
        of = np.full((1, chooser.n_ranges), -1, np.int64)
        of[0, chooser.ranges_at[d].start + at] = 0
        updates = updates._replace(given=updates.given._replace(plays=Plays(followed[None, PLAY], of)))
    if event is not None:
        updates = updates._replace(given=updates.given._replace(to_event=chooser.to_event(event), event_s=event[1]))
    updates.run(ASK)
    if enters:
        row[WINNER], row[CHOSEN] = d, (d, at, frame, 0.0)
        updates.found[0, d] = at, frame, 0.0
    elif CAUSES[int(row[CAUSE])] is Trigger.DUE:
        row[CAUSE] = 0.0
    updates.run(DECIDE)
    question = Question(query[None], [None], [body], asked.force, asked.interrupt, asked.event)
    decision = decision_of(updates, 0, question, Asker(0, controller.playing))
    controller.take(updates, 0, decision)
    return Decided([decision], [([0], updates)])
