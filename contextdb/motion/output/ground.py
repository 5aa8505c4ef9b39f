"""The ground below feet: how high and how steep it is where a foot stands, or is going to.

A game gives it as a function of a place: `ground(x, z) -> (height_m, (nx, ny, nz))`, the normal upwards, or None where it is flat.
The ground of a pose is three numbers: the height, and by how much it rises along x and z.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contextdb.cells.arguments import require_real
from contextdb.errors import ContextError, Fault
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output.legs import eased
from contextdb.motion.output.samples import Place3
from contextdb.motion.output.stages import Ground, decayed

Triple = tuple[float, float, float]
ManyGround = Callable[[Floats, Floats], tuple[Any, Any] | None]
"""Of places x [n] and z [n]: heights [n] and normals [n, 3], or None where all is flat."""

LEVEL: Triple = (0.0, 0.0, 0.0)
STEEPEST = math.tan(math.radians(35.0))
"""A foot stands no steeper than this."""
A_GROUND = "a function of x and z that gives a height in metres and a normal upwards, or None where it is flat"

MANY_GROUND = "a function of x [n] and z [n] that gives heights [n] and normals upwards [n, 3], or None where all is flat"


@dataclass(frozen=True, slots=True)
class Footing:
    """What is below a foot: the ground now, its change a second, and the ground where the foot stood last."""

    now: Triple = LEVEL
    speed: Triple = LEVEL
    last: Triple = LEVEL


FLAT = Footing()


def below(ground: Ground | None, x: float, z: float) -> Triple:
    """Height and rise of the ground at a place. Raises ContextError for a ground that is none."""
    found = None if ground is None else ground(x, z)
    if found is None:
        return LEVEL
    try:
        height, (nx, ny, nz) = found
    except (TypeError, ValueError):
        raise ContextError(Fault(f"the ground at ({x:g}, {z:g}) is {found!r}.", A_GROUND)) from None
    height, nx, ny, nz = (require_real(each, "the ground's height or normal") for each in (height, nx, ny, nz))
    if ny <= 0.0:
        raise ContextError(Fault(f"the ground's normal at ({x:g}, {z:g}) is {(nx, ny, nz)}.", "a normal upwards: y above 0"))
    along_x, along_z = -nx / ny, -nz / ny
    share = min(1.0, STEEPEST / max(math.hypot(along_x, along_z), 1e-9))
    return height, share * along_x, share * along_z


def below_many(ground: ManyGround, points: Sequence[tuple[float, float]]) -> list[Triple]:
    """Height and rise of the ground at many places, asked at once. Raises ContextError for a ground that is none."""
    at = np.array(points, np.float64).reshape(-1, 2)
    found = ground(at[:, 0], at[:, 1])
    if found is None:
        return [LEVEL] * len(points)
    try:
        heights, normals = (np.asarray(each, np.float64) for each in found)
        is_whole = heights.shape == (len(at),) and normals.shape == (len(at), 3)
    except (TypeError, ValueError):
        is_whole = False
    if not is_whole:
        raise ContextError(Fault(f"the ground at {len(at)} places is {found!r}.", MANY_GROUND))
    if not (np.isfinite(heights).all() and np.isfinite(normals).all() and (normals[:, 1] > 0.0).all()):
        accepted = "finite heights, and normals upwards: y above 0"
        raise ContextError(Fault("some heights or normals of the ground are not usable.", accepted))
    rise = -normals[:, [0, 2]] / normals[:, 1:2]
    share = np.minimum(1.0, STEEPEST / np.maximum(np.hypot(rise[:, 0], rise[:, 1]), 1e-9))
    return [(height, x, z) for height, (x, z) in zip(heights.tolist(), (share[:, None] * rise).tolist(), strict=True)]


def standing(footing: Footing, here: Triple, y: float, dt_s: float) -> Footing:
    """The footing of a foot that is down on some ground."""
    return _come(footing, here, here, y, dt_s)


def swinging(footing: Footing, there: Triple, share: float, y: float, dt_s: float) -> Footing:
    """The footing of a foot that goes from where it stood last to some ground: up early, down late."""
    last = footing.last
    height = eased(2.0 * share) if there[0] > last[0] else eased(2.0 * share - 1.0)
    slope = eased(share)
    goal = (last[0] + height * (there[0] - last[0]), *(a + slope * (b - a) for a, b in zip(last[1:], there[1:], strict=True)))
    return _come(footing, (goal[0], goal[1], goal[2]), last, y, dt_s)


def _come(footing: Footing, goal: Triple, last: Triple, y: float, dt_s: float) -> Footing:
    (a, b, c), speed = decayed(apart(footing.now, goal), footing.speed, y, dt_s)
    return Footing((goal[0] + a, goal[1] + b, goal[2] + c), speed, last)


def apart(first: Place3, second: Place3) -> Triple:
    """One triple less another."""
    return first[0] - second[0], first[1] - second[1], first[2] - second[2]
