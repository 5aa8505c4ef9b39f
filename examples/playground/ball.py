"""The ball: it waits over a place until somebody catches it. Who may, the table `catches` says; the joint search casts two."""

import math
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contextdb import motion

from .actor import Actor
from .stick import REST, Stick

if TYPE_CHECKING:
    from .game import Game

SPOTS = ((-1.5, 2.5), (1.5, -3.0), (-4.0, -1.0), (4.0, -2.0), (-2.0, -5.0))
HELD_S, REACH_M, HIGH_M, FALL_S = 4.0, 1.6, 2.05, 1.2
"""How long it is held, from how far somebody reaches it, where it waits, and how long it takes to come down to there."""


class Ball:
    """Where the ball is, and who has it."""

    def __init__(self, game: "Game") -> None:
        stock = game.player.stock
        self.contest = motion.JointNode(stock.config.joint_searcher("contest", stock.databases))
        self.picker = game.watch["catches"].picker()  # kept: it remembers what it gave, through a reload too
        self.holder: Actor | None = None
        self.game = game
        self._spots = cycle(SPOTS)
        self.said = ""
        self.caught_s = 0.0
        self._throw()

    def _throw(self) -> None:
        self.spot, self.holder, self.since_s = next(self._spots), None, 0.0

    @property
    def place(self) -> NDArray[np.float64]:
        """It comes down from above, waits, is on its way to a hand, and then in it: x, y, z."""
        fallen = 1.0 if self.holder is not None else min(1.0, self.since_s / FALL_S)
        place = np.array((self.spot[0], HIGH_M + 6.0 * (1.0 - fallen) ** 2, self.spot[1]))
        if self.holder is not None:
            hand = self.holder.pose.positions[self.holder.stock.banks["moves"].skeleton.index("RightHand")]
            place += min(1.0, self.since_s / max(self.caught_s, 1e-6)) * (hand - place)
        return place

    def stick_of(self, actor: Actor, other: Actor) -> Stick:
        """For somebody who wants it: to where it is free, after whoever has it, and a few steps away with it."""
        goal = self.spot
        if self.holder is not None:
            goal = other.character.body.position if self.holder is other else (-0.5 * self.spot[0], -0.5 * self.spot[1])
        dx, dz = goal[0] - actor.pose.root[0], goal[1] - actor.pose.root[1]
        away = math.hypot(dx, dz)
        return REST if away < (0.3 if self.holder is None else 1.8) else Stick(dx / away, dz / away, run=away > 2.5)

    def update(self, dt: float) -> None:
        """Ask who catches it, or throw it to the next place."""
        self.since_s += dt
        if self.holder is not None:
            if self.since_s > HELD_S:
                self._throw()
        elif self.since_s > FALL_S and min(actor.character.sees(*self.spot).distance_m for actor in self.game.actors) < REACH_M:
            self._ask()

    def _ask(self) -> None:
        """Offer both characters for both roles. Clip, frame and cast of a contest are found together; else one may catch alone."""
        actors, catches = {actor.name: actor for actor in self.game.actors}, self.game.watch["catches"]
        self.game.asking = "ball"
        offered = [self._offer(actor) for actor in self.game.actors]
        valid = catches.query({}, actors=dict.fromkeys(self.contest.searcher.roles, offered), prefer="distance")
        queries = {name: actor.character.features() for name, actor in actors.items()}
        places = {name: actor.pose.root for name, actor in actors.items()}
        both = self.contest.enter(queries, places, valid=valid, in_match_range=True)
        pick = self.picker.pick(valid if both is None else valid.only([str(both.hit.asset)]))
        if both is not None:
            cast = {role: actors[str(name)] for role, name in both.hit.cast.items()}
            for role, actor in cast.items():
                actor.once = motion.OneOff(actor.character, both.plays[role], "contest")
            self._catch(cast["Catcher"], both.contact_s, f"{both.hit.asset}; {cast['Other'].name} misses it")
        elif pick.asset is not None and (who := pick.casting["Catcher"]) is not None:
            catcher = actors[str(who["id"])]
            play = self.game.node.enter(catcher.character.features(), catcher.character.sees(*self.spot), valid.only([pick.asset]))
            if play is not None:
                catcher.once = motion.OneOff(catcher.character, play, "once")
                self._catch(catcher, play.path.position_s or 0.0, pick.asset)

    def _catch(self, catcher: Actor, after_s: float, how: str) -> None:
        self.holder, self.since_s, self.caught_s = catcher, 0.0, after_s
        self.said = f"{catcher.name} catches the ball: {how}"

    def _offer(self, actor: Actor) -> dict[str, object]:
        """An actor of a role: the facts, without the role before their names."""
        seen = actor.character.sees(*self.spot)
        return {"id": actor.name, "distance": seen.distance_m, "facing": seen.direction_deg, "busy": actor.once is not None}
