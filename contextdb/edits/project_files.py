"""The files of a project, as a rename reads them: its tables and contextdb.toml, with the variants of a table and the projects that
extend this one.

An edge: it reads the files of folders, and works out how contextdb.toml is to be written.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from contextdb.columns import TextColumn
from contextdb.disk import read_bytes, real_path
from contextdb.disk.boundary import TYPED_ROOT, extended_file, inside, is_below, project_folders, work_tree
from contextdb.edits.schema_file import schema_path
from contextdb.errors import ContextDBError, Fault, Place, SchemaError, TableError, in_quotes
from contextdb.files.texts import AnySource, read_texts
from contextdb.schema import toml_edit
from contextdb.schema.settings import Schema, TableSettings, extends_of, plain_names, resolved
from contextdb.tables.project import SCHEMA_FILE, read_folder_schema, schema_of, table_files
from contextdb.tables.table import Table

NO_NAMES: Mapping[str, str] = {}
_BOM = b"\xef\xbb\xbf"


@dataclass(frozen=True)
class Rewrite:
    """A file as it is to be written."""

    path: Path
    before: bytes
    after: bytes


@dataclass(frozen=True)
class TableFile:
    """A table's file and what is in it."""

    name: str
    path: Path
    settings: TableSettings
    """With what a variant inherits."""
    source: AnySource
    columns: tuple[TextColumn, ...]
    expected: Path | None = None
    """The file of the contexts that are expected, where there is one."""

    def has_condition(self, condition: str) -> bool:
        return condition not in plain_names(self.settings, self.columns) and any(c.name == condition for c in self.columns)

    @property
    def rules(self) -> TextColumn | None:
        return next((c for c in self.columns if c.name == self.settings.when), None)

    @property
    def assets(self) -> TextColumn | None:
        name = self.settings.asset
        return next((c for c in self.columns if c.name == name), None) if name else next(iter(self.columns), None)

    def has_asset(self, asset: str) -> bool:
        return self.assets is not None and asset in self.assets.texts


@dataclass(frozen=True)
class ProjectFiles:
    """A project as it is on the disk, and the table of it whose names change."""

    folder: Path
    raw: bytes
    """Its contextdb.toml; empty where there is none."""
    schema: Schema
    tables: tuple[tuple[str, Path], ...]
    own: str = ""
    """The name of the table; nothing in another project than the table's."""

    @classmethod
    def of(cls, table: Table) -> ProjectFiles:
        assert table.path is not None
        project, here = cls.read_in(folder_of(table), table.schema), real_path(table.path)
        own = next((name for name, path in project.tables if real_path(path) == here), table.name)
        return cls(project.folder, project.raw, project.schema, project.tables, own)

    @classmethod
    def read_in(cls, folder: Path, schema: Schema) -> ProjectFiles:
        """The project of a folder; `schema` is that of one without a contextdb.toml."""
        raw = read_bytes(folder / SCHEMA_FILE) if (folder / SCHEMA_FILE).is_file() else b""
        schema = read_folder_schema(folder) if raw else schema
        return cls(folder, raw, schema, tuple(table_files(folder, schema)))

    # ---- tables

    def table_file(self, name: str, path: Path) -> TableFile:
        """One table as it is on the disk. Raises FileError or TableError where it cannot be read."""
        settings = resolved(self.schema.tables.get(name, TableSettings(name)), self.schema.tables)
        source, columns = read_texts(path)
        expected = inside(self.folder / settings.expected, self.folder) if settings.expected is not None else None
        has_file = expected is not None and expected.is_file()
        return TableFile(name, path, settings, source, tuple(columns), expected if has_file else None)

    def read(self, only_own: bool = False) -> list[TableFile]:
        """The tables of the project, or the table with its variants."""
        return [self.table_file(name, path) for name, path in self.tables if not only_own or name in self.family]

    @property
    def family(self) -> set[str]:
        """The table, its variants, and theirs."""
        return {name for name in (self.own, *self.schema.tables) if self.own in (name, *self._bases(name))}

    def _bases(self, name: str) -> list[str]:
        """The base of a table, the base of that, and so on."""
        bases: list[str] = []
        tables = self.schema.tables
        while (base := tables[name].base if name in tables else None) is not None and base not in bases:
            bases.append(base)
            name = base
        return bases

    def require_free(
        self, files: Iterable[TableFile], old: str, new: str, has: Callable[[TableFile, str], bool], noun: str
    ) -> None:
        """Raise TableError where a table that names something has the new name already, itself or in its base: the two would be
        one; or where the base of the table names it, and would keep the old name."""
        paths, known = dict(self.tables), {file.name: file for file in files}

        def bases_of(name: str) -> list[TableFile]:
            return [known.get(base) or self.table_file(base, paths[base]) for base in self._bases(name) if base in paths]

        for file in list(known.values()):
            bases = bases_of(file.name)
            if any(has(one, old) for one in (file, *bases)) and any(has(one, new) for one in (file, *bases)):
                problem = f"{in_quotes(new)} is {noun} of {file.name} already: the two would be one."
                raise TableError(Fault(problem, f"a name that no {noun.split()[-1]} has yet", place=Place(str(file.path))))
            base = next((one for one in bases if one.name not in known and has(one, old)), None)
            if base is not None:
                problem = (
                    f"{in_quotes(old)} is {noun} of {base.name}, of which {file.name} is a variant: here alone it stays what it is."
                )
                raise TableError(Fault(problem, f"to rename it everywhere, or in {base.name}", place=Place(str(file.path))))

    # ---- projects that extend this one

    def carrying(self, conditions: Iterable[str]) -> list[tuple[ProjectFiles, frozenset[str]]]:
        """This project with some conditions, and each that extends it, or one that does, with those that it has from it."""
        every = [(self, frozenset(conditions))]
        below = self._extending() if self.raw else {}
        for project, names in every:
            for folder in below.pop(real_path(project.folder / SCHEMA_FILE), ()):
                other = ProjectFiles.read_in(folder, project.schema)
                if shared := frozenset(name for name in names if ("conditions", name) in other.schema.shared):
                    every.append((other, shared))
        return every

    def _extending(self) -> dict[Path, list[Path]]:
        """The folders of all projects below the root, by the contextdb.toml that each extends."""
        typed, here = TYPED_ROOT.get(), real_path(self.folder)
        root = real_path(typed) if typed is not None and is_below(here, real_path(typed)) else work_tree(here)
        below: dict[Path, list[Path]] = {}
        for folder in project_folders(root):
            with suppress(ContextDBError, UnicodeDecodeError):  # one that extends what cannot be has nothing of this one
                extends = extends_of(read_bytes(folder / SCHEMA_FILE).decode("utf-8-sig"), str(folder / SCHEMA_FILE))
                if extends is not None:
                    below.setdefault(extended_file(folder, extends), []).append(folder)
        return below

    # ---- contextdb.toml

    def rewritten_toml(
        self,
        change: Callable[[dict[str, Any]], None],
        moved: Mapping[str, str] = NO_NAMES,
        before: Iterable[Rewrite] = (),
        kind: str = "conditions",
    ) -> Iterator[Rewrite]:
        """contextdb.toml with a change, where there is one; only the keys that say something else are written, and a section of
        `kind` that moves keeps its lines. `before` are files that are written with it. Raises SchemaError where it could not say
        what it should."""
        if not self.raw:
            return
        path = self.folder / SCHEMA_FILE
        bom = _BOM if self.raw.startswith(_BOM) else b""
        text = self.raw.removeprefix(_BOM).decode()
        was, wanted = tomllib.loads(text), tomllib.loads(text)
        change(wanted)
        if wanted == was:
            return
        for old, new in moved.items():
            text = toml_edit.rename_section(text, (kind, old), (kind, new)) or text
        for section in ("conditions", "tables", "blueprints", "contracts"):
            text = _with_section(text, section, tomllib.loads(text).get(section, {}), wanted.get(section, {}))
        if tomllib.loads(text) != wanted:
            problem = "this cannot be renamed without changing more of the file."
            raise SchemaError(
                Fault(problem, "sections such as [conditions.NAME]", "to rename it in a text editor", Place(str(path)))
            )
        schema_of(text.encode(), path, partial(_read_as_written, {real_path(file.path): file.after for file in before}))
        yield Rewrite(path, self.raw, bom + text.encode())


def folder_of(table: Table) -> Path:
    """The folder of the project that a table is in."""
    return schema_path(table).parent


def _read_as_written(written: Mapping[Path, bytes], path: Path) -> bytes:
    return written[real_path(path)] if real_path(path) in written else read_bytes(path)


def _with_section(text: str, section: str, now: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    for name, part in wanted.items():
        for key, value in part.items():
            if now.get(name, {}).get(key) != value:
                behind = [(section, one) for one in now]
                text = toml_edit.set_key(text, (section, name, key), value, behind)
    for name in now:
        if name not in wanted:
            text = toml_edit.drop_key(text, (section, name))
    return text
