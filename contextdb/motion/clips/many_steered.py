"""A crowd of bodies that follow sticks, in arrays: as `contextdb.motion.clips.steering` has one. Q bodies, T moments."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import MOST, require_many_of, require_numbers, require_real
from contextdb.core import move_bodies, steer_paths
from contextdb.errors import Fault, MotionError
from contextdb.motion.clips.many_paths import ManyTrajectories
from contextdb.motion.clips.poses import LEAST_RATE, MOST_RATE
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import N_NUMBERS, Steered
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
        moved = np.empty((len(self), N_NUMBERS))
        move_bodies(self._numbers, self.goals(wanted, facing), float(dt_s), moved)
        return ManySteered(moved[:, 0:2], moved[:, 2:4], moved[:, 4:6], *moved[:, 6:].T)

    @property
    def _numbers(self) -> Floats:
        """The bodies as the core takes them: [Q, 10]."""
        others = self.headings, self.turn_rates, self.velocity_halflives_s, self.heading_halflives_s
        return np.column_stack((self.positions, self.velocities, self.accelerations, *others))

    def goals(self, wanted: ArrayLike, facing: ArrayLike | None) -> Floats:
        """The velocities and headings that the sticks ask for, checked: [Q, 3], NaN where none is asked for."""
        velocities = require_numbers(wanted, "wanted")
        if velocities.shape != self.positions.shape:
            problem = f"the velocities that are requested have shape {velocities.shape}."
            raise MotionError(Fault(problem, f"{self.positions.shape}, x and z for each body"))
        if (unfit := np.flatnonzero(~(np.abs(velocities) <= MOST).all(axis=1))).size:
            problem = f"the velocity {velocities[unfit[0]].tolist()} is asked of body {unfit[0]}."
            raise MotionError(Fault(problem, f"numbers from {-MOST:g} to {MOST:g}"))
        if facing is None:
            return np.column_stack((velocities, np.full(len(self), math.nan)))
        headings = require_numbers(facing, "facing")
        if headings.shape != self.headings.shape:
            raise MotionError(Fault(f"the facing has shape {headings.shape}.", f"{self.headings.shape}, a heading for each body"))
        if (unfit := np.flatnonzero(~np.isfinite(headings))).size:
            raise MotionError(Fault(f"the facing {headings[unfit[0]]} is asked of body {unfit[0]}.", "radians"))
        return np.column_stack((velocities, headings))


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
    n_past = len(past)
    n_frames = n_past + math.ceil(reach_s * rate)
    positions, headings = np.empty((len(present), n_frames, 2)), np.empty((len(present), n_frames))
    for i, bodies in enumerate(past):
        positions[:, i], headings[:, i] = bodies.positions, bodies.headings
    steer_paths(present._numbers, present.goals(wanted, facing), rate, n_past, positions, headings)
    return ManyTrajectories(rate, positions, headings, n_past - 1)
