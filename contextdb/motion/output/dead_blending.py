"""Dead blending: where what plays jumps, the pose that was shown goes on by its velocities, ever slower, and fades.

    gone on, t seconds after the seam      x0 + v0 (1 - e^{-yt}) / y,   y = ln 2 / h
    shown                                  from there to what plays, by smoothstep(t / T); after T what plays, and nothing else

It never shows more than what was shown and what plays lie apart, which for poses that differ much looks better than a spring.

Source: D. Holden, "Dead Blending", 2023, and the node of that name in Unreal.
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return"

from __future__ import annotations

import math

import numpy as np

from contextdb.motion.output import kernels
from contextdb.motion.output.kernels import compiled


@compiled
def _mixed(
    left, spins, shifts, speeds, since, fade_s, y, playing, playing_spins, playing_positions, playing_speeds,
    to_left, to_spins, to_shifts, to_speeds,
):  # fmt: skip
    """What is shown while one thing fades over another: rotations, positions, and how both change."""
    u = since / fade_s
    share, slope = u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) / fade_s
    braking = math.exp(-y * since)
    reach = (1.0 - braking) / y
    kernels.fade_turns(left, spins, reach, share, slope, braking, playing, playing_spins, to_left, to_spins)
    for k in range(shifts.shape[0]):
        for i in range(3):
            gone = shifts[k, i] + reach * speeds[k, i]
            apart = playing_positions[k, i] - gone
            to_speeds[k, i] = (1.0 - share) * braking * speeds[k, i] + share * playing_speeds[k, i] + slope * apart
            to_shifts[k, i] = gone + share * apart


@compiled
def dead_blend(
    left, spins, shifts, speeds, since, fade_s, y, dt, is_seam, seam, seam_spins, seam_positions, seam_speeds,
    clip, clip_positions, to_left, to_spins, to_shifts, to_speeds, rotations, positions,
):  # fmt: skip
    """What plays, and what was left over it as far as it has not faded; gives the seconds since the last seam, below 0 for none."""
    since = -1.0 if since < 0.0 or since + dt >= fade_s else since + dt
    if is_seam and since >= 0.0:
        _mixed(
            left, spins, shifts, speeds, since, fade_s, y, seam, seam_spins, seam_positions, seam_speeds,
            to_left, to_spins, to_shifts, to_speeds,
        )  # fmt: skip
        since = 0.0
    elif is_seam:
        to_left[:], to_spins[:], to_shifts[:], to_speeds[:] = seam, seam_spins, seam_positions, seam_speeds
        since = 0.0
    else:
        to_left[:], to_spins[:], to_shifts[:], to_speeds[:] = left, spins, shifts, speeds
    if since < 0.0:
        rotations[:], positions[:] = clip, clip_positions
        return since
    still, pace, slide = np.zeros(spins.shape), np.empty(spins.shape), np.empty(shifts.shape)
    _mixed(
        to_left, to_spins, to_shifts, to_speeds, since, fade_s, y, clip, still, clip_positions, np.zeros(shifts.shape),
        rotations, pace, positions, slide,
    )  # fmt: skip
    return since
