"""A new table in the folder: an empty file with the columns of a blueprint. An edge: it writes the file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from contextdb.columns import TextColumn
from contextdb.disk import TABLE_SUFFIXES
from contextdb.disk.boundary import inside
from contextdb.errors import in_quotes
from contextdb.files.file_names import alike, why_no_table
from contextdb.files.texts import write_texts

ASSET = "Asset Name"
_FORBIDDEN = set('/\\:*?"<>|')


def name_fault(folder: Path, name: str, taken: Iterable[str]) -> str:
    """Why a table cannot have a name; empty when it can."""
    stem = name.strip()
    if not stem or stem.startswith("."):
        return "A table needs a name that does not begin with a dot."
    if any(c in _FORBIDDEN or not c.isprintable() for c in stem):
        return 'The name is that of a file, so it has no / \\ : * ? " < > |.'
    if why := why_no_table(f"{stem}.csv"):
        return f"{why[0].upper()}{why[1:]}."
    if alike(stem) in map(alike, taken) or any((folder / f"{stem}{suffix}").exists() for suffix in TABLE_SUFFIXES):
        return f"There is a table {in_quotes(stem)} already."
    return ""


def make_table(folder: Path, name: str, conditions: Sequence[str]) -> Path:
    """Write an empty table with a column of assets and these conditions. Raises FileError where the disk refuses."""
    path = inside(folder / f"{name.strip()}.csv", folder)
    columns = [TextColumn.of(column, ()) for column in (ASSET, *conditions)]
    write_texts(path, columns, None, np.arange(0))
    return path
