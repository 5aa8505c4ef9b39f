"""The game: two characters, a wall to vault, a ball to contest, tables that are watched, and a link for the editor.

It knows neither a window nor a clock: `update` is called with the seconds that have passed and the player's stick.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

import contextdb as cdb
from contextdb import motion
from examples.playground import world
from examples.playground.actor import LAST_MINUTE, Actor, Stock
from examples.playground.ball import Ball
from examples.playground.stick import GAITS, REST, Stick

LOOK_EVERY_S = 0.2
"""How often the files of the tables are looked at."""
GATE, GATE_CLOSES = 1.0, 1.5
"""Below which cost a vault begins."""


class Game:
    """All of it. Use it in a `with`: it opens a link under `link`, where a name is given."""

    def __init__(self, folder: Path, link: str | None = None, settle_s: float = 0.1, stock: Stock | None = None) -> None:
        self.watch = cdb.watch(folder, self._reloaded, self._refused, poll_s=None, settle_s=settle_s)
        self.folder, self.trouble, self.time_s, self.asking = self.watch.folder, "", 0.0, ""
        stock = Stock.of(self.watch.project) if stock is None else stock
        moves = next(iter(self.watch.snapshot().values()))  # the first that contextdb.toml declares
        self.player = Actor("player", stock, moves, (0.0, 0.0, 0.0))
        self.actors, self.ball, self.gate = [self.player], None, None
        if "once" in stock.databases:  # the game's own clips; a folder of others has none of these
            self.rival = Actor("rival", stock, moves, (2.5, -4.0, 0.0))
            self.actors.append(self.rival)
            self.node = motion.MatchNode(stock.databases["once"], position_weight=0.5, rotation_weight=0.5)
            self.gate = motion.MatchGate(self.node, GATE, GATE_CLOSES)
            self.ball = Ball(self)
        self.link = None if link is None else cdb.link(link)
        if self.link is not None:
            self.link.watch(self.watch, lambda: self.asking)
            for actor in self.actors:
                self.link.watch(actor.character.controller, actor.name)
        self._look_in_s = 0.0

    ball: Ball | None
    gate: motion.MatchGate | None

    def update(self, dt: float, stick: Stick) -> None:
        """One frame."""
        self.time_s += dt
        self._look_in_s -= dt
        if self._look_in_s <= 0.0:
            self._look_in_s = LOOK_EVERY_S
            self.watch.poll()
        for actor in self.actors:
            self.asking = actor.name
            actor.update(dt, stick if actor is self.player else self._rival_s_stick())
            if self.link is not None and self.link.is_heard and actor.playing in actor.readout.valid.assets:
                actor.moves.pick(actor.readout.valid.only([actor.playing]))  # the editor marks the row that the search picked
        try:
            self._vault(self.player)
            if self.ball is not None:
                self.ball.update(dt)
        except cdb.ContextDBError as error:
            self._refused(error)

    def _vault(self, actor: Actor) -> None:
        """Begin a vault when one fits: the table says which may play, the gate whether the best is good enough."""
        if self.gate is None or actor.once is not None or actor.stick.gait == "Idle":
            return
        here = actor.root
        ahead = world.wall_ahead(here.left_m, here.ahead_m, math.atan2(actor.stick.x, actor.stick.z))
        if ahead is None:
            self.gate.close()
            return
        self.asking = actor.name
        *place, angle_deg = ahead
        speed = math.hypot(*actor.character.body.velocity)
        valid = self.watch["vaults"].query({"speed": speed, "wall_height": world.WALL.near_m, "wall_angle": angle_deg})
        look = self.gate.update(actor.features, motion.Target.seen_from(here, *place), valid)
        if look.play is not None:
            actor.begin(look.play, "once")
            self.gate.close()

    def play_once(self, actor: Actor, asset: str, x: float, z: float) -> motion.MatchPlay | None:
        """Let somebody play a one-off that ends at a place."""
        may_play = np.array([each == asset for each in self.node.database.assets])
        play = self.node.enter(actor.features, motion.Target.seen_from(actor.root, x, z), may_play)
        if play is not None:
            actor.begin(play, "once")
        return play

    def _rival_s_stick(self) -> Stick:
        """To the ball where it is free, after whoever has it, and a few steps away with it."""
        if self.ball is None:
            return REST
        x, z = self.ball.goal_of(self.rival, self.player)
        dx, dz = x - self.rival.root.left_m, z - self.rival.root.ahead_m
        away = math.hypot(dx, dz)
        near_m = 0.3 if self.ball.holder is None else 1.8
        return REST if away < near_m else Stick(dx / away, dz / away, run=away > 2.5)

    def _reloaded(self, snapshot: cdb.Snapshot) -> None:
        """The designer has saved: obey the new table, if it takes what the game says."""
        moves = next(iter(snapshot.values()))
        try:
            for gait in GAITS:
                moves.query({**self.player.moved.facts, "gait": gait}, unknown="any")
        except cdb.ContextDBError as error:
            self._refused(error)
            return
        self.trouble = ""
        for actor in self.actors:
            actor.exchange(moves)

    def _refused(self, error: cdb.ContextDBError) -> None:
        """What was saved cannot be used: what was good plays on."""
        self.trouble = str(error.faults[0])

    @property
    def state(self) -> list[str]:
        """What there is to say beside what plays: the breath, the gate, the ball, the link, the record, what is wrong."""
        lines = [f"{'tired' if self.player.is_tired else 'stamina'}  {100 * self.player.stamina:.0f} %"]
        if self.gate is not None and self.gate.seen is not None:
            lines.append(f"gate  {self.gate.seen}")
        if self.ball is not None:
            lines.append("the ball is free" if self.ball.holder is None else self.ball.said)
        if self.link is not None:
            lines.append(f"link  {self.link.name}, {'followed' if self.link.is_heard else 'nobody follows'}")
        if self.player.trace.most > LAST_MINUTE:
            lines.append(f"recording  {len(self.player.trace)} moments")
        return lines if not self.trouble else [*lines, f"not loaded: {self.trouble}"]

    def __enter__(self) -> Game:
        return self

    def __exit__(self, *error: object) -> None:
        """Let go of the link and the files."""
        if self.link is not None:
            self.link.close()
        self.watch.close()
