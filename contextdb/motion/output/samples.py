"""One moment of a clip, as a pose bank gives it: its joints, its root and their velocities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats

Flags = NDArray[np.bool_]
Singles = NDArray[np.float32]
Place3 = tuple[float, float, float]
"""x and z in metres and a heading in radians, or their change a second."""


@dataclass(frozen=True, eq=False, slots=True)
class Sample:
    """A moment of a clip: rotations [J, 4] and positions [M, 3], and how fast they change: spins [J, 3], velocities [M, 3].

    `root_velocity` is in the body's own frame: to its left, ahead, and its turning.
    """

    rotations: Floats
    positions: Floats
    spins: Floats
    velocities: Floats
    root_velocity: Place3


@dataclass(frozen=True, eq=False, slots=True)
class Moment:
    """A moment of a clip to be displayed.

    Rotations [J, 4] and positions [M, 3]; where the clip has the body; how fast it goes to the left and ahead of its mean facing,
    and how far it is turned from that; which feet are down; the nearest frame.
    """

    rotations: Floats
    positions: Floats
    root: Place3
    travel: Place3
    contacts: Flags
    frame: int
