"""Warp an animation's path over the ground, so that the body arrives at a target instead of where the animation would end.

A target, and every placement here, is seen by the body as it stands and faces when the animation is entered: metres to its left,
metres ahead, radians to the left. Within the warp window of position (or rotation) the difference between the target and the
animation is blended in; the share of it that is blended in goes from 0 where the window opens to 1 where it closes. There the body
is at the target (or faces as it shall), and from there on it follows the animation, in the direction it now faces. Outside the
windows nothing is warped.

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
from contextdb.errors import Fault, QueryError
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import STANDING_MPS, to_own_frame
from contextdb.motion.features.extraction import FARTHEST_M
from contextdb.motion.markup.span_faults import TOLERANCE_S
from contextdb.motion.selection.root_motion import RootMotion

STANDING_RADPS = 0.1
"""A body that turns slower does not turn; one that moves slower than `STANDING_MPS` stands."""
LEAST_MOVED_M = 0.1
LEAST_TURNED_RAD = 0.15
"""An animation that covers or turns less within a window does not carry a warp: a few steps of it would take all of it at once."""
MOST_TIMES = 4.0
"""Nor does one of which a warp would add more than so many times its own movement."""


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
        here = [_number(value, "the body's place", "three numbers") for value in (body.left_m, body.ahead_m, body.turn_rad)]
        there = [_number(value, "the target's place", "metres") for value in (x_m, z_m)]
        way = to_own_frame(np.array(there) - np.array(here[:2]), np.array(here[2]))
        heading = None if heading_rad is None else _number(heading_rad, "the target's heading", "radians, or None") - here[2]
        return cls(float(way[0]), float(way[1]), heading)


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
        left, ahead, turn = (float(np.interp(time_s, self.times_s, column)) for column in self.placements.T)
        return RootMotion(left, ahead, turn)

    def share_at(self, time_s: float) -> WarpShare:
        """How much of the warp is blended in by then."""
        position, rotation = (float(np.interp(time_s, self.times_s, column)) for column in self.shares.T)
        return WarpShare(position, rotation)


def warped(times_s: Floats, path: Floats, position: Window, rotation: Window, target: Target) -> WarpedPath:
    """Warp a path to a target.

    Parameters
    ----------
    times_s : float64 array, shape (n,)
        Ascending from 0, the entry.
    path : float64 array, shape (n, 3)
        As the animation has it: x and z in metres and the heading in radians, unwrapped.
    position, rotation : Window
        Within `times_s`, in seconds since the entry. Nothing is warped in one that is not open.
    target : Target
    """
    windows = [window for window in (position, rotation) if window.is_open]
    knots = np.unique(np.concatenate([times_s, *map(np.array, windows)]))
    natural = np.stack([np.interp(knots, times_s, column) for column in path.T], axis=-1)
    steps = to_own_frame(np.diff(natural[:, :2], axis=0), path[0, 2])
    turns = natural[:, 2] - path[0, 2]
    way, turning = _movements(knots, steps, turns)

    rotation_s = rotation.to_s if rotation.is_open and target.turn_rad is not None else None
    missing_turn = 0.0
    if rotation_s is not None and target.turn_rad is not None:
        missing_turn = math.remainder(target.turn_rad - turns[np.searchsorted(knots, rotation_s)], math.tau)
    turn_share = _share(knots, rotation, (turning, way), abs(missing_turn))
    added = missing_turn * turn_share
    places = _summed(to_own_frame(steps, -(added[1:] + added[:-1]) / 2.0))

    position_s = position.to_s if position.is_open else None
    missing = np.zeros(2)
    if position_s is not None:
        missing = np.array((target.left_m, target.ahead_m)) - places[np.searchsorted(knots, position_s)]
    way_share = _share(knots, position, (way, turning), float(np.linalg.norm(missing)))
    placements = np.column_stack((places + way_share[:, None] * missing, turns + added))
    return WarpedPath(knots, placements, np.column_stack((way_share, turn_share)), position_s, rotation_s)


def wrapped(radians: Floats) -> Floats:
    """Angles as the shortest way round, from -π to π."""
    return np.asarray(radians - math.tau * np.rint(radians / math.tau))


class _Movement(NamedTuple):
    """What an animation does from knot to knot, [K-1], in metres or radians; `least` of it within a window can carry a warp."""

    amounts: Floats
    least: float


def _movements(knots: Floats, steps: Floats, turns: Floats) -> tuple[_Movement, _Movement]:
    """How far the animation goes and how far it turns; standing still is 0."""
    seconds, lengths, angles = np.diff(knots), np.linalg.norm(steps, axis=-1), np.abs(np.diff(turns))
    moved = np.where(lengths > STANDING_MPS * seconds, lengths, 0.0)
    turned = np.where(angles > STANDING_RADPS * seconds, angles, 0.0)
    return _Movement(moved, LEAST_MOVED_M), _Movement(turned, LEAST_TURNED_RAD)


def _share(knots: Floats, window: Window, movements: tuple[_Movement, ...], missing: float) -> Floats:
    """The share of a warp at each knot, [K]: by the first movement of which there is enough for what is missing, or by time."""
    if not window.is_open:
        return np.zeros(len(knots))
    inside = (knots[:-1] >= window.from_s) & (knots[1:] <= window.to_s)
    enough = (each.amounts for each in movements if each.amounts[inside].sum() >= max(each.least, missing / MOST_TIMES))
    passed = _summed(np.where(inside, next(enough, np.diff(knots)), 0.0))
    return np.asarray(passed / passed[-1])


def _summed(amounts: Floats) -> Floats:
    """What has come together at each knot, 0 at the first: [K-1, ...] to [K, ...]."""
    return np.concatenate((np.zeros((1, *amounts.shape[1:])), np.cumsum(amounts, axis=0)))


def _number(value: object, what: str, accepted: str) -> float:
    number = as_number(value)
    if number is None:
        raise QueryError(Fault(f"{what} is {value!r}.", f"{accepted}, finite"))
    return number
