"""Warp an animation's path over the ground, so that the body arrives at a target instead of where the animation would end.

A target, and every placement here, is seen by the body as it stands and faces when the animation is entered: metres to its left,
metres ahead, radians to the left. Within the warp window of position (or rotation) the difference between the target and the
animation is blended in; the share of it that is blended in goes from 0 where the window opens to 1 where it closes. There the body
is at the target (or faces as it shall), and from there on it follows the animation, in the direction it now faces. Outside the
windows nothing is warped. The loops are the core's nodes.h, which games play one-offs with.

    placement(t) = natural path, each step turned by rotation share x turn still missing
                   + position share x way still missing after those turns

The share follows the animation's own movement and not the clock: metres covered for position, radians turned for rotation. While
the animation stands still so does the warp, and feet that stand do not slide; where it strides, its strides get longer. An
animation that does too little of the one for what is missing is warped along with the other, counting a metre for a radian, and one
that does too little of both evenly in time.

K knots. Times are seconds. Source: the match node of Remedy's talk; "Warping To Target" in EA's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from contextdb.cells.arguments import as_number
from contextdb.core import motion_from, row_at, warp
from contextdb.errors import Fault, QueryError
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.features.extraction import FARTHEST_M
from contextdb.motion.markup.span_faults import TOLERANCE_S
from contextdb.motion.selection.root_motion import RootMotion

N_MORE = 4
"""So many knots a path has at most beside its frames: where two windows open and close."""


@dataclass(frozen=True, slots=True)
class Target:
    """Where a body shall be, as it sees it when it sets out.

    Attributes
    ----------
    left_m, ahead_m : float
    turn_rad : float or None
        Which way it shall face then, positive to the left; whole turns do not count. None: as the animation brings it about.

    Raises
    ------
    QueryError
        A number that is not finite, or a target more than 1,000 km away.
    """

    left_m: float
    ahead_m: float
    turn_rad: float | None = None

    @property
    def distance_m(self) -> float:
        """How far away it is."""
        return math.hypot(self.left_m, self.ahead_m)

    @property
    def numbers(self) -> Floats:
        """As the core has it: float64 [3], NaN for no heading."""
        return np.array((self.left_m, self.ahead_m, math.nan if self.turn_rad is None else self.turn_rad))

    @property
    def direction_deg(self) -> float:
        """In which direction it is seen: degrees, 0 ahead, positive to the left."""
        return math.degrees(math.atan2(self.left_m, self.ahead_m))

    def __post_init__(self) -> None:
        for name in ("left_m", "ahead_m"):
            metres = _number(getattr(self, name), f"the target's {name}", "metres")
            if abs(metres) > FARTHEST_M:
                raise QueryError(Fault(f"the target's {name} is {metres:g}.", f"metres, at most {FARTHEST_M:,.0f} away"))
            object.__setattr__(self, name, metres)
        if self.turn_rad is not None:
            turn = _number(self.turn_rad, "the target's turn_rad", "radians, or None")
            object.__setattr__(self, "turn_rad", math.remainder(turn, math.tau))

    @classmethod
    def seen_from(cls, body: RootMotion, x_m: float, z_m: float, heading_rad: float | None = None) -> Target:
        """A target in the world, as a body sees it whose own place is `RootMotion(x_m, z_m, heading_rad)`.

        In the world x is to the left and z ahead of a heading of 0, as in `MotionDatabase.root`: a body's place is the movement to
        it from the origin, and `body.then(placement)` puts a placement back into the world.
        """
        left, ahead, facing = (
            _number(each, "the body's place", "three numbers") for each in (body.left_m, body.ahead_m, body.turn_rad)
        )
        x, z = (_number(value, "the target's place", "metres") for value in (x_m, z_m))
        turn = None if heading_rad is None else _number(heading_rad, "the target's heading", "radians, or None") - facing
        way = motion_from(left, ahead, facing, x, z, 0.0)
        return cls(way[0], way[1], turn)


class Window(NamedTuple):
    """From when to when a warp may happen."""

    from_s: float
    to_s: float

    @property
    def is_open(self) -> bool:
        """Whether there is time to warp in it."""
        return self.to_s - self.from_s > TOLERANCE_S


class WarpShare(NamedTuple):
    """How much of the warp has been blended in, of position and of rotation: each from 0 to 1."""

    position: float
    rotation: float


@dataclass(frozen=True, eq=False)
class WarpedPath:
    """A path from entry to its end, straight from knot to knot, K of them. Make it with `warped`.

    `times_s` float64 [K] are seconds since the entry, from 0 on; `placements` float64 [K, 3] metres to the left and ahead, and
    radians turned, not wrapped; `shares` float64 [K, 2] how much of the warp of position and rotation is blended in. `position_s`
    and `rotation_s` say when the body is at the target, and when it faces as it shall; None where there is no time to warp, or
    nothing is asked.
    """

    times_s: Floats
    placements: Floats
    shares: Floats
    position_s: float | None
    rotation_s: float | None

    def at(self, time_s: float) -> RootMotion:
        """Where the body is some seconds after the entry; before it and behind the end, as there."""
        return RootMotion(*self._row_at(self.placements, time_s))

    def share_at(self, time_s: float) -> WarpShare:
        """How much of the warp is blended in by then."""
        return WarpShare(*self._row_at(self.shares, time_s))

    def _row_at(self, rows: Floats, time_s: float) -> list[float]:
        row = np.empty(rows.shape[1])
        row_at(self.times_s, rows, time_s, row)
        return row.tolist()


def warped(times_s: Floats, path: Floats, position: Window, rotation: Window, target: Target) -> WarpedPath:
    """Warp a path to a target.

    Parameters
    ----------
    times_s : float64 array, shape (n,)
        Ascending from 0, the entry.
    path : float64 array, shape (n, 3)
        As the animation has it: x and z in metres and the heading in radians.
    position, rotation : Window
        Within `times_s`, in seconds since the entry. Nothing is warped in one that is not open.
    target : Target
    """
    n = len(times_s) + N_MORE
    knots, own, places, shares = np.empty(n), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 2))
    n = warp(times_s, np.array(path, np.float64), np.array((position, rotation)), target.numbers, knots, own, places, shares)
    position_s = position.to_s if position.is_open else None
    rotation_s = rotation.to_s if rotation.is_open and target.turn_rad is not None else None
    return WarpedPath(knots[:n].copy(), places[:n].copy(), shares[:n].copy(), position_s, rotation_s)


def _number(value: object, what: str, accepted: str) -> float:
    number = as_number(value)
    if number is None:
        raise QueryError(Fault(f"{what} is {value!r}.", f"{accepted}, finite"))
    return number
