"""Save a table into the file that it was read from, though others may have written it since. An edge: this touches the disk.

What others wrote is merged cell by cell, as the editor does it; where both changed a cell otherwise, nothing is written.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from contextdb.disk import Was, read_bytes, write_atomic
from contextdb.errors import ContextDBError, Fault, FileError, Place, TableError, plural, safe_text
from contextdb.files.texts import new_source
from contextdb.tables.data import AnyTable, TableData
from contextdb.tables.merging.alignment import align
from contextdb.tables.merging.conflicts import Conflict
from contextdb.tables.merging.merging import merge, table_of

MOST_NAMED = 3


def save_table(table: AnyTable, target: Path, overwrite: bool) -> AnyTable:
    """Write a table; see `Table.save`."""
    is_own = not overwrite and table.path is not None and table.source is not None and _is_same(table.path, target)
    while True:
        there = _bytes_of(target) if is_own else None
        now = table if there is None else _merged(table, target, there)
        source = new_source(target, now.columns, now.source, now.origin)
        was: Was = there if is_own else "any"
        if write_atomic(target, source.raw, was):
            return replace(now, path=target, source=source, origin=np.arange(now.n_rows))


def require_related(base: TableData, on_disk: TableData, mend: str) -> None:
    """Raise TableError when what is in a file has no row in common with the table that was read from it."""
    if base.n_rows and not (align(base, on_disk).rows >= 0).any():
        problem = "the file now has no row in common with the table that was read from it."
        raise TableError(Fault(problem, "the table as it was, with changes", mend, Place(str(on_disk.path)), "merge-conflict"))


def _is_same(one: Path, other: Path) -> bool:
    return os.path.realpath(one) == os.path.realpath(other)


def _bytes_of(file: Path) -> bytes | None:
    return read_bytes(file) if os.path.exists(file) else None


def _merged(table: AnyTable, file: Path, there: bytes) -> AnyTable:
    """The table with what others wrote into its file since it was read. Raises FileError where both changed a cell otherwise, or
    the file is not a table any more."""
    assert table.source is not None
    if there == table.source.raw:
        return table
    place = Place(str(file))
    mend = "to load it again and repeat the edits, or save(overwrite=True)"
    try:
        base, theirs = (table_of(type(table), raw, str(file), table.schema, table.settings) for raw in (table.source.raw, there))
        require_related(base, theirs, mend)
    except ContextDBError as error:
        problem = f"the file has been changed since it was read, and cannot be merged: {error.faults[0].found}"
        raise FileError(Fault(problem, "the table as it was, with changes", mend, place, "merge-conflict")) from None
    merged = merge(base, table, theirs)
    if merged.conflicts:
        n = len(merged.conflicts)
        named = "; ".join(map(_conflict_sentence, merged.conflicts[:MOST_NAMED])) + (
            f"; and {n - MOST_NAMED:,} more" if n > MOST_NAMED else ""
        )
        problem = f"the file has been changed since it was read, in {plural(n, 'place')} differently than here: {named}."
        raise FileError(Fault(problem, mend=mend, place=place, rule="merge-conflict"))
    now = merged.edit_of_theirs().apply(theirs)
    return replace(now, name=table.name, schema=table.schema, around=table.around)


def _conflict_sentence(one: Conflict) -> str:
    here, there = (_quoted(text) for text in (one.ours, one.theirs))
    return f"{safe_text(one.place)} is {here} here and {there} in the file"


def _quoted(text: str | None) -> str:
    return "gone" if text is None else f'"{safe_text(text)}"'
