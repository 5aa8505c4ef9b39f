"""A file in which git, or `contextdb merge`, left a conflict between marks: its versions as choices, and the file without marks.

Git writes no version of before between its usual marks. While the conflict lasts its index has one; without it a row that one side
deleted would be a new row of the other. An edge: this reads and writes the disk, and runs git.
"""

from __future__ import annotations

import contextlib
import subprocess
from pathlib import Path

from contextdb.disk import read_bytes, write_atomic
from contextdb.edits.diffing.markers import names_of, versions_of
from contextdb.errors import ContextDBError
from contextdb.tables.merging.merging import Merge, merge, merged_bytes, table_of
from contextdb.tables.project import schema_for, settings_of
from contextdb.tables.table import Table


def conflicts_in(path: str | Path) -> Merge[Table] | None:
    """The merge that a file's marks stand for, to be decided; None where it has none, or no table is between them."""
    try:
        versions = versions_of(read_bytes(path))
        if versions is None:
            return None
        folder, schema = schema_for(Path(path))
        settings = settings_of(Path(path), folder, schema)
        base, ours, theirs = (table_of(Table, raw, str(path), schema, settings) for raw in versions)
    except ContextDBError:
        return None
    with contextlib.suppress(ContextDBError):  # of a version of before that is no table
        base = table_of(Table, _before(Path(path)) or versions[0], str(path), schema, settings)
    return merge(base, ours, theirs)


def _before(path: Path) -> bytes:
    """What git's index calls the common ancestor of a file in conflict; empty where git knows none."""
    try:
        done = subprocess.run(["git", "show", f":1:./{path.name}"], cwd=path.parent, capture_output=True, timeout=10, check=False)
    except (OSError, subprocess.SubprocessError):
        return b""
    return done.stdout if done.returncode == 0 else b""


def sides_in(path: str | Path) -> tuple[str, str]:
    """What the marks of a file call its two sides."""
    ours, theirs = names_of(read_bytes(path))
    return (f"Ours ({ours})" if ours else "Ours"), (f"Theirs ({theirs})" if theirs else "Theirs")


def write_decided(path: str | Path, decided: Merge[Table]) -> None:
    """Write the file without marks; what is not decided is as ours has it. Raises FileError where the disk refuses; the file is
    then as it was."""
    write_atomic(path, merged_bytes(decided))
