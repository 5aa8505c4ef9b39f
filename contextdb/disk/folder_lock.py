"""Turns of saves into one folder, and what killed saves left there. An edge: this touches the disk.

A save is made in a temporary file that its process holds a lock on. The system lets go of a lock when the process ends, however it
ends. So a temporary file that nobody holds belongs to a dead save, whatever the clock says, and the next save in that folder
deletes it. Names carry the machine, since locks of other machines may not be seen here.

POSIX: `flock` on the folder and on the temporary file. Windows: the turn is a file that the system deletes when its last handle is
closed, and a file that is open cannot be deleted. Where the disk cannot lock, saves go on without turns, and nothing is deleted.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

UNFINISHED = ".contextdb-unfinished.json"
"""Where it is, several files are being replaced in one step (`contextdb.disk.together`): their temporary files are still
wanted."""

_TURN = ".contextdb-turn"
_HELD = ".held"
_POLL_S = 0.005
_PATIENCE_S = 2.0
_MOST_TURN_S = 20.0
"""No save has a turn for so long: a file of a turn that is still there was left when the machine lost its power."""


@cache
def _machine() -> str:
    import hashlib
    import platform

    return hashlib.sha256(platform.node().encode()).hexdigest()[:8]


def temporary_name() -> str:
    """A new name for a temporary file or folder of this machine."""
    return f".contextdb-{_machine()}-{os.urandom(8).hex()}.tmp"


def is_temporary(name: str) -> bool:
    """Whether a file or folder of this name is a temporary one of this machine."""
    return name.startswith(f".contextdb-{_machine()}-") and name.endswith(".tmp") and not set(name) & set("/\\:")


@contextmanager
def folder_turn(folder: Path) -> Iterator[int | None]:
    """Wait until no other save replaces a file in this folder; gives a handle of the folder where there is one.

    A thread must not ask for the turn of a folder that it has.
    """
    handle = _turn(folder)
    try:
        yield handle if fcntl is not None else None
    finally:
        if handle is not None:
            with suppress(OSError):  # nothing was written to it
                _let_go(handle)


def _turn(folder: Path) -> int | None:
    if fcntl is None:
        return _turn_by_file(folder / _TURN)
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:  # a folder that may be written in and not be read
        return None
    with suppress(OSError):  # a disk that cannot lock
        fcntl.flock(handle, fcntl.LOCK_EX)
    return handle


def _let_go(handle: int) -> None:
    try:
        if fcntl is not None:
            fcntl.flock(handle, fcntl.LOCK_UN)  # closing is not enough where a process was forked meanwhile
    finally:
        os.close(handle)


def _turn_by_file(path: Path) -> int | None:
    """The turn as a file that goes with its handle; None where no file can be made."""
    flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_TEMPORARY", 0)
    began = time.monotonic()
    while True:
        try:
            return os.open(path, flags)
        except FileExistsError:
            if time.monotonic() > began + _MOST_TURN_S:
                with suppress(OSError):
                    path.unlink()
                return None
        except PermissionError:  # the file is just going, or the folder may not be written in
            if time.monotonic() > began + _PATIENCE_S:
                return None
        except OSError:
            return None
        time.sleep(_POLL_S)


def claim(handle: int) -> None:
    """Hold an open temporary file, so that nobody takes it for that of a dead save."""
    if fcntl is not None:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def temporary_folder(beside: Path) -> Iterator[Path]:
    """A folder in the folder `beside` for what is not finished. It goes at the end, or with the next save where the process is
    killed. Raises OSError where the folder cannot be made."""
    folder = beside / temporary_name()
    with folder_turn(beside):
        folder.mkdir()
        handle = _claimed_folder(folder)
    try:
        yield folder
    finally:
        if handle is not None:
            with suppress(OSError):
                os.close(handle)
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def growing_folder(growing: Path, whole: Path) -> Iterator[Path]:
    """A new folder that takes the name `whole` at the end, unless somebody else has done so, and is gone otherwise. Raises OSError
    where it cannot be made."""
    try:
        growing.mkdir()  # not the folders above: they are gone where the run has ended
        yield growing
        if not whole.exists():
            os.rename(growing, whole)
    finally:
        shutil.rmtree(growing, ignore_errors=True)


def _claimed_folder(folder: Path) -> int | None:
    try:
        if fcntl is None:
            return os.open(folder / _HELD, os.O_RDWR | os.O_CREAT | getattr(os, "O_TEMPORARY", 0))
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        return None
    claim(handle)
    return handle


# ---- what killed saves left


def sweep(folder: Path) -> int:
    """Delete the temporary files and folders of dead saves; gives how many."""
    with folder_turn(folder):
        return sweep_in_turn(folder)


def sweep_in_turn(folder: Path) -> int:
    """`sweep`, for whoever has the turn of the folder."""
    n_gone = 0
    with suppress(OSError):
        names = os.listdir(folder)
        if UNFINISHED in names:
            return 0
        for name in names:
            if is_temporary(name):
                n_gone += _is_gone(folder / name)
    return n_gone


def _is_gone(path: Path) -> bool:
    """Delete a temporary file or folder unless somebody holds it."""
    is_folder = path.is_dir() and not path.is_symlink()
    if fcntl is None:
        return _is_gone_on_windows(path, is_folder)
    with suppress(OSError):
        handle = os.open(path, (os.O_RDONLY if is_folder else os.O_RDWR) | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if is_folder:
                shutil.rmtree(path)
            else:
                path.unlink()
            return True
        finally:
            os.close(handle)
    return False


def _is_gone_on_windows(path: Path, is_folder: bool) -> bool:
    with suppress(OSError):
        if is_folder and not (path / _HELD).exists():
            shutil.rmtree(path)
            return True
        if not is_folder:
            path.unlink()  # refused while it is open
            return True
    return False
