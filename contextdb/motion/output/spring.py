"""Inertialization: where what plays jumps, the difference to what was shown stays as an offset, and decays.

Only the animation that plays is sampled. At a seam the offset is chosen so that the pose and its velocity are what they were; a
seam within a decay takes what is left of it along. The offset is a turn of each joint in its parent's frame and a shift of each
joint with a position of its own, and both decay as critically damped springs of one half-life, in closed form: after any steps of
time they are what they are after one.

Source: D. Bollo, "Inertialization", GDC 2018; D. Holden, "Spring-It-On", 2021; orangeduck/Motion-Matching, `controller.cpp`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output import kernels
from contextdb.motion.output.bank import Place3, Sample
from contextdb.motion.output.stages import Posture, Tick, damping


@dataclass(frozen=True, eq=False, slots=True)
class Offsets:
    """What is added to what plays: turns [J, 3] and shifts [M, 3], and their changes a second."""

    turns: Floats
    turn_speeds: Floats
    shifts: Floats
    shift_speeds: Floats


@dataclass(frozen=True, slots=True)
class Spring:
    """The stage: offsets of all joints that decay by a half-life."""

    halflife_s: float

    def begin(self, posture: Posture, body: Place3 | None) -> Offsets:
        """No offset."""
        n_joints, n_moving = len(posture.rotations), len(posture.positions)
        return Offsets(np.zeros((n_joints, 3)), np.zeros((n_joints, 3)), np.zeros((n_moving, 3)), np.zeros((n_moving, 3)))

    def apply(self, posture: Posture, tick: Tick, state: object) -> tuple[Posture, Offsets]:
        """The posture with the offsets as they are now."""
        assert isinstance(state, Offsets)
        offsets = decayed(state, self.halflife_s, tick.dt_s)
        if tick.left is not None and tick.entered is not None:
            offsets = kept(offsets, tick.left, tick.entered)
        rotations = np.empty_like(posture.rotations)
        kernels.turn_by(offsets.turns, posture.rotations, rotations)
        return Posture(rotations, posture.positions + offsets.shifts, posture.root), offsets


def decayed(offsets: Offsets, halflife_s: float, dt_s: float) -> Offsets:
    """The offsets some time later."""
    now = Offsets(*(np.empty_like(each) for each in (offsets.turns, offsets.turns, offsets.shifts, offsets.shifts)))
    y = damping(halflife_s)
    kernels.decay(offsets.turns, offsets.turn_speeds, y, dt_s, now.turns, now.turn_speeds)
    kernels.decay(offsets.shifts, offsets.shift_speeds, y, dt_s, now.shifts, now.shift_speeds)
    return now


def kept(offsets: Offsets, left: Sample, entered: Sample) -> Offsets:
    """The offsets to one moment of a clip that show the same as some offsets to another one, in pose and velocity."""
    turns, speeds = np.empty_like(offsets.turns), np.empty_like(offsets.turns)
    kernels.leave(offsets.turns, offsets.turn_speeds, left.rotations, left.spins, entered.rotations, entered.spins, turns, speeds)
    shifts = offsets.shifts + left.positions - entered.positions
    return Offsets(turns, speeds, shifts, offsets.shift_speeds + left.velocities - entered.velocities)
