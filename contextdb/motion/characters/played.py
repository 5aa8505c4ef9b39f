"""What plays now, as facts for the tables: which foot is down, how fast the clip goes, what its markup says.

A table asks for such a fact by a condition of its name, like for any other: `[conditions."LeftFoot.Down"] type = "bool"`.

| fact | type | what it is |
| --- | --- | --- |
| `LeftFoot.Down`, `RightFoot.Down` | bool | whether the clip has the foot on the ground, as a foot lock knows it |
| `LeftFoot.UntilDown_s`, `RightFoot.UntilDown_s` | number | seconds until it next has, 0 while it has; at most `MOST_S` |
| `Playing.Speed` | number | how fast the clip goes, m/s |
| `Playing.Turn` | number | how fast it turns, degrees a second, positive to the left |
| `Playing.Phase` | number | the share of the clip that has played, 0 to 1 |
| `Playing.Tag.NAME` | bool | whether the frame has this tag of the markup, or one below it |

The core computes them, see `contextdb/core/played.h`; a bundle names each by the letter that is first in `FACTS`.

Before anything plays no foot is down, and everything else is 0 or false. Of a mirrored clip the feet are those that are seen.

Source: the talk on walking of Tom Forsyth, in which the next step begins with the foot that is free.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.core import going, phase, until_down_s
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.records import quickly_made
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Playing

MOST_S = 10.0
TAG = "Playing.Tag."


@quickly_made
@dataclass(frozen=True, eq=False, slots=True)
class Played:
    """What plays, with the database and the poses that it is of, as far as there are any."""

    playing: Playing
    database: MotionDatabase | None
    bank: PoseBank | None

    def is_down(self, foot: int) -> bool:
        """Whether a foot, 0 for the left one, is down."""
        return self.until_down_s(foot) == 0.0

    def until_down_s(self, foot: int) -> float:
        """Seconds until a foot is down, in the clip's own time; `MOST_S` where it never is, or not before the clip ends."""
        if self.bank is None:
            return MOST_S
        number = self.bank.range_of(self.playing.asset, self.playing.mirrored)
        contacts = np.ascontiguousarray(self.bank.contacts[self.bank.starts[number] : self.bank.stops[number]])
        return until_down_s(contacts, foot, bool(self.bank.looping[number]), float(self.bank.rate), self.playing.time_s)

    def motion(self) -> tuple[float, float]:
        """How fast the clip goes, m/s, and turns, degrees a second, about now."""
        if self.database is None or self.database.root is None or self.database.schema is None:
            return 0.0, 0.0
        return going(
            np.ascontiguousarray(self.database.root[self._frames], np.float32), self.database.schema.rate, self.playing.time_s
        )

    def phase(self) -> float:
        """The share of the clip that has played."""
        if self.database is None or self.database.schema is None:
            return 0.0
        return phase(self._frames.stop - self._frames.start, self.database.schema.rate, self.playing.time_s)

    @property
    def _frames(self) -> slice:
        """Those of the clip in its database."""
        assert self.database is not None, "asked where there is one"
        return slice(int(self.database.starts[self.playing.range]), int(self.database.stops[self.playing.range]))

    def has_tag(self, tag: str) -> bool:
        """Whether the frame has a tag, or one below it."""
        return self.database is not None and bool(
            self.database.marks.kinds_with(tag)[self.database.marks.kinds[self.playing.frame]]
        )


OfPlayed = Callable[[Played], object]


class FactOfPlayed(NamedTuple):
    """A fact of what plays: its letter in a bundle, how it is answered, and what it is before anything plays."""

    letter: str
    value_of: OfPlayed
    before: object
    units: tuple[str, ...] = ()
    """Those in which a number is answered; none for True and False."""


UNTIL = ("", "s", "seconds")
FACTS = {
    "LeftFoot.Down": FactOfPlayed("l", lambda played: played.is_down(0), False),
    "RightFoot.Down": FactOfPlayed("r", lambda played: played.is_down(1), False),
    "LeftFoot.UntilDown_s": FactOfPlayed("L", lambda played: played.until_down_s(0), MOST_S, UNTIL),
    "RightFoot.UntilDown_s": FactOfPlayed("R", lambda played: played.until_down_s(1), MOST_S, UNTIL),
    "Playing.Speed": FactOfPlayed("v", lambda played: played.motion()[0], 0.0, ("", "m/s", "mps", "m / s")),
    "Playing.Turn": FactOfPlayed(
        "w", lambda played: played.motion()[1], 0.0, ("", "degrees/s", "deg/s", "°/s", "dps", "degrees a second")
    ),
    "Playing.Phase": FactOfPlayed("p", lambda played: played.phase(), 0.0, ("",)),
}


def of_played(name: str, condition: Condition) -> FactOfPlayed | None:
    """How a condition of that name is answered from what plays; None for any other name, and for a condition of another type or
    unit."""
    type_ = condition.domain.type
    fact = FACTS.get(name)
    if name.startswith(TAG) and len(name) > len(TAG):
        tag = name.removeprefix(TAG)
        fact = FactOfPlayed(f"g={tag}", lambda played: played.has_tag(tag), False)
    if fact is None or not fact.units:
        return fact if type_.fixed == (False, True) else None
    is_number = type_.is_decimal and not (type_.is_whole or type_.is_circular)
    return fact if is_number and condition.unit.strip() in fact.units else None
