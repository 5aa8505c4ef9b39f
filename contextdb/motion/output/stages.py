"""The stages between what plays and the pose that is shown. Each is a small function of a posture and a state of its own.

    clip ─► joints (spring or dead blending) ─► root (animation, code or both; its spring) ─► alignment ─► feet ─► Posture

A stage takes the posture so far, what happened in this tick and its state, and gives the posture and its next state. It changes
nothing in place, so that old states stay good for a rollback. J joints, M of them with positions of their own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output.bank import Flags, Place3, Sample
from contextdb.motion.selection.root_motion import RootMotion

Ground = Callable[[float, float], tuple[float, tuple[float, float, float]] | None]


@dataclass(frozen=True, slots=True)
class Warp:
    """How a body is bent to the way it is to go: its hips and legs turned against its root, its steps so many times as long, and
    how both change a second."""

    turn: float = 0.0
    turn_speed: float = 0.0
    stride: float = 1.0
    stride_speed: float = 0.0


UNWARPED = Warp()


@dataclass(frozen=True, eq=False, slots=True)
class Posture:
    """A pose in the making: rotations [J, 4] and positions [M, 3], where the root is: x, z and heading, and how it is warped."""

    rotations: Floats
    positions: Floats
    root: Place3
    warp: Warp = UNWARPED


@dataclass(frozen=True, eq=False, slots=True)
class Tick:
    """What happens in one update.

    Attributes
    ----------
    dt_s : float
    left, entered : Sample or None
        Where what plays has a seam: the moment that would have been shown, and the one that is shown instead. None without a seam.
    root_motion : RootMotion
        How the clip moved the body since the last update.
    is_ahead : bool
        Whether it is already the movement of what is entered at the seam, as where something else has decided meanwhile.
    root_weight : float
        How much of its movement is to come from the clip.
    body : (x, z, heading) or None
        Where the game has the body.
    velocity : (x, z) or None
        How fast the game moves it over the ground.
    travel : (left, ahead, sway)
        How fast what plays goes, to the left and ahead of its mean facing; and by how much the root is turned from that.
    warp : Warp
        That of the pose before.
    ground : function or None
        Of a place, x and z: the height of the ground and its normal; None where it is flat.
    steps : sequence of (share, left, ahead)
        How far each foot is through its swing in the clip, and where it comes down; empty without a ground.
    clip : Posture
        What plays, as the clip has it.
    contacts : bool array, shape (n feet,)
        Which feet are down in the clip.
    """

    dt_s: float
    left: Sample | None
    entered: Sample | None
    root_motion: RootMotion
    is_ahead: bool
    root_weight: float
    body: Place3 | None
    velocity: tuple[float, float] | None
    travel: Place3
    warp: Warp
    ground: Ground | None
    steps: Sequence[Sequence[float]]
    clip: Posture
    contacts: Flags


class Stage(Protocol):
    """A stage; `begin` gives its state before the first update."""

    def begin(self, posture: Posture, body: Place3 | None) -> object:
        """The state of a character that first appears in a posture."""

    def apply(self, posture: Posture, tick: Tick, state: object) -> tuple[Posture, object]:
        """The posture after this stage, and the state after it."""


def damping(halflife_s: float) -> float:
    """The damping of a spring of a half-life, critically damped: 2 ln 2 / h."""
    return 2.0 * math.log(2.0) / halflife_s


def decayed(offset: Place3, speed: Place3, y: float, dt_s: float) -> tuple[Place3, Place3]:
    """An offset of three numbers and its change a second some time later: x = e^{-yt} (x0 + (v0 + x0 y) t)."""
    (a, b, c), (d, e, f) = offset, speed
    fade, p, q, r = math.exp(-y * dt_s), d + a * y, e + b * y, f + c * y
    faded = fade * (a + p * dt_s), fade * (b + q * dt_s), fade * (c + r * dt_s)
    return faded, (fade * (d - p * y * dt_s), fade * (e - q * y * dt_s), fade * (f - r * y * dt_s))
