"""Places on the ground, and steady movement: (x, z, heading) against another place, and (left, ahead, turn) of a movement.

A place faces +z at heading 0, its left is +x; a turn is positive to the left. Metres and radians.
"""

from __future__ import annotations

import math

from contextdb.motion.output.samples import Place3

HERE: Place3 = (0.0, 0.0, 0.0)
LEAST_TURN = 1e-6


def joined(first: Place3, second: Place3) -> Place3:
    """Where a place is that is given against another one."""
    x, z, heading = first
    sin, cos = math.sin(heading), math.cos(heading)
    return x + cos * second[0] + sin * second[1], z + cos * second[1] - sin * second[0], heading + second[2]


def undone(place: Place3) -> Place3:
    """What brings a place back: where the origin is against it."""
    x, z, heading = place
    sin, cos = math.sin(heading), math.cos(heading)
    return sin * z - cos * x, -cos * z - sin * x, -heading


def moved(movement: Place3, share: float) -> Place3:
    """Where a body comes, against where it was, with a share of a steady movement: on a straight line, or on a circle."""
    left, ahead, turn = (share * each for each in movement)
    if abs(turn) < LEAST_TURN:
        along, across = 1.0, 0.5 * turn
    else:
        along, across = math.sin(turn) / turn, (1.0 - math.cos(turn)) / turn
    return along * left + across * ahead, along * ahead - across * left, turn


def movement_to(place: Place3) -> Place3:
    """The steady movement that brings a body from the origin to a place, turning by its heading."""
    x, z, turn = place
    if abs(turn) < LEAST_TURN:
        along, across = 1.0, 0.5 * turn
    else:
        along, across = math.sin(turn) / turn, (1.0 - math.cos(turn)) / turn
    size = along * along + across * across
    return (along * x - across * z) / size, (across * x + along * z) / size, turn


def movement_of(movement: Place3, place: Place3) -> Place3:
    """The same steady movement of a place that is fixed against the body, seen from that place."""
    left, ahead, turn = movement
    left, ahead = left + turn * place[1], ahead - turn * place[0]
    sin, cos = math.sin(place[2]), math.cos(place[2])
    return cos * left - sin * ahead, sin * left + cos * ahead, turn
