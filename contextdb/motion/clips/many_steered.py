"""A crowd of bodies that follow sticks, in arrays: as `contextdb.motion.clips.steering` has one. Q bodies, T moments."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import MOST, require_many_of, require_numbers, require_real
from contextdb.errors import Fault, MotionError
from contextdb.motion.clips.many_paths import ManyTrajectories
from contextdb.motion.clips.poses import LEAST_RATE, MOST_RATE
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import STANDING_MPS, Steered, moved_along, turned
from contextdb.motion.clips.trajectory import MOST_REACH_S


@dataclass(frozen=True, slots=True, eq=False)
class ManySteered:
    """Bodies that follow sticks. `moved` gives them some time later.

    Attributes
    ----------
    positions, velocities, accelerations : float64 arrays, shape (Q, 2)
        x and z: m, m/s, m/s².
    headings, turn_rates : float64 arrays, shape (Q,)
        Radians, positive to the left, and radians a second.
    velocity_halflives_s, heading_halflives_s : float64 arrays, shape (Q,)
        See `Steered`.
    """

    positions: Floats
    velocities: Floats
    accelerations: Floats
    headings: Floats
    turn_rates: Floats
    velocity_halflives_s: Floats
    heading_halflives_s: Floats

    @classmethod
    def of(cls, bodies: Sequence[Steered]) -> ManySteered:
        """Single bodies together; `[Steered()] * n` are n at rest. Raises ContextError for anything else."""
        bodies = require_many_of(bodies, Steered, "bodies", "a list of Steered")
        pairs = [
            np.array([getattr(b, name) for b in bodies], float).reshape(-1, 2) for name in ("position", "velocity", "acceleration")
        ]
        names = ("heading", "turn_rate", "velocity_halflife_s", "heading_halflife_s")
        return cls(*pairs, *(np.array([getattr(b, name) for b in bodies], float) for name in names))

    def __len__(self) -> int:
        return len(self.headings)

    def __iter__(self) -> Iterator[Steered]:
        pairs = (map(tuple, each.tolist()) for each in (self.positions, self.velocities, self.accelerations))
        others = (self.headings, self.turn_rates, self.velocity_halflives_s, self.heading_halflives_s)
        return map(Steered, *pairs, *(each.tolist() for each in others))

    def __getitem__(self, i: int) -> Steered:
        x, z = self.positions[i].tolist(), self.velocities[i].tolist()
        others = (self.headings, self.turn_rates, self.velocity_halflives_s, self.heading_halflives_s)
        return Steered(tuple(x), tuple(z), tuple(self.accelerations[i].tolist()), *(float(each[i]) for each in others))

    def moved(self, dt_s: float, wanted: ArrayLike, facing: ArrayLike | None = None) -> ManySteered:
        """The bodies some seconds later, when the sticks ask for velocities [Q, 2] and headings [Q]; by default, to face where they
        go. Raises MotionError for shapes that do not fit, ContextError for what is no number of seconds."""
        require_real(dt_s, "dt_s", 0.0)
        place, speed, change, heading, turn_rate = self._at(np.array([dt_s]), *self._asked(wanted, facing))
        return replace(
            self,
            positions=place[:, 0],
            velocities=speed[:, 0],
            accelerations=change[:, 0],
            headings=heading[:, 0],
            turn_rates=turn_rate[:, 0],
        )

    def _at(self, times_s: Floats, wanted: Floats, facing: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Positions, velocities and accelerations, each [Q, T, 2], and headings and turn rates [Q, T] at some moments."""
        damping = (2.0 * math.log(2.0) / self.velocity_halflives_s)[:, None, None]
        seconds = times_s[None, :, None]
        positions, velocities, accelerations = self.positions[:, None], self.velocities[:, None], self.accelerations[:, None]
        left = np.exp(-damping * seconds)
        place, speed, change = moved_along(positions, velocities, accelerations, wanted[:, None], damping, left, seconds)
        apart = facing - self.headings
        apart = (apart - 2.0 * math.pi * np.rint(apart / (2.0 * math.pi)))[:, None]
        damping = (2.0 * math.log(2.0) / self.heading_halflives_s)[:, None]
        left = np.exp(-damping * times_s)
        return place, speed, change, *turned(self.headings[:, None], self.turn_rates[:, None], -apart, damping, left, times_s)

    def _asked(self, wanted: ArrayLike, facing: ArrayLike | None) -> tuple[Floats, Floats]:
        """The velocities and headings that the sticks ask for, checked."""
        velocities = require_numbers(wanted, "wanted")
        if velocities.shape != self.positions.shape:
            found = f"the velocities that are asked for have shape {velocities.shape}."
            raise MotionError(Fault(found, f"{self.positions.shape}, x and z for each body"))
        if (unfit := np.flatnonzero(~(np.abs(velocities) <= MOST).all(axis=1))).size:
            found = f"the velocity {velocities[unfit[0]].tolist()} is asked of body {unfit[0]}."
            raise MotionError(Fault(found, f"numbers from {-MOST:g} to {MOST:g}"))
        if facing is None:
            is_going = np.hypot(velocities[:, 0], velocities[:, 1]) >= STANDING_MPS
            return velocities, np.where(is_going, np.arctan2(velocities[:, 0], velocities[:, 1]), self.headings)
        headings = require_numbers(facing, "facing")
        if headings.shape != self.headings.shape:
            raise MotionError(Fault(f"the facing has shape {headings.shape}.", f"{self.headings.shape}, a heading for each body"))
        if (unfit := np.flatnonzero(~np.isfinite(headings))).size:
            raise MotionError(Fault(f"the facing {headings[unfit[0]]} is asked of body {unfit[0]}.", "radians"))
        return velocities, headings


def steered_paths(
    past: Sequence[ManySteered], wanted: ArrayLike, facing: ArrayLike | None = None, *, reach_s: float = 1.0, rate: float = 30.0
) -> ManyTrajectories:
    """The paths of many bodies: where they were, and where they will be if the sticks stay as they are; see `steered_path`.

    Parameters
    ----------
    past : sequence of ManySteered
        The bodies at each of the last moments, 1 / rate seconds apart, the last of them now; at least one.
    wanted : float array, shape (Q, 2)
        The velocities that the sticks ask for, x and z in m/s.
    facing : float array, shape (Q,), optional
        The headings that they ask for. Default: where the bodies go.
    reach_s : float
        Seconds ahead.
    rate : float
        Frames a second.

    Raises
    ------
    MotionError
        There is no moment, the moments are of different numbers of bodies, or an argument cannot be used.
    """
    past = require_many_of(past, ManySteered, "past", "a list of ManySteered, the last of them now")
    rate, reach_s = require_real(rate, "rate", LEAST_RATE, MOST_RATE), require_real(reach_s, "reach_s", 0.0, MOST_REACH_S)
    if not past:
        raise MotionError(Fault("there is no body to steer.", "its last moments, at least the present one"))
    present = past[-1]
    if any(len(bodies) != len(present) for bodies in past):
        raise MotionError(Fault("the moments are of different numbers of bodies.", "the same bodies at each"))
    times_s = np.arange(1, math.ceil(reach_s * rate) + 1) / rate
    place, _, _, heading, _ = present._at(times_s, *present._asked(wanted, facing))
    positions = np.concatenate((np.stack([bodies.positions for bodies in past], axis=1), place), axis=1)
    headings = np.concatenate((np.stack([bodies.headings for bodies in past], axis=1), heading), axis=1)
    return ManyTrajectories(rate, positions, np.unwrap(headings, axis=1), len(past) - 1)
