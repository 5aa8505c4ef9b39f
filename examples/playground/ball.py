"""The ball: it waits over a place until somebody catches it. Who may, the table `catches` says; the joint search casts two."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

from contextdb import motion
from examples.playground.actor import Actor

if TYPE_CHECKING:
    from examples.playground.game import Game

SPOTS = ((-1.5, 2.5), (1.5, -3.0), (-4.0, -1.0), (4.0, -2.0), (-2.0, -5.0))
HELD_S, REACH_M, HIGH_M, FALL_S = 4.0, 1.6, 2.05, 1.2
"""How long it is held, from how far somebody reaches it, where it waits, and how long it takes to come down to there."""


class Ball:
    """Where the ball is, and who has it."""

    def __init__(self, game: Game) -> None:
        stock = game.player.stock
        self.contest = motion.JointNode(stock.config.joint_searcher("contest", stock.databases))
        self.contest.searcher.search({}, {}, casts=[])  # the first one compiles the loops: at the start, not in a frame
        self._spots = cycle(SPOTS)
        self.holder: Actor | None = None
        self.game, self.said, self.caught_s = game, "", 0.0
        self._throw()

    def _throw(self) -> None:
        self.spot, self.holder, self.since_s = next(self._spots), None, 0.0

    @property
    def height_m(self) -> float:
        """It comes down from above, and then waits."""
        return HIGH_M + 6.0 * max(0.0, 1.0 - self.since_s / FALL_S) ** 2

    def goal_of(self, actor: Actor, other: Actor) -> tuple[float, float]:
        """Where somebody goes who wants it."""
        if self.holder is None:
            return self.spot
        return other.character.body.position if self.holder is other else (-0.5 * self.spot[0], -0.5 * self.spot[1])

    def update(self, dt: float) -> None:
        """Ask who catches it, or throw it to the next place."""
        self.since_s += dt
        if self.holder is not None:
            if self.since_s > HELD_S:
                self._throw()
        elif self.since_s > FALL_S and min(actor.sees(*self.spot)[0] for actor in self.game.actors) < REACH_M:
            self._ask()

    def _ask(self) -> None:
        """Offer both characters for both roles. Clip, frame and cast of a contest are found together; else one may catch alone."""
        actors, catches = {actor.name: actor for actor in self.game.actors}, self.game.watch["catches"]
        self.game.asking = "ball"
        offered = [self._seen(actor) for actor in self.game.actors]
        valid = catches.query({}, actors=dict.fromkeys(self.contest.searcher.roles, offered), prefer="distance")
        queries = {name: actor.features for name, actor in actors.items()}
        places = {name: actor.pose.root for name, actor in actors.items()}
        both = self.contest.enter(queries, places, valid=valid, in_match_range=True)
        pick = catches.picker().pick(valid if both is None else valid.only([str(both.hit.asset)]))
        if both is not None:
            cast, self.caught_s = {role: actors[str(name)] for role, name in both.hit.cast.items()}, both.contact_s
            for role, actor in cast.items():
                actor.begin(both.plays[role], "contest")
            self._catch(cast["Catcher"], f"{both.hit.asset}; {cast['Other'].name} misses it")
        elif pick.asset is not None and (who := pick.casting["Catcher"]) is not None:
            catcher = actors[str(who["id"])]
            play = self.game.play_once(catcher, pick.asset, *self.spot)
            if play is not None:
                self.caught_s = play.path.position_s or 0.0
                self._catch(catcher, pick.asset)

    def _catch(self, catcher: Actor, how: str) -> None:
        self.holder, self.since_s, self.said = catcher, 0.0, f"{catcher.name} catches the ball: {how}"

    def _seen(self, actor: Actor) -> dict[str, object]:
        """An actor of a role: the facts, without the role before their names."""
        distance, facing = actor.sees(*self.spot)
        return {"id": actor.name, "distance": distance, "facing": facing, "busy": actor.once is not None}
