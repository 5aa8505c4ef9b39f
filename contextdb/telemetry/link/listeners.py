"""Who listens to a game: each gets the lines that it wants, as fast as it reads and no faster.

A listener may send one line of JSON, and again whenever it wants other lines:

    {"format": 1, "token": "…", "every": true, "who": ["player"], "tables": ["locomotion"], "trace": true, "poses": true}

`every`: every question, not only the newest of each character and table. `trace`: every decision in full, and nothing else.
`poses`: poses too. Lines that a listener does not read in time are dropped, and the link sends their number; nothing here ever
waits for a listener.
"""

from __future__ import annotations

import hmac
import json
import logging
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import IO

from contextdb.telemetry.link.feed import Decisions, Moment
from contextdb.telemetry.link.lines import LOST, dumped

MOST_PENDING = 1 << 20
"""Bytes that wait for a listener that does not read; what would be more is dropped."""
MOST_REQUEST = 1 << 12
"""Bytes that a listener may send at once; one that sends more is disconnected."""
MOST_REQUESTS = 16
"""Lines that a listener may send at once."""
REQUEST_S = 5.0
"""A listener that has begun a line, or owes a token, must have sent the whole line in this time."""
STALLED_S = 60.0
"""A listener that reads nothing in this time, while lines wait for it, is disconnected."""
PIECE = 1 << 16


class Listener:
    """Takes lines, all of every moment unless it wants fewer; drops are counted, and reported before the next line."""

    wants_every = True
    wants_trace = wants_poses = False

    def __init__(self) -> None:
        self.n_lost = 0

    @property
    def has_room(self) -> bool:
        """Whether a line would not be dropped now."""
        return True

    def wants(self, moment: Moment) -> bool:
        """Whether a moment is among those that it wants."""
        return not moment.is_pose

    def take(self, moment: Moment, decisions: Decisions | None) -> None:
        """Take the line of a moment, or drop it."""
        if self.has_room:
            self.offer(moment.line(decisions))
        else:
            self.n_lost += 1

    def offer(self, line: bytes) -> None:
        """Take a line, or drop it."""
        raise NotImplementedError

    def send(self) -> None:
        raise NotImplementedError

    def _lost_line(self) -> bytes:
        """The line that reports drops; none without drops."""
        n_lost, self.n_lost = self.n_lost, 0
        return dumped({"line": LOST, "count": n_lost}) if n_lost else b""


class SocketListener(Listener):
    """A listener at the other end of a socket. `header` gives what it is sent first, and after it has lost lines."""

    def __init__(self, connection: socket.socket, token: str, header: Callable[[], bytes]) -> None:
        super().__init__()
        connection.setblocking(False)
        self.connection = connection
        self.wants_every = False
        self.is_gone = False
        self.is_let_in = not token
        self._header, self._token = header, token
        self._who: frozenset[str] | None = None
        self._tables: frozenset[str] | None = None
        self._sent_marks: set[object] = set()
        """What it was sent already, and need not be sent again."""
        self._request = b""
        self._pending = bytearray()
        self._waits_since_s = self._stalls_since_s = time.monotonic()
        if self.is_let_in:
            self.offer(header())

    @property
    def has_room(self) -> bool:
        return self.is_let_in and not self.is_gone and len(self._pending) < MOST_PENDING

    def wants(self, moment: Moment) -> bool:
        if self._who is not None and moment.who not in self._who:
            return False
        if moment.is_pose:
            return self.wants_poses
        if self.wants_trace:
            return moment.decision is not None
        return self._tables is None or moment.table is None or moment.table in self._tables

    def take(self, moment: Moment, decisions: Decisions | None) -> None:
        if not (self.wants_trace or moment.is_pose) or decisions is None or not self.has_room:
            super().take(moment, decisions)
            return
        for mark, line in moment.in_full(decisions):
            if mark is None or mark not in self._sent_marks:
                self._sent_marks |= set() if mark is None else {mark}
                self.offer(line)

    def offer(self, line: bytes) -> None:
        if not self.has_room:
            self.n_lost += self.is_let_in and not self.is_gone
            return
        if self.n_lost and not self._pending:
            self._sent_marks.clear()
            self._pending += self._lost_line() + self._header()
        self._pending += line

    def read(self) -> None:
        try:
            sent = self.connection.recv(MOST_REQUEST)
        except BlockingIOError:
            return
        except OSError:
            sent = b""
        if not self._request:
            self._waits_since_s = time.monotonic()
        *lines, self._request = (self._request + sent).split(b"\n")
        longest = max(map(len, (*lines, self._request)))
        self.is_gone = not sent or longest >= MOST_REQUEST or len(lines) > MOST_REQUESTS
        for line in lines:
            if not self.is_gone:
                self._take_request(line)

    def _take_request(self, line: bytes) -> None:
        """Take what it wants; one that sends anything else, or not the token, is disconnected."""
        try:
            request = json.loads(line)
        except (ValueError, RecursionError):
            request = None
        if not isinstance(request, dict) or not self._has_token(request):
            self.is_gone = True
            return
        self.wants_trace, self.wants_poses = request.get("trace") is True, request.get("poses") is True
        self.wants_every = request.get("every") is True or self.wants_trace
        self._who, self._tables = _names(request.get("who")), _names(request.get("tables"))
        if not self.is_let_in:
            self.is_let_in = True
            self.offer(self._header())

    def _has_token(self, request: dict[str, object]) -> bool:
        token = str(request.get("token")).encode("utf-8", "surrogatepass")
        return self.is_let_in or hmac.compare_digest(token, self._token.encode())

    def send(self) -> None:
        """Send what waits, as much as the system takes without waiting; find out whether it is too slow."""
        if self.n_lost and not self._pending:
            self.offer(b"")
        now_s = time.monotonic()
        if not self._pending:
            self._stalls_since_s = now_s
        with suppress(BlockingIOError):
            while self._pending and not self.is_gone:
                try:
                    n_sent = self.connection.send(self._pending[:PIECE])
                except BlockingIOError:
                    raise
                except OSError:
                    self.is_gone = True
                    return
                del self._pending[:n_sent]
                self._stalls_since_s = now_s
        owes_line = bool(self._request) or not self.is_let_in
        self.is_gone |= owes_line and now_s - self._waits_since_s > REQUEST_S
        self.is_gone |= bool(self._pending) and now_s - self._stalls_since_s > STALLED_S

    def close(self) -> None:
        self.is_gone = True
        self.connection.close()


def _names(given: object) -> frozenset[str] | None:
    return frozenset(map(str, given)) if isinstance(given, list) else None


class FileListener(Listener):
    """A file that takes every line, until the disk refuses one: that is logged, and the game goes on without the file."""

    def __init__(self, path: Path, file: IO[bytes]) -> None:
        super().__init__()
        self.path, self._file = path, file
        self._is_refused = False

    def offer(self, line: bytes) -> None:
        self._try(partial(self._file.write, self._lost_line() + line))

    def send(self) -> None:
        self._try(self._file.flush)

    def close(self) -> None:
        if self.n_lost:
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
