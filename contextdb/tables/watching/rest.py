"""When the files of a folder may be read: after they have rested. Knows stamps and times, and touches neither disk nor clock.

A file that was written a moment ago may be half-written, or about to be written again. So all files must have rested for
`settle_s`. Saves that never rest would put that off for ever; after `patience_s` of unrest the files may be read all the same,
unless one of those that have not rested was written in place: a file that was put there whole, by a rename, is whole.

A stamp is (inode, size, time of the last write, time of the last change of any kind), or None for a file that is missing or
cannot be looked at. File systems tell times in steps, the coarsest of them 2 s (FAT), so that equal stamps promise equal bytes
only when the last write lies longer ago than that.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from contextdb.disk import read_bytes
from contextdb.disk.boundary import inside
from contextdb.errors import ContextDBError

PATIENCE_S = 1.0


class Rest:
    """What is known of a folder's files: their stamps, and when each was last seen to change."""

    def __init__(self, seen: Stamps, now: float, settle_s: float, patience_s: float = PATIENCE_S) -> None:
        self._seen = dict(seen)
        self._moved: dict[Path, tuple[float, bool]] = {}
        """Of each file that changed: when that was seen, and whether it was replaced whole."""
        self._restless_since = now
        self._settle_s, self._patience_s = settle_s, patience_s
        self.moved_s = now
        """When the last change was seen."""

    def is_due(self, seen: Stamps, now: float) -> bool:
        """Whether the files, whose stamps were taken now, may be read."""
        was_restless = bool(self._restless(now))
        for path in sorted(seen.keys() | self._seen.keys()):
            before, after = self._seen.get(path), seen.get(path)
            if before != after or (path in seen) != (path in self._seen):
                self._moved[path] = now, before is not None and after is not None and before[0] != after[0]
                self.moved_s = now
        self._seen = dict(seen)
        if not was_restless:
            self._restless_since = now
        restless = self._restless(now)
        if not restless:
            return True
        return now - self._restless_since >= self._patience_s and all(was_replaced for _, was_replaced in restless)

    def disturb(self, now: float) -> None:
        """Wait for another rest: the files are not what their stamps promised."""
        self._moved = dict.fromkeys(self._seen, (now, False))
        self.moved_s = now

    def taken(self, now: float) -> None:
        """The files were read: patience begins again."""
        self._restless_since = now

    def wait_s(self, now: float) -> float | None:
        """Seconds until the files have rested if nothing moves; None when they have."""
        restless = self._restless(now)
        return max(moved for moved, _ in restless) + self._settle_s - now if restless else None

    def _restless(self, now: float) -> list[tuple[float, bool]]:
        self._moved = {path: move for path, move in self._moved.items() if now - move[0] < self._settle_s}
        return list(self._moved.values())


# ---- what the file system says of a project's files without reading them. An edge: this touches the disk


COARSEST_TICK_S = 2.0
"""So long after a write a second one can leave the stamp as it is."""

Stamp = tuple[int, int, int, int] | None
Stamps = Mapping[Path, Stamp]
Digests = Mapping[Path, bytes]


def look(paths: Iterable[Path]) -> dict[Path, Stamp]:
    return {path: _stamp(path) for path in paths}


def read_all(paths: Iterable[Path], folder: Path, shared: Collection[Path] = ()) -> dict[Path, bytes]:
    """The bytes of those files that are there, in the folder or among those that its project extends, and may be read."""
    contents = {}
    for path in paths:
        try:
            contents[path] = read_bytes(path if path in shared else inside(path, folder))
        except ContextDBError:  # whoever needs it says why it cannot be read
            continue
    return contents


def digests_of(contents: Mapping[Path, bytes]) -> Digests:
    """BLAKE2b-128 of each file's bytes."""
    return {path: hashlib.blake2b(raw, digest_size=16).digest() for path, raw in contents.items()}


def _stamp(path: Path) -> Stamp:
    try:
        status = path.stat()
    except (OSError, ValueError):
        return None
    return status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns
