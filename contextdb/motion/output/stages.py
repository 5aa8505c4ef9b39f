"""The stages between what plays and the pose that is shown, and the row of numbers that a character is between two updates.

    clip ─► joints (spring or dead blending) ─► root (animation, code or both; its spring) ─► alignment ─► feet ─► pose

A stage is a compiled loop over some part of a row. Characters are rows of one array [N, W], one update writes new rows from the old
ones, and nothing is changed in place, so that old states stay good for a rollback. J joints, M of them with positions of their own,
F feet.

A row begins with single numbers, at the columns named here; then come, each a flat array, the parts of `Columns`. What happens in
one update is a row too, of `GIVEN` numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.output.samples import Place3

Ground = Callable[[float, float], tuple[float, tuple[float, float, float]] | None]

BEGUN, TIME, PLAY_RATE, CLIP_RATE = 0, 1, 2, 3
"""Whether anything was shown; the seconds of the clip that were; its seconds in a second of play, as it was and as it goes on."""
BASE, OFFSET, OFFSET_SPEED = 4, 7, 10
"""The root without its offset (x, z and heading), the offset, and its change a second."""
HAS_BODY, BODY, HAS_VELOCITY, VELOCITY = 13, 14, 17, 18
"""Where the game had the body, and how fast it moved it (x and z)."""
TURN, TURN_SPEED, STRIDE, STRIDE_SPEED = 20, 21, 22, 23
"""How the body is bent to the way it is to go: hips and legs turned against the root, steps so many times as long; each followed by
its change a second."""
HIPS, LOWER = 24, 26
"""How high the hips are over their clip's, and how much lower than that legs need them; each followed by its change."""
SINCE = 28
"""Dead blending: seconds since the last seam; below 0 nothing fades."""
CLIP_ROOT = 29
"""Where the clip had the body."""
NUMBERS = 32

IN_BANK, RANGE, AT, IS_ON, ACTION, RATE = 0, 1, 2, 3, 4, 5
"""Of what plays: the number of its bank, below 0 where nothing plays; its range and second; whether anything played before; what
the update did (`CONTINUES`, `HOLDS` or `ELSE`); and how fast it plays."""
MOTION, WEIGHT, IS_AHEAD, SEAM = 6, 9, 10, 11
"""How the clip moved the body, and how much of that counts; whether that is already the movement of what is entered at the seam, as
where something else has decided meanwhile; and the row of the seam, below 0 without one."""
GIVES_BODY, GIVEN_BODY, GIVES_GROUND = 12, 13, 16
TRAVEL, FRAME, IS_FLAT, BENDS = 17, 20, 21, 22
"""Written by loops: how fast what plays goes to the left and ahead of its mean facing, and by how much the root is turned from
that; the nearest frame; whether no ground is felt; whether legs may have to bend."""
LOST = 23
"""The seconds of the update that were left when what played had run out: the clip's movement is without them."""
GIVEN = 24
CONTINUES, HOLDS, ELSE = 0.0, 1.0, 2.0

ANIMATION, CODE, MIXED, PATH = 0, 1, 2, 3
PLAIN, SPRING, DEAD = 0, 1, 2
FOOT, FOOTING = 17, 9
"""So many numbers has the state of a foot, see `feet_loops`, and the ground below it: now, its change, and where it stood last."""


class Shaping(NamedTuple):
    """Settings as loops read them: of half-lives the dampings, of degrees radians."""

    root: int
    blend: int
    position_weight: float
    rotation_weight: float
    position_pull_s: float
    rotation_pull_s: float
    position_clamp_m: float
    rotation_clamp: float
    damping: float
    fade_s: float
    braking: float
    is_warping: bool
    turn_limit: float
    turn_damping: float
    min_stride: float
    max_stride: float
    is_locking: bool
    foot_damping: float
    foot_radius_m: float


class Bones(NamedTuple):
    """A rig as loops read it.

    Parents [J], offsets [J, 3], and which row of positions [M, 3] is each joint's [J]; of each foot hip, knee, ankle and what
    stands [F, 4], and the axis that its knee bends about [F, 3]; the joints that hang on the root, and where they are in positions;
    the joints from the hips to the chest, none of a rig that is not aligned, and after each the share of the turn that is left;
    and the acceleration of joints that may be added to the clips'.
    """

    parents: Ints
    offsets: Floats
    places: Ints
    legs: Ints
    hinges: Floats
    tops: Ints
    top_places: Ints
    spine: Ints
    left: Floats
    most_accel: float


@dataclass(frozen=True)
class Columns:
    """Where the parts of a row begin.

    In order: what is left of the last seam, its turns [J, 3] or, of dead blending, rotations [J, 4], their change [J, 3], shifts or
    positions [M, 3] and their change [M, 3]; feet [F, 17], footings [F, 9]; and the clip's rotations [J, 4] and positions [M, 3].
    """

    n_joints: int
    n_moving: int
    n_feet: int
    blend: int

    @cached_property
    def at(self) -> Ints:
        """The first column of each part, and the width of a row: int64 [9]."""
        j, m, f = self.n_joints, self.n_moving, self.n_feet
        blended = {PLAIN: (0, 0, 0, 0), SPRING: (3 * j, 3 * j, 3 * m, 3 * m), DEAD: (4 * j, 3 * j, 3 * m, 3 * m)}[self.blend]
        return np.cumsum((NUMBERS, *blended, FOOT * f, FOOTING * f, 4 * j, 3 * m)).astype(np.int64)

    @property
    def width(self) -> int:
        return int(self.at[-1])


LEFT, SPINS, SHIFTS, SPEEDS, FEET, FOOTINGS, ROTATIONS, POSITIONS, END = range(9)
"""The parts by their number in `Columns.at`."""


def damping(halflife_s: float) -> float:
    """The damping of a spring of a half-life, critically damped: 2 ln 2 / h."""
    return 2.0 * math.log(2.0) / halflife_s


def decayed(offset: Place3, speed: Place3, y: float, dt_s: float) -> tuple[Place3, Place3]:
    """An offset of three numbers and its change a second some time later: x = e^{-yt} (x0 + (v0 + x0 y) t)."""
    (a, b, c), (d, e, f) = offset, speed
    fade, p, q, r = math.exp(-y * dt_s), d + a * y, e + b * y, f + c * y
    faded = fade * (a + p * dt_s), fade * (b + q * dt_s), fade * (c + r * dt_s)
    return faded, (fade * (d - p * y * dt_s), fade * (e - q * y * dt_s), fade * (f - r * y * dt_s))
