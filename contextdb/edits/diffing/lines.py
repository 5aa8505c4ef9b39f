"""A three-way merge of lines, as git does it: for files whose meaning cannot be merged. An edge: this runs git."""

from __future__ import annotations

import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from contextdb.edits.diffing.markers import block

NAMES = ("ours", "base", "theirs")
MOST_CONFLICTS = 127
"""What `git merge-file` exits with where there are at least so many conflicts; more is an error of its own."""


def merged_lines(base: bytes, ours: bytes, theirs: bytes) -> tuple[bytes, int]:
    """The merged bytes, and how many places are between marks in them. Where git cannot tell, the whole files are there."""
    versions = (ours, base, theirs)
    try:
        with TemporaryDirectory(prefix="contextdb-") as folder:
            for name, raw in zip(NAMES, versions, strict=True):
                (Path(folder) / name).write_bytes(raw)
            labels = [word for name in NAMES for word in ("-L", name)]
            done = subprocess.run(
                ["git", "merge-file", "-p", "--diff3", *labels, *NAMES], cwd=folder, capture_output=True, check=False
            )
    except OSError:  # there is no git, or no room for what it is to read
        return _whole(versions), 1
    if 0 <= done.returncode <= MOST_CONFLICTS:
        return done.stdout, done.returncode
    return _whole(versions), 1


def _whole(versions: tuple[bytes, bytes, bytes]) -> bytes:
    end = b"\r\n" if b"\r\n" in versions[0] else b"\n"
    return block([raw if not raw or raw.endswith(b"\n") else raw + end for raw in versions], end)
