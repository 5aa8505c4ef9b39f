"""The ball: it waits over a place until somebody catches it. Who that is, and what both play, the table `catches` says."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

from examples.playground.actor import Actor

if TYPE_CHECKING:
    from examples.playground.game import Game

SPOTS = ((-1.5, 2.5), (1.5, -3.0), (-4.0, -1.0), (4.0, -2.0), (-2.0, -5.0))
HELD_S = 4.0
REACH_M = 1.6
"""Nobody farther away is worth a question."""
HIGH_M, FALL_S, BESIDE_M = 2.05, 1.2, 0.7


class Ball:
    """Where the ball is, and who has it."""

    def __init__(self) -> None:
        self._spots = cycle(SPOTS)
        self.spot, self.holder, self.since_s = next(self._spots), None, 0.0
        self.said = ""

    holder: Actor | None

    @property
    def height_m(self) -> float:
        """It comes down from above, and then waits."""
        return HIGH_M + 6.0 * max(0.0, 1.0 - self.since_s / FALL_S) ** 2

    def goal_of(self, actor: Actor, other: Actor) -> tuple[float, float]:
        """Where somebody goes who wants it."""
        if self.holder is None:
            return self.spot
        if self.holder is other:
            return other.character.body.position
        return -0.5 * self.spot[0], -0.5 * self.spot[1]

    def update(self, dt: float, game: Game) -> None:
        """Ask who catches it, or throw it to the next place."""
        self.since_s += dt
        if self.holder is not None:
            if self.since_s > HELD_S:
                self.spot, self.holder, self.since_s = next(self._spots), None, 0.0
        elif self.since_s > FALL_S and min(actor.sees(*self.spot)[0] for actor in game.actors) < REACH_M:
            self._contest(game)

    def _contest(self, game: Game) -> None:
        """Offer both characters for both roles: the table casts them, the nearest first."""
        catches = game.watch["catches"]
        offered = [_seen(actor, self.spot) for actor in game.actors]
        game.asking = "ball"
        valid = catches.query({}, actors={"Catcher": offered, "Other": offered}, prefer="distance")
        pick = catches.picker().pick(valid)
        if pick.asset is None:
            return
        cast = {role: game.actors[int(str(actor["id"]))] for role, actor in pick.casting.items() if actor is not None}
        self.holder, self.since_s = cast["Catcher"], 0.0
        game.play_once(cast["Catcher"], pick.asset, *self.spot)
        self.said = f"{cast['Catcher'].name} catches the ball: {pick.asset}"
        if "Other" in cast and (misses := pick.outputs.get("Other plays")):
            game.play_once(cast["Other"], str(misses), *self.spot, BESIDE_M)
            self.said += f"; {cast['Other'].name} misses it: {misses}"


def _seen(actor: Actor, spot: tuple[float, float]) -> dict[str, object]:
    """An actor of a role: the facts, without the role before their names."""
    distance, facing = actor.sees(*spot)
    names = {"player": 0, "rival": 1}
    return {"id": names[actor.name], "distance": distance, "facing": facing, "busy": actor.once is not None}
