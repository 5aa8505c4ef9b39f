"""Give an asset another name in a whole project, or in one table of it.

The cells of all tables that name it, fallbacks, saved contexts, and the markup of databases. The clip keeps its file's name: it is
another program's, and `AssetUses` says which it is. An edge, as `contextdb.edits.renaming`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contextdb.columns import TextColumn
from contextdb.disk import matching, real_path
from contextdb.edits.renaming import ProjectFiles, Renaming, Rewrite, TableFile, folder_of, rewritten, rewritten_notes, with_texts
from contextdb.edits.renaming_values import with_value
from contextdb.errors import ContextDBError, Fault, TableError, in_quotes, plural
from contextdb.files.texts import read_texts
from contextdb.schema.settings import Schema, TableSettings
from contextdb.tables.other_files import cases_path
from contextdb.tables.project import table_files
from contextdb.tables.table import Table

EXPECTED = "Expected"


@dataclass(frozen=True)
class AssetUses:
    """What speaks of an asset elsewhere than in the cells of one table."""

    tables: tuple[str, ...] = ()
    """Other tables with rows of it, or that cannot be read."""
    n_cases: int = 0
    n_fallbacks: int = 0
    n_markup: int = 0
    clips: tuple[str, ...] = ()
    """Files of clips that are called so."""

    @property
    def text(self) -> str:
        """How many there are of each; nothing for none. The files of clips are not counted: they keep their names."""
        counts = (
            (len(self.tables), "other table"),
            (self.n_cases, "saved context"),
            (self.n_fallbacks, "fallback"),
            (self.n_markup, "line of markup"),
        )
        return ", ".join(f"{n} lines of markup" if n > 1 and "line" in noun else plural(n, noun) for n, noun in counts if n)


def asset_uses(table: Table, asset: str) -> AssetUses:
    """What speaks of an asset in the files of a table's project, but for the cells of the table itself."""
    if table.path is None:
        return AssetUses()
    folder, schema = folder_of(table), table.schema
    others, n_cases = [], 0
    for name, path in table_files(folder, schema):
        is_own = real_path(path) == real_path(table.path)
        n_cases += sum(with_value(text, asset, f"{asset}_") != text for text in _expected(path))
        try:
            column = _assets(TableFile.read(name, path, schema.tables.get(name, TableSettings(name))))
        except ContextDBError:
            others += [] if is_own else [name]
            continue
        others += [name] if not is_own and column is not None and asset in column.texts else []
    n_fallbacks = sum(settings.fallback == asset for settings in schema.tables.values())
    n_markup = 0
    for path in _markup(folder, schema):
        columns = _read(path)
        n_markup += sum(text == asset for c in columns if c.name == "asset" for text in c.to_list())
    patterns = [str(part.get("clips", "")) for part in schema.databases.values()]
    clips = [path.name for pattern in patterns if pattern for path in matching(folder, pattern) if path.stem == asset]
    return AssetUses(tuple(others), n_cases, n_fallbacks, n_markup, tuple(dict.fromkeys(clips)))


def asset_renaming(table: Table, old: str, new: str, only_here: bool = False) -> Renaming:
    """What is to be written so that an asset has another name, in all the project, or in this table and its saved contexts only.
    Raises TableError, SchemaError or FileError where a table names the new asset already; a file cannot be read, or could not say
    what it should."""
    files = ProjectFiles.of(table)
    rewrites = [rewrite for file in files.read(only_here) for rewrite in _rewritten_table(file, old, new)]
    for path in _markup(files.folder, files.schema) if not only_here else ():
        rewrites += _rewritten_columns(path, "asset", {old: new})
    only = files.own if only_here else None
    return Renaming(old, new, (*rewrites, *files.rewritten_toml(lambda document: _change(document, old, new, only))))


# ---- parts


def _assets(file: TableFile) -> TextColumn | None:
    name = file.settings.asset
    return next((c for c in file.columns if c.name == name), None) if name else next(iter(file.columns), None)


def _expected(table: Path) -> list[str]:
    path = cases_path(table)
    columns = _read(path) if path.is_file() else []
    return [text for c in columns if c.name == EXPECTED for text in c.to_list()]


def _markup(folder: Path, schema: Schema) -> list[Path]:
    names = dict.fromkeys(part["markup"] for part in schema.databases.values() if isinstance(part.get("markup"), str))
    return [path for name in names if (path := folder / str(name)).is_file()]


def _read(path: Path) -> tuple[TextColumn, ...]:
    try:
        return tuple(read_texts(path)[1])
    except ContextDBError:
        return ()


def _rewritten_table(file: TableFile, old: str, new: str) -> Iterator[Rewrite]:
    assets = _assets(file)
    if assets is not None and old in assets.texts and new in assets.texts:
        problem = f"{in_quotes(new)} is an asset of {file.name} already: the two would be one."
        raise TableError(Fault(problem, "a name that no asset has yet"))
    columns = [with_texts(c, {old: new}) if c is assets else c for c in file.columns]
    yield from rewritten(file.path, file.source, file.columns, columns)
    cases = cases_path(file.path)
    if cases.is_file():
        yield from _rewritten_columns(cases, EXPECTED, None, old, new)
    yield from rewritten_notes(file.path, "Asset", {old: new})


def _rewritten_columns(path: Path, column: str, texts: Mapping[str, str] | None, old: str = "", new: str = "") -> Iterator[Rewrite]:
    """A file with other texts in one column: those of a mapping, or lists of names with one of them renamed."""
    source, columns = read_texts(path)
    after = [
        with_texts(c, texts or {text: with_value(text, old, new) for text in c.texts}) if c.name == column else c for c in columns
    ]
    yield from rewritten(path, source, columns, after)


def _change(document: dict[str, Any], old: str, new: str, only: str | None) -> None:
    for name, part in document.get("tables", {}).items():
        fallback = part.get("fallback") if only in (None, name) else None
        if fallback == old:
            part["fallback"] = new
        elif isinstance(fallback, dict) and fallback.get("asset") == old:
            part["fallback"] = {**fallback, "asset": new}
