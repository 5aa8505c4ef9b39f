"""Inertialization: where what plays jumps, the difference to what was shown stays as an offset, and decays.

Only the animation that plays is sampled. At a seam the offset is chosen so that the pose and its velocity are what they were; a
seam within a decay takes what is left of it along. The offset is a turn of each joint in its parent's frame and a shift of each
joint with a position of its own, and both decay as critically damped springs of one half-life, in closed form: after any steps of
time they are what they are after one.

Source: D. Bollo, "Inertialization", GDC 2018; D. Holden, "Spring-It-On", 2021; orangeduck/Motion-Matching, `controller.cpp`.
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return"

from __future__ import annotations

from contextdb.motion.output import kernels
from contextdb.motion.output.kernels import compiled


@compiled
def spring(
    turns, spins, shifts, speeds, y, dt, is_seam, left, left_spins, left_positions, left_speeds,
    entered, entered_spins, entered_positions, entered_speeds, clip, clip_positions,
    to_turns, to_spins, to_shifts, to_speeds, rotations, positions,
):  # fmt: skip
    """The clip's pose with the offsets as they are after some time, and after a seam where there is one."""
    kernels.decay(turns, spins, y, dt, to_turns, to_spins)
    kernels.decay(shifts, speeds, y, dt, to_shifts, to_speeds)
    if is_seam:
        old, pace = to_turns.copy(), to_spins.copy()
        kernels.leave(old, pace, left, left_spins, entered, entered_spins, to_turns, to_spins)
        for k in range(shifts.shape[0]):
            for i in range(3):
                to_shifts[k, i] = to_shifts[k, i] + left_positions[k, i] - entered_positions[k, i]
                to_speeds[k, i] = to_speeds[k, i] + left_speeds[k, i] - entered_speeds[k, i]
    kernels.turn_by(to_turns, clip, rotations)
    for k in range(shifts.shape[0]):
        for i in range(3):
            positions[k, i] = clip_positions[k, i] + to_shifts[k, i]
