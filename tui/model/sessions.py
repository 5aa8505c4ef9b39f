"""The recorded sessions of a project, by their files. Reads of each what it says of itself, and nothing else."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from contextdb.disk import real_path
from contextdb.disk.boundary import is_below, why_outside, work_tree

MOST_FILES = 1000
"""So many files are looked at."""


def sessions_of(folder: Path) -> list[Path]:
    """The recorded sessions of a project, the newest first: those in its folder, two folders deep, and
    beside it in the same work tree of git."""
    paths = []
    for path in islice(_near(folder), MOST_FILES):
        try:
            if _is_of(path, folder):
                paths.append((path.stat().st_mtime, path))
        except OSError:  # gone since
            continue
    return [path for _, path in sorted(paths, key=lambda each: (-each[0], each[1].name))]


def _near(folder: Path) -> Iterator[Path]:
    places = [(folder, pattern) for pattern in ("*.parquet", "*/*.parquet", "*/*/*.parquet")]
    beside = real_path(folder).parent
    if is_below(beside, work_tree(folder)):
        places.append((beside, "*.parquet"))
    for base, pattern in places:
        try:
            yield from (path for path in base.glob(pattern) if why_outside(path, base) is None)
        except OSError:
            continue


def _is_of(path: Path, folder: Path) -> bool:
    """Whether a Parquet file is a session of the project, or says of none and lies in its folder."""
    import polars as pl

    from contextdb.motion.trace.session_file import (  # loads the motion search, only where there is such a file
        ABOUT_KEY,
        FORMAT_KEY,
    )

    try:
        metadata = pl.read_parquet_metadata(path)
        about = json.loads(metadata[ABOUT_KEY]) if FORMAT_KEY in metadata else None
    except (KeyError, ValueError, pl.exceptions.PolarsError):
        return False
    if not isinstance(about, dict):
        return False
    projects = {str(each["project"]) for each in about.values() if isinstance(each, dict) and "project" in each}
    if not projects:
        return real_path(folder) in real_path(path).parents
    return any(os.path.realpath(path.parent / project) == os.path.realpath(folder) for project in projects)
