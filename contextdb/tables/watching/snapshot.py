"""One version of a project: read from bytes that were all on the disk at one time, compiled, and never changed.

`next_snapshot` makes a version from the one before: files whose bytes are the same are not read again, and of the others only the
columns that changed are compiled. The disk is touched only to say why a file that is missing could not be read.

Columns are compared by what they say. One that says the same is taken from the older table, with its cells and masks; of one that
changed, only texts that are new are read. So a reload costs the columns that changed. Nothing here touches the disk.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from contextdb.cells.notebook import one_line
from contextdb.columns import TextColumn
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.compiled.unchanging import Unchanging
from contextdb.disk import read_bytes
from contextdb.errors import ContextDBError, Fault, FileError, Place, TableError, plural
from contextdb.files.texts import AnySource, texts_of
from contextdb.schema.settings import EMPTY, Schema, TableSettings
from contextdb.tables.data import require_readable
from contextdb.tables.nesting.links import sources
from contextdb.tables.project import (
    SCHEMA_FILE,
    ByName,
    Project,
    around_each_other,
    require_all_sound,
    schema_of,
    settings_of,
    twice_named,
)
from contextdb.tables.table import Table
from contextdb.tables.watching.rest import Digests, digests_of

Contents = Mapping[Path, bytes]
NamedFiles = Sequence[tuple[str, Path]]


@dataclass(frozen=True, eq=False, repr=False)
class Snapshot(Unchanging, ByName[CompiledTable]):
    """One version of a project, compiled: a mapping of compiled tables by name. It never changes, so that a game can ask several
    tables of one and the same version."""

    number: int
    """1 for the version that the watch began with, one more for each that came after it."""
    project: Project
    tables: Mapping[str, CompiledTable]
    """Every table compiled, by name."""
    changed: tuple[str, ...]
    """The tables that are new or differ from the version before, in a table inside them too."""
    _digests: Digests
    """Of each file, as it was read."""
    _alone: Mapping[str, Table]
    """The tables as their files have them, knowing nothing of each other."""

    def __repr__(self) -> str:
        return one_line("Snapshot", self.project.folder.name, f"version {self.number} of {plural(len(self), 'table')}")

    def __getitem__(self, name: str) -> CompiledTable:
        """One compiled table; a name that is missing raises NoSuchTable, which is a KeyError too, and names the nearest."""
        return self.tables[self.project[name].name]


def schema_from(folder: Path, contents: Contents, last: Snapshot | None) -> Schema:
    """What the folder's contextdb.toml says; the same object as before when its bytes are the same. Raises FileError where it was
    there and is not, or may not be read; SchemaError where it has an invalid setting."""
    path = folder / SCHEMA_FILE
    raw = contents.get(path)
    if raw is None:
        if last is not None and path in last._digests:
            gone = "the file is gone; the tables stay as they were."
            raise FileError(Fault(gone, mend="to put it back", place=Place(str(path)), rule="no-such-path"))
        if path.exists():
            read_bytes(path)
        return EMPTY
    if last is not None:
        files = [path, *shared_files(last.project.schema)]
        now = digests_of({file: contents[file] for file in files if file in contents})
        if all(now.get(file) == last._digests.get(file) for file in files):
            return last.project.schema
    return schema_of(raw, path)


def shared_files(schema: Schema) -> list[Path]:
    """The files that the project of a schema extends."""
    return [Path(file) for file in schema.studio.files] if schema.studio is not None else []


def next_snapshot(folder: Path, schema: Schema, files: NamedFiles, contents: Contents, last: Snapshot | None = None) -> Snapshot:
    """The version that the files now are; `files` are the names and files of the tables. Raises ContextDBError with every fault of
    every table."""
    digests = digests_of(contents)
    tables: dict[str, Table] = {}
    faults: list[Fault] = []
    for name, path in files:
        try:
            tables[name] = _table(path, folder, schema, contents, digests, last)
        except ContextDBError as error:
            faults += error.faults
    faults += twice_named(files)
    if faults:
        raise TableError(*faults)
    project = Project(folder, schema, around_each_other(tables, last.project.tables if last else {}))
    require_all_sound(project)
    before = last._alone if last else {}
    changed = tuple(n for n, t in tables.items() if any(before.get(m) is not inner for m, inner in sources(t, tables).items()))
    older = last.tables if last else {}
    compiled = {n: older[n] if last and n not in changed else _compiled(t, older.get(n)) for n, t in project.tables.items()}
    return Snapshot(last.number + 1 if last else 1, project, compiled, changed, digests, tables)


def _table(path: Path, folder: Path, schema: Schema, contents: Contents, digests: Digests, last: Snapshot | None) -> Table:
    settings = settings_of(path, folder, schema)
    old = last._alone.get(settings.name) if last else None
    if path not in contents:
        read_bytes(path)  # raises FileError, which says why it cannot be read
        raise FileError(Fault("the file came while the folder was read.", mend="to save it again", place=Place(str(path))))
    is_same = old is not None and old.path == path and last is not None and digests[path] == last._digests.get(path)
    if is_same and old is not None and old.schema is schema:
        return old
    source, columns = (old.source, old.columns) if is_same and old and old.source else texts_of(contents[path], str(path))
    table = table_like(old, columns, schema, settings, path, source)
    require_readable(table)
    return table


def _compiled(table: Table, older: CompiledTable | None) -> CompiledTable:
    """The table compiled, and made ready for the first query, which else would wait for it; it remembers what was picked of the
    older version."""
    compiled = table.compile()
    if older is not None:
        data_of(compiled).remember_as(data_of(older))
    compiled.query({}, unknown="any")
    return compiled


# ---- a table read again that keeps what its older version had worked out


def table_like(
    old: Table | None, columns: Sequence[TextColumn], schema: Schema, settings: TableSettings, path: Path, source: AnySource
) -> Table:
    """The table that `Table.build` gives, and its errors; equal columns of `old` are shared. Cells that cannot be read are in the
    table's `faults`."""
    texts = [_shared_texts(c, old) for c in columns] if old else columns
    known = {c.condition.name: c for c in old.conditions} if old else {}
    return Table.build(settings.name, texts, schema, settings, path, source, known)


def _shared_texts(column: TextColumn, old: Table) -> TextColumn:
    match = next((c for c in old.columns if c.name == column.name), None)
    is_same = match is not None and match.texts == column.texts and np.array_equal(match.codes, column.codes)
    return match if match is not None and is_same else column
