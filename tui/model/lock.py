"""A table held open by one editor, so that a second one is reported.

The lock is a file in the folder of journals that says who holds it. The system lets go of it when the process ends, however it
ends, so on one machine none is stale. On a network drive locks may not reach another machine: there a name of another host in the
file counts as a holder of whom nobody can say whether it still runs, and a person decides.
"""

from __future__ import annotations

import json
import os
import platform
import secrets
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contextdb.disk.own_files import FOLDER as FOLDER
from contextdb.disk.own_files import NOT_OURS, make_own_folder, open_own, read_own, rewrite_own
from contextdb.errors import Fault, FileError

MOST_BYTES = 1000


@dataclass(frozen=True)
class Holder:
    """The editor that has a table open."""

    pid: int
    id: str
    host: str = ""
    """Its machine; empty for this one."""

    @property
    def is_certain(self) -> bool:
        """Whether the editor surely runs; of one on another machine nobody can tell."""
        return not self.host

    def __str__(self) -> str:
        where = [f"on {self.host}"] if self.host else []
        return " ".join(["another editor", *where, *([f"(process {self.pid})"] if self.pid else [])])


class Lock:
    """A table held open by this editor."""

    def __init__(self, table: Path, host: str | None = None) -> None:
        self.path = table.parent / FOLDER / f"{table.name}.lock"
        self.id = secrets.token_hex(8)
        self._host = platform.node() if host is None else host
        self._descriptor = -1
        self.problem: Fault | None = None
        """Why there is no lock: what has its name is not ours."""

    def acquire(self, takes_over: bool = False) -> Holder | None:
        """Take the lock; gives who has it when somebody else does. Where the disk cannot lock, nobody is reported.

        `takes_over`: take it from an editor on another machine, which a person says has ended.
        """
        self.problem = None
        try:
            make_own_folder(self.path.parent)
            descriptor = self._opened()
        except OSError as error:
            refused = error.faults[0] if isinstance(error, FileError) else None
            self.problem = refused if refused is not None and refused.rule == NOT_OURS else None
            return None
        try:
            _lock(descriptor)
        except BlockingIOError:
            holder = self._holder(os.read(descriptor, MOST_BYTES))
            os.close(descriptor)
            return holder or Holder(0, "")
        except OSError:
            os.close(descriptor)
            return None
        last = self._holder(os.read(descriptor, MOST_BYTES))
        if last is not None and last.host and not takes_over:
            os.close(descriptor)
            return last
        with suppress(OSError):  # a full disk: the lock holds, and does not say whose it is
            rewrite_own(descriptor, json.dumps({"pid": os.getpid(), "id": self.id, "host": self._host}).encode())
        self._descriptor = descriptor
        return None

    def _opened(self) -> int:
        """The lock of another user is looked at, and not written into."""
        try:
            return open_own(self.path, os.O_RDWR, makes=True)
        except FileError:
            return open_own(self.path, os.O_RDONLY, is_anybodys=True)

    @property
    def is_held(self) -> bool:
        return self._descriptor >= 0

    def taken_by(self) -> Holder | None:
        """Who has taken the lock over from this editor; None when nobody has."""
        if not self.is_held:
            return None
        with suppress(OSError):
            holder = self._holder(read_own(self.path)[:MOST_BYTES])
            return holder if holder is not None and holder.id not in ("", self.id) else None
        return None

    def release(self) -> None:
        if self.is_held:
            with suppress(OSError):
                if self.taken_by() is None:
                    rewrite_own(self._descriptor, b"")
            with suppress(OSError):  # a network drive may refuse at last; let go of it is
                os.close(self._descriptor)
            self._descriptor = -1

    def __enter__(self) -> Lock:
        self.acquire()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def _holder(self, raw: bytes) -> Holder | None:
        """Who the file names; None when it names nobody: the last holder let go."""
        if not raw.strip():
            return None
        try:
            document: Any = json.loads(raw)
            host = str(document.get("host", ""))
            return Holder(int(document["pid"]), str(document["id"]), "" if host == self._host else host)
        except (ValueError, KeyError, TypeError, AttributeError):  # it is just writing who it is
            return Holder(0, "")


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
