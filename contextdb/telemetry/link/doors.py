"""Where a game listens for who wants to watch it: a local socket, which only programs of the same user can connect to.

A Unix socket with mode 0600 where there are such; the system also says which user has connected. Elsewhere (Windows) a port of
127.0.0.1, and a file that only the user may read with the port and a token: who does not begin with the token is sent nothing.
"""

from __future__ import annotations

import errno
import json
import os
import re
import secrets
import socket
import stat
import struct
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from contextdb.cells.arguments import require_text
from contextdb.disk import path_in_quotes
from contextdb.errors import ContextError, Fault, FileError, Place, in_quotes

IS_UNIX = hasattr(socket, "AF_UNIX")
SOCKET, PORT = ".sock", ".port"
MOST_OF_A_NAME = 99
"""So many games of one name may run at once."""
MOST_PORT = 65535
MOST_FILE = 1 << 12
"""Bytes of a file with a port that are read."""
WAITING = 16
"""So many connections may wait to be taken."""
PATIENCE_S = 2.0
"""A game that has not taken a connection in this time is stopped, or has too many listeners."""


@dataclass(frozen=True, eq=False)
class Door:
    """A game that listens."""

    name: str
    path: Path
    server: socket.socket
    token: str
    """What a listener must begin with; "" where the system says who connects."""
    inode: int

    def close(self) -> None:
        self.server.close()
        with suppress(OSError), turn(self.path.parent):
            if os.lstat(self.path).st_ino == self.inode:
                self.path.unlink()


def opened(name: str) -> Door:
    """Listen under a name, or under it with a number, "game-2", where another game has it. Raises FileError where the folder is not
    this user's alone, or the system refuses."""
    folder = runtime_folder()
    try:
        with turn(folder):
            for number in range(1, MOST_OF_A_NAME + 1):
                own = name if number == 1 else f"{name}-{number}"
                path = folder / f"{own}{SOCKET if IS_UNIX else PORT}"
                if _is_free(path):
                    return _door(own, path)
    except OSError as error:
        why = f"the game cannot listen: {error.strerror or error}."
        raise FileError(Fault(why, "a folder for sockets, with a short path", place=Place(str(folder)))) from None
    raise ContextError(Fault(f"{MOST_OF_A_NAME} games are called {in_quotes(name)}.", "another name"))


def _door(name: str, path: Path) -> Door:
    """A socket that is a file; elsewhere a port of this machine, which the file names, with a word that only its readers know."""
    server = socket.socket(socket.AF_UNIX if IS_UNIX else socket.AF_INET, socket.SOCK_STREAM)
    token = "" if IS_UNIX else secrets.token_hex(32)
    try:
        server.bind(str(path) if IS_UNIX else ("127.0.0.1", 0))
        if IS_UNIX:
            os.chmod(path, 0o600)  # nobody can connect before it listens
        server.listen(WAITING)
        server.setblocking(False)
        if not IS_UNIX:
            handle = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
            with os.fdopen(handle, "w", encoding="ascii") as file:
                json.dump({"port": server.getsockname()[1], "token": token}, file)
        return Door(name, path, server, token, os.lstat(path).st_ino)
    except OSError:
        server.close()
        raise


def _is_free(path: Path) -> bool:
    """Whether nobody listens there; what a game that was killed left there is deleted, and nothing else, no link either."""
    if not os.path.lexists(path):
        return True
    if not _is_door(path):
        return False
    try:
        connected(path).close()
    except (ConnectionRefusedError, FileNotFoundError):
        with suppress(FileNotFoundError):
            path.unlink()
        return True
    except OSError:
        return False
    return False


def _is_door(path: Path) -> bool:
    """Whether this is what a game listens at: a socket, or the file of a port; of this user."""
    try:
        status = os.lstat(path)
    except OSError:
        return False
    is_own = not HAS_OWNERS or status.st_uid == os.getuid()
    return is_own and (stat.S_ISREG(status.st_mode) if path.suffix == PORT else stat.S_ISSOCK(status.st_mode))


def doors() -> Iterator[tuple[str, Path]]:
    """The name of each game that listens, and where; what killed games left is deleted."""
    folder = runtime_folder()
    with turn(folder):
        paths = [
            path for path in folder.iterdir() if path.suffix in (SOCKET, PORT) and NAME.fullmatch(path.stem) and _is_door(path)
        ]
        listening = [path for path in sorted(paths, key=lambda path: path.stem) if not _is_free(path)]
    for path in listening:
        yield path.stem, path


def connected(path: Path) -> socket.socket:
    """A connection to a game, which may wait for `PATIENCE_S`. Raises OSError where nobody listens there: ConnectionRefusedError,
    FileNotFoundError; or the system refuses."""
    connection = socket.socket(socket.AF_INET if path.suffix == PORT else socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        connection.settimeout(PATIENCE_S)
        address = ("127.0.0.1", _port(path)[0]) if path.suffix == PORT else str(path)
        end_s = time.monotonic() + PATIENCE_S
        while True:
            try:
                connection.connect(address)
                return connection
            except BlockingIOError:  # too many wait to be taken
                if time.monotonic() > end_s:
                    raise
                time.sleep(0.01)
    except BaseException:
        connection.close()
        raise


def token_of(path: Path) -> str:
    """What a listener must begin with."""
    return _port(path)[1] if path.suffix == PORT else ""


def _port(path: Path) -> tuple[int, str]:
    """Port and token of a file; OSError for one that is not whole, or not this user's alone."""
    with open(os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)), "rb") as file:
        status = os.fstat(file.fileno())
        is_own = not HAS_OWNERS or (status.st_uid == os.getuid() and not status.st_mode & 0o077)
        if not is_own or not stat.S_ISREG(status.st_mode):
            raise PermissionError(f"{path} is not this user's alone")
        raw = file.read(MOST_FILE)
    try:
        content = json.loads(raw)
    except (ValueError, RecursionError):
        content = None
    port, token = (content.get("port"), content.get("token")) if isinstance(content, dict) else (None, None)
    if not isinstance(port, int) or not 0 < port <= MOST_PORT or not isinstance(token, str):
        raise OSError(f"{path} is not the file of a listening game")
    return port, token


def is_same_user(connection: socket.socket) -> bool:
    """Whether the program at the other end is the same user's; True where the system does not say."""
    peer = getattr(socket, "SO_PEERCRED", None)
    if peer is None or connection.family != getattr(socket, "AF_UNIX", None):
        return True
    _, uid, _ = struct.unpack("3i", connection.getsockopt(socket.SOL_SOCKET, peer, struct.calcsize("3i")))
    return bool(uid == os.getuid())


# ---- the folder in which running games are met: one of the user's own, where nobody else may look. On Unix it is `contextdb`
# in $XDG_RUNTIME_DIR, or `contextdb-UID` in the folder for temporary files, with mode 0700; one of another owner, or that
# others may open, is refused. On Windows it lies in %LOCALAPPDATA%, which other users may not read

HAS_OWNERS = hasattr(os, "getuid")
"""Whether files have an owner and a mode that say who may open them."""
MOST_NAME = 40
TURN_S = 5.0
"""A program that holds the folder longer is stopped."""
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def require_name(name: object) -> str:
    """The name of a game. Raises ContextError where it is none: what could be a path, or part of one, is refused."""
    text = require_text(name, "name")
    if NAME.fullmatch(text) and len(text) <= MOST_NAME and not text.endswith("."):
        return text
    mend = re.sub(r"[^A-Za-z0-9._-]+", "-", text).strip("-._")[:MOST_NAME].rstrip("-.")
    accepted = f"up to {MOST_NAME} letters, digits and . _ -, the first a letter or digit"
    raise ContextError(Fault(f"{in_quotes(text)} is not the name of a game.", accepted, in_quotes(mend) if mend else ""))


def runtime_folder() -> Path:
    """The folder, made where it is missing. Raises FileError where it cannot be made, or is not this user's alone."""
    folder = _place()
    try:
        if HAS_OWNERS:
            with suppress(FileExistsError):
                folder.mkdir(mode=0o700)
        else:
            folder.mkdir(parents=True, exist_ok=True)
        status = os.lstat(folder)
    except OSError as error:
        why = f"the folder for running games cannot be made: {error.strerror}."
        raise FileError(Fault(why, "a folder that may be written to", place=Place(str(folder)))) from None
    _require_own(folder, status)
    return folder


def _place() -> Path:
    if not HAS_OWNERS:
        return Path(os.environ.get("LOCALAPPDATA") or tempfile.gettempdir()) / "contextdb" / "live"
    given = os.environ.get("XDG_RUNTIME_DIR", "")
    if os.path.isabs(given) and os.path.isdir(given):
        status = os.stat(given)
        if status.st_uid == os.getuid() and not status.st_mode & 0o022:  # nobody else can exchange the folder in it
            return Path(given) / "contextdb"
    return Path(tempfile.gettempdir()) / f"contextdb-{os.getuid()}"


def _require_own(folder: Path, status: os.stat_result) -> None:
    """Raise FileError unless a folder is one, of this user, that nobody else may open."""
    place = Place(str(folder))
    if not stat.S_ISDIR(status.st_mode):
        raise FileError(Fault("the folder for running games is not a folder.", "a folder", "to delete what is there", place))
    if not HAS_OWNERS:
        return
    if status.st_uid != os.getuid():
        accepted = "a folder of yours"
        raise FileError(Fault("the folder for running games belongs to another user.", accepted, "to set XDG_RUNTIME_DIR", place))
    if status.st_mode & 0o077:
        mend = f"to run: chmod 700 {path_in_quotes(folder)}"
        raise FileError(Fault("others may open the folder for running games.", "a folder with mode 0700", mend, place))


@contextmanager
def turn(folder: Path) -> Iterator[None]:
    """One process at a time makes or deletes what is in the folder, where the system has such locks. Raises OSError where the
    turn does not come."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        end_s = time.monotonic() + TURN_S
        while True:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if time.monotonic() > end_s:
                    raise TimeoutError(errno.ETIMEDOUT, "another program holds the folder") from None
                time.sleep(0.01)
        yield
    finally:
        os.close(handle)
