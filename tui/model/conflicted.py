"""A file in which git, or `contextdb merge`, left a conflict between marks: its versions as choices, and the file without marks.

An edge: this reads and writes the disk.
"""

from __future__ import annotations

from pathlib import Path

from contextdb.diff import Merge, merge
from contextdb.diffing.markers import versions_of
from contextdb.diffing.reading import merged_bytes, table_of
from contextdb.disk import read_bytes, write_atomic
from contextdb.errors import ContextDBError
from contextdb.project import schema_for, settings_of


def conflicts_in(path: str | Path) -> Merge | None:
    """The merge that a file's marks stand for, to be decided; None where it has none, or no table is between them."""
    try:
        versions = versions_of(read_bytes(path))
        if versions is None:
            return None
        folder, schema = schema_for(Path(path))
        settings = settings_of(Path(path), folder, schema)
        base, ours, theirs = (table_of(raw, str(path), schema, settings) for raw in versions)
    except ContextDBError:
        return None
    return merge(base, ours, theirs)


def write_decided(path: str | Path, decided: Merge) -> None:
    """Write the file without marks; what is not decided is as ours has it.

    Raises
    ------
    FileError
        The disk refuses; the file is then as it was.
    """
    write_atomic(path, merged_bytes(decided))
