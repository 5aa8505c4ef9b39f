"""How fast a clip is played, so that it goes about as fast as its character is asked to.

The query says how fast that is, where its schema has a trajectory of positions, velocities or speeds: how far the path leads in
about half a second. The frame that plays says the same of the clip, and their ratio is what is missing. Play rate makes up for a
part of it, in logarithms a little more than a third, within the settings' limits; longer or shorter steps are left to do the rest
(`contextdb.motion.output.alignment`). A schema without such a channel leaves every clip at its own rate.

While a clip plays on its rate comes by and by to what it is to be; where one begins, it begins at that.

Source: EA's talk, whose screen shows a speed of 1.18 made of a time scale of 1.06 and a foot warp of 1.11; the play rate range of
Unreal's motion matching node.
"""

from __future__ import annotations

import math

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.search.database import MotionDatabase

SHARE = 0.36
HALFLIFE_S = 0.2
LEAST_MPS = 0.2
"""A clip or character that is slower stands: nothing is made up for."""


def play_rate(database: MotionDatabase, frame: int, query: Floats, limits: tuple[float, float]) -> float:
    """At what rate a frame is to play for a query [F] in the schema's units."""
    least, most = limits
    where = None if database.schema is None or least == most == 1.0 else database.schema.speed_features
    if where is None:
        return 1.0
    columns, seconds = where
    wanted, own = math.hypot(*query[columns].tolist()) / seconds, database.path_speed(frame)
    if own is None or wanted < LEAST_MPS or own < LEAST_MPS:
        return 1.0
    return float(min(max((wanted / own) ** SHARE, least), most))


def eased(rate: float, to: float, dt_s: float) -> float:
    """A rate some time later that comes to another one."""
    return to + (rate - to) * math.exp(-math.log(2.0) * dt_s / HALFLIFE_S)
