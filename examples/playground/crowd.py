"""Very many characters who walk about, coloured by the row that they play: `--crowd 500`. A `motion.Crowd` updates them at once."""

import math
from collections import Counter

import numpy as np
from numpy.typing import NDArray

import contextdb as cdb
from contextdb import motion

from . import world
from .stick import PACES_MPS

Floats = NDArray[np.float64]
EVERY_S, APART_M, THINKS_S, STAGE_M, MOST_NAMED = 0.05, 1.3, 4.0, 3.0, 5
"""How often they are updated, how far apart they begin, for how long each keeps its way, and how much room the stage has."""


class Throng:
    """The characters, what each plays, and their poses."""

    def __init__(self, n: int, stock: motion.MotionProject, moves: cdb.CompiledTable, seed: int = 1) -> None:
        self.rng, self._due_s = np.random.default_rng(seed), 0.0
        places = _places(n)
        bodies = [motion.Steered(position=place) for place in places]
        self.crowd = motion.Crowd(stock.character("player", moves, body, unknown="any") for body in bodies)
        self.gaits, self.ways = ["Idle"] * n, np.zeros(n)
        self.until_s = self.rng.uniform(0.0, THINKS_S, n)
        self.moves = moves
        self.positions = np.zeros((n, 0, 3))
        self.rows = np.zeros(n, np.int64)
        self.names: Counter[str] = Counter()
        self.update(EVERY_S)

    def use(self, moves: cdb.CompiledTable) -> None:
        """Obey another version of the table."""
        self.moves = moves
        for character in self.crowd:
            character.tables = moves

    def update(self, dt: float) -> None:
        """Some time passes; all are updated together when their time has come."""
        self._due_s += dt
        if self._due_s < EVERY_S:
            return
        dt, self._due_s = self._due_s, 0.0
        self._think(dt)
        speeds = np.array([PACES_MPS[gait] for gait in self.gaits])
        sticks = np.stack((np.sin(self.ways) * speeds, np.cos(self.ways) * speeds), axis=1)
        moved = self.crowd.update(dt, sticks, {"gait": self.gaits, "strafe": False, "style": "normal"})
        poses = [each.pose for each in moved if each.pose is not None]
        self.positions = np.stack([pose.positions for pose in poses])
        playing = ["" if pose.playing is None else pose.playing.asset for pose in poses]
        rows = {asset: row for row, asset in reversed([*enumerate(self.moves.assets)])}
        self.rows = np.array([rows.get(asset, -1) for asset in playing])
        self.names = Counter(playing)

    @property
    def state(self) -> str:
        """How many play what, the most common first."""
        common = ", ".join(f"{name} {n}" for name, n in self.names.most_common(MOST_NAMED))
        return f"{len(self.crowd)} figures, coloured by their row: {common}"

    def _think(self, dt: float) -> None:
        """Whose time is over chooses another way; who has come to the edge turns to the middle."""
        self.until_s -= dt
        over = self.until_s <= 0.0
        for i in np.flatnonzero(over):
            self.gaits[i] = str(self.rng.choice(["Idle", "Walk", "Walk", "Run"]))
        self.ways[over] = self.rng.uniform(-math.pi, math.pi, int(over.sum()))
        self.until_s[over] = self.rng.uniform(1.0, THINKS_S, int(over.sum()))
        places = np.array([character.body.position for character in self.crowd])
        far = np.abs(places).max(axis=1) > world.EDGE_M
        self.ways[far] = np.arctan2(-places[far, 0], -places[far, 1])


def _places(n: int) -> list[tuple[float, float]]:
    """Places in a square around the stage, the nearest first."""
    reach = math.ceil(math.sqrt(n)) + math.ceil(STAGE_M / APART_M) + 1
    grid = [(APART_M * i, APART_M * j) for i in range(-reach, reach + 1) for j in range(-reach, reach + 1)]
    free = [place for place in grid if max(map(abs, place)) > STAGE_M and world.ground(*place)[0] == 0.0]
    return sorted(free, key=lambda place: (math.hypot(*place), place))[:n]
