"""A one-off that a character plays, such as what a match node entered: it moves the body for a while.

What would play without it goes on below, with the body of the one-off and without poses. So what plays after it fits.
"""

from __future__ import annotations

from dataclasses import replace

from contextdb.cells.arguments import require_kind, require_real, require_text
from contextdb.errors import ContextError, Fault
from contextdb.motion.characters.character import Character
from contextdb.motion.characters.facts import Ground
from contextdb.motion.characters.tables import Facts
from contextdb.motion.characters.updates import Updated
from contextdb.motion.nodes.match_node import MatchPlay
from contextdb.motion.selection.decision import Decision


class OneOff:
    """Plays a one-off on a character, from where its animation is: update this in place of the character until it is done.

    Parameters
    ----------
    character : Character
        With a pose stream that has a bank of the one-off's database.
    play : MatchPlay
        What `MatchNode.enter`, a gate that opens, or a role of `JointNode.enter` gave.
    database : str
        The name of that bank.

    Attributes
    ----------
    character, play, database
        As given.
    decision : Decision or None
        What the one-off showed in the last update; None before the first.

    Raises
    ------
    ContextError
        An argument of another type, or a character without a pose stream.
    """

    def __init__(self, character: Character, play: MatchPlay, database: str) -> None:
        require_kind(character, Character, "character", "a Character")
        require_kind(play, MatchPlay, "play", "a MatchPlay")
        if character.stream is None:
            raise ContextError(Fault("the character has no pose stream.", "a character with one"))
        self.character, self.play, self.database = character, play, require_text(database, "database")
        self.decision: Decision | None = None
        self._stream, self._origin = character.stream, character.root

    @property
    def is_done(self) -> bool:
        """Whether it has played to completion: update the character again."""
        return self.play.is_done

    def update(self, dt: float, stick: Ground = (0.0, 0.0), facts: Facts | None = None) -> Updated:
        """One update: the body and the pose are the one-off's, the decision is the character's. Raises ContextDBError as
        `Character.update`; MotionError for a database whose poses the stream does not have."""
        dt, character = require_real(dt, "dt", 0.0), self.character
        place, before = self._origin.then(self.play.at(self.play.time_s + dt)), character.body
        position = (place.left_m, place.ahead_m)
        x, z = ((new - old) / dt for new, old in zip(position, before.position, strict=True)) if dt else before.velocity
        body = replace(before, position=position, velocity=(x, z), heading=place.turn_rad, acceleration=(0.0, 0.0))
        character._is_posed = False
        try:
            updated = character.update(dt, stick, facts, body=body)
        finally:
            character._is_posed = True
        self.play.advance(dt)
        self.decision = self.play.decision(self.database)
        pose = self._stream.update(self.decision, dt, body, character.ground)
        return replace(updated, poses=(pose,), at=0)
