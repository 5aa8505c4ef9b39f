"""Where a character wishes to go: a body that follows a stick, smoothly, and the path that it expects of it.

The velocity nears the one that the stick asks for like a critically damped spring, and so does the facing. The past of the path is
where the body was, its future where it will be if the stick stays as it is. It becomes a query's trajectory by `with_path`.

Ground positions are (x, z) in metres and headings radians, as in `contextdb.motion.clips.trajectory`. Positions are computed
exactly, not step by step: a step of 0.2 s leads to where twenty of 0.01 s lead.

Source: D. Holden, "Spring-It-On", 2021; orangeduck/Motion-Matching, `controller.cpp`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np

from contextdb.cells.arguments import as_number, require_many_of, require_point, require_real
from contextdb.errors import Fault, MotionError
from contextdb.motion.clips.poses import LEAST_RATE, MOST_RATE
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import MOST_REACH_S, Trajectory
from contextdb.motion.records import quickly_made

STANDING_MPS = 0.1
"""Asked to go slower than this, a body keeps its facing."""

Ground = tuple[float, float]
Number = TypeVar("Number", float, Floats)
"""Formulas of springs serve one body at one moment or at many, and many bodies in arrays."""
At = Any
"""What is the same at all moments: a number, or an array that goes with the moments."""


@quickly_made
@dataclass(frozen=True, slots=True)
class Steered:
    """A body that follows a stick. `moved` gives the body some time later.

    Attributes
    ----------
    position, velocity, acceleration : (x, z)
        m, m/s, m/s².
    heading, turn_rate : float
        Radians, positive to the left, and radians a second.
    velocity_halflife_s, heading_halflife_s : float
        How long it takes until about half of a difference to what is asked for is gone.
    """

    position: Ground = (0.0, 0.0)
    velocity: Ground = (0.0, 0.0)
    acceleration: Ground = (0.0, 0.0)
    heading: float = 0.0
    turn_rate: float = 0.0
    velocity_halflife_s: float = 0.27
    heading_halflife_s: float = 0.27

    def __post_init__(self) -> None:
        one, other = self.velocity_halflife_s, self.heading_halflife_s
        if type(one) is type(other) is float and 0.0 < one < math.inf and 0.0 < other < math.inf:  # as mostly
            return
        for name in ("velocity_halflife_s", "heading_halflife_s"):
            number = as_number(getattr(self, name))
            if number is None or number <= 0.0:
                raise MotionError(Fault(f"{name} is {getattr(self, name)!r}.", "seconds above 0, such as 0.27"))

    def moved(self, dt_s: float, wanted: Ground, facing: float | None = None) -> Steered:
        """The body some seconds later, when the stick asks for a velocity and a heading; by default, to face where it goes.

        Raises ContextError where `wanted` is no pair of numbers, or another argument no number.
        """
        require_real(dt_s, "dt_s", 0.0)
        wanted = require_point(wanted, "wanted", "two numbers, x and z in metres a second")
        if facing is not None:
            require_real(facing, "facing")
        return self._moved(dt_s, wanted, facing)

    def _moved(self, dt_s: float, wanted: Ground, facing: float | None) -> Steered:
        x, z = (self._along(axis, dt_s, wanted[axis]) for axis in (0, 1))
        heading, turn_rate = self._turned(dt_s, self._facing(wanted) if facing is None else facing)
        return replace(
            self,
            position=(x[0], z[0]),
            velocity=(x[1], z[1]),
            acceleration=(x[2], z[2]),
            heading=heading,
            turn_rate=turn_rate,
        )

    def _path(self, times_s: Floats, wanted: Ground, facing: float | None) -> tuple[Floats, Floats]:
        """Where the body is at some moments, [T, 2], and its headings, [T]: `moved` for all moments at once."""
        damping = 2.0 * math.log(2.0) / self.velocity_halflife_s
        left = np.exp(-damping * times_s)
        places = np.empty((len(times_s), 2))
        for axis in (0, 1):
            own = self.position[axis], self.velocity[axis], self.acceleration[axis]
            places[:, axis] = placed_along(*own, wanted[axis], damping, left, times_s)
        damping = 2.0 * math.log(2.0) / self.heading_halflife_s
        apart = self._apart(self._facing(wanted) if facing is None else facing)
        return places, heading_of(self.heading, self.turn_rate, apart, damping, np.exp(-damping * times_s), times_s)

    def _along(self, axis: int, dt_s: float, wanted: float) -> tuple[float, float, float]:
        """Position, velocity and acceleration on one axis."""
        damping = 2.0 * math.log(2.0) / self.velocity_halflife_s
        own = self.position[axis], self.velocity[axis], self.acceleration[axis]
        return moved_along(*own, wanted, damping, math.exp(-damping * dt_s), dt_s)

    def _turned(self, dt_s: float, wanted: float) -> tuple[float, float]:
        """Heading and turn rate, on the shorter way to a heading."""
        damping = 2.0 * math.log(2.0) / self.heading_halflife_s
        return turned(self.heading, self.turn_rate, self._apart(wanted), damping, math.exp(-damping * dt_s), dt_s)

    def _apart(self, wanted: float) -> float:
        """How far the heading is past another, on the shorter way."""
        return -math.remainder(wanted - self.heading, 2.0 * math.pi)

    def _facing(self, wanted: Ground) -> float:
        return math.atan2(*wanted) if math.hypot(*wanted) >= STANDING_MPS else self.heading


def moved_along(
    position: Number, velocity: Number, acceleration: Number, wanted: Number, damping: Number, left: Number, dt_s: Number
) -> tuple[Number, Number, Number]:
    """Position, velocity and acceleration after a time; `left` is exp(-damping x time)."""
    apart = velocity - wanted
    drift = acceleration + apart * damping
    moved = placed_along(position, velocity, acceleration, wanted, damping, left, dt_s)
    return moved, left * (apart + drift * dt_s) + wanted, left * (acceleration - drift * damping * dt_s)


def placed_along(position: At, velocity: At, acceleration: At, wanted: At, damping: At, left: Number, dt_s: Number) -> Number:
    """The position alone."""
    apart = velocity - wanted
    drift = acceleration + apart * damping
    moved: Number = left * (-drift / damping**2 - (apart + drift * dt_s) / damping)
    moved += drift / damping**2 + apart / damping + wanted * dt_s + position
    return moved


def turned(heading: Number, turn_rate: Number, apart: Number, damping: Number, left: Number, dt_s: Number) -> tuple[Number, Number]:
    """Heading and turn rate after a time; `apart` is how far the heading is past the one that is asked for."""
    drift = turn_rate + apart * damping
    return heading_of(heading, turn_rate, apart, damping, left, dt_s), left * (turn_rate - drift * damping * dt_s)


def heading_of(heading: At, turn_rate: At, apart: At, damping: At, left: Number, dt_s: Number) -> Number:
    """The heading alone."""
    found: Number = heading - apart + left * (apart + (turn_rate + apart * damping) * dt_s)
    return found


def steered_path(
    past: list[Steered], wanted: Ground, facing: float | None = None, *, reach_s: float = 1.0, rate: float = 30.0
) -> Trajectory:
    """The path of a body: where it was, and where it will be if the stick stays as it is.

    Parameters
    ----------
    past : list of Steered
        The body at each of the last moments, 1 / rate seconds apart, the last of them now; at least one.
    wanted : (x, z)
        The velocity that the stick asks for, m/s.
    facing : float, optional
        The heading that it asks for. Default: where the body goes.
    reach_s : float
        Seconds ahead.
    rate : float
        Frames a second.

    Raises
    ------
    MotionError
        `past` is empty.
    ContextError
        `past` holds something that is no Steered, `wanted` is no pair of numbers, or another argument no number.
    """
    accepted = "a list of Steered, the body at its last moments"
    if not require_many_of(past, Steered, "past", accepted):
        raise MotionError(Fault("there is no body to steer.", "its last moments, at least the present one"))
    wanted = require_point(wanted, "wanted", "two numbers, x and z in metres a second")
    if facing is not None:
        require_real(facing, "facing")
    rate, reach_s = require_real(rate, "rate", LEAST_RATE, MOST_RATE), require_real(reach_s, "reach_s", 0.0, MOST_REACH_S)
    times_s = _times_s(rate, math.ceil(reach_s * rate))
    positions, headings = past[-1]._path(times_s, wanted, facing)
    positions = np.concatenate(([body.position for body in past], positions))
    headings = np.concatenate(([body.heading for body in past], headings))
    is_unwrapped = (np.abs(headings[1:] - headings[:-1]) < math.pi).all()
    return Trajectory(rate, positions, headings if is_unwrapped else np.unwrap(headings), len(past) - 1)


@lru_cache(64)
def _times_s(rate: float, n: int) -> Floats:
    """The moments of n frames ahead."""
    times_s = np.arange(1, n + 1) / rate
    times_s.flags.writeable = False
    return times_s
