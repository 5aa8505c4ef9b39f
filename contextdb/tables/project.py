"""A folder of tables: contextdb.toml and one file a table, read from the disk."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from contextdb.cells.arguments import require_kind, require_path
from contextdb.cells.notebook import one_line
from contextdb.compiled.table import CompiledTable
from contextdb.compiled.unchanging import Unchanging
from contextdb.disk import TABLE_SUFFIXES, names_a_table, path_in_quotes, read_bytes, real_path
from contextdb.disk.boundary import SCHEMA_FILE as SCHEMA_FILE
from contextdb.disk.boundary import extended_file, inside, why_outside
from contextdb.disk.together import finish
from contextdb.errors import (
    ContextDBError,
    Fault,
    FileError,
    NoSuchTable,
    Place,
    SchemaError,
    TableError,
    in_quotes,
    nearest,
    no_such,
    plural,
    some,
)
from contextdb.files import texts as files
from contextdb.files.file_names import alike, composed, spelled
from contextdb.schema.settings import EMPTY, Schema, Studio, TableSettings, extends_of, read_schema, resolved
from contextdb.tables.data import require_readable
from contextdb.tables.nesting.links import Neighbours, inner_tables, is_nested, require_sound
from contextdb.tables.other_files import other_form, stray_sentence
from contextdb.tables.table import Table, has_others
from contextdb.tables.variants import whole_of

T = TypeVar("T")


class ByName(Mapping[str, T]):
    """A mapping by names that is equal to itself alone, and true though it may be empty: `tables`."""

    __slots__ = ()
    tables: Mapping[str, T]

    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return id(self)

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator[str]:
        return iter(self.tables)

    def __len__(self) -> int:
        return len(self.tables)


@dataclass(frozen=True, eq=False, repr=False)
class Project(Unchanging, ByName[Table]):
    """All tables of a folder, under one contextdb.toml: a mapping of tables by name."""

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
        folder = folder_of(require_path(path))
        schema = read_folder_schema(folder)
        tables: dict[str, Table] = {}
        faults: list[Fault] = []
        files = list(table_files(folder, schema))
        for name, file in files:
            try:
                tables[name] = _read_table(file, schema, folder, strict)
            except ContextDBError as error:
                faults += error.faults
        faults += twice_named(files)
        if faults:
            raise TableError(*faults)
        project = cls(folder, schema, around_each_other(tables))
        if strict:
            require_all_sound(project)
        return project

    def __getitem__(self, name: str) -> Table:
        """One table by its name; a name that is missing raises NoSuchTable, which is a KeyError too, and names the nearest."""
        if name not in self.tables:
            raise NoSuchTable(no_such("table", name, self.tables, some(self.tables) or "none: the folder has no table"))
        return self.tables[name]

    def with_table(self, table: Table) -> Project:
        """The project with one table in another version, for those too whose rows refer to it; raises ContextError for no table."""
        require_kind(table, Table, "table", "a Table")
        return replace(self, tables=around_each_other({**self.tables, table.name: table}))

    def __repr__(self) -> str:
        return one_line("Project", self.schema.name or self.folder.name, plural(len(self.tables), "table"))

    @property
    def inner(self) -> set[str]:
        """The names of the tables that rows of other tables refer to."""
        return inner_tables(self.tables.values()) & set(self.tables)

    def compile(self) -> dict[str, CompiledTable]:
        """Every table compiled, by name."""
        return {name: table.compile() for name, table in self.tables.items()}


def require_all_sound(project: Project) -> None:
    """Raise TableError with what is wrong with rows that refer to tables."""
    faults: dict[Fault, None] = {}
    for table in project.tables.values():
        if has_others(table):
            try:
                require_whole(table, project.tables)
            except ContextDBError as error:
                faults |= dict.fromkeys(error.faults)
    if faults:
        raise TableError(*faults)


def require_whole(table: Table, tables: Mapping[str, Table]) -> None:
    """Raise TableError with what is wrong with the base of a table and with the tables inside it."""
    whole = whole_of(table, tables)
    if is_nested(whole):
        require_sound(whole, tables)
    require_readable(whole)


def load(path: str | Path, strict: bool = True) -> Table:
    """Read one table and the contextdb.toml next to it.

    Parameters
    ----------
    path : str or Path
        A .csv or .parquet file.
    strict : bool
        False keeps cells that cannot be read, in `table.faults`, as an editor needs it.

    Raises
    ------
    FileError, SchemaError, TableError
        Each with every fault, its place, what is accepted and the nearest correction.
    """
    file = require_path(path)
    place = Place(str(path))
    if file.is_dir():
        raise FileError(Fault("this is a folder.", "one .csv or .parquet file", f"contextdb.Project.load({str(path)!r})", place))
    if not file.suffix and not file.exists():
        named = (folder / f"{file.name}{suffix}" for folder in (file.parent, file.parent / "tables") for suffix in TABLE_SUFFIXES)
        near = next((path_in_quotes(one) for one in named if one.is_file()), "")
        raise FileError(Fault("there is no such file.", "the path of a .csv or .parquet file", near, place), errno=errno.ENOENT)
    return load_table(file, strict)


def load_table(path: Path, strict: bool = True) -> Table:
    """Read one table under the contextdb.toml next to it, or above it where that one declares the file."""
    folder, schema = schema_for(path)
    around = Neighbours(_Folder(folder, schema))
    table = _read_table(path, schema, folder, strict, around)
    if strict and has_others(table):
        require_whole(table, around)
    return table


def neighbours(path: Path) -> Neighbours[Table]:
    """The tables that the rows of a table file may refer to: those of its folder, each read when it is first used."""
    return Neighbours(_Folder(*schema_for(path)))


def around_each_other(tables: Mapping[str, Table], before: Mapping[str, Table] | None = None) -> dict[str, Table]:
    """Tables that know of each other; what was worked out for them, or for their versions before, is kept."""
    alone = {name: table if table.around is None else replace(table, around=None) for name, table in tables.items()}
    was = {name: (before or {}).get(name, table).around for name, table in tables.items()}
    lasts = {name: around.last if isinstance(around, Neighbours) else None for name, around in was.items()}
    return {name: replace(table, around=Neighbours(alone, lasts[name])) for name, table in tables.items()}


class _Folder(Mapping[str, Table]):
    """The tables of a folder, each read when it is first used."""

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
    finish(path.parent)
    if os.path.lexists(path.parent / SCHEMA_FILE):
        return path.parent, read_folder_schema(path.parent)
    for folder in real_path(path).parent.parents:
        if (folder / SCHEMA_FILE).is_file():
            schema = read_folder_schema(folder)
            if settings_of(path, folder, schema).name in schema.tables:
                return folder, schema
            break
    return path.parent, EMPTY


def read_folder_schema(folder: Path) -> Schema:
    """What the folder's contextdb.toml says; nothing where there is none."""
    finish(folder)
    path = inside(folder / SCHEMA_FILE, folder)
    if not path.is_file():
        return EMPTY
    return schema_of(read_bytes(path), path)


def schema_of(raw: bytes, path: Path, read: Callable[[Path], bytes] = read_bytes) -> Schema:
    """What the bytes of a contextdb.toml say, with what it extends, whose bytes `read` gives. Raises SchemaError where they are no
    UTF-8, or have an invalid setting; FileError where the project that it extends cannot be read."""
    text = _decoded(raw, path)
    return read_schema(text, str(path), _studio_of(text, path, (), read))


def _decoded(raw: bytes, path: Path) -> str:
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise SchemaError(Fault("the file is not UTF-8.", "TOML is UTF-8", "to save it as UTF-8", Place(str(path), line))) from None


def _studio_of(text: str, path: Path, way: tuple[Path, ...], read: Callable[[Path], bytes]) -> Studio | None:
    """What the text of a contextdb.toml extends; None where it extends nothing, or not in a way that can be read."""
    extends = extends_of(text, str(path))
    if extends is None:
        return None
    file = extended_file(path.parent, extends)
    if file in (real_path(path), *way):
        problem = f"[project] extends = {in_quotes(extends)}: the project extends itself."
        raise SchemaError(Fault(problem, "another project", "to leave it out", Place(str(path))))
    known = _decoded(read(file), file)
    return Studio(known, str(file), _studio_of(known, file, (*way, real_path(path), file), read))


def table_files(folder: Path, schema: Schema) -> Iterator[tuple[str, Path]]:
    """Name and file of every table: those that contextdb.toml declares, then others that lie in the folder and may be tables.

    Raises FileError with every file that a link brings from elsewhere.
    """
    declared, others = _files_in(folder, schema)
    yield from declared
    for path in others:
        if other_form(path, schema.conditions) is None:
            yield composed(path.stem), path


def stray_files(folder: Path, schema: Schema) -> Iterator[tuple[Path, str]]:
    """The files that lie next to the tables and look like something else, each with a sentence that says so. Raises FileError as
    `table_files` does."""
    for path in _files_in(folder, schema)[1]:
        form = other_form(path, schema.conditions)
        if form is not None:
            yield path, stray_sentence(path, form)


def _files_in(folder: Path, schema: Schema) -> tuple[list[tuple[str, Path]], list[Path]]:
    """The declared tables of a folder, and the other files that may be tables."""
    declared = list(_declared_files(folder, schema))
    expected = {folder / settings.expected for settings in schema.tables.values() if settings.expected is not None}
    others = [path for path in _undeclared_files(folder, declared) if path not in expected]
    paths = [*(path for _, path in declared), *others]
    if faults := [fault for path in paths if (fault := why_outside(path, folder)) is not None]:
        raise FileError(*faults)
    return declared, others


def _declared_files(folder: Path, schema: Schema) -> Iterator[tuple[str, Path]]:
    names: dict[Path, list[str]] = {}
    for settings in schema.tables.values():
        candidates = [folder / f for f in settings.files]
        if any(why_outside(candidate.parent, folder) for candidate in candidates):  # nothing is listed there
            yield settings.name, candidates[0]
            continue
        yield settings.name, next((match for p in candidates if (match := _on_disk(p, names)) is not None), candidates[0])


def _undeclared_files(folder: Path, declared: Iterable[tuple[str, Path]]) -> Iterator[Path]:
    taken = {path for _, path in declared}
    return (path for path in sorted(folder.iterdir()) if path not in taken and names_a_table(path.name) and path.is_file())


def _on_disk(path: Path, names: dict[Path, list[str]]) -> Path | None:
    """A file as its folder spells it: in another Unicode form perhaps, on some disks in other capitals; None where it is missing.
    `names` are those of folders that were listed already."""
    if path.parent not in names:
        names[path.parent] = _names_in(path.parent)
    present = names[path.parent]
    spelling = spelled(path.name, present)
    if spelling is None and path.is_file():  # a disk that does not tell capitals, or a folder that cannot be listed
        spelling = next((name for name in present if alike(name) == alike(path.name)), path.name)
    return path.with_name(spelling) if spelling is not None and path.with_name(spelling).is_file() else None


def _names_in(folder: Path) -> list[str]:
    try:
        return sorted(os.listdir(folder))
    except (OSError, ValueError):
        return []


def settings_of(path: Path, folder: Path, schema: Schema) -> TableSettings:
    """What contextdb.toml says of a table file: what it declares for this file, whatever the disk makes of its name; of a variant
    with what it inherits."""
    file_below = below(path, folder)
    settings = schema.settings_for(file_below)
    if settings.name in schema.tables:
        return settings
    for declared in schema.tables.values():
        for file in declared.files:
            if alike(file) == alike(file_below) and _is_same_file(folder / file, path):
                return resolved(declared, schema.tables)
    return settings


def _is_same_file(one: Path, other: Path) -> bool:
    with suppress(OSError, ValueError):
        return os.path.samefile(one, other)
    return False


def twice_named(files: Iterable[tuple[str, Path]]) -> list[Fault]:
    """A fault for every file whose table has the name of one before it: nobody could say which of the two is meant."""
    first: dict[str, Path] = {}
    faults = []
    for name, path in files:
        if first.setdefault(name, path) != path:
            stands = f"table {in_quotes(name)} is also defined in {path_in_quotes(first[name])}."
            faults.append(Fault(stands, "one file for each table", place=Place(str(path))))
    return faults


def folder_of(path: Path, accepted: str = f"a folder of tables, or its {SCHEMA_FILE}") -> Path:
    """The folder that a path to a folder, or to a contextdb.toml, means."""
    if os.path.isdir(path):  # os.path says no, where Path raises, to a name that no file can have
        return path
    if path.name == SCHEMA_FILE and os.path.isfile(path):
        return path.parent
    noun = "file" if path.name == SCHEMA_FILE else "folder"
    problem = "not a folder." if os.path.exists(path) else f"there is no such {noun}."
    siblings = [p.name for p in path.parent.iterdir() if p.is_dir()] if os.path.isdir(path.parent) else []
    near = nearest(path.name, siblings)
    mend = path_in_quotes(path.parent / near) if near else ""
    raise FileError(Fault(problem, accepted, mend, Place(str(path)), "no-such-path"))


def _read_table(path: Path, schema: Schema, folder: Path, strict: bool, around: Mapping[str, Table] | None = None) -> Table:
    settings = settings_of(path, folder, schema)
    source, columns = files.read_texts(path)
    table = replace(Table.build(settings.name, columns, schema, settings, path, source), around=around)
    if strict:
        require_readable(table)
    return table


def below(path: Path, folder: Path) -> str:
    """The path of a file below a folder, as contextdb.toml has it; links on the way to the file stay what they are named."""
    if path.is_relative_to(folder):
        return path.relative_to(folder).as_posix()
    whole, root = real_path(path.parent) / path.name, real_path(folder)
    return whole.relative_to(root).as_posix() if whole.is_relative_to(root) else path.name
