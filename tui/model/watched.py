"""One file that others may write while it is open: a cheap look, and a digest only where the look finds something. An edge."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Literal

from contextdb.disk import read_bytes
from contextdb.errors import FileError

State = Literal["same", "changed", "gone"]
Seen = tuple[int, int, int, int] | None
"""What tells that a file was written: its times, size and number; None where there is none."""


def digest_of(raw: bytes) -> str:
    """What tells two files apart."""
    return hashlib.sha256(raw).hexdigest()


class Watched:
    """A file, and the digest of the bytes that are known here; None: known not to be there."""

    def __init__(self, path: Path, digest: str | None) -> None:
        self.path = path
        self._state: State = "same"
        self._last: Seen = None
        self.know(digest)

    def know(self, digest: str | None) -> None:
        """These are the bytes that are known here from now on."""
        self.digest = digest
        self._state = "same"
        self._judged: Seen | Literal["never"] = "never"

    def look(self) -> State:
        """What became of the file. One that is being written is looked at again before it is called changed."""
        seen = self._seen()
        is_settled, self._last = seen == self._last, seen
        if seen == self._judged or (not is_settled and seen is not None):
            return self._state
        return self._judge(seen)

    @property
    def stamp(self) -> Seen:
        """What the last look saw: another one after each write."""
        return self._last

    @property
    def state(self) -> State:
        """What became of the file, by its bytes as they are now."""
        return self._judge(self._seen())

    def _judge(self, seen: Seen) -> State:
        self._judged = seen
        if seen is None:
            self._state = "same" if self.digest is None else "gone"
        else:
            self._state = "same" if self._digest_now() == self.digest else "changed"
        return self._state

    def _seen(self) -> Seen:
        try:
            stat = os.stat(self.path)
        except (OSError, ValueError):
            return None
        return stat.st_mtime_ns, stat.st_ctime_ns, stat.st_size, stat.st_ino

    def _digest_now(self) -> str | None:
        try:
            return digest_of(read_bytes(self.path))
        except FileError:
            return ""
