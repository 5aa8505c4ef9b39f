"""Bytes of files: read whole, written atomically. An edge: this touches the disk.

A save writes a temporary file beside the old one, has the system put it on the disk, and renames it. So at any moment, killed or
out of power, the file is wholly the old one or wholly the new one. What the system refuses is a `FileError` that says what to do.
"""

from __future__ import annotations

import errno
import os
import secrets
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from contextdb.errors import Fault, FileError, Place, in_quotes, nearest

TABLE_SUFFIXES = (".csv", ".parquet")
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def read_bytes(path: str | Path) -> bytes:
    """The bytes of a file.

    Raises
    ------
    FileError
        It is missing (with the nearest name there is), a folder, no plain file, or may not be read.
    """
    file = Path(path)
    with _refused(file, _why_unread):
        mode = file.stat().st_mode
        if stat.S_ISDIR(mode):
            raise FileError(_is_folder(file))
        if not stat.S_ISREG(mode):  # reading a pipe could wait for ever
            raise FileError(Fault("this is no plain file.", "a file", place=Place(str(file))))
        return file.read_bytes()


def write_atomic(path: str | Path, data: bytes | Iterable[bytes]) -> None:
    """Replace a file's bytes, given whole or in pieces, in one step, or make the file.

    A link stays a link, and the file it leads to is replaced; mode and, where that is permitted, owner stay.

    Raises
    ------
    FileError
        The file is read-only, the folder missing or not permitted, the disk full. The old file is then whole, and no temporary file
        stays.
    """
    file = Path(path)
    with _refused(file, lambda error, at: _why_unwritten(error, at, len(data) if isinstance(data, bytes) else None)):
        target = Path(os.path.realpath(file))
        old = target.stat() if target.exists() else None
        if old is not None:
            _require_writable(file, old)
        temporary = target.with_name(f".contextdb-{secrets.token_hex(8)}.tmp")
        try:
            _write_new(temporary, data, old)
            os.replace(temporary, target)
        except BaseException:  # also when the user interrupts
            with suppress(OSError):
                temporary.unlink()
            raise
        _sync_folder(target.parent)


def make_folder(folder: Path) -> None:
    """Make a folder and those above it, where they are not there yet.

    Raises
    ------
    FileError
        It is a file, or may not be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        why = "it is a file" if isinstance(error, (FileExistsError, NotADirectoryError)) else error.strerror
        raise FileError(Fault(f"the folder cannot be made: {why}.", "a folder", place=Place(str(folder)))) from None


def _require_writable(file: Path, old: os.stat_result) -> None:
    """Refuse what a rename would replace all the same: a folder, a device, a file that is marked read-only."""
    if stat.S_ISDIR(old.st_mode):
        raise FileError(_is_folder(file))
    if not stat.S_ISREG(old.st_mode):
        raise FileError(Fault("this is no plain file.", "a file", place=Place(str(file))))
    if not old.st_mode & (stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH):
        mend = "to check it out of version control, or to make it writable"
        raise FileError(Fault("the file is marked read-only.", "a file that may be written", mend, Place(str(file))))


def _write_new(temporary: Path, data: bytes | Iterable[bytes], old: os.stat_result | None) -> None:
    """Write a file that is not there yet and have the system put it on the disk."""
    handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    try:
        if old is not None:
            with suppress(OSError, AttributeError):  # only root may give a file away; Windows has no chown
                os.chown(temporary, old.st_uid, old.st_gid)
            os.chmod(temporary, stat.S_IMODE(old.st_mode))
        for piece in [data] if isinstance(data, bytes) else data:
            rest = memoryview(piece)
            while rest:
                rest = rest[os.write(handle, rest) :]
        os.fsync(handle)
    finally:
        os.close(handle)


def _sync_folder(folder: Path) -> None:
    """Have the system put the new name on the disk too, where it can; the file is whole either way."""
    if os.name == "nt":
        return
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


# ---- what the system refuses


@contextmanager
def _refused(file: Path, why: Callable[[OSError, Path], Fault]) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise FileError(why(error, file)) from None
    except ValueError as error:  # a path with a NUL character
        raise FileError(Fault(f"this is no path: {error}.", "a path", place=Place(str(file)))) from None


def _is_folder(folder: Path) -> Fault:
    tables = sorted(p for p in folder.iterdir() if p.suffix.lower() in TABLE_SUFFIXES)
    return Fault("this is a folder.", "one file", path_in_quotes(tables[0]) if tables else "", Place(str(folder)))


def _why_unread(error: OSError, file: Path) -> Fault:
    place = Place(str(file))
    if isinstance(error, FileNotFoundError):
        return _missing(file)
    if isinstance(error, NotADirectoryError):
        return Fault(f"{path_in_quotes(file.parent)} is no folder.", "a file in a folder", place=place, rule="no-such-path")
    if isinstance(error, PermissionError):
        return Fault("the file may not be read.", "a file that you have the permission to read", place=place)
    return Fault(f"the file cannot be read: {error.strerror}.", place=place)


def _missing(file: Path) -> Fault:
    """There is no such file; the nearest name in its folder, or, if the folder is missing too, the nearest folder."""
    place = Place(str(file))
    if file.is_symlink():
        return Fault(
            f"this is a link to {path_in_quotes(os.readlink(file))}, which is not there.", place=place, rule="no-such-path"
        )
    part = file
    while not part.parent.is_dir() and part.parent != part:
        part = part.parent
    what = "file" if part is file else f"folder {path_in_quotes(part)}"
    with suppress(OSError):
        near = nearest(part.name, os.listdir(part.parent))
        mend = path_in_quotes(part.with_name(near)) if near else ""
        return Fault(f"there is no such {what}.", mend=mend, place=place, rule="no-such-path")
    return Fault(f"there is no such {what}.", place=place, rule="no-such-path")


def _why_unwritten(error: OSError, file: Path, size: int | None) -> Fault:
    place, folder = Place(str(file)), path_in_quotes(Path(os.path.realpath(file)).parent)
    kept = " The old file is as it was." if os.path.exists(file) else ""
    if error.errno in _FULL:
        return Fault(
            f"the disk is full.{kept}",
            "more room" if size is None else f"{size:,} free bytes",
            "to free some space and save again",
            place,
        )
    if error.errno == errno.EROFS:
        return Fault(f"the folder {folder} is on a disk that cannot be written.{kept}", mend="to save elsewhere", place=place)
    if isinstance(error, (FileNotFoundError, NotADirectoryError)):
        return Fault(f"there is no folder {folder}.", "a folder that is there", place=place, rule="no-such-path")
    if isinstance(error, PermissionError):
        busy = ", or another program has the file open" if os.name == "nt" else ""
        return Fault(f"the folder {folder} may not be written in{busy}.{kept}", mend="to save elsewhere", place=place)
    return Fault(f"the file cannot be written: {error.strerror}.{kept}", mend="to save elsewhere", place=place)


def path_in_quotes(path: str | Path) -> str:
    """A path in quotes, in full: half a path is no help."""
    return in_quotes(str(path), most=4096)
