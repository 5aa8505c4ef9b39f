"""What a character knows of itself, as facts for its tables: how fast it goes, where the stick points, how it turns.

A fact is a function of the character's moment. Those of `FACTS` are given to each table that asks for a fact of that name, as a
number or an angle in the same unit, unless the game gives it. Facts of what plays have names of their own, see
`contextdb.motion.characters.played`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from contextdb.cells.conditions import Condition
from contextdb.core import direction_of
from contextdb.motion.characters.played import Played, of_played
from contextdb.motion.clips.steering import Steered
from contextdb.motion.records import quickly_made
from contextdb.motion.selection.decision import Playing

Ground = tuple[float, float]


@quickly_made
@dataclass(frozen=True, slots=True)
class Moment:
    """What a character's own facts are computed from, at one update, before its tables are asked.

    Attributes
    ----------
    dt_s : float
        Seconds since the last update.
    stick : (x, z)
        The velocity over the ground that is requested, m/s.
    facing : float or None
        The heading that is requested, radians.
    body : Steered
        The body now: already moved by this update.
    playing : Playing or None
        What plays up to now.
    played : Played or None
        The same with its database and poses.
    """

    dt_s: float
    stick: Ground
    facing: float | None
    body: Steered
    playing: Playing | None
    played: Played | None = None


FactOf = Callable[[Moment], object]


def speed(moment: Moment) -> float:
    """How fast the body goes, m/s."""
    x, z = moment.body.velocity
    return math.sqrt(x * x + z * z)  # as the core does, to the bit


def direction(moment: Moment) -> float:
    """Where the stick points against the way the body faces: degrees, positive to the left; 0 at rest."""
    return direction_of(*moment.stick, moment.body.heading)


def turn(moment: Moment) -> float:
    """How fast the body turns, degrees a second, positive to the left."""
    return math.degrees(moment.body.turn_rate)


FACTS: Mapping[str, FactOf] = MappingProxyType({"speed": speed, "direction": direction, "turn": turn})
"""The facts that a character computes by itself."""
UNITS = {
    "speed": ("", "m/s", "mps", "m / s"),
    "direction": ("", "degrees", "degree", "deg", "°"),
    "turn": ("", "degrees/s", "deg/s", "°/s", "dps", "degrees a second"),
}


def is_asked(name: str, function: FactOf, condition: Condition) -> bool:
    """Whether a condition of that name asks for what the function gives. One of one's own is given whatever the condition is."""
    if FACTS.get(name) is not function:
        return True
    return condition.domain.type.is_decimal and not condition.domain.type.is_whole and condition.unit.strip() in UNITS[name]


def fact_of_played(name: str, condition: Condition) -> FactOf | None:
    """The function of a fact of what plays, where a condition of that name asks for one."""
    fact = of_played(name, condition)
    if fact is None:
        return None
    return lambda moment: fact.before if moment.played is None else fact.value_of(moment.played)
