"""What the player asks for, whoever holds the stick: keys and mouse, a gamepad, a file, or the rival's own head."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

from contextdb.errors import Fault, FileError, Place

PACES_MPS = {"Idle": 0.0, "Walk": 1.4, "Run": 3.6}
COLUMNS = ("time_s", "x", "z", "run", "strafe", "camera_deg")
TIRED_MPS, DEAD = 2.6, 0.15
"""How fast a tired one runs; a stick that is pushed less than this is at rest."""


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
        return "Idle" if math.hypot(self.x, self.z) < DEAD else "Run" if self.run else "Walk"

    def velocity(self, tired: bool = False) -> tuple[float, float]:
        """The velocity over the ground that it asks for, m/s."""
        pace = TIRED_MPS if tired and self.gait == "Run" else PACES_MPS[self.gait]
        share = pace / max(1.0, math.hypot(self.x, self.z))
        return self.x * share, self.z * share


REST = Stick()


Sticks = list[tuple[float, Stick]]
"""From which second on, ascending, and which."""


def read_sticks(path: Path) -> Sticks:
    """Read a CSV file with the columns time_s, x, z, run, strafe and camera_deg. Raises FileError for another."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = [[float(row[name] or 0.0) for name in COLUMNS] for row in csv.DictReader(file)]
    except (OSError, KeyError, ValueError) as error:
        raise FileError(
            Fault(f"this is no stick: {error}.", f"a CSV file of numbers: {', '.join(COLUMNS)}", place=Place(str(path)))
        ) from None
    return [(time_s, Stick(x, z, run > 0.0, strafe > 0.0, math.radians(camera))) for time_s, x, z, run, strafe, camera in rows]


def stick_at(sticks: Sticks, time_s: float) -> Stick:
    """The stick at a moment: that of the last row before it."""
    return next((stick for from_s, stick in reversed(sticks) if from_s <= time_s + 1e-9), REST)
