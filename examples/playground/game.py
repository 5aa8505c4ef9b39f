"""The game: two characters, a wall to vault, a ball to contest, tables that are watched, and a link for the editor.

It knows neither a window nor a clock: `update` is called with the seconds that have passed and the player's stick.
"""

import math
import os
from contextlib import AbstractContextManager
from pathlib import Path

import contextdb as cdb
from contextdb import motion

from . import world
from .actor import LAST_MINUTE, Actor
from .ball import Ball
from .crowd import Throng
from .stick import PACES_MPS, Stick

LOOK_EVERY_S, GATE, GATE_CLOSES = 0.2, 1.0, 1.5
"""How often the files of the tables are looked at, below which cost a vault begins, and above which one may no more."""


class Game(AbstractContextManager["Game"]):
    """All of it. Use it in a `with`: it opens a link under `link`, where a name is given."""

    ball: Ball | None = None
    gate: motion.MatchGate | None = None

    def __init__(
        self,
        folder: Path,
        link: str | None = None,
        settle_s: float = 0.1,
        stock: motion.MotionProject | None = None,
        n_crowd: int = 0,
    ) -> None:
        self.watch = cdb.watch(folder, self._reloaded, self._refused, poll_s=None, settle_s=settle_s)
        self.trouble, self.asking, self.time_s, self._look_in_s = "", "", 0.0, 0.0
        stock = motion.MotionProject.of(self.watch.project) if stock is None else stock
        moves = next(iter(self.watch.snapshot().values()))  # the first that contextdb.toml declares
        self.player = Actor("player", stock, moves, (0.0, 0.0))
        self.actors = [self.player]
        if "once" in stock.databases:  # the game's own clips; a folder of others has none of these
            self.rival = Actor("rival", stock, moves, (2.5, -4.0))
            self.actors.append(self.rival)
            self.player.others, self.rival.others = [self.rival], [self.player]
            self.node = motion.MatchNode(stock.databases["once"], position_weight=0.5, rotation_weight=0.5)
            self.gate = motion.MatchGate(self.node, GATE, GATE_CLOSES)
            self.ball = Ball(self)
        self.throng = Throng(n_crowd, stock, moves) if n_crowd else None
        self.link = None if link is None else cdb.link(link)
        if self.link is not None:
            self.link.watch(self.watch, lambda: self.asking)
            for actor in self.actors:
                self.link.watch(actor.character.controller, actor.name)

    def update(self, dt: float, stick: Stick) -> None:
        """One frame."""
        self.time_s += dt
        self._look_in_s -= dt
        if self._look_in_s <= 0.0:
            self._look_in_s = LOOK_EVERY_S
            self.watch.poll()
        for actor in self.actors:
            self.asking = actor.name
            actor.update(dt, stick if actor is self.player or self.ball is None else self.ball.stick_of(actor, self.player))
            if self.link is not None and self.link.is_heard and actor.playing in actor.readout.valid.assets:
                row = actor.readout.valid.only([actor.playing]).rows[0]  # the search picked it: the editor marks it
                self.link.picked(actor.moves, actor.name, row)
        if self.throng is not None:
            self.throng.update(dt)
        try:
            self._vault(self.player)
            if self.ball is not None:
                self.ball.update(dt)
        except cdb.ContextDBError as error:
            self._refused(error)

    def _vault(self, actor: Actor) -> None:
        """Begin a vault when one fits: the table says which may play, the gate whether the best is good enough."""
        if self.gate is None:
            return
        ahead = world.wall_ahead(*actor.pose.root[:2], math.atan2(actor.stick.x, actor.stick.z))
        if ahead is None or actor.once is not None or actor.stick.gait == "Idle":
            self.gate.close()
            return
        self.asking = actor.name
        *place, angle_deg = ahead
        speed = math.hypot(*actor.character.body.velocity)
        valid = self.watch["vaults"].query({"speed": speed, "wall_height": world.WALL.near_m, "wall_angle": angle_deg})
        look = self.gate.update(actor.character.features(), actor.character.sees(*place), valid)
        if look.play is not None:
            actor.once = motion.OneOff(actor.character, look.play, "once")
            self.gate.close()

    def _reloaded(self, snapshot: cdb.Snapshot) -> None:
        """The designer has saved: obey the new table, if it takes what the game says."""
        moves = next(iter(snapshot.values()))
        try:
            for gait in PACES_MPS:
                moves.query({**self.player.moved.facts, "gait": gait}, unknown="any")
        except cdb.ContextDBError as error:
            self._refused(error)
            return
        self.trouble = ""
        for actor in self.actors:
            actor.moves = actor.character.tables = moves
        if self.throng is not None:
            self.throng.use(moves)

    def _refused(self, error: cdb.ContextDBError) -> None:
        """What was saved cannot be used: what was good plays on."""
        self.trouble = str(error.faults[0]).replace(f"{self.watch.folder}{os.sep}", "")

    @property
    def state(self) -> list[str]:
        """What there is to say beside what plays: the breath, the gate, the ball, the link, the record, what is wrong."""
        player, ball, link, seen = self.player, self.ball, self.link, self.gate and self.gate.seen
        lines = [
            f"{'tired' if player.is_tired else 'stamina'}  {100 * player.stamina:.0f} %",
            f"gate  {seen}" if seen else "",
            "" if ball is None or ball.holder is None else ball.said,
            "" if link is None else "the editor follows" if link.is_heard else "no editor follows yet",
            "" if self.throng is None else self.throng.state,
            f"recording  {len(player.trace)} moments" if player.trace.most > LAST_MINUTE else "",
            f"not loaded: {self.trouble}" if self.trouble else "",
        ]
        return [line for line in lines if line]

    def __exit__(self, *error: object) -> None:
        """Let go of the link and the files."""
        if self.link is not None:
            self.link.close()
        self.watch.close()
