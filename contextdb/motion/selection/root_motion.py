"""How an animation moves the body over the ground: the part of a clip's path that was played.

A clip's path is where its root is, frame by frame. Between two moments of a range it gives a movement in the body's own frame as it
was at the first: metres to its left and ahead, and a turn. A jump to another frame moves nobody.

Source: "Root Motion Weight" in EA's talk; animation-driven movement in Remedy's.
"""

from __future__ import annotations

from dataclasses import dataclass

from contextdb.core import motion_from, motion_then
from contextdb.motion.records import quickly_made


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
