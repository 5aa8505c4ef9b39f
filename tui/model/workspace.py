"""The tables of a folder, and which of them are open. An edge: it reads the disk."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from contextdb.disk import real_path
from contextdb.disk.boundary import inside
from contextdb.edits.renaming import Renaming
from contextdb.errors import ContextDBError, Fault, FileError, TableError, some
from contextdb.tables.nesting.links import Neighbours
from contextdb.tables.places import table_path
from contextdb.tables.project import read_folder_schema, schema_for, table_files
from contextdb.tables.table import Table
from contextdb.tables.variants import is_variant

from .beginning import Beginning, beginning, beginning_from
from .session import Session


class OpenTables(Mapping[str, Table]):
    """The tables of a folder, those that are open as they are edited."""

    def __init__(self, base: Mapping[str, Table], edited: Mapping[str, Table]) -> None:
        self.base, self.edited = base, edited

    def __getitem__(self, name: str) -> Table:
        return self.edited[name] if name in self.edited else self.base[name]

    def __contains__(self, name: object) -> bool:
        return name in self.edited or name in self.base

    def __iter__(self) -> Iterator[str]:
        return iter({**dict.fromkeys(self.base), **self.edited})

    def __len__(self) -> int:
        return len(list(iter(self)))


FOLDERS = (Path("tables"), Path())


class Workspace:
    """A folder of tables. A table is read when it is first requested, and then stays open with its edits."""

    def __init__(self, path: str | Path | None = None, reads_only: bool = False) -> None:
        """Look at a folder, or at the folder of a table; without a path in tables/ or here. `reads_only`: nothing is edited.

        Where there is no table yet, `first` is empty and `beginning` says what the path may become. Raises FileError, TableError or
        SchemaError where the folder of the path does not exist, or its contextdb.toml cannot be read.
        """
        self.sessions: dict[str, Session] = {}
        self._reads_only = reads_only
        self._renames: list[tuple[Renaming, dict[str, str]]] = []
        """The renames that were written, each with the names of facts that it changed."""
        self._n_renamed = 0
        """So many of them hold now; the others were taken back."""
        self.beginning: Beginning | None = None
        """How to begin, where the path is that of no table."""
        where = _resolved(path)
        if isinstance(where, Beginning):
            self.beginning, self.folder, self.first = where, where.folder, ""
            self.files = _tables(self.folder)
            return
        self.folder = where if where.is_dir() else schema_for(where)[0]
        self.files = _tables(self.folder)
        if where.is_dir():
            self.first = next(iter(self.files), "")
            self.beginning = None if self.files else Beginning(self.folder)
        else:
            self.first = self._name_of(where)

    def session(self, name: str) -> Session:
        """A table, opened when it is not yet; errors as of `Session`."""
        if name not in self.sessions:
            self.sessions[name] = Session(self.files[name], reads_only=self._reads_only)
        return self.sessions[name]

    def begin_from(self, path: Path) -> bool:
        """Begin with a file that is no table of ours, but can be imported; gives whether it can."""
        self.beginning = beginning_from(path)
        if self.beginning is not None:
            self.first = ""
        return self.beginning is not None

    def know_others(self, name: str) -> None:
        """Let a table whose rows refer to others know of those as they are being edited."""
        session = self.sessions[name]
        table = session.sheet.table
        if table.around is None or not (session.sheet.query.is_nested or is_variant(table)):
            return
        edited = {other: one.sheet.table for other, one in self.sessions.items() if other != name}
        if edited:
            session.know(Neighbours(OpenTables(_of_disk(table.around), edited), getattr(table.around, "last", None)))

    def reopen(self, name: str, takes_over: bool = False) -> Session:
        """Let go of a table and open it again; errors as of `Session`."""
        before = self.sessions.pop(name, None)
        if before is not None:
            before.close()
        self.sessions[name] = session = Session(self.files[name], takes_over, self._reads_only)
        if before is not None:  # of one that is read-only nothing was stored
            session.sheet.show_columns(before.sheet.visible_columns)
        return session

    def save_as(self, name: str, other: str, suffix: str = ".csv") -> None:
        """Write a table, its unsaved edits with it, as another table of the folder; the old file stays as it was last saved. Raises
        FileError, TableError or SchemaError as `save` of a session does; nothing has changed then."""
        path = inside(self.folder / f"{other}{suffix}", self.folder)
        session = self.session(name)
        session.save(path)
        session.close()
        del self.sessions[name]
        self.files[other] = path

    def rename(self, name: str, renaming: Renaming, names: Mapping[str, str]) -> tuple[str, ...]:
        """Write a rename into the files of the project; gives which were written. `names`: the other names of facts of test rows.

        The tables whose files are written are opened again: what was edited before cannot be taken back any more, but for the
        rename itself. Raises TableError or FileError where a table that is to be written has unsaved edits, or is read-only; else
        as `Renaming.write`. Nothing has changed then.
        """
        files = self._write_renaming(name, renaming, names)
        self._renames = [*self._renames[: self._n_renamed], (renaming, dict(names))]
        self._n_renamed += 1
        return files

    def undo_rename(self, name: str, is_redo: bool = False) -> Renaming | None:
        """Take the last rename back, or make it again; None where there is none. Errors as of `rename`."""
        at = self._n_renamed if is_redo else self._n_renamed - 1
        if not 0 <= at < len(self._renames):
            return None
        renaming, names = self._renames[at]
        if is_redo:
            self._write_renaming(name, renaming, names)
        else:
            self._write_renaming(name, renaming.reversed, {new: old for old, new in names.items()})
        self._n_renamed += 1 if is_redo else -1
        return renaming

    def _write_renaming(self, name: str, renaming: Renaming, names: Mapping[str, str]) -> tuple[str, ...]:
        paths = {real_path(file.path) for file in renaming.files}
        open_here = [
            one
            for one, session in self.sessions.items()
            if one == name or real_path(session.path) in paths or is_variant(session.sheet.table)
        ]
        if waiting := [one for one in open_here if one in self.unsaved]:
            problem = f"{some(waiting)} {'has' if len(waiting) == 1 else 'have'} unsaved edits, and the rename is written at once."
            raise TableError(Fault(problem, "tables that are saved", "to save first: Ctrl+S"))
        if held := [one for one in open_here if self.sessions[one].is_read_only]:
            raise FileError(Fault(f"{some(held)} can be read only.", "tables that can be written"))
        renaming.write()
        for one in open_here:
            query = self.sessions[one].sheet.query
            self.reopen(one).sheet.query.load({names.get(fact, fact): text for fact, text in query.texts.items()})
        return tuple(Path(os.path.relpath(file.path, self.folder)).as_posix() for file in renaming.files)

    @property
    def unsaved(self) -> list[str]:
        return [name for name, session in self.sessions.items() if session.sheet.is_modified]

    def look_again(self) -> None:
        """Take in tables that came to the folder; those that are open stay."""
        open_files = {name: self.files[name] for name in self.sessions if name in self.files}
        self.files = open_files | {n: p for n, p in _tables(self.folder).items() if p not in open_files.values()}

    def forget(self) -> None:
        """Let go of every table: their files have changed. Each is read again when it is next wanted; what was edited before
        cannot be taken back."""
        self.close()
        self.sessions, self._renames, self._n_renamed = {}, [], 0

    def close(self, keep_journals: bool = False) -> None:
        for session in self.sessions.values():
            session.close(keep_journals)

    def _name_of(self, file: Path) -> str:
        for name, path in self.files.items():
            if path.exists() and path.samefile(file):
                return name
        name = file.stem if file.stem not in self.files else file.name
        self.files = {name: file, **self.files}
        return name


def _of_disk(tables: Mapping[str, Table]) -> Mapping[str, Table]:
    """The tables as they were read from the disk."""
    inner = tables.tables if isinstance(tables, Neighbours) else tables
    return inner.base if isinstance(inner, OpenTables) else tables


def _resolved(path: str | Path | None) -> Path | Beginning:
    if path is None:
        return next((folder for folder in FOLDERS if folder.is_dir() and _tables(folder)), Path())
    if Path(path).is_dir():
        return Path(path)
    try:
        file = table_path(str(path))
    except ContextDBError as error:
        begun = beginning(Path(path), error)
        if begun is None:
            raise
        return begun
    return beginning(file) or file


def _tables(folder: Path) -> dict[str, Path]:
    paths: dict[str, Path] = {}
    for name, file in table_files(folder, read_folder_schema(folder)):
        paths.setdefault(name, file)
    return paths
