"""Files of one folder replaced in one step: all of them or none. An edge: this touches the disk.

The new files stand ready before the first is replaced, and a record in the folder names them. A process that is killed while it
replaces them leaves the record. Whoever reads the folder next replaces the rest, so that all are new; where somebody has changed
one of the files meanwhile, the rest stays as it is. A warning says which. What fails without a kill is taken back at once.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from contextdb.disk import (
    TABLE_SUFFIXES,
    Staged,
    Was,
    is_still,
    is_stream,
    read_bytes,
    real_path,
    refused_writing,
    staged,
    sync_folder,
    write_atomic,
)
from contextdb.disk.folder_lock import UNFINISHED, folder_turn, is_temporary, temporary_name
from contextdb.disk.own_files import has_own, read_own
from contextdb.errors import Fault, FileError, Place, some

FORMAT = 1
SUFFIXES = (*TABLE_SUFFIXES, ".toml")
"""What may be replaced after a kill."""


class UnfinishedWarning(UserWarning):
    """What became of files whose writer was killed."""


@dataclass(frozen=True)
class NewFile:
    """A file as it is to be, and what it must still hold (see `contextdb.disk.write_atomic`)."""

    path: Path
    data: bytes
    was: Was = "any"


def write_together(folder: Path, files: Sequence[NewFile]) -> bool:
    """Replace files in or below a folder, or make them, in one step. Files that are elsewhere, behind a link say, are replaced one
    after another.

    Gives whether they were written: where one is not as its `was` says, none is. Raises FileError where the disk refuses one of
    them; all are then as they were, and no temporary file stays.
    """
    root = real_path(folder)
    targets = [real_path(new.path) for new in files]
    if len(files) < 2 or not all(_is_in(root, target) for target in targets) or any(is_stream(new.path) for new in files):
        return all(write_atomic(new.path, new.data, new.was) for new in files)
    finish(root)
    with ExitStack() as stack:
        ready = []
        for new in files:
            with refused_writing(new.path, new.data):
                ready.append(stack.enter_context(staged(new.path, new.data, folder=root)))
        handles = stack.enter_context(_turns([root, *(target.parent for target in targets)]))
        if not all(is_still(target, new.was) for target, new in zip(targets, files, strict=True)):
            return False
        _replace_all(root, files, ready)
        for handle in handles:
            sync_folder(handle)
    return True


def _is_in(root: Path, target: Path) -> bool:
    """Whether a file can be renamed from the folder to there, and a record of the folder may name it."""
    with suppress(OSError):
        return target.is_relative_to(root) and os.stat(target.parent).st_dev == os.stat(root).st_dev
    return False


@contextmanager
def _turns(folders: Iterable[Path]) -> Iterator[list[int | None]]:
    """The turns of several folders, in one order, so that nobody waits for the other."""
    with ExitStack() as stack:
        yield [stack.enter_context(folder_turn(folder)) for folder in sorted(set(folders))]


def _replace_all(root: Path, files: Sequence[NewFile], ready: Sequence[Staged]) -> None:
    """Replace the files, for whoever has the turns; all are as they were when this raises."""
    record = root / UNFINISHED
    backups: list[Path | None] = []
    n_done = 0
    try:
        for new, one in zip(files, ready, strict=True):
            with refused_writing(new.path, new.data):
                one.close()
                backups.append(_backup(root, one.target))
        with refused_writing(files[0].path, files[0].data):
            entries = [_entry(root, *each) for each in zip(files, ready, backups, strict=True)]
            write_record(record, {"format": FORMAT, "files": entries})
        for new, one in zip(files, ready, strict=True):
            with refused_writing(new.path, new.data):
                one.replace()
            n_done += 1
    except BaseException:  # also when the user interrupts
        for new, one, old in zip(files[:n_done], ready, backups, strict=False):
            with putting_back(new.path, "to repeat the command, which puts it back first"):  # by the record
                _put_back(one.target, old)
        _delete(record, *backups)
        raise
    _delete(record, *backups)


@contextmanager
def putting_back(path: Path, mend: str) -> Iterator[None]:
    """Say of a file that cannot be put back as it was that it is new."""
    try:
        yield
    except OSError as error:
        why = os.strerror(error.errno or 0)
        problem = f"not all files could be replaced; this one is new already, and cannot be put back: {why}."
        raise FileError(Fault(problem, mend=mend, place=Place(str(path))), errno=error.errno) from None


def _put_back(target: Path, old: Path | None) -> None:
    if old is None:
        target.unlink()
    else:
        os.replace(old, target)


def _delete(*paths: Path | None) -> None:
    for path in paths:
        if path is not None:
            with suppress(OSError):
                path.unlink(missing_ok=True)


def _backup(root: Path, target: Path) -> Path | None:
    """The old file under a second name, to be put back; None where there is none."""
    if not target.exists():
        return None
    path = root / temporary_name()
    try:
        os.link(target, path)
    except OSError:  # a disk without links
        shutil.copy2(target, path)
    return path


def _entry(root: Path, new: NewFile, one: Staged, old: Path | None) -> dict[str, str | None]:
    return {
        "file": one.target.relative_to(root).as_posix(),
        "new": one.temporary.name,
        "is": hashlib.sha256(new.data).hexdigest(),
        "old": None if old is None else old.name,
        "was": _digest(one.target),
    }


def write_record(path: Path, entries: object) -> None:
    """Write a record in one step, for whoever has the turn of the folder: a part of one would not say which files are wanted."""
    growing = path.with_name(temporary_name())
    try:
        handle = os.open(growing, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        try:
            rest = memoryview(json.dumps(entries).encode())
            while rest:
                rest = rest[os.write(handle, rest) :]
            os.fsync(handle)
        finally:
            os.close(handle)
        os.replace(growing, path)
    finally:
        with suppress(OSError):
            growing.unlink(missing_ok=True)


# ---- after a kill


def finish(folder: Path) -> None:
    """Bring to an end what a killed process has begun in a folder; it is reported as an `UnfinishedWarning`. Raises FileError where
    the disk refuses."""
    root = real_path(folder)
    record = root / UNFINISHED
    if not has_own(record):
        return
    with refused_writing(folder / UNFINISHED, b""):
        entries = _entries(record)
        with _turns([root, *(entry.target.parent for entry in entries)]):
            if not record.exists():  # it was not dead, or somebody else was quicker
                return
            is_done = bool(entries) and _is_finished(entries)
            is_back = bool(entries) and not is_done and _is_taken_back(entries)
            for path in (*(path for entry in entries for path in (entry.new, entry.old) if path is not None), record):
                path.unlink(missing_ok=True)
    names = some(entry.target.name for entry in entries)
    begun = f"{folder}: a process was killed while it wrote {names}"
    if is_done:
        message = f"{begun}; all of them are now as it was going to write them."
    elif is_back:
        message = f"{begun}; all of them are now as they were before."
    elif entries:
        message = f"{begun}, which were changed since: what it did not write is left out."
    else:
        message = f"{folder}: {UNFINISHED} names no files of this folder, and was deleted."
    warnings.warn(message, UnfinishedWarning, stacklevel=2)


@dataclass(frozen=True)
class _Entry:
    target: Path
    new: Path
    old: Path | None
    is_now: str
    was: str | None

    @property
    def is_replaced(self) -> bool:
        return _digest(self.target) == self.is_now

    @property
    def is_ready(self) -> bool:
        return _digest(self.target) == self.was and _digest(self.new) == self.is_now


def _is_finished(entries: Sequence[_Entry]) -> bool:
    """Replace what is not replaced yet, unless somebody has changed something."""
    if not all(entry.is_replaced or entry.is_ready for entry in entries):
        return False
    for entry in entries:
        if not entry.is_replaced:
            os.replace(entry.new, entry.target)
    return True


def _is_taken_back(entries: Sequence[_Entry]) -> bool:
    """Put back what was replaced, where the new files of the rest are gone and nobody has changed something."""
    done = [entry for entry in entries if entry.is_replaced]
    if not all(entry in done or _digest(entry.target) == entry.was for entry in entries):
        return False
    if not all((None if entry.old is None else _digest(entry.old)) == entry.was for entry in done):
        return False
    for entry in done:
        _put_back(entry.target, entry.old)
    return bool(done)


def _entries(record: Path) -> list[_Entry]:
    """The files of a record; none where it says something else. A record may come with a clone from anybody, so that it may name
    temporary files of this machine, and tables and contextdb.toml below its folder alone."""
    root = record.parent
    try:
        content = json.loads(read_own(record))
        files = content["files"]
        entries = [_Entry(root / e["file"], root / e["new"], e["old"] and root / e["old"], e["is"], e["was"]) for e in files]
        temporary = [path for entry in entries for path in (entry.new, entry.old) if path is not None]
        is_ours = all(path.parent == root and is_temporary(path.name) and not path.is_symlink() for path in temporary)
        is_below = all(_is_in(root, real_path(entry.target)) for entry in entries)
        is_below &= all(entry.target.suffix.lower() in SUFFIXES for entry in entries)
        return entries if content["format"] == FORMAT and is_ours and is_below else []
    except (ValueError, KeyError, TypeError, RecursionError, FileNotFoundError):
        return []


def _digest(file: Path) -> str | None:
    """What tells a file's bytes apart; None where there is none. Raises FileError where it is no file."""
    return hashlib.sha256(read_bytes(file)).hexdigest() if os.path.lexists(file) else None
