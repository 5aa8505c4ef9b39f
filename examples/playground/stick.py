"""What the player asks for, whoever holds the stick: keys and mouse, a gamepad, a file, or the rival's own head."""

from __future__ import annotations

import csv
import math
from bisect import bisect_right
from dataclasses import dataclass
from pathlib import Path

WALK_MPS, RUN_MPS, TIRED_MPS = 1.4, 3.6, 2.6
GAITS = ("Idle", "Walk", "Run")
DEAD = 0.15
"""A stick that is pushed less than this is at rest."""


@dataclass(frozen=True, slots=True)
class Stick:
    """How far the stick is pushed along x and z of the world, 0 to 1; whether to run and to strafe; where the camera looks."""

    x: float = 0.0
    z: float = 0.0
    run: bool = False
    strafe: bool = False
    camera: float = 0.0

    @property
    def gait(self) -> str:
        """The fact of this name."""
        return GAITS[0 if math.hypot(self.x, self.z) < DEAD else 2 if self.run else 1]

    def velocity(self, tired: bool = False) -> tuple[float, float]:
        """The velocity over the ground that it asks for, m/s."""
        pace = {"Idle": 0.0, "Walk": WALK_MPS, "Run": TIRED_MPS if tired else RUN_MPS}[self.gait]
        share = pace / max(1.0, math.hypot(self.x, self.z))
        return self.x * share, self.z * share


REST = Stick()


@dataclass(frozen=True)
class StickFile:
    """A stick that is moved by a file: each row holds until the next."""

    times_s: list[float]
    sticks: list[Stick]

    @classmethod
    def read(cls, path: Path) -> StickFile:
        """Read a CSV file with the columns time_s, x, z, run, strafe and camera_deg."""
        with path.open(encoding="utf-8", newline="") as file:
            rows = [{name: float(text or 0.0) for name, text in row.items()} for row in csv.DictReader(file)]
        sticks = [Stick(row["x"], row["z"], row["run"] > 0.0, row["strafe"] > 0.0, math.radians(row["camera_deg"])) for row in rows]
        return cls([row["time_s"] for row in rows], sticks)

    def at(self, time_s: float) -> Stick:
        """The stick at a moment."""
        row = bisect_right(self.times_s, time_s + 1e-9) - 1
        return self.sticks[row] if row >= 0 else REST
