"""One moment of a clip, as a pose bank gives it: its joints, its root and their velocities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints

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
    """A moment of a clip to be shown.

    Rotations [J, 4] and positions [M, 3]; where the clip has the body; how fast it goes to the left and ahead of its mean facing,
    and how far it is turned from that; which feet are down; the nearest frame.
    """

    rotations: Floats
    positions: Floats
    root: Place3
    travel: Place3
    contacts: Flags
    frame: int


class Frames(NamedTuple):
    """A bank as loops read it: its arrays, root and travel of each frame [N, 6], and of each range the first frame, the steps to
    the last, and whether it loops."""

    rotations: Singles
    positions: Singles
    root: Singles
    ways: Floats
    contacts: Flags
    starts: Ints
    n_steps: Ints
    looping: Flags
    rate: float
