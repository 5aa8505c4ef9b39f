"""One character of the game: a `motion.Character`, its stamina, and the one-off that it plays now and then."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import contextdb as cdb
from contextdb import motion
from examples.playground import world
from examples.playground.stick import REST, Stick

LAST_MINUTE, LONGEST = 3600, 216_000
"""Decisions that are always kept, a minute at 60 a second; and of an hour, more are not recorded."""


@dataclass(frozen=True, eq=False)
class Stock:
    """What all characters share: the settings, and the frames and poses of all clips."""

    config: motion.MotionConfig
    databases: Mapping[str, motion.MotionDatabase]
    banks: Mapping[str, motion.PoseBank]

    @classmethod
    def of(cls, project: cdb.Project) -> Stock:
        """Read the clips. No table is named, so that a database holds every clip, with a row or without."""
        config = motion.MotionConfig.from_dict(project.schema.motion, tables=project.tables, file=project.schema.file)
        databases = motion.open_or_build(config, project.folder)
        return cls(config, databases, motion.open_or_build_poses(config, project.folder))


class Actor:
    """A character of the game."""

    def __init__(self, name: str, stock: Stock, moves: cdb.CompiledTable, place: tuple[float, float, float]) -> None:
        self.name, self.stock, self.moves = name, stock, moves
        controller = stock.config.controller(name, stock.databases)
        schema = controller.selector.databases["moves"].schema
        assert schema is not None
        self.stream = motion.PoseStream(stock.banks, stock.config.output_of(name))
        body = motion.Steered(position=place[:2], heading=place[2])
        self.character = motion.Character(controller, schema, moves, self.stream, body, unknown="any", ground=world.ground)
        self.keep(LAST_MINUTE)
        self.stamina, self.is_tired = 1.0, False
        self.once: motion.MatchPlay | None = None
        self.readout = motion.Readout()
        self.update(0.0, REST)

    def update(self, dt: float, stick: Stick) -> None:
        """One frame of the game."""
        self._tire(dt, stick)
        self.stick = stick
        facts = {"gait": stick.gait, "strafe": stick.strafe, "style": "tired" if self.is_tired else "normal"}
        if "style" in self.moves.asked and facts["style"] not in (self.moves.asked["style"].domain.values or ()):
            del facts["style"]  # a folder of other clips may have none that is tired
        wanted, facing = stick.velocity(self.is_tired), stick.camera if stick.strafe else None
        before = self.character.body
        if self.once is None:
            body = world.moved(before, before.moved(dt, wanted, facing))
            self.moved = self.character.update(dt, wanted, facts, facing, body=body)
            assert self.moved.pose is not None
            self.pose = self.moved.pose
        else:
            self._play_once(self.once, dt, wanted, facts)
        self.readout.update(self.moved, self.moves, self.pose.playing)

    def begin(self, play: motion.MatchPlay, database: str) -> None:
        """Play a one-off from where the body is."""
        self.once, self.once_of, self.origin = play, database, self.root

    def _play_once(self, play: motion.MatchPlay, dt: float, wanted: tuple[float, float], facts: Mapping[str, object]) -> None:
        """The one-off moves the body; what would play without it goes on below, so that it fits when the one-off is over."""
        before, place = self.character.body, self.origin.then(play.advance(dt))
        x, z = place.left_m, place.ahead_m
        velocity = ((x - before.position[0]) / dt, (z - before.position[1]) / dt)
        body = replace(before, position=(x, z), velocity=velocity, heading=place.turn_rad, acceleration=(0.0, 0.0))
        self.character.stream = None
        self.moved = self.character.update(dt, wanted, facts, body=body)
        self.pose = self.stream.update(play.decision(self.once_of), dt, body, world.ground)
        if play.is_done:
            self.once, self.character.stream = None, self.stream

    def keep(self, most: int) -> None:
        """Keep so many decisions from now on, the last ones, for a session."""
        self.trace = motion.Trace(5, self.character.controller.selector.databases, most=most)
        self.character.controller.recorder = self.trace

    def exchange(self, moves: cdb.CompiledTable) -> None:
        """Obey another version of the table from now on."""
        self.moves = self.character.tables = moves

    @property
    def root(self) -> motion.RootMotion:
        """Where the animation is."""
        return motion.RootMotion(*self.pose.root)

    @property
    def playing(self) -> str:
        """The asset that is shown."""
        shown = self.pose.playing
        return "" if shown is None else shown.asset

    @property
    def why(self) -> str:
        """Why that plays, in one sentence."""
        if self.once is None:
            return self.readout.why
        cost, role = self.once.costs, self.playing.split(".")[-1]
        if self.once_of == "contest":
            return f"Clip, frame and cast were found together; its own part, {role}, costs {cost.total:.2f}."
        return f"It fits best: its pose and the way to its target cost {cost.total:.2f}, {cost.distance:.2f} of it the way."

    @property
    def features(self) -> Any:
        """The pose, as a query for a one-off."""
        playing = self.moved.decision.playing
        assert playing is not None
        return self.stock.databases[playing.database].raw(playing.frame)

    def sees(self, x: float, z: float) -> tuple[float, float]:
        """How far away a place is, and in which direction: metres, and degrees to the left."""
        seen = motion.Target.seen_from(self.root, x, z)
        return math.hypot(seen.left_m, seen.ahead_m), math.degrees(math.atan2(seen.left_m, seen.ahead_m))

    def _tire(self, dt: float, stick: Stick) -> None:
        """Running costs breath; who has none left is tired until most of it is back."""
        change = {"Run": -0.09, "Walk": 0.05, "Idle": 0.12}[stick.gait]
        self.stamina = min(1.0, max(0.0, self.stamina + dt * change))
        self.is_tired = self.stamina < (0.6 if self.is_tired else 0.05)
