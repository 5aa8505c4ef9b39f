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

Before anything plays no foot is down, and everything else is 0 or false. Of a mirrored clip the feet are those that are seen.

Source: the talk on walking of Tom Forsyth, in which the next step begins with the foot that is free.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.records import quickly_made
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Playing
from contextdb.motion.selection.root_motion import motion_between

MOST_S = 10.0
WINDOW_S = 1.0
"""Speed and turn are means over so much of the clip, as a body sways with its steps."""
FEET = ("LeftFoot", "RightFoot")
DOWN, UNTIL, TAG = ".Down", ".UntilDown_s", "Playing.Tag."


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
        if self.bank is None or foot >= len(self.bank.feet):
            return MOST_S
        number = self.bank.range_of(self.playing.asset, self.playing.mirrored)
        down = self.bank.contacts[self.bank.starts[number] : self.bank.stops[number], foot]
        first = min(max(round(self.playing.time_s * self.bank.rate), 0), len(down) - 1)
        ahead = np.concatenate((down[first:], down[:first])) if self.bank.looping[number] else down[first:]
        return min(float(np.argmax(ahead)) / self.bank.rate, MOST_S) if ahead.any() else MOST_S

    def motion(self) -> tuple[float, float]:
        """How fast the clip goes, m/s, and turns, degrees a second, about now."""
        if self.database is None or self.database.root is None or self.database.schema is None:
            return 0.0, 0.0
        start, stop = (int(each[self.playing.range]) for each in (self.database.starts, self.database.stops))
        rate, half = self.database.schema.rate, WINDOW_S * self.database.schema.rate / 2.0
        now = self.playing.time_s * rate
        first, last = max(now - half, 0.0), min(now + half, float(stop - start - 1))
        if last <= first:
            return 0.0, 0.0
        moved, seconds = motion_between(self.database.root[start:stop], first, last), (last - first) / rate
        return math.hypot(moved.left_m, moved.ahead_m) / seconds, math.degrees(moved.turn_rad) / seconds

    def phase(self) -> float:
        """The share of the clip that has played."""
        if self.database is None or self.database.schema is None:
            return 0.0
        start, stop = (int(each[self.playing.range]) for each in (self.database.starts, self.database.stops))
        last_s = max(stop - start - 1, 1) / self.database.schema.rate
        return min(max(self.playing.time_s / last_s, 0.0), 1.0)

    def has_tag(self, tag: str) -> bool:
        """Whether the frame has a tag, or one below it."""
        if self.database is None:
            return False
        wanted = tag.casefold()
        return any(f"{own.casefold()}.".startswith(f"{wanted}.") for own in self.database.marks.tags_of(self.playing.frame))


OfPlayed = Callable[[Played], object]
UNITS: dict[str, tuple[str, ...]] = {
    "Playing.Speed": ("", "m/s", "mps", "m / s"),
    "Playing.Turn": ("", "degrees/s", "deg/s", "°/s", "dps", "degrees a second"),
    "Playing.Phase": ("",),
    UNTIL: ("", "s", "seconds"),
}


def of_played(name: str, condition: Condition) -> tuple[OfPlayed, object] | None:
    """How a condition of that name is answered from what plays, and what it is before anything plays; None for any other name,
    and for a condition of another type or unit."""
    type_, unit = condition.domain.type, condition.unit.strip()
    is_bool = type_.fixed == (False, True)
    is_number = type_.is_decimal and not (type_.is_whole or type_.is_circular)
    foot = next((i for i, each in enumerate(FEET) if name in (each + DOWN, each + UNTIL)), None)
    if foot is not None and name.endswith(DOWN):
        return (lambda played: played.is_down(foot), False) if is_bool else None
    if name.startswith(TAG) and len(name) > len(TAG):
        return (lambda played: played.has_tag(name.removeprefix(TAG)), False) if is_bool else None
    if not is_number or unit not in UNITS.get(UNTIL if foot is not None else name, ()):
        return None
    if foot is not None:
        return lambda played: played.until_down_s(foot), MOST_S
    functions: dict[str, OfPlayed] = {
        "Playing.Speed": lambda played: played.motion()[0],
        "Playing.Turn": lambda played: played.motion()[1],
        "Playing.Phase": lambda played: played.phase(),
    }
    return functions[name], 0.0
