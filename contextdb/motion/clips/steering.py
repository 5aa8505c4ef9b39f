"""Where a character wishes to go: a body that follows a stick, smoothly, and the path that it expects of it.

The velocity nears the one that the stick asks for like a critically damped spring, and so does the facing. The past of the path is
where the body was, its future where it will be if the stick stays as it is. It becomes a query's trajectory by `with_path`.

Ground positions are (x, z) in metres and headings radians, as in `contextdb.motion.clips.trajectory`. Positions are computed
exactly, not step by step: a step of 0.2 s leads to where twenty of 0.01 s lead.

Source: D. Holden, "Spring-It-On", 2021; orangeduck/Motion-Matching, `controller.cpp`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contextdb.cells.arguments import as_number, require_many_of, require_point, require_real
from contextdb.core import move_bodies, steer_paths
from contextdb.errors import Fault, MotionError
from contextdb.motion.clips.poses import LEAST_RATE, MOST_RATE
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import MOST_REACH_S, Trajectory
from contextdb.motion.records import quickly_made

Ground = tuple[float, float]
N_NUMBERS = 10
"""So many numbers a body is for the core, see `cdbo_body` in paths.h."""


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
        How long it takes until about half of a difference to what is requested is gone.
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
        return self.moved_unchecked(dt_s, wanted, facing)

    def moved_unchecked(self, dt_s: float, wanted: Ground, facing: float | None) -> Steered:
        """The same of arguments that are known to be right."""
        moved = np.empty((1, N_NUMBERS))
        move_bodies(np.array([self.numbers]), _goal(wanted, facing), float(dt_s), moved)
        return Steered.of_numbers(moved[0].tolist())

    @classmethod
    def of_numbers(cls, numbers: Sequence[float]) -> Steered:
        """A body as the core has it."""
        x, z, to_x, to_z, more_x, more_z, heading, turn_rate, *halflives_s = numbers
        return cls((x, z), (to_x, to_z), (more_x, more_z), heading, turn_rate, *halflives_s)

    @property
    def numbers(self) -> tuple[float, ...]:
        """Itself as the core takes it."""
        others = self.heading, self.turn_rate, self.velocity_halflife_s, self.heading_halflife_s
        return (*self.position, *self.velocity, *self.acceleration, *others)


def _goal(wanted: Ground, facing: float | None) -> Floats:
    """What a stick asks for, as the core takes it: [1, 3]."""
    return np.array([(*wanted, math.nan if facing is None else facing)], np.float64)


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
    n_past = len(past)
    n_frames = n_past + math.ceil(reach_s * rate)
    positions, headings = np.empty((1, n_frames, 2)), np.empty((1, n_frames))
    positions[0, :n_past], headings[0, :n_past] = [body.position for body in past], [body.heading for body in past]
    steer_paths(np.array([past[-1].numbers]), _goal(wanted, facing), rate, n_past, positions, headings)
    return Trajectory(rate, positions[0], headings[0], n_past - 1)
