"""A walk through a town: each time somebody could speak, the line that fits best, not one that was said a moment ago.

    python examples/barks/game.py

The picker of each speaker remembers what was said once for all, and what is not to be said again for some seconds; a saved game
keeps the pickers.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from pathlib import Path

import contextdb as cdb

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Moment:
    """Somebody could speak."""

    time_s: float
    speaker: str
    weather: str = "Sun"
    reputation: float = 1.0
    memory: frozenset[str] = frozenset()

    @property
    def facts(self) -> dict[str, object]:
        """What the table asks for."""
        return {"speaker": self.speaker, "weather": self.weather, "reputation": self.reputation, "memory": self.memory}


HERO = frozenset({"SavedTheTown"})
THIEF = frozenset({"StoleTheHorse"})
WALK = (
    Moment(0.0, "Guard"),
    Moment(5.0, "Guard"),
    Moment(9.0, "Merchant", "Rain"),
    Moment(11.0, "Merchant", "Rain"),
    Moment(20.0, "Guard", "Rain", -3.0, THIEF),
    Moment(24.0, "Guard", "Rain", -3.0, THIEF),
    Moment(30.0, "Merchant", "Rain", -3.0, THIEF),
    Moment(60.0, "Child", "Snow", 6.0, HERO),
    Moment(62.0, "Child", "Snow", 6.0, HERO),
    Moment(64.0, "Child", "Snow", 6.0, HERO),
    Moment(66.0, "Child", "Snow", 6.0, HERO),
    Moment(67.0, "Child", "Snow", 6.0, HERO),
)


def walk() -> list[str]:
    """Every moment of the walk, in a line each."""
    barks = cdb.load(HERE / "barks.csv").compile()
    pickers = {name: barks.picker(seed=i) for i, name in enumerate(barks.asked["speaker"].domain.values or ())}
    said = []
    for moment in WALK:
        pick = pickers[moment.speaker].pick(barks.query(moment.facts), time_s=moment.time_s)
        line, volume = pick.outputs["Line"], pick.outputs["Volume"]
        said.append(f"{moment.time_s:4.0f} s  {moment.speaker:8} {volume:6} {line}  ({pick.why})")
        pickers = pickle.loads(pickle.dumps(pickers))  # the game is saved here and loaded again: nothing is forgotten
    return said


if __name__ == "__main__":
    print(*walk(), sep="\n")
