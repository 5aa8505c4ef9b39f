"""Two opponents play cards; each plays from a hand of four, within its mana, the cards that fit the moment best.

    python examples/cards/game.py

The table says which cards make sense now, the game which ones can be played at all: those in the hand, and those that the mana pays
for. An answer is a set of rows, so one is cut out of the other.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from pathlib import Path

import contextdb as cdb

HERE = Path(__file__).parent
HAND, MANA, MOST_TURNS = 4, 3, 30


@dataclass
class Side:
    """One of the two."""

    name: str
    rng: random.Random
    picker: cdb.Picker
    health: int = 30
    shield: int = 0
    hand: list[int] = field(default_factory=list)
    """Rows of the table."""

    def hit(self, damage: int) -> None:
        """Lose shield first, then health."""
        kept = max(0, self.shield - damage)
        self.health = max(0, self.health - max(0, damage - self.shield))
        self.shield = kept


def take_turn(cards: cdb.CompiledTable, mine: Side, other: Side, turn: int) -> list[str]:
    """Draw, and play as long as something fits and can be paid for; gives the cards that were played."""
    mine.hand += [mine.rng.randrange(cards.n_rows) for _ in range(HAND - len(mine.hand))]
    cost, mana = cards.outputs.column("Cost"), MANA
    played: list[str] = []
    while True:
        facts = {"health": mine.health, "enemy_health": other.health, "enemy_shield": other.shield > 0, "turn": turn}
        possible = cards.query(facts).only(mine.hand).only(cost <= mana)
        pick = mine.picker.pick(possible)
        if pick.row is None or other.health == 0:
            return played
        mana -= int(cost[pick.row])
        mine.hand.remove(pick.row)
        mine.shield += int(pick.outputs["Shield"])
        other.hit(int(pick.outputs["Damage"]))
        played.append(str(pick.asset))


def duel(seed: int = 3) -> list[str]:
    """A whole game, a line for each turn."""
    cards = cdb.load(HERE / "cards.csv").compile()
    sides = [Side(name, random.Random(seed + i), cards.picker(seed=seed + i, memory=0)) for i, name in enumerate(("Red", "Blue"))]
    said = []
    for turn in range(1, MOST_TURNS + 1):
        mine, other = sides[(turn + 1) % 2], sides[turn % 2]
        played = take_turn(cards, mine, other, turn)
        cards_played = ", ".join(played) or "nothing"
        said.append(f"{turn:2} {mine.name:4} plays {cards_played:20} {other.name}: {other.health} + {other.shield}")
        if other.health == 0:
            return [*said, f"{mine.name} wins."]
    return [*said, "A draw."]


if __name__ == "__main__":
    print(*duel(), sep="\n")
