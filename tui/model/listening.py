"""A running game that is listened to: a thread of its own reads its lines, and keeps the last minute of each character.

The thread works a quarter of the time at most: of a game that tells more, lines are lost, and counted. Nothing here waits
for the game but the thread, which ends when the game does, or when nobody listens any more.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from threading import Event, Thread
from typing import Literal

from contextdb.errors import ContextDBError
from contextdb.telemetry.link.hearing import Hearing, Wanted, hear
from contextdb.telemetry.link.lines import ASK, END, HEADER, LOST, PICK, TABLES, Line

from .moments import Key, LiveTrack, Moment, pick_of

State = Literal["opening", "on", "ended", "gone", "refused"]
MOST_TRACKS = 500
"""At most this many characters have a track; those that come later are left out."""
PAUSE, LONGEST_S = 3.0, 0.25
"""The thread rests so many times as long as it worked, and not longer than that."""
SILENT_S = 2.0
"""A game that has sent nothing for so long counts as one that asks nothing."""


class Listening:
    """One game. All it knows may be read from any thread."""

    def __init__(self, game: str, path: Path, wanted: Wanted) -> None:
        self.game, self.path, self.wanted = game, path, wanted
        self.state: State = "opening"
        self.problem = ""
        """Why the game is not listened to any more, where it is not that it ended."""
        self.tables: Mapping[str, Mapping[str, object]] = {}
        """What the game says of each of its tables."""
        self.tracks: dict[Key, LiveTrack] = {}
        self.n_lost = 0
        self.n_left_out = 0
        """Lines of characters that are left out."""
        self._heard_at = time.monotonic()
        self._closed = Event()
        self._hearing: Hearing | None = None
        self._thread = Thread(target=self._listen, name=f"listen to {game}", daemon=True)
        self._thread.start()

    @property
    def silent_s(self) -> float:
        """How long nothing has come."""
        return time.monotonic() - self._heard_at

    @property
    def is_over(self) -> bool:
        """Whether nothing will come any more."""
        return self.state in ("ended", "gone", "refused")

    @property
    def trouble(self) -> str:
        """Why nothing comes; empty while something does."""
        if self.state == "opening":
            return "connecting"
        if self.state == "on":
            return f"no query for {self.silent_s:.0f} s" if self.silent_s >= SILENT_S else ""
        reason = {"ended": "the game has ended", "gone": "the game is gone", "refused": "the game does not answer"}[self.state]
        return self.problem or reason

    def close(self) -> None:
        self._closed.set()
        if self._hearing is not None:
            self._hearing.close()

    def join(self, timeout_s: float) -> None:
        self._thread.join(timeout_s)

    def _listen(self) -> None:
        try:
            with hear(self.path, self.wanted) as self._hearing:
                self._take_tables(self._hearing.header)
                self.state = "on"
                self._read(self._hearing)
        except (OSError, ContextDBError) as error:
            self.state = "refused" if self.state == "opening" else "gone"
            if isinstance(error, ContextDBError):
                self.problem = error.faults[0].found

    def _read(self, hearing: Hearing) -> None:
        has_ended = False
        batches = hearing.batches()
        while not self._closed.is_set():
            batch = next(batches, None)
            if batch is None:
                break
            start = time.thread_time()
            for raw, line in batch:
                self._take(line, len(raw))
                has_ended = has_ended or line["line"] == END
            self._heard_at = time.monotonic()
            self._closed.wait(min(PAUSE * (time.thread_time() - start), LONGEST_S))
        self.state = "ended" if has_ended else "gone"

    def _take(self, line: Line, n_bytes: int) -> None:
        kind = line["line"]
        if kind in (HEADER, TABLES):
            self._take_tables(line)
        elif kind == LOST:
            self.n_lost += line["count"]
        elif kind in (ASK, PICK):
            key = line["who"], line["table"]
            track = self.tracks.get(key)
            if track is None and (kind == PICK or len(self.tracks) >= MOST_TRACKS):
                self.n_left_out += kind == ASK
                return
            if kind == PICK and track is not None:
                track.picked(pick_of(line))
            else:
                track = track or LiveTrack()
                track.add(Moment.of(line), n_bytes)
                self.tracks[key] = track

    def _take_tables(self, line: Line) -> None:
        self.tables = line["tables"]
