"""The ground, what stands on it, and where a body may go. Metres; x is to the left of who faces along z."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from contextdb.motion import Steered

RADIUS_M, APART_M, HIGHEST_STEP_M, EDGE_M = 0.35, 0.6, 0.35, 18.0
"""How near a body comes to a wall and to another body, onto what it steps, and how far the world goes."""


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


RAMP = Box((3.0, 6.0), (2.0, 6.5), 0.0, 1.2)
TOP = Box((3.0, 6.0), (6.5, 9.0), 1.2, 1.2)
STEPS = [Box((3.0, 6.0), (9.0 + 0.45 * i, 9.45 + 0.45 * i), 1.0 - 0.2 * i, 1.0 - 0.2 * i) for i in range(5)]
FLOORS = [RAMP, TOP, *STEPS]
WALL = Box((-5.0, -1.0), (5.85, 6.15), 0.9, 0.9)


def ground(x: float, z: float) -> tuple[float, tuple[float, float, float]]:
    """The height and the normal below a place, as a pose stream asks for them."""
    floor = next((floor for floor in FLOORS if floor.holds(x, z)), None)
    if floor is None:
        return 0.0, (0.0, 1.0, 0.0)
    slope = math.atan2(floor.far_m - floor.near_m, floor.z[1] - floor.z[0])
    return floor.height(z), (0.0, math.cos(slope), -math.sin(slope))


def moved(before: Steered, after: Steered) -> Steered:
    """A body that has moved, as far as it may: it slides along walls and along what is too high to step on."""
    (x, z), (new_x, new_z), (vx, vz) = before.position, after.position, after.velocity
    if is_free(before.position, after.position):
        return after
    ways = [((new_x, z), (vx, 0.0)), ((x, new_z), (0.0, vz))]
    place, velocity = next((way for way in ways if is_free(before.position, way[0])), ((x, z), (0.0, 0.0)))
    return replace(after, position=place, velocity=velocity, acceleration=(0.0, 0.0))


def apart(body: Steered, others: Iterable[tuple[float, float]]) -> Steered:
    """A body that keeps its distance from others: it is pushed back to where it touches them, and slides round."""
    x, z = body.position
    for other_x, other_z in others:
        away = math.hypot(x - other_x, z - other_z)
        if 1e-6 < away < APART_M:
            x, z = other_x + (x - other_x) * APART_M / away, other_z + (z - other_z) * APART_M / away
    return body if (x, z) == body.position else replace(body, position=(x, z))


def is_free(here: tuple[float, float], there: tuple[float, float]) -> bool:
    """Whether a body may go from here to a place beside it."""
    if max(map(abs, there)) > EDGE_M or (WALL.holds(*there, RADIUS_M) and not WALL.holds(*here, RADIUS_M)):
        return False
    return ground(*there)[0] - ground(*here)[0] <= HIGHEST_STEP_M


def wall_ahead(x: float, z: float, way: float, within_m: float = 6.0) -> tuple[float, float, float, float] | None:
    """Where a body that goes some way would be on the wall (x, z), straight over it, and degrees off that; None if not there."""
    middle = sum(WALL.z) / 2.0
    heading = 0.0 if z < middle else math.pi
    angle = math.remainder(way - heading, math.tau)
    at = x + (middle - z) * math.tan(angle)
    is_near = abs(angle) < math.radians(60.0) and abs(middle - z) < within_m
    return (at, middle, heading, math.degrees(angle)) if is_near and abs(at + 3.0) < 2.0 - RADIUS_M else None
