"""A folder of tables: contextdb.toml and one file a table, read from the disk."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from contextdb import files
from contextdb.disk import TABLE_SUFFIXES, path_in_quotes, read_bytes
from contextdb.errors import ContextDBError, Fault, FileError, Place, SchemaError, TableError, in_quotes, nearest, some
from contextdb.nesting.links import Neighbours, inner_tables, is_nested, require_sound
from contextdb.schema import EMPTY, Schema, read_schema
from contextdb.table import Table, build_table

if TYPE_CHECKING:
    from contextdb.compiled import CompiledTable

SCHEMA_FILE = "contextdb.toml"
CASES_SUFFIX = ".cases.csv"


@dataclass(frozen=True)
class Project:
    """All tables of a folder, under one contextdb.toml."""

    folder: Path
    schema: Schema
    tables: Mapping[str, Table]

    @classmethod
    def load(cls, path: str | Path, strict: bool = True) -> Project:
        """Read a folder of tables (or its contextdb.toml).

        Parameters
        ----------
        strict : bool
            False keeps cells that cannot be read, in each table's `faults`.

        Raises
        ------
        ContextDBError
            With every fault of every file.
        """
        folder = folder_of(Path(path))
        schema = read_folder_schema(folder)
        tables: dict[str, Table] = {}
        faults: list[Fault] = []
        found = list(table_files(folder, schema))
        for name, file in found:
            try:
                tables[name] = _read_table(file, schema, folder, strict)
            except ContextDBError as error:
                faults += error.faults
        faults += twice_named(found)
        if faults:
            raise TableError(*faults)
        project = cls(folder, schema, around_each_other(tables))
        if strict:
            project.require_sound()
        return project

    def __getitem__(self, name: str) -> Table:
        """One table by its name; a name that is not there raises TableError and names the nearest."""
        if name not in self.tables:
            near = nearest(name, self.tables)
            found = f"there is no table {in_quotes(name)}."
            raise TableError(Fault(found, some(self.tables) or "none: the folder has no table", in_quotes(near) if near else ""))
        return self.tables[name]

    def with_table(self, table: Table) -> Project:
        """The project with one table in another version, for those too whose rows stand for it."""
        return replace(self, tables=around_each_other({**self.tables, table.name: table}))

    @property
    def inner(self) -> set[str]:
        """The names of the tables that rows of other tables stand for."""
        return inner_tables(self.tables.values()) & set(self.tables)

    def require_sound(self) -> None:
        """Raise TableError with what is wrong with rows that stand for tables."""
        faults: dict[Fault, None] = {}
        for table in self.tables.values():
            if is_nested(table):
                try:
                    require_sound(table, self.tables)
                except ContextDBError as error:
                    faults |= dict.fromkeys(error.faults)
        if faults:
            raise TableError(*faults)

    def compile(self) -> dict[str, CompiledTable]:
        """Every table compiled, by name."""
        return {name: table.compile() for name, table in self.tables.items()}


def load_table(path: Path, strict: bool = True) -> Table:
    """Read one table under the contextdb.toml beside it, or above it where that one declares the file."""
    folder, schema = schema_for(path)
    around = Neighbours(_Folder(folder, schema))
    table = _read_table(path, schema, folder, strict, around)
    if strict and is_nested(table):
        require_sound(table, around)
    return table


def neighbours(path: Path) -> Neighbours:
    """The tables that the rows of a table file may stand for: those of its folder, each read when it is first asked for."""
    return Neighbours(_Folder(*schema_for(path)))


def around_each_other(tables: Mapping[str, Table], before: Mapping[str, Table] | None = None) -> dict[str, Table]:
    """Tables that know of each other; what was worked out for them, or for their versions before, is kept."""
    alone = {name: table if table.around is None else replace(table, around=None) for name, table in tables.items()}
    was = {name: (before or {}).get(name, table).around for name, table in tables.items()}
    lasts = {name: around.last if isinstance(around, Neighbours) else None for name, around in was.items()}
    return {name: replace(table, around=Neighbours(alone, lasts[name])) for name, table in tables.items()}


class _Folder(Mapping[str, Table]):
    """The tables of a folder, each read when it is first asked for."""

    def __init__(self, folder: Path, schema: Schema) -> None:
        self._folder, self._schema = folder, schema
        self._read: dict[str, Table] = {}
        self._paths: dict[str, Path] | None = None

    @property
    def _files(self) -> dict[str, Path]:
        if self._paths is None:
            self._paths = {}
            with suppress(OSError):  # a folder that cannot be listed has no other tables
                self._paths |= table_files(self._folder, self._schema)
        return self._paths

    def __getitem__(self, name: str) -> Table:
        if name not in self._read:
            self._read[name] = _read_table(self._files[name], self._schema, self._folder, strict=False)
        return self._read[name]

    def __contains__(self, name: object) -> bool:
        return name in self._files

    def __iter__(self) -> Iterator[str]:
        return iter(self._files)

    def __len__(self) -> int:
        return len(self._files)


def schema_for(path: Path) -> tuple[Path, Schema]:
    """The folder and the schema that a table file belongs to."""
    beside = path.parent / SCHEMA_FILE
    if beside.is_file():
        return path.parent, read_folder_schema(path.parent)
    for folder in path.resolve().parent.parents:
        if (folder / SCHEMA_FILE).is_file():
            schema = read_folder_schema(folder)
            if any(_below(path, folder) in settings.files for settings in schema.tables.values()):
                return folder, schema
            break
    return path.parent, EMPTY


def read_folder_schema(folder: Path) -> Schema:
    """What the folder's contextdb.toml says; nothing where there is none."""
    path = folder / SCHEMA_FILE
    if not path.is_file():
        return EMPTY
    raw = read_bytes(path)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise SchemaError(Fault("the file is not UTF-8.", "TOML is UTF-8", "to save it as UTF-8", Place(str(path), line))) from None
    return read_schema(text, str(path))


def table_files(folder: Path, schema: Schema) -> Iterator[tuple[str, Path]]:
    """Name and file of every table: those that contextdb.toml declares, then others that lie in the folder."""
    taken: set[Path] = set()
    for settings in schema.tables.values():
        candidates = [folder / f for f in settings.files]
        path = next((p for p in candidates if p.is_file()), candidates[0])
        taken.add(path)
        yield settings.name, path
    for path in sorted(folder.iterdir()):
        if path not in taken and _is_table(path):
            yield path.stem, path


def twice_named(found: Iterable[tuple[str, Path]]) -> list[Fault]:
    """A fault for every file whose table has the name of one before it: nobody could say which of the two is meant."""
    first: dict[str, Path] = {}
    faults = []
    for name, path in found:
        if first.setdefault(name, path) != path:
            stands = f"the table {in_quotes(name)} stands in {path_in_quotes(first[name])} too."
            faults.append(Fault(stands, "one file for each table", place=Place(str(path))))
    return faults


def _is_table(path: Path) -> bool:
    name = path.name.lower()
    is_hidden = name.startswith(".")  # what macOS and editors put beside a file
    return name.endswith(TABLE_SUFFIXES) and not name.endswith(CASES_SUFFIX) and not is_hidden and path.is_file()


def folder_of(path: Path) -> Path:
    """The folder that a path to a folder, or to a contextdb.toml, means."""
    if os.path.isdir(path):  # os.path says no, where Path raises, to a name that no file can have
        return path
    if path.name == SCHEMA_FILE and os.path.isfile(path):
        return path.parent
    noun = "file" if path.name == SCHEMA_FILE else "folder"
    found = "it is no folder." if os.path.exists(path) else f"there is no such {noun}."
    siblings = [p.name for p in path.parent.iterdir() if p.is_dir()] if os.path.isdir(path.parent) else []
    near = nearest(path.name, siblings)
    mend = path_in_quotes(path.parent / near) if near else ""
    raise FileError(Fault(found, f"a folder of tables, or its {SCHEMA_FILE}", mend, Place(str(path)), "no-such-path"))


def _read_table(path: Path, schema: Schema, folder: Path, strict: bool, around: Mapping[str, Table] | None = None) -> Table:
    settings = schema.settings_for(_below(path, folder))
    source, columns = files.read_texts(path)
    table = replace(build_table(settings.name, columns, schema, settings, path, source), around=around)
    if strict:
        table.require_readable()
    return table


def _below(path: Path, folder: Path) -> str:
    """The path of a file below a folder, as contextdb.toml has it; links on the way to the file stay what they are named."""
    if path.is_relative_to(folder):
        return path.relative_to(folder).as_posix()
    whole, root = path.parent.resolve() / path.name, folder.resolve()
    return whole.relative_to(root).as_posix() if whole.is_relative_to(root) else path.name
