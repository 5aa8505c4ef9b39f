"""The folder in which running games are met: one of the user's own, where nobody else may look.

On Unix it is `contextdb` in $XDG_RUNTIME_DIR, or `contextdb-UID` in the folder for temporary files, with mode 0700; one of another
owner, or that others may open, is refused. On Windows it lies in %LOCALAPPDATA%, which other users may not read.
"""

from __future__ import annotations

import errno
import os
import re
import stat
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from contextdb.cells.arguments import require_text
from contextdb.disk import path_in_quotes
from contextdb.errors import ContextError, Fault, FileError, Place, in_quotes

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
