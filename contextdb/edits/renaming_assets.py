"""Give an asset another name in a whole project, or in one table of it.

The cells of all tables that name it, fallbacks, saved contexts, contracts, and the markup of databases. The clip keeps its file's
name: it is another program's, and `AssetUses` says which it is. An edge, as `contextdb.edits.renaming`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contextdb.columns import TextColumn
from contextdb.disk import matching, real_path
from contextdb.edits.project_files import ProjectFiles, Rewrite, TableFile
from contextdb.edits.renaming import Renaming, rewritten, rewritten_notes, with_texts
from contextdb.edits.renaming_values import with_text, with_value
from contextdb.errors import ContextDBError, plural
from contextdb.files.texts import read_texts
from contextdb.schema.contracts import VERBS
from contextdb.schema.settings import Schema
from contextdb.tables.other_files import cases_path
from contextdb.tables.table import Table

EXPECTED = "Expected"


@dataclass(frozen=True)
class AssetUses:
    """What speaks of an asset elsewhere than in the cells of one table."""

    tables: tuple[str, ...] = ()
    """Other tables with rows of it, or that cannot be read."""
    n_cases: int = 0
    n_fallbacks: int = 0
    n_contracts: int = 0
    """Those whose kind of rows names it; patterns such as `like 'walk*'` are not looked at."""
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
            (self.n_contracts, "contract"),
            (self.n_markup, "line of markup"),
        )
        return ", ".join(f"{n} lines of markup" if n > 1 and "line" in noun else plural(n, noun) for n, noun in counts if n)


def asset_uses(table: Table, asset: str) -> AssetUses:
    """What speaks of an asset in the files of a table's project, but for the cells of the table itself."""
    if table.path is None:
        return AssetUses()
    project, schema = ProjectFiles.of(table), table.schema
    folder, others, n_cases = project.folder, [], 0
    for name, path in project.tables:
        is_own = real_path(path) == real_path(table.path)
        n_cases += sum(with_value(text, asset, f"{asset}_") != text for text in _expected(path))
        try:
            has_it = project.table_file(name, path).has_asset(asset)
        except ContextDBError:
            others += [] if is_own else [name]
            continue
        others += [name] if not is_own and has_it else []
    n_fallbacks = sum(settings.fallback == asset for settings in schema.tables.values())
    n_contracts = sum(
        with_text(each.kind or "", "asset", asset, f"{asset}_") != (each.kind or "") for each in schema.contracts.values()
    )
    n_markup = 0
    for path in _markup(folder, schema):
        columns = _read(path)
        n_markup += sum(text == asset for c in columns if c.name == "asset" for text in c.to_list())
    patterns = [str(part.get("clips", "")) for part in schema.databases.values()]
    clips = [path.name for pattern in patterns if pattern for path in matching(folder, pattern) if path.stem == asset]
    return AssetUses(tuple(others), n_cases, n_fallbacks, n_contracts, n_markup, tuple(dict.fromkeys(clips)))


def asset_renaming(table: Table, old: str, new: str, only_here: bool = False) -> Renaming:
    """What is to be written so that an asset has another name, in all the project, or in this table, its variants and their saved
    contexts only. Raises TableError, SchemaError or FileError where a table names the new asset already; a file cannot be read, or
    could not say what it should."""
    project = ProjectFiles.of(table)
    files = project.read(only_here)
    project.require_free(files, old, new, TableFile.has_asset, "an asset")
    rewrites = [rewrite for file in files for rewrite in _rewritten_table(file, old, new)]
    for path in _markup(project.folder, project.schema) if not only_here else ():
        rewrites += _rewritten_columns(path, "asset", {old: new})
    only = project.family if only_here else None
    return Renaming(old, new, (*rewrites, *project.rewritten_toml(lambda document: _change(document, old, new, only))))


# ---- parts


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
    assets = file.assets
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


def _change(document: dict[str, Any], old: str, new: str, only: Collection[str] | None) -> None:
    for name, part in document.get("tables", {}).items():
        fallback = part.get("fallback") if only is None or name in only else None
        if fallback == old:
            part["fallback"] = new
        elif isinstance(fallback, dict) and fallback.get("asset") == old:
            part["fallback"] = {**fallback, "asset": new}
    for part in document.get("contracts", {}).values():
        if only is None or part.get("table") in only:
            part |= {key: _kind(part[key], old, new) for key in VERBS if key in part}


def _kind(value: Any, old: str, new: str) -> Any:
    """A kind of rows of a contract, as contextdb.toml has it."""
    if isinstance(value, dict):
        return {key: _kind(part, old, new) for key, part in value.items()}
    return with_text(value, "asset", old, new) if isinstance(value, str) else value
