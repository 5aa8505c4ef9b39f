"""What a character is put through to see how well it moves: sticks over time, from standing to figures of eight.

A drive is a velocity over the ground for each moment, of one speed; it begins at +z. `steered` updates a character along one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from contextdb.motion.characters.character import Character
from contextdb.motion.characters.facts import Ground
from contextdb.motion.characters.tables import Facts
from contextdb.motion.characters.updates import Updated

RADIUS_M = 2.0
EVERY_S = 3.0
"""A new direction or speed is requested so often."""
SLOW = 0.6
"""The slower one of two speeds, as a share of the other."""


@dataclass(frozen=True, slots=True)
class Drive:
    """A stick over time: `at` gives the velocity over the ground at a moment, x and z in m/s."""

    name: str
    seconds: float
    speed_mps: float
    at: Callable[[float], Ground]


def drives(speed_mps: float) -> list[Drive]:
    rate = speed_mps / RADIUS_M  # radians a second on the circle
    round_s = math.tau / rate

    def turns(radians: float, *sides: int) -> Callable[[float], Ground]:
        def at(time_s: float) -> Ground:
            n = int(time_s / EVERY_S)
            return _ahead(speed_mps, radians * sum(sides[i % len(sides)] for i in range(n)))

        return at

    def eight(time_s: float) -> Ground:
        n, within = divmod(time_s, round_s)
        return _ahead(speed_mps, rate * within * (-1.0 if n % 2 else 1.0))

    def steps(*shares: float) -> Callable[[float], Ground]:
        return lambda time_s: _ahead(speed_mps * shares[int(time_s / EVERY_S) % len(shares)], 0.0)

    return [
        Drive("straight", 6.0, speed_mps, lambda time_s: _ahead(speed_mps, 0.0)),
        Drive("turns of 90 degrees", 5 * EVERY_S, speed_mps, turns(math.pi / 2.0, 1, -1, -1, 1)),
        Drive("turns of 180 degrees", 4 * EVERY_S, speed_mps, turns(math.pi, 1)),
        Drive("circle to the left", round_s, speed_mps, lambda time_s: _ahead(speed_mps, rate * time_s)),
        Drive("circle to the right", round_s, speed_mps, lambda time_s: _ahead(speed_mps, -rate * time_s)),
        Drive("figure eight", 2.0 * round_s, speed_mps, eight),
        Drive("speeds", 4 * EVERY_S, speed_mps, steps(1.0, SLOW)),
        Drive("starts and stops", 5 * EVERY_S, speed_mps, steps(0.0, 1.0)),
    ]


def _ahead(speed_mps: float, heading: float) -> Ground:
    return speed_mps * math.sin(heading), speed_mps * math.cos(heading)


def steered(
    character: Character, drive: Drive, rate: float, facts_at: Callable[[Ground], Facts]
) -> Iterator[tuple[Ground, Updated]]:
    """Update a character along a drive, so many times a second, with the facts that the game gives for a stick."""
    for i in range(math.floor(drive.seconds * rate + 1e-6) + 1):
        stick = drive.at(i / rate)
        yield stick, character.update(1.0 / rate if i else 0.0, stick, facts_at(stick))
