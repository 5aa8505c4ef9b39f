"""A running game that is debugged: a thread takes its decisions, and the screen the last minute of one character."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from contextdb.console import printable
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.trace.last_minute import LastMinute
from contextdb.telemetry.link.hearing import Wanted
from contextdb.telemetry.link.lines import DATABASES, DECISION, Line

from ..model.listening import MOST_TRACKS, Listening
from .recording import Recording

MOST_WAITING = 4096
"""So many decisions wait for the screen at most."""
MOST_PLAIN = 60
"""A game that sent so many decisions without their rows knows nothing of rows."""
AGAIN_S = 1.0


class Decisions(Listening):
    """The decisions of a game, in full."""

    def __init__(self, game: str, path: Path, character_id: str | None) -> None:
        self.rows: deque[tuple[str | None, str]] = deque(maxlen=MOST_WAITING)
        self.databases: dict[str | None, Mapping[str, Any]] = {}
        self.n_plain = 0
        super().__init__(game, path, Wanted(() if character_id is None else (character_id,), trace=True))

    def _take(self, line: Line, n_bytes: int) -> None:
        if line["line"] == DATABASES:
            if line["who"] in self.databases or len(self.databases) < MOST_TRACKS:
                self.databases[line["who"]] = line["databases"]
        elif line["line"] != DECISION:
            super()._take(line, n_bytes)
        elif isinstance(line.get("row"), str):
            self.rows.append((line["who"], line["row"]))
        else:
            self.n_plain += 1


class Live:
    """What a running game decides for one character.

    Parameters
    ----------
    game, path
        The game's name, and its door.
    character_id : str or None
        The character; None for the one that decides first.
    folder : str
        Of the project; "" without one.
    databases : mapping of name to MotionDatabase
        Those of the project.
    """

    def __init__(
        self,
        game: str,
        path: Path,
        character_id: str | None,
        folder: str,
        databases: Mapping[str, MotionDatabase],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.game, self._path, self._wanted, self._clock = game, path, character_id, clock
        self.folder, self._databases = folder, databases
        self.character_id: str | None = character_id
        self.characters: dict[str | None, None] = {}
        self.trace = LastMinute(databases)
        self.recording: Recording | None = None
        """None until the first decision."""
        self.n_refused = 0
        self._reported: object = None
        self._tried_at = clock()
        self.listening = Decisions(game, path, character_id)

    @property
    def name(self) -> str:
        """The game and the character."""
        return printable(self.game if self.character_id is None else f"{self.game} · {self.character_id}")

    @property
    def notes(self) -> str:
        """What is to be known of the game: that it is silent, has ended, or is of another version."""
        notes = [self.listening.trouble.replace("no query", "no decision")]
        if self.listening.n_plain >= MOST_PLAIN and not self.characters:
            notes.append("the game is of a version whose decisions cannot be debugged")
        if self.n_refused:
            notes.append(f"{self.n_refused:,} decisions cannot be read: the game is of another version")
        if self.listening.n_lost:
            notes.append(f"{self.listening.n_lost:,} lines lost")
        if len(self.characters) > 1:
            notes.append(f"{len(self.characters)} characters: --who NAME")
        return " · ".join(filter(None, notes))

    def take(self) -> bool:
        """Take what the game decided since the last time; whether anything is new."""
        self._connect_again()
        rows, n = self.listening.rows, 0
        while rows:
            character_id, text = rows.popleft()
            if not self.characters and self._wanted is None:
                self.character_id = character_id
            if len(self.characters) < MOST_TRACKS:
                self.characters[character_id] = None
            if character_id == self.character_id:
                is_taken = self.trace.take(text)
                n, self.n_refused = n + is_taken, self.n_refused + (not is_taken)
        reported = self.listening.databases.get(self.character_id)
        is_other = reported is not None and reported is not self._reported
        if reported is not None and is_other:
            self._reported = reported
            self.trace.made_with(reported)
        if not n:
            return False
        self.trace.settle()
        if self.recording is None:
            self.recording = Recording(self.name, self.trace, self.folder, self._databases, self.trace.missing)
        else:
            self.recording.refresh(self.trace.missing)
        return True

    def close(self) -> None:
        self.listening.close()

    def _connect_again(self) -> None:
        """Listen again to a game that went and came back."""
        if not self.listening.is_over or self._clock() - self._tried_at < AGAIN_S:
            return
        self._tried_at = self._clock()
        if self._path.exists():
            self.listening = Decisions(self.game, self._path, self._wanted)
