"""What the file system says of a project's files without reading them. An edge: this touches the disk.

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
