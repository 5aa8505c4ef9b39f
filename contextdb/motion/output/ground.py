"""The ground below feet: how high and how steep it is where a foot stands, or is going to.

A game gives it as a function of a place: `ground(x, z) -> (height_m, (nx, ny, nz))`, the normal upwards, or None where it is flat.
The ground of a pose is three numbers: the height, and by how much it rises along x and z.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from contextdb.cells.arguments import require_real
from contextdb.core import risen
from contextdb.errors import ContextError, Fault
from contextdb.motion.clips.quaternions import Floats

Triple = tuple[float, float, float]
Ground = Callable[[float, float], tuple[float, Triple] | None]
ManyGround = Callable[[Floats, Floats], tuple[Any, Any] | None]
"""Of places x [n] and z [n]: heights [n] and normals [n, 3], or None where all is flat."""

LEVEL: Triple = (0.0, 0.0, 0.0)
STEEPEST = math.tan(math.radians(35.0))
"""A foot stands no steeper than this."""
A_GROUND = "a function of x and z that gives a height in metres and a normal upwards, or None where it is flat"

MANY_GROUND = "a function of x [n] and z [n] that gives heights [n] and normals upwards [n, 3], or None where all is flat"


def below(ground: Ground | None, x: float, z: float) -> Triple:
    """Height and rise of the ground at a place. Raises ContextError for a ground that is none."""
    answer = None if ground is None else ground(x, z)
    if answer is None:
        return LEVEL
    return risen(answer, STEEPEST) or _risen(answer, x, z)  # mostly the first


def _risen(answer: Any, x: float, z: float) -> Triple:
    """The same of any answer."""
    try:
        height, (nx, ny, nz) = answer
    except (TypeError, ValueError):
        raise ContextError(Fault(f"the ground at ({x:g}, {z:g}) is {answer!r}.", A_GROUND)) from None
    height, nx, ny, nz = (require_real(each, "the ground's height or normal") for each in (height, nx, ny, nz))
    if ny <= 0.0:
        raise ContextError(Fault(f"the ground's normal at ({x:g}, {z:g}) is {(nx, ny, nz)}.", "a normal upwards: y above 0"))
    along_x, along_z = -nx / ny, -nz / ny
    share = min(1.0, STEEPEST / max(math.hypot(along_x, along_z), 1e-9))
    return height, share * along_x, share * along_z


def below_many(ground: ManyGround, points: Sequence[tuple[float, float]]) -> list[Triple]:
    """Height and rise of the ground at many places, asked at once. Raises ContextError for a ground that is none."""
    at = np.array(points, np.float64).reshape(-1, 2)
    answers = ground(at[:, 0], at[:, 1])
    if answers is None:
        return [LEVEL] * len(points)
    try:
        heights, normals = (np.asarray(each, np.float64) for each in answers)
        is_whole = heights.shape == (len(at),) and normals.shape == (len(at), 3)
    except (TypeError, ValueError):
        is_whole = False
    if not is_whole:
        raise ContextError(Fault(f"the ground at {len(at)} places is {answers!r}.", MANY_GROUND))
    if not (np.isfinite(heights).all() and np.isfinite(normals).all() and (normals[:, 1] > 0.0).all()):
        accepted = "finite heights, and normals upwards: y above 0"
        raise ContextError(Fault("some heights or normals of the ground are not usable.", accepted))
    rise = -normals[:, [0, 2]] / normals[:, 1:2]
    share = np.minimum(1.0, STEEPEST / np.maximum(np.hypot(rise[:, 0], rise[:, 1]), 1e-9))
    return [(height, x, z) for height, (x, z) in zip(heights.tolist(), (share[:, None] * rise).tolist(), strict=True)]


Grounds = tuple[Ground | None, ...] | ManyGround
"""One for each of some characters, or one for all."""
