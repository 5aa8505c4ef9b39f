"""The other end of a link: which games run, and the lines of one of them."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from contextdb.errors import ContextDBError, Fault, Place, in_quotes, mend_for, some
from contextdb.telemetry.link.doors import connected, doors, token_of
from contextdb.telemetry.link.lines import BONES, FORMAT, HEADER, MOST_BYTES, POSE, Line, dumped, read_line

PIECE = 1 << 16
HEADER_S = 5.0
"""A game that has not sent its header in this time is stopped."""


@dataclass(frozen=True)
class Wanted:
    """What a listener asks for; nobody and no table named: all."""

    who: Sequence[str] = ()
    tables: Sequence[str] = ()
    every: bool = False
    """Every question, not only the newest of each character and table."""
    trace: bool = False
    """Every decision in full, as a row of a recorded session, and nothing else."""
    poses: bool = False
    """Poses too, of a game that publishes them."""

    def takes(self, line: Line) -> bool:
        """Whether a line is requested: a game written in C sends all of them."""
        if self.who and "who" in line and line["who"] not in self.who:
            return False
        if line["line"] in (BONES, POSE):
            return self.poses
        return not self.tables or "table" not in line or line["table"] in self.tables


def hear(path: Path, wanted: Wanted = Wanted()) -> Hearing:
    """Listen to a game. Raises OSError where it is not there, or does not answer; ContextDBError where what it sends is not the
    lines of a link, or of another format."""
    return Hearing(path, connected(path), wanted)


class Hearing:
    """The lines of a game. `header` is the first of them."""

    def __init__(self, path: Path, connection: socket.socket, wanted: Wanted) -> None:
        self._connection = connection
        self._place = Place(str(path))
        self._wanted = wanted
        self._rest = bytearray()
        self._waiting: list[tuple[bytes, Line]] = []
        try:
            connection.settimeout(HEADER_S)
            connection.sendall(_request(wanted, token_of(path)))
            self.header, self.raw_header = self._first()
            connection.settimeout(None)
        except BaseException:
            connection.close()
            raise

    def batches(self) -> Iterator[list[tuple[bytes, Line]]]:
        """Lines as they are sent, with their bytes, those that came together in one list; ends when the game does."""
        batch, self._waiting = self._waiting, []
        while True:
            if batch:
                yield batch
            try:
                sent = self._connection.recv(PIECE)
            except ConnectionError:
                sent = b""
            if not sent:
                return
            batch = self._lines(sent)

    def close(self) -> None:
        """Hang up; a thread that waits for lines is woken by it, and sees the end."""
        with suppress(OSError):  # the game has hung up already
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()

    def __enter__(self) -> Hearing:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _first(self) -> tuple[Line, bytes]:
        end_s = time.monotonic() + HEADER_S
        while not self._waiting:
            self._connection.settimeout(max(end_s - time.monotonic(), 0.001))
            sent = self._connection.recv(PIECE)
            if not sent:
                raise ConnectionResetError("it hung up")
            self._waiting = self._lines(sent)
        raw, header = self._waiting.pop(0)
        require_header(header, self._place)
        return header, raw

    def _lines(self, sent: bytes) -> list[tuple[bytes, Line]]:
        self._rest += sent
        whole: list[bytes] = []
        if b"\n" in sent:
            *whole, rest = bytes(self._rest).split(b"\n")
            self._rest = bytearray(rest)
        if len(self._rest) > MOST_BYTES:
            raise ContextDBError(Fault("a line of the game does not end.", "lines of JSON", place=self._place))
        try:
            lines = [(raw + b"\n", read_line(raw)) for raw in whole]
            return [(raw, line) for raw, line in lines if self._wanted.takes(line)]
        except ValueError as error:
            raise ContextDBError(Fault(f"a line of the game cannot be read: {error}", place=self._place)) from None


def require_header(line: Line, place: Place) -> None:
    """Raise ContextDBError for a first line that is no header of this format."""
    if line["line"] != HEADER:
        raise ContextDBError(Fault("the first line is not the header of a link.", 'a line with "line": "header"', place=place))
    if line["format"] != FORMAT:
        problem = f"the lines are of format {line['format']}; this contextdb reads format {FORMAT}."
        raise ContextDBError(Fault(problem, f"format {FORMAT}", place=place))


def _request(wanted: Wanted, token: str) -> bytes:
    request: Line = {"format": FORMAT, "every": wanted.every}
    request |= {"token": token} if token else {}
    request |= {"who": list(wanted.who)} if wanted.who else {}
    request |= {"tables": list(wanted.tables)} if wanted.tables else {}
    request |= {"trace": True} if wanted.trace else {}
    request |= {"poses": True} if wanted.poses else {}
    return dumped(request)


@dataclass(frozen=True)
class Game:
    """A game that can be listened to."""

    name: str
    path: Path
    header: Line


def games() -> list[Game]:
    """The games that run now, by name. One that does not answer is left out."""
    games = []
    for name, path in doors():
        try:
            with hear(path) as hearing:
                games.append(Game(name, path, hearing.header))
        except (OSError, ContextDBError):
            continue
    return games


def the_game(name: str | None) -> tuple[str, Path]:
    """The game that is meant, with its door: the one of a name, or the only one that runs.

    Raises ContextDBError for none, or several.
    """
    if name is not None:
        path = dict(doors()).get(name)
        if path is None:
            raise no_game(name, games())
        return name, path
    running = games()
    if not running:
        raise no_game(None, running)
    if len(running) > 1:
        raise ContextDBError(Fault("several games are running.", some([game.name for game in running]), "to name one"))
    return running[0].name, running[0].path


def no_game(name: str | None, running: Sequence[Game]) -> ContextDBError:
    """The error where a game that is requested does not run."""
    names = [game.name for game in running]
    if name is None:
        return ContextDBError(Fault("no game is running.", 'a game that calls contextdb.link("game")'))
    problem = f"no game {in_quotes(name)} is running{'' if names else ', nor any other'}."
    return ContextDBError(Fault(problem, some(names) if names else "", mend_for(name, names)))
