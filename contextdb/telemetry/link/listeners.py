"""Who listens to a game: each gets the lines that it wants, as fast as it reads and no faster.

A listener may send one line of JSON, and again whenever it wants other lines:

    {"format": 1, "token": "…", "every": true, "who": ["player"], "tables": ["locomotion"], "trace": true}

`every`: every question, not only the newest of each character and table. `trace`: every decision in full, and nothing else. What a
listener does not read in time is lost, and the link sends their number; nothing here ever waits for a listener.
"""

from __future__ import annotations

import hmac
import json
import logging
import socket
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import IO, Protocol

from contextdb.telemetry.link.lines import LOST, dumped
from contextdb.telemetry.link.ring import Moment

MOST_PENDING = 1 << 20
"""Bytes that wait for a listener that does not read; what would be more is lost."""
MOST_REQUEST = 1 << 12
"""Bytes of what a listener may ask for; who sends more floods, and is sent away."""
PIECE = 1 << 16


class Listener(Protocol):
    """Takes lines."""

    wants_every: bool
    wants_trace: bool

    @property
    def has_room(self) -> bool:
        """Whether a line would not be lost now."""
        ...

    def wants(self, moment: Moment) -> bool:
        """Whether a moment is among those asked for."""
        ...

    def offer(self, line: bytes) -> None:
        """Take a line, or lose it."""
        ...

    def offer_in_full(self, moment: Moment) -> None:
        """Take a decision in full; only for who wants that."""
        ...

    def lose(self, n_lines: int) -> None:
        """Learn that lines are lost."""
        ...


class SocketListener:
    """A listener at the other end of a socket. `header` gives what it is sent first, and after it has lost lines."""

    def __init__(self, connection: socket.socket, token: str, header: Callable[[], bytes]) -> None:
        connection.setblocking(False)
        self.connection = connection
        self.wants_every = self.wants_trace = False
        self._knows: set[object] = set()
        """What it was sent already, and need not be sent again."""
        self.is_gone = False
        self._header = header
        self._token = token
        self._who: frozenset[str] | None = None
        self._tables: frozenset[str] | None = None
        self._request = bytearray()
        self._pending = bytearray()
        self._n_lost = 0
        self.is_let_in = not token
        if self.is_let_in:
            self.offer(header())

    @property
    def is_behind(self) -> bool:
        """Whether something waits for it to read."""
        return bool(self._pending)

    @property
    def has_room(self) -> bool:
        """Whether a line would not be lost now."""
        return self.is_let_in and not self.is_gone and len(self._pending) < MOST_PENDING

    def wants(self, moment: Moment) -> bool:
        """Whether a moment is among those asked for."""
        if self._who is not None and moment.who not in self._who:
            return False
        if self.wants_trace:
            return moment.decision is not None
        return self._tables is None or moment.table is None or moment.table in self._tables

    def offer(self, line: bytes) -> None:
        """Take a line, or lose it."""
        if not self.is_let_in or self.is_gone:
            return
        if not self.has_room:
            self._n_lost += 1
            return
        if self._n_lost and not self._pending:
            self._pending += dumped({"line": LOST, "count": self._n_lost}) + self._header()
            self._n_lost = 0
        self._pending += line

    def offer_in_full(self, moment: Moment) -> None:
        """Take the lines of a decision for who debugs it."""
        for mark, line in moment.in_full():
            if mark is None or mark not in self._knows:
                self._knows |= set() if mark is None else {mark}
                self.offer(line)

    def lose(self, n_lines: int) -> None:
        self._n_lost += n_lines
        self._knows.clear()

    def read(self) -> None:
        try:
            got = self.connection.recv(MOST_REQUEST)
        except BlockingIOError:
            return
        except OSError:
            got = b""
        self._request += got
        self.is_gone = self.is_gone or not got
        while not self.is_gone and b"\n" in self._request:
            line, _, rest = bytes(self._request).partition(b"\n")
            self._request = bytearray(rest)
            self._take(line)
        if len(self._request) >= MOST_REQUEST:
            self.is_gone = True

    def _take(self, line: bytes) -> None:
        """Take what it asks for; who sends anything else, or not the token, is sent away."""
        try:
            asked = json.loads(line)
        except (ValueError, RecursionError):
            asked = None
        if not isinstance(asked, dict) or not self._knows_token(asked):
            self.is_gone = True
            return
        self.wants_trace = asked.get("trace") is True
        self.wants_every = asked.get("every") is True or self.wants_trace
        self._who, self._tables = _names(asked.get("who")), _names(asked.get("tables"))
        if not self.is_let_in:
            self.is_let_in = True
            self.offer(self._header())

    def _knows_token(self, asked: dict[str, object]) -> bool:
        return self.is_let_in or hmac.compare_digest(str(asked.get("token")).encode(), self._token.encode())

    def send(self) -> None:
        """Send what waits, as much as the system takes without waiting."""
        if self._n_lost and not self._pending:
            self.offer(b"")
        with suppress(BlockingIOError):
            while self._pending and not self.is_gone:
                try:
                    sent = self.connection.send(self._pending[:PIECE])
                except BlockingIOError:
                    raise
                except OSError:
                    self.is_gone = True
                    return
                del self._pending[:sent]

    def close(self) -> None:
        self.is_gone = True
        self.connection.close()


def _names(given: object) -> frozenset[str] | None:
    return frozenset(map(str, given)) if isinstance(given, list) else None


class FileListener:
    """A file that takes every line, until the disk refuses one: that is logged, and the game goes on without the file."""

    wants_every = True
    wants_trace = False
    has_room = True

    def __init__(self, path: Path, file: IO[bytes]) -> None:
        self.path, self._file = path, file
        self._n_lost = 0
        self._is_refused = False

    def wants(self, moment: Moment) -> bool:
        return True

    def offer(self, line: bytes) -> None:
        if self._n_lost:
            line = dumped({"line": LOST, "count": self._n_lost}) + line
            self._n_lost = 0
        self._try(partial(self._file.write, line))

    def offer_in_full(self, moment: Moment) -> None:
        """A recording has the lines that everybody gets."""

    def lose(self, n_lines: int) -> None:
        self._n_lost += n_lines

    def send(self) -> None:
        """Hand what was written to the system."""
        self._try(self._file.flush)

    def close(self) -> None:
        if self._n_lost:
            self.offer(b"")
        self._try(self._file.flush)
        with suppress(OSError):
            self._file.close()

    def _try(self, write: Callable[[], object]) -> None:
        if self._is_refused:
            return
        try:
            write()
        except OSError as error:
            self._is_refused = True
            logging.getLogger("contextdb").error("%s: the recording ends here: %s", self.path, error.strerror)
