"""Unsaved edits kept beside the table, so that they come back after a crash or a kill; and a lock, so that two editors know.

Both stand in the folder `.contextdb-journal` next to the table, which ignores itself in git by a .gitignore of its own. A journal
is lines of a check sum, a space and JSON. The first names the file and the digest of the bytes that the edits were made for:

    {"format": 1, "file": "hit_mid_air.csv", "digest": "…"}
    {"do": {"name": …, "changes": […]}}      an edit was made
    {"go": 3}                                undo or redo, to where 3 edits lie behind
    {"saving": "…"}                          the file is about to become the bytes of this digest

A line is handed to the system as its edit happens, so a kill loses at most the edit in progress. It is not forced onto the disk: a
power failure may lose the last seconds. A line that is cut or altered ends the journal.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import zlib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from contextdb.disk import make_folder, write_atomic
from contextdb.edits import Edit, edit_between
from contextdb.errors import ContextDBError, Fault, Place, plural
from contextdb.history import History, Step
from contextdb.table import Table

FOLDER = ".contextdb-journal"
FORMAT = 1

Record = Mapping[str, Any]


def journal_path(table: Path) -> Path:
    """The journal of a table's file."""
    return table.parent / FOLDER / f"{table.name}.journal"


def digest_of(raw: bytes) -> str:
    """What tells two files apart."""
    return hashlib.sha256(raw).hexdigest()


class Journal:
    """The journal of one table, written as edits happen. It is a `tui.model.sheet.Recorder`.

    When the disk refuses, editing goes on without a journal, and `problem` says why.
    """

    def __init__(self, table: Path, digest: str, recovered: History | None = None) -> None:
        self.path = journal_path(table)
        self.problem: Fault | None = None
        self._table = table
        self._digest = digest
        self._first = 0
        """The position of the history that the journal starts from."""
        self._is_straight = True
        """Whether the journal holds the edits of the history from there on; no longer once a step went back past a save."""
        self._position = recovered.position if recovered else 0
        self._n_edits = len(recovered.names) if recovered else 0
        """How many edits a reader of the journal knows, those taken back too."""
        self._is_begun = self._n_edits > 0

    def did(self, edit: Edit) -> None:
        """Write an edit that was made."""
        self._position += 1
        self._n_edits = self._position
        self._write({"do": edit.to_json()})

    def went(self, before: Table, history: History, step: Step) -> None:
        """Write that the history went to where it is; as an edit where a reader could not follow."""
        position = history.position - self._first
        if self._is_straight and 0 <= position <= self._n_edits:
            self._position = position
            self._write({"go": position})
            return
        self._is_straight = False
        came_from = np.arange(before.n_rows) if step.came_from is None else step.came_from
        self._write({"do": edit_between(before, history.table, came_from, step.name).to_json()})

    def saving(self, raw: bytes) -> None:
        """Write that the file is about to have these bytes."""
        if self._is_begun:
            self._write({"saving": digest_of(raw)})

    def saved(self, raw: bytes, position: int) -> None:
        """The file has these bytes, at this position of the history: begin anew with the next edit."""
        self._digest, self._first, self._is_straight = digest_of(raw), position, True
        self._position = self._n_edits = 0
        self.discard()

    def discard(self) -> None:
        """Take the journal away: nothing is unsaved, or nobody wants it."""
        self._is_begun = False
        with suppress(OSError):
            self.path.unlink(missing_ok=True)

    def _write(self, record: Record) -> None:
        try:
            if not self._is_begun:
                self._begin()
            _append(self.path, _line(record))
        except (OSError, ContextDBError) as error:
            why = error.strerror if isinstance(error, OSError) else str(error)
            self.problem = Fault(f"unsaved edits are not kept: {why}.", mend="to save often", place=Place(str(self.path)))

    def _begin(self) -> None:
        own_folder(self.path.parent)
        write_atomic(self.path, _line({"format": FORMAT, "file": self._table.name, "digest": self._digest}))
        self._is_begun = True


def own_folder(folder: Path) -> None:
    """Make the folder of journals, which git passes over."""
    make_folder(folder)
    ignore = folder / ".gitignore"
    if not ignore.exists():
        write_atomic(ignore, b"*\n")


def _line(record: Record) -> bytes:
    body = json.dumps(record, ensure_ascii=True, separators=(",", ":")).encode()
    return b"%08x %s\n" % (zlib.crc32(body), body)


def _append(path: Path, line: bytes) -> None:
    descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | getattr(os, "O_BINARY", 0))
    try:
        while line:
            line = line[os.write(descriptor, line) :]
    finally:
        os.close(descriptor)


# ---- after a crash


@dataclass(frozen=True)
class Recovery:
    """What a journal brings back."""

    history: History
    """The table with the unsaved edits made, and undo for them."""
    n_edits: int
    problem: Fault | None = None
    """Why edits could not be brought back, or not all of them."""


def read_records(raw: bytes) -> tuple[list[Record], int]:
    """The records of a journal up to the first line that is cut or altered, and how many bytes they take."""
    records, at = [], 0
    for line in raw.splitlines(keepends=True):
        body = line[9:-1]
        try:
            if not line.endswith(b"\n") or int(line[:8], 16) != zlib.crc32(body) or line[8:9] != b" ":
                break
            record = json.loads(body)
        except ValueError:
            break
        records.append(record)
        at += len(line)
    return records, at


def recover(table: Table) -> Recovery | None:
    """Bring back the unsaved edits of a table as it was just loaded; None when there are none.

    A journal that was cut is cut at its last whole line, so that it can be gone on with.
    """
    if table.path is None or table.source is None or not journal_path(table.path).is_file():
        return None
    path, digest = journal_path(table.path), digest_of(table.source.raw)
    raw = path.read_bytes()
    records, n_bytes = read_records(raw)
    if not records or not any("do" in r for r in records):
        return None
    if any(r.get("saving") == digest for r in records):
        return None  # killed between the save and the end of the journal: all of it is in the file
    if records[0].get("format") != FORMAT or records[0].get("digest") != digest:
        n_edits = sum("do" in r for r in records)
        found = f"the file has changed since {plural(n_edits, 'unsaved edit')} of it were kept, so they cannot be made again."
        return Recovery(History(table), 0, Fault(found, "the file as it was then", place=Place(str(path))))
    if n_bytes < len(raw):
        with suppress(OSError):
            os.truncate(path, n_bytes)
    return _replayed(History(table), records[1:], path)


def _replayed(history: History, records: list[Record], path: Path) -> Recovery:
    for record in records:
        try:
            if "do" in record:
                history.do(Edit.from_json(record["do"]))
            elif "go" in record and 0 <= record["go"] <= len(history.names):
                history.go(record["go"])
        except (ContextDBError, KeyError, TypeError, ValueError, IndexError) as error:
            found = f"only {plural(history.position, 'unsaved edit')} could be made again: {error}"
            return Recovery(history, history.position, Fault(found, place=Place(str(path))))
    return Recovery(history, history.position)


# ---- two editors


@dataclass(frozen=True)
class Holder:
    """The editor that has a table open."""

    pid: int
    id: str

    def __str__(self) -> str:
        return f"process {self.pid}" if self.pid else "another process"


class Lock:
    """A table held open by this editor. The system lets go of it when the process ends, however it ends, so none is stale."""

    def __init__(self, table: Path) -> None:
        self.path = table.parent / FOLDER / f"{table.name}.lock"
        self.id = secrets.token_hex(8)
        self._descriptor = -1

    def acquire(self) -> Holder | None:
        """Take the lock; gives who has it when somebody else does. Where the disk cannot lock, nobody is told."""
        try:
            own_folder(self.path.parent)
            descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
        except (OSError, ContextDBError):
            return None
        try:
            _lock(descriptor)
        except BlockingIOError:
            holder = _holder(os.read(descriptor, 1000))
            os.close(descriptor)
            return holder
        except OSError:
            os.close(descriptor)
            return None
        os.truncate(descriptor, 0)
        os.write(descriptor, json.dumps({"pid": os.getpid(), "id": self.id}).encode())
        self._descriptor = descriptor
        return None

    @property
    def is_held(self) -> bool:
        """Whether this editor has the lock."""
        return self._descriptor >= 0

    def release(self) -> None:
        """Let go of the table."""
        if self.is_held:
            os.close(self._descriptor)
            self._descriptor = -1

    def __enter__(self) -> Lock:
        self.acquire()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def _lock(descriptor: int) -> None:
    """Lock an open file or raise BlockingIOError."""
    try:
        import fcntl
    except ImportError:  # Windows: there the lock is on a byte far behind the text, which others may then still read
        import msvcrt

        os.lseek(descriptor, 1 << 30, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined, unused-ignore]
        except PermissionError as error:
            raise BlockingIOError from error
        finally:
            os.lseek(descriptor, 0, os.SEEK_SET)
    else:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _holder(raw: bytes) -> Holder:
    try:
        said = json.loads(raw)
        return Holder(int(said["pid"]), str(said["id"]))
    except (ValueError, KeyError, TypeError):  # it is just writing who it is
        return Holder(0, "")
