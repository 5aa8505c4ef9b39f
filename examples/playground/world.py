"""The ground, what stands on it, and where a body may go. Metres; x is to the left of who faces along z."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from contextdb.motion import Steered

Normal = tuple[float, float, float]
UP: Normal = (0.0, 1.0, 0.0)
RADIUS_M = 0.35
"""How near a body comes to a wall."""
HIGHEST_STEP_M = 0.35
EDGE_M = 18.0


@dataclass(frozen=True)
class Box:
    """A part of the ground: from x to x, from z to z, and how high it is at both ends along z."""

    x: tuple[float, float]
    z: tuple[float, float]
    near_m: float
    far_m: float

    def holds(self, x: float, z: float, margin: float = 0.0) -> bool:
        """Whether a place is on it."""
        return self.x[0] - margin <= x < self.x[1] + margin and self.z[0] - margin <= z < self.z[1] + margin

    def height(self, z: float) -> float:
        """How high it is there."""
        return self.near_m + (self.far_m - self.near_m) * (z - self.z[0]) / (self.z[1] - self.z[0])

    @property
    def normal(self) -> Normal:
        """Upwards from it."""
        rise, run = self.far_m - self.near_m, self.z[1] - self.z[0]
        length = math.hypot(rise, run)
        return 0.0, run / length, -rise / length


RAMP = Box((3.0, 6.0), (2.0, 6.5), 0.0, 1.2)
TOP = Box((3.0, 6.0), (6.5, 9.0), 1.2, 1.2)
STEPS = [Box((3.0, 6.0), (9.0 + 0.45 * i, 9.45 + 0.45 * i), 1.0 - 0.2 * i, 1.0 - 0.2 * i) for i in range(5)]
FLOORS = [RAMP, TOP, *STEPS]
WALL = Box((-5.0, -1.0), (5.85, 6.15), 0.9, 0.9)


def ground(x: float, z: float) -> tuple[float, Normal]:
    """The height and the normal below a place, as a pose stream asks for them."""
    for floor in FLOORS:
        if floor.holds(x, z):
            return floor.height(z), floor.normal
    return 0.0, UP


def moved(before: Steered, after: Steered) -> Steered:
    """A body that has moved, as far as it may: it slides along walls and along what is too high to step on."""
    (x, z), (new_x, new_z) = before.position, after.position
    for place in ((new_x, new_z), (new_x, z), (x, new_z)):
        if is_free(before.position, place):
            break
    else:
        place = x, z
    if place == after.position:
        return after
    stopped = tuple(v if now == wished else 0.0 for v, now, wished in zip(after.velocity, place, after.position, strict=True))
    return replace(after, position=place, velocity=(stopped[0], stopped[1]), acceleration=(0.0, 0.0))


def is_free(here: tuple[float, float], there: tuple[float, float]) -> bool:
    """Whether a body may go from here to a place beside it."""
    if max(map(abs, there)) > EDGE_M or (WALL.holds(*there, RADIUS_M) and not WALL.holds(*here, RADIUS_M)):
        return False
    return ground(*there)[0] - ground(*here)[0] <= HIGHEST_STEP_M


@dataclass(frozen=True)
class Ahead:
    """The wall ahead of a body: where it would come over it, which way is straight, and how far that is from its own way."""

    place: tuple[float, float]
    heading: float
    angle_deg: float


def wall_ahead(x: float, z: float, way: float, within_m: float = 6.0) -> Ahead | None:
    """The wall, for a body that goes some way; None where it does not lead there."""
    middle = sum(WALL.z) / 2.0
    heading = 0.0 if z < middle else math.pi
    angle = math.remainder(way - heading, math.tau)
    away = abs(middle - z)
    if abs(angle) > math.radians(60.0) or away > within_m:
        return None
    at = x + away * math.tan(angle) * (1.0 if z < middle else -1.0)
    if not WALL.x[0] + RADIUS_M < at < WALL.x[1] - RADIUS_M:
        return None
    return Ahead((at, middle), heading, math.degrees(angle))
