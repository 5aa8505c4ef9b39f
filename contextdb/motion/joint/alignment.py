"""Where in the world a joint clip is played, so that its actors have the least to make up for.

The clip as a whole is turned and put down so that, summed up over roles, the squared metres between where each actor is and where
the clip has him, and the squared radians (of the chord) between the headings, are least. What then is missing is each actor's
error; a role that gives way `g` times as readily as another makes up `g` times as much of a difference between them, and one that
gives way by 0 makes up none.

Places are (x, z, heading): metres and radians, as in `MotionDatabase.root`. K roles. The sums are the core's meeting.h.
"""

from __future__ import annotations

import numpy as np

from contextdb.core import align
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.selection.root_motion import RootMotion, between


def aligned(recorded: Floats, places: Floats, gives: Floats) -> Floats:
    """Where a clip that was recorded at some places [K, 3] has each actor, when it is put down best for actors at `places`: [K, 3].

    `gives` [K] is how readily each role gives way. Where none does, all give way alike.
    """
    put = np.empty((len(recorded), 3))
    align(np.ascontiguousarray(recorded), np.ascontiguousarray(places), np.asarray(gives, np.float64), put)
    return put


def moved(place: Floats, wanted: Floats) -> RootMotion:
    """The movement that brings a body from its place to another one, the shorter way round."""
    correction = between(RootMotion(*place.tolist()), RootMotion(*wanted.tolist()))
    return RootMotion(correction.left_m, correction.ahead_m, float(np.remainder(correction.turn_rad + np.pi, 2.0 * np.pi) - np.pi))
