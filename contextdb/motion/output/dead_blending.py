"""Dead blending: where what plays jumps, the pose that was shown goes on by its velocities, ever slower, and fades.

    gone on, t seconds after the seam      x0 + v0 (1 - e^{-yt}) / y,   y = ln 2 / h
    shown                                  from there to what plays, by smoothstep(t / T); after T what plays, and nothing else

It never shows more than what was shown and what plays lie apart, which for poses that differ much looks better than a spring.

Source: D. Holden, "Dead Blending", 2023, and the node of that name in Unreal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output import kernels
from contextdb.motion.output.bank import Place3, Sample
from contextdb.motion.output.stages import Posture, Tick


@dataclass(frozen=True, eq=False, slots=True)
class Fading:
    """What was shown at the last seam, its velocities then, and the seconds since."""

    rotations: Floats
    positions: Floats
    spins: Floats
    velocities: Floats
    since_s: float


@dataclass(frozen=True, slots=True)
class DeadBlending:
    """The stage: what was left at the last seam, until it has faded."""

    fade_s: float
    halflife_s: float

    def begin(self, posture: Posture, body: Place3 | None) -> Fading | None:
        """Nothing fades."""
        return None

    def apply(self, posture: Posture, tick: Tick, state: object) -> tuple[Posture, Fading | None]:
        """What plays, and what was left over it as far as it has not faded."""
        assert isinstance(state, Fading | None)
        fading = None if state is None or state.since_s + tick.dt_s >= self.fade_s else state
        if fading is not None:
            fading = replace(fading, since_s=fading.since_s + tick.dt_s)
        if tick.left is not None:
            fading = self._mixed(fading, tick.left)
        if fading is None:
            return posture, None
        zeros = np.zeros((len(posture.rotations), 3))
        plays = Sample(posture.rotations, posture.positions, zeros, np.zeros_like(posture.positions), (0.0, 0.0, 0.0))
        shown = self._mixed(fading, plays)
        return replace(posture, rotations=shown.rotations, positions=shown.positions), fading

    def _mixed(self, fading: Fading | None, plays: Sample) -> Fading:
        """What is shown while one thing fades over another, as what fades from now on."""
        if fading is None:
            return Fading(plays.rotations, plays.positions, plays.spins, plays.velocities, 0.0)
        u = fading.since_s / self.fade_s
        share, slope = u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) / self.fade_s
        y = math.log(2.0) / self.halflife_s
        braking = math.exp(-y * fading.since_s)
        reach = (1.0 - braking) / y
        rotations, spins = np.empty_like(plays.rotations), np.empty_like(fading.spins)
        kernels.fade_turns(
            fading.rotations, fading.spins, reach, share, slope, braking, plays.rotations, plays.spins, rotations, spins
        )
        gone = fading.positions + reach * fading.velocities
        positions = gone + share * (plays.positions - gone)
        velocities = (1.0 - share) * braking * fading.velocities + share * plays.velocities + slope * (plays.positions - gone)
        return Fading(rotations, positions, spins, velocities, 0.0)
