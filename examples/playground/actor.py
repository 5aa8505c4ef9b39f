"""One character of the game: a `motion.Character`, its stamina, and the one-off that it plays now and then."""

import contextdb as cdb
from contextdb import motion

from . import world
from .stick import REST, Stick

LAST_MINUTE, LONGEST = 3600, 216_000
"""Decisions that are always kept, a minute at 60 a second; and of an hour, more are not recorded."""


class Actor:
    """A character of the game."""

    def __init__(self, name: str, stock: motion.MotionProject, moves: cdb.CompiledTable, place: tuple[float, float]) -> None:
        self.name, self.stock, self.moves = name, stock, moves
        self.character = stock.character(name, moves, motion.Steered(position=place), unknown="any", ground=world.ground)
        self.stamina, self.is_tired = 1.0, False
        self.others: list[Actor] = []
        self.once: motion.OneOff | None = None
        self.readout = motion.Readout()
        self.trace = self.character.record(5, most=LAST_MINUTE)
        self.update(0.0, REST)

    def update(self, dt: float, stick: Stick) -> None:
        """One frame of the game."""
        self.stick = stick
        self._tire(dt)
        facts = {"gait": stick.gait, "strafe": stick.strafe, "style": "tired" if self.is_tired else "normal"}
        if "style" in self.moves.asked and facts["style"] not in (self.moves.asked["style"].domain.values or ()):
            del facts["style"]  # a folder of other clips may have none that is tired
        wanted, facing, once = stick.velocity(self.is_tired), stick.camera if stick.strafe else None, self.once
        if once is None:
            before = self.character.body
            after = world.apart(before.moved(dt, wanted, facing), (each.character.body.position for each in self.others))
            body = world.moved(before, after)
            self.moved = self.character.update(dt, wanted, facts, facing, body=body)
        else:
            self.moved = once.update(dt, wanted, facts)
            self.once = None if once.is_done else once
        assert self.moved.pose is not None
        self.pose = self.moved.pose
        self.readout.update(self.moved, self.moves, None if once is None else once.decision)

    @property
    def playing(self) -> str:
        """The asset that is shown."""
        return "" if self.pose.playing is None else self.pose.playing.asset

    def _tire(self, dt: float) -> None:
        """Running costs breath; who has none left is tired until most of it is back."""
        change = {"Run": -0.09, "Walk": 0.05, "Idle": 0.12}[self.stick.gait]
        self.stamina = min(1.0, max(0.0, self.stamina + dt * change))
        self.is_tired = self.stamina < (0.6 if self.is_tired else 0.05)
