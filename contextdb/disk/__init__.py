"""Bytes of files: read whole, written atomically. An edge: this touches the disk.

A save writes a temporary file next to the old one, has the system put it on the disk, and renames it. So at any moment, killed or
out of power, the file is wholly the old one or wholly the new one. What the system refuses is a `FileError` that says what to do.

Saves into one folder take turns for the moment in which they look at the old file and replace it (`contextdb.disk.folder_lock`), so
that no save writes over another one that it has not seen. Whoever has the turn deletes what killed saves left there.
"""

from __future__ import annotations

import errno
import fnmatch
import os
import re
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from contextdb.disk.boundary import ACTORS_SUFFIX as ACTORS_SUFFIX
from contextdb.disk.boundary import CASES_SUFFIX as CASES_SUFFIX
from contextdb.disk.boundary import GAPS_SUFFIX as GAPS_SUFFIX
from contextdb.disk.boundary import NOTES_SUFFIX as NOTES_SUFFIX
from contextdb.disk.boundary import inside, require_companion_inside
from contextdb.disk.boundary import real_path as real_path
from contextdb.disk.folder_lock import claim, folder_turn, sweep_in_turn, temporary_name
from contextdb.errors import ContextDBError, Fault, FileError, Place, in_quotes, nearest

TABLE_SUFFIXES = (".csv", ".parquet")
TENSORS_SUFFIX = ".safetensors"
CONTEXT_SUFFIXES = (*TABLE_SUFFIXES, ".jsonl")
"""What files of contexts end in: tables, and the lines of a link (see `contextdb.telemetry.link`)."""
MOST_PATTERNS = 64
_CHOICE = re.compile(r"\{([^{}/]*,[^{}/]*)\}")
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_BINARY = getattr(os, "O_BINARY", 0)
_refusals: list[str] = []
"""Why this process writes nothing, where it was told so."""
_AT_ONCE = getattr(os, "O_NONBLOCK", 0)
"""To open a pipe does not wait for its other end."""

Data = bytes | Iterable[bytes | memoryview]

Was = bytes | Literal["any"] | None
"""What a file must still hold when it is replaced; None: it must not be there."""


def read_bytes(path: str | Path) -> bytes:
    """The bytes of a file. Raises FileError where it is missing (with the nearest name there is), a folder, no plain file, may not
    be read, or is a companion of a table and a link out of its project."""
    file = Path(path)
    with _refused(file, _why_unread):
        require_companion_inside(file)
        _require_regular(file, file.stat())
        with os.fdopen(os.open(file, os.O_RDONLY | _AT_ONCE | _BINARY), "rb") as opened:
            _require_regular(file, os.fstat(opened.fileno()))
            return opened.read()


def refuse_writing(why: str) -> None:
    """Have this process write no file from now on: whoever wants to gets a FileError that says why."""
    _refusals[:] = [why]


def names_a_table(name: str) -> bool:
    """Whether a file of this name in a folder of tables is a table: no saved contexts, notes or gaps, and nothing hidden, as macOS
    and editors put next to a file."""
    folded = name.lower()
    is_companion = folded.endswith((CASES_SUFFIX, NOTES_SUFFIX, GAPS_SUFFIX))
    return folded.endswith(TABLE_SUFFIXES) and not is_companion and not folded.startswith(".")


def write_atomic(path: str | Path, data: Data, was: Was = "any", syncs: bool = True) -> bool:
    """Replace a file's bytes, given whole or in pieces, in one step, or make the file. A link stays a link, and the file it leads
    to is replaced; mode and, where that is permitted, owner stay. A pipe, a terminal or another device is written into.

    Gives whether the file was written: False where it is not as `was` says, these bytes or, for None, missing. `syncs=False` does
    not wait until the bytes are on the disk: for what can be computed again. Raises FileError where the file is read-only, the
    folder missing or not permitted, or the disk full; the old file is then whole, and no temporary file stays.
    """
    file = Path(path)
    require_companion_inside(file)
    if is_stream(file):
        _write_into(file, data)
        return True
    with refused_writing(file, data), staged(file, data, syncs) as new, folder_turn(new.target.parent) as folder:
        if not is_still(new.target, was):
            return False
        new.replace()
        sync_folder(folder)
        return True


def is_stream(path: Path) -> bool:
    """Whether a path is that of a pipe, a terminal or another device that takes bytes one after another."""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return False
    return stat.S_ISCHR(mode) or stat.S_ISFIFO(mode)


def require_allowed(file: Path) -> None:
    """Raise FileError where this process writes nothing."""
    if _refusals:
        raise FileError(Fault(f"nothing is written: {_refusals[0]}", "another way to start it", place=Place(str(file))))


def is_still(file: Path, was: Was) -> bool:
    """Whether a file holds what it is said to hold. Whoever asks has the turn of its folder."""
    if was == "any":
        return True
    try:
        return file.read_bytes() == was
    except FileNotFoundError:
        return was is None


@dataclass
class Staged:
    """New bytes of a file, in a temporary file next to it that this process holds."""

    target: Path
    temporary: Path
    handle: int

    def close(self) -> None:
        """Let go of the temporary file, before it takes its name: for whoever has the turn of the folder."""
        if self.handle >= 0:
            handle, self.handle = self.handle, -1
            os.close(handle)

    def replace(self) -> None:
        """Take the name, for whoever has the turn of the folder."""
        self.close()
        os.replace(self.temporary, self.target)


@contextmanager
def staged(file: Path, data: Data, syncs: bool = True, folder: Path | None = None) -> Iterator[Staged]:
    """New bytes next to a file, or in another folder, not yet under its name; gone at the end where they did not take it. Raises
    OSError or FileError where the file may not be replaced, or the disk refuses."""
    require_allowed(file)
    target = real_path(file)
    old = target.stat() if target.exists() else None
    if old is not None:
        _require_writable(file, old)
    place = target.parent if folder is None else folder
    temporary = place / temporary_name()
    with folder_turn(place):  # so that nobody sees the file before it is held
        if syncs:  # a cache is swept by whoever prunes it: its folder may be long
            sweep_in_turn(place)
        new = Staged(target, temporary, os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _BINARY, 0o666))
        claim(new.handle)
    try:
        _fill(new, data, old, syncs)
        yield new
    finally:  # also when the user interrupts
        with suppress(OSError):
            new.close()
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def make_folder(folder: Path) -> None:
    """Make a folder and those above it, where they are missing yet. Raises FileError where it is a file, or may not be made."""
    require_allowed(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        why = "it is a file" if isinstance(error, (FileExistsError, NotADirectoryError)) else error.strerror
        fault = Fault(f"the folder cannot be made: {why}.", "a folder", place=Place(str(folder)))
        raise FileError(fault, errno=error.errno) from None


def remove(path: Path) -> None:
    """Remove a file, or a link and not what it leads to; nothing where there is none. Raises FileError where the system refuses."""
    require_allowed(path)
    with refused_writing(path, b""):
        path.unlink(missing_ok=True)


def _require_regular(file: Path, status: os.stat_result) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise FileError(_is_folder(file))
    if not stat.S_ISREG(status.st_mode):  # reading a pipe could wait for ever
        raise FileError(Fault("this is not a regular file.", "a file", place=Place(str(file))))


def _require_writable(file: Path, old: os.stat_result) -> None:
    """Refuse what a rename would replace all the same: a folder, a device, a file that is marked read-only."""
    _require_regular(file, old)
    if not old.st_mode & (stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH):
        mend = "to check it out of version control, or to make it writable"
        raise FileError(Fault("the file is marked read-only.", "a file that may be written", mend, Place(str(file))))


def _fill(new: Staged, data: Data, old: os.stat_result | None, syncs: bool) -> None:
    """Write a temporary file and have the system put it on the disk."""
    if old is not None:
        with suppress(OSError, AttributeError):  # only root may give a file away; Windows has no chown
            os.chown(new.temporary, old.st_uid, old.st_gid)
        os.chmod(new.temporary, stat.S_IMODE(old.st_mode))
    _write_all(new.handle, data)
    if syncs:
        os.fsync(new.handle)


def _write_all(handle: int, data: Data) -> None:
    for piece in [data] if isinstance(data, bytes) else data:
        rest = memoryview(piece)
        while rest:
            rest = rest[os.write(handle, rest) :]


def _write_into(file: Path, data: Data) -> None:
    try:
        handle = os.open(file, os.O_WRONLY | _BINARY)
        try:
            _write_all(handle, data)
        finally:
            os.close(handle)
    except BrokenPipeError:  # a reader that has seen enough, as `head`
        raise
    except OSError as error:
        problem = f"it cannot be written into: {error.strerror}."
        raise FileError(Fault(problem, "a file, or a pipe that is read", place=Place(str(file))), errno=error.errno) from None


def sync_folder(folder: int | None) -> None:
    """Have the system put a new name on the disk too, where it can; the file is whole either way."""
    if folder is not None:
        with suppress(OSError):
            os.fsync(folder)


def matching(folder: Path, pattern: str) -> list[Path]:
    """The files below a folder that fit a pattern, sorted; the suffix of a file may be in capitals where the pattern's is not.
    `{bvh,fbx}` in it fits each of these.

    Raises ValueError or NotImplementedError where it is no pattern, FileError where a link leads out of the folder.
    """
    paths: set[Path] = set()
    for plain in patterns_of(pattern):
        for n_parts in range(1, len(parts := Path(plain).parts)):
            if "*" not in "".join(parts[:n_parts]):  # before what is behind a link is listed
                inside(folder.joinpath(*parts[:n_parts]), folder)
        paths.update(folder.glob(_of_any_case(plain)))
    return [inside(path, folder) for path in sorted(paths)]


def fits(name: str, pattern: str) -> bool:
    """Whether `matching` would find a file of this name by the last part of a pattern."""
    return any(fnmatch.fnmatch(name, _of_any_case(plain)) for plain in patterns_of(pattern))


def patterns_of(pattern: str) -> list[str]:
    """A pattern with `{one,other}` as one pattern for each; raises ValueError where that would be more than `MOST_PATTERNS`."""
    choice = _CHOICE.search(pattern)
    if choice is None:
        return [pattern]
    before, after = pattern[: choice.start()], patterns_of(pattern[choice.end() :])
    patterns = [before + word + rest for word in choice[1].split(",") for rest in after]
    if len(patterns) > MOST_PATTERNS:
        raise ValueError("too many patterns")
    return patterns


def _of_any_case(pattern: str) -> str:
    """A pattern whose suffix may be in capitals, or not, in the name of a file."""
    suffix = Path(pattern).suffix
    if not suffix[1:].isalnum():
        return pattern
    return pattern.removesuffix(suffix) + "".join(f"[{c.lower()}{c.upper()}]" if c.isalpha() else c for c in suffix)


# ---- what the system refuses


def refused_writing(file: Path, data: Data) -> AbstractContextManager[None]:
    """Turn what the system refuses into a `FileError` that names the file."""
    size = len(data) if isinstance(data, bytes) else None
    return _refused(file, lambda error, at: why_unwritten(error, at, size))


@contextmanager
def needing(n_bytes: int) -> Iterator[None]:
    """Where the disk is full, say how many bytes all that is written together needs, and not only the file that failed."""
    try:
        yield
    except FileError as error:
        if error.errno not in _FULL:
            raise
        raise FileError(
            *(replace(fault, accepted=f"{n_bytes:,} free bytes") for fault in error.faults), errno=error.errno
        ) from None


@contextmanager
def _refused(file: Path, why: Callable[[OSError, Path], Fault]) -> Iterator[None]:
    try:
        yield
    except ContextDBError:  # an OSError or a ValueError too, which names its own place
        raise
    except OSError as error:
        raise FileError(why(error, file), errno=error.errno) from None
    except UnicodeEncodeError as error:
        raise FileError(unnameable(error, file)) from None
    except ValueError as error:  # a path with a NUL character
        raise FileError(Fault(f"this is not a valid path: {error}.", "a path", place=Place(str(file)))) from None


def unnameable(error: UnicodeEncodeError, file: Path) -> Fault:
    """Why files cannot be named so here, and what to do."""
    encoding = "UTF-8" if error.encoding == "utf-8" else error.encoding
    problem = f"files are named in {encoding} here, which has no {in_quotes(error.object[error.start : error.end])}."
    if encoding == "UTF-8":
        return Fault(problem, "names of characters that Unicode has", place=Place(str(file)))
    return Fault(problem, "an environment in UTF-8", "to set PYTHONUTF8=1", Place(str(file)))


def _is_folder(folder: Path) -> Fault:
    tables = sorted(p for p in folder.iterdir() if names_a_table(p.name))
    return Fault("this is a folder.", "one file", path_in_quotes(tables[0]) if tables else "", Place(str(folder)))


def _why_unread(error: OSError, file: Path) -> Fault:
    place = Place(str(file))
    if isinstance(error, FileNotFoundError):
        return _missing(file)
    if isinstance(error, NotADirectoryError):
        return Fault(f"{path_in_quotes(file.parent)} is not a folder.", "a file in a folder", place=place, rule="no-such-path")
    if isinstance(error, PermissionError):
        return Fault("the file may not be read.", "a file that you have the permission to read", place=place)
    return Fault(f"the file cannot be read: {error.strerror}.", place=place)


def _missing(file: Path) -> Fault:
    """There is no such file; the nearest name in its folder, or, if the folder is missing too, the nearest folder."""
    place = Place(str(file))
    if file.is_symlink():
        return Fault(
            f"this is a link to {path_in_quotes(os.readlink(file))}, which does not exist.", place=place, rule="no-such-path"
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


def why_unwritten(error: OSError, file: Path, size: int | None = None) -> Fault:
    """Why the system did not write a file, and what to do."""
    place, folder = Place(str(file)), path_in_quotes(real_path(file).parent)
    note = " The old file is as it was." if os.path.exists(file) else ""
    if error.errno in _FULL:
        is_limit = error.errno == errno.EFBIG
        return Fault(
            f"the file is larger than files may be here.{note}" if is_limit else f"the disk is full.{note}",
            "more room" if size is None else f"room for {size:,} bytes" if is_limit else f"{size:,} free bytes",
            'to raise the limit that "ulimit -f" shows' if is_limit else "to free some space and save again",
            place,
        )
    if error.errno == errno.EROFS:
        return Fault(f"the folder {folder} is on a disk that cannot be written.{note}", mend="to save elsewhere", place=place)
    if isinstance(error, (FileNotFoundError, NotADirectoryError)):
        return Fault(f"there is no folder {folder}.", "an existing folder", place=place, rule="no-such-path")
    if isinstance(error, PermissionError):
        busy = ", or another program has the file open" if os.name == "nt" else ""
        return Fault(f"the folder {folder} may not be written in{busy}.{note}", mend="to save elsewhere", place=place)
    return Fault(f"the file cannot be written: {error.strerror or error}.{note}", mend="to save elsewhere", place=place)


def path_in_quotes(path: str | Path) -> str:
    """A path in quotes, in full: half a path is no help."""
    return in_quotes(str(path), most=4096)
