"""Files of our own in the folder of a project: locks, journals, caches. An edge: this touches the disk.

They are in folders that git passes over, but a stranger may have put anything there. So a link, a pipe, a device, a folder in the
place of a file, a second name of some other file, and a file of somebody else are refused: nothing is read from them or written
into them, and nothing waits for them. `path` is always a file directly in such a folder.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from contextdb.disk import Data, make_folder, write_atomic
from contextdb.errors import Fault, FileError, Place

FOLDER = ".contextdb-journal"
"""The folder beside tables, of what an editor and an import keep."""
NOT_OURS = "not-ours"
"""The rule of what is said of a file that is refused."""
_IGNORE = ".gitignore"
_FLAGS = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
_JUNCTION = 0xA0000003


def make_own_folder(folder: Path, is_ignored: bool = True) -> None:
    """Make a folder of our own, which git passes over, unless it is there. Raises FileError where the name is taken by something
    else, or it may not be made."""
    if not is_own_folder(folder):
        make_folder(folder)
        is_own_folder(folder)
    if is_ignored and not os.path.lexists(folder / _IGNORE):
        write_own(folder / _IGNORE, b"*\n", syncs=False)


def has_own(path: Path) -> bool:
    """Whether there is a file of our own. Raises FileError where something else has the name."""
    if not is_own_folder(path.parent):
        return False
    try:
        with _placed(path):
            _require_own(path, os.lstat(path))
    except FileNotFoundError:
        return False
    return True


def read_own(path: Path) -> bytes:
    """The bytes of a file of our own. Raises FileError where it is none; FileNotFoundError where it is missing."""
    with _placed(path), os.fdopen(open_own(path, os.O_RDONLY), "rb") as file:
        return file.read()


def write_own(path: Path, data: Data, syncs: bool = True) -> None:
    """Replace a file of our own in one step, or make it. Raises FileError where something else has the name, or the disk
    refuses."""
    has_own(path)
    write_atomic(path, data, syncs=syncs)


def append_own(path: Path, line: bytes) -> None:
    """Add bytes to a file of our own that is there. Raises FileError or OSError."""
    descriptor = open_own(path, os.O_WRONLY | os.O_APPEND)
    try:
        while line:
            line = line[os.write(descriptor, line) :]
    finally:
        os.close(descriptor)


def cut_own(path: Path, n_bytes: int) -> None:
    """Cut a file of our own after some bytes. Raises FileError or OSError."""
    descriptor = open_own(path, os.O_RDWR)
    try:
        os.ftruncate(descriptor, n_bytes)
    finally:
        os.close(descriptor)


def rewrite_own(descriptor: int, data: bytes) -> None:
    """Put bytes in the place of all that an open file of our own holds. Raises OSError."""
    os.ftruncate(descriptor, 0)
    os.lseek(descriptor, 0, os.SEEK_SET)
    os.write(descriptor, data)


def open_own(path: Path, flags: int, makes: bool = False, is_anybodys: bool = False) -> int:
    """A handle of a file of our own; with `makes` it is made where it is missing, with `is_anybodys` the owner may be another.
    Raises FileError where something else has the name; OSError where the system refuses."""
    if not is_own_folder(path.parent):
        raise FileNotFoundError(path)
    with suppress(FileNotFoundError):  # before it is opened: to open a device may do something, and Windows follows links
        _require_own(path, os.lstat(path), is_anybodys)
    if makes:
        with suppress(FileExistsError):
            return os.open(path, flags | os.O_CREAT | os.O_EXCL | _FLAGS, 0o666)
    descriptor = os.open(path, flags | _FLAGS)
    try:
        _require_own(path, os.fstat(descriptor), is_anybodys)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def remove_own(path: Path, is_anybodys: bool = False) -> None:
    """Remove a file of our own, if there is one. Raises FileError where something else has the name; OSError where the system
    refuses."""
    if is_own_folder(path.parent):
        with suppress(FileNotFoundError):
            _require_own(path, os.lstat(path), is_anybodys)
            path.unlink()


def move_own(path: Path, to: Path) -> None:
    """Give a file of our own another name in its folder. Raises FileError where its folder is not ours; OSError."""
    if has_own(path):
        os.replace(path, to)


def link_own(file: Path, path: Path) -> None:
    """Keep a file that some table has under a second name of our own. Raises FileError where the folder is not ours; OSError where
    the disk has no links."""
    remove_second_name(path)
    os.link(os.path.realpath(file), path)


def remove_second_name(path: Path) -> None:
    """Remove what `link_own` kept, if anything. Raises as `remove_own`."""
    remove_own(path, is_anybodys=True)


def read_second_name(path: Path) -> bytes:
    """The bytes of what `link_own` kept. Raises FileError where it is none; FileNotFoundError where it is missing."""
    with _placed(path), os.fdopen(open_own(path, os.O_RDONLY, is_anybodys=True), "rb") as file:
        return file.read()


def remove_own_folder(folder: Path) -> None:
    """Remove a folder of our own where it is empty. Raises OSError."""
    os.rmdir(folder)


def own_names(folder: Path) -> list[str]:
    """The names in a folder of our own, sorted; none where it is missing or not ours."""
    with suppress(OSError):  # FileError is one
        if is_own_folder(folder):
            return sorted(os.listdir(folder))
    return []


def is_own_folder(folder: Path) -> bool:
    """Whether a folder is there. Raises FileError where something else has its name. It may be another's: who shares a drive shares
    the locks; what matters is whose the files are."""
    try:
        status = os.lstat(folder)
    except (FileNotFoundError, NotADirectoryError):
        return False
    if _is_link(status) or not stat.S_ISDIR(status.st_mode):
        what = "a link" if _is_link(status) else "no folder"
        raise _refused(folder, f"this is {what}, and is not used.", "a folder")
    return True


def _require_own(path: Path, status: os.stat_result, is_anybodys: bool = False) -> None:
    """Raise FileError unless this is a plain file of this user that has no other name."""
    if _is_link(status) or not stat.S_ISREG(status.st_mode):
        what = "a link" if _is_link(status) else "a folder" if stat.S_ISDIR(status.st_mode) else "not a regular file"
        raise _refused(path, f"this is {what}, and is not used.", "a file")
    if is_anybodys:
        return
    if hasattr(os, "geteuid") and status.st_uid != os.geteuid():
        raise _refused(path, "this belongs to another user, and is not used.", "a file of yours")
    if status.st_nlink > 1:
        raise _refused(path, "this is a second name of another file, and is not used.", "a file of its own")


def _is_link(status: os.stat_result) -> bool:
    return stat.S_ISLNK(status.st_mode) or getattr(status, "st_reparse_tag", 0) == _JUNCTION


def _refused(path: Path, problem: str, accepted: str) -> FileError:
    return FileError(Fault(problem, accepted, "to remove it", Place(str(path)), NOT_OURS))


@contextmanager
def _placed(path: Path) -> Iterator[None]:
    """Turn what the system refuses into a FileError at the path, but for a file that is missing."""
    try:
        yield
    except (FileError, FileNotFoundError):
        raise
    except OSError as error:
        fault = Fault(f"the file cannot be read: {error.strerror}.", place=Place(str(path)))
        raise FileError(fault, errno=error.errno) from None
