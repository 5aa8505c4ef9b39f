"""How an animation moves the body over the ground: the part of a clip's path that was played.

A clip's path is where its root is, frame by frame. Between two moments of a range it gives a movement in the body's own frame as it
was at the first: metres to its left and ahead, and a turn. A jump to another frame moves nobody.

Source: "Root Motion Weight" in EA's talk; animation-driven movement in Remedy's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from contextdb.core import motion_from, motion_then
from contextdb.motion.records import quickly_made
from contextdb.motion.search.layout import Features


@quickly_made
@dataclass(frozen=True, slots=True)
class RootMotion:
    """A movement over the ground in the body's own frame at its beginning: metres and radians, positive to the left."""

    left_m: float = 0.0
    ahead_m: float = 0.0
    turn_rad: float = 0.0

    def then(self, other: RootMotion) -> RootMotion:
        """This movement and after it another one, which begins where this one ends."""
        return RootMotion(*motion_then(self.left_m, self.ahead_m, self.turn_rad, other.left_m, other.ahead_m, other.turn_rad))

    def repeated(self, times: int) -> RootMotion:
        """This movement some times, one after the other."""
        if times <= 0:
            return NO_MOTION
        half = self.repeated(times // 2)
        twice = half.then(half)
        return twice.then(self) if times % 2 else twice

    def scaled(self, share: float) -> RootMotion:
        """A share of the movement, such as what a root weight leaves of it."""
        return RootMotion(share * self.left_m, share * self.ahead_m, share * self.turn_rad)


NO_MOTION = RootMotion()


def between(body: RootMotion, later: RootMotion) -> RootMotion:
    """The movement that leads from one place of a body to a later one, both seen from the same place."""
    return RootMotion(*motion_from(body.left_m, body.ahead_m, body.turn_rad, later.left_m, later.ahead_m, later.turn_rad))


def motion_between(path: Features, from_frame: float, to_frame: float) -> RootMotion:
    """The movement of a path [n, 3], x and z in metres and heading in radians, from one frame to another; both may be fractions."""
    low, to_low = _low(path, from_frame), _low(path, to_frame)
    if low <= to_low <= low + 2:  # one look at the path is enough
        about = path[low : to_low + 2].tolist()
        x, z, heading = _between(about[:2], from_frame - low)
        to_x, to_z, to_heading = _between(about[to_low - low :], to_frame - to_low)
    else:
        x, z, heading = _between(path[low : low + 2].tolist(), from_frame - low)
        to_x, to_z, to_heading = _between(path[to_low : to_low + 2].tolist(), to_frame - to_low)
    sin, cos = math.sin(heading), math.cos(heading)
    return RootMotion(cos * (to_x - x) - sin * (to_z - z), sin * (to_x - x) + cos * (to_z - z), to_heading - heading)


def _low(path: Features, frame: float) -> int:
    """The last frame of a path that is not behind a frame."""
    low, last = int(frame), len(path) - 1
    return 0 if low < 0 else low if low < last else last


def _between(about: list[list[float]], share: float) -> tuple[float, float, float]:
    """A share of the straight line from the first of some places to the last."""
    share = 0.0 if share < 0.0 else 1.0 if share > 1.0 else share
    (x, z, heading), (to_x, to_z, to_heading) = about[0], about[-1]
    return x + share * (to_x - x), z + share * (to_z - z), heading + share * (to_heading - heading)
