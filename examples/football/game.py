"""Twenty-two players, ten seconds at 60 frames a second, and a designer who saves the table in the middle.

    python examples/football/game.py

The game keeps the watch on the folder, one picker for all players, and for each player the facts and the time at which the clip
ends. All who need a new clip in a frame are asked and picked together.
"""

from __future__ import annotations

import random
import shutil
import tempfile
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import contextdb as cdb

HERE = Path(__file__).parent
FRAMES, RATE = 600, 60.0
SAVE_AT = 300
"""The frame in which the designer saves."""


@dataclass
class Player:
    """What the game knows of a player."""

    rng: random.Random
    x: float
    speed: float = 0.0
    stamina: float = 1.0
    clip: str = ""
    until_s: float = 0.0
    facts: dict[str, object] = field(default_factory=dict)

    def update(self, ball: float) -> None:
        """Run for the ball where it is near, else slow down."""
        wanted = 6.5 if abs(ball - self.x) < 25.0 else 1.5 * self.rng.random()
        self.speed += (wanted - self.speed) / RATE
        self.x += (self.speed if ball > self.x else -self.speed) / RATE
        self.stamina = min(1.0, max(0.0, self.stamina + (2.5 - self.speed) * 0.08 / RATE))
        self.facts = {"speed": self.speed, "ball": min(60.0, abs(ball - self.x)), "tired": self.stamina < 0.8}


def saved_by_the_designer(folder: Path) -> None:
    """What happens in another program: a clip for tired players who jog is new, and tired players no longer jog back."""
    table = cdb.load(folder / "moves.csv").with_cell(5, "tired", "False")
    jog_tired = {"Asset": "jog_tired", "speed": "1.5..4.5", "tired": "True", "Weight": "4", "seconds": "0.9"}
    table.with_rows(table.n_rows, [jog_tired]).save()


def play(folder: Path, seed: int = 7) -> list[str]:
    """Play ten seconds; gives what happened, in lines."""
    players = [Player(random.Random(seed + i), x=5.0 * i) for i in range(22)]
    played: list[Counter[str]] = []
    said: list[str] = []
    with cdb.watch(folder, poll_s=None, settle_s=0.0) as watch:
        moves, picker = watch["moves"], watch["moves"].picker(seed=seed)
        for frame in range(FRAMES):
            now_s = frame / RATE
            if frame == SAVE_AT:
                saved_by_the_designer(folder)
            watch.poll()
            if watch["moves"] is not moves:
                moves = watch["moves"]
                said.append(f"{now_s:.1f} s: version {watch.snapshot().number} of the table, {moves.n_rows} rows")
            if frame in (0, SAVE_AT):
                played.append(Counter())
            ball = 55.0 + 45.0 * float(np.sin(now_s / 2.0))
            for player in players:
                player.update(ball)
            free = [i for i, player in enumerate(players) if player.until_s <= now_s]
            if not free:
                continue
            many = moves.query_many({name: [players[i].facts[name] for i in free] for name in moves.asked})
            rows = picker.pick_many(many, who=free)
            seconds = moves.outputs.of(rows, "seconds")
            for i, row, lasts in zip(free, rows.tolist(), seconds.tolist(), strict=True):
                players[i].clip = moves.assets[row] if row >= 0 else moves.fallback or ""
                players[i].until_s = now_s + lasts
                played[-1][players[i].clip] += 1
    for title, counts in zip(("before", "after"), played, strict=True):
        said.append(f"{title}: " + ", ".join(f"{clip} {n}" for clip, n in sorted(counts.items())))
    return said


def main() -> None:
    """Play in a copy of the folder, so that the example stays as it is."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "football"
        shutil.copytree(HERE, folder, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
        print(*play(folder), sep="\n")


if __name__ == "__main__":
    main()
