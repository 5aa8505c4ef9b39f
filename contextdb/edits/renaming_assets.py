"""Give an asset another name in a whole project, or in one table of it.

The cells of all tables that name it, fallbacks, saved contexts, contracts, and the markup of databases. The clip keeps its file's
name: it is another program's, and `AssetUses` says which it is. An edge, as `contextdb.edits.renaming`.

The headers of tables, rules of rows, slots, saved contexts and actors, and in contextdb.toml declarations, derived facts,
assumptions and blueprints. An edge, as `contextdb.edits.renaming`: it reads the files of a folder, and works out how they are to be
written.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contextdb.cells.outputs import SLOT_COLUMNS
from contextdb.columns import TextColumn
from contextdb.disk import matching, real_path
from contextdb.edits.project_files import ProjectFiles, Rewrite, TableFile
from contextdb.edits.renaming import Renaming, rewritten, rewritten_notes, rewritten_projects, rewritten_table, uses_of, with_texts
from contextdb.edits.renaming_values import with_text, with_value
from contextdb.errors import ContextDBError, Fault, SchemaError, in_quotes, plural
from contextdb.files.texts import read_texts
from contextdb.files.toml_shapes import wrong_name
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


# ---- give a role another name in a whole project, or in one table of it: Defender.DepthChart and all other facts of it go
# along


def facts_of(table: Table, role: str) -> tuple[str, ...]:
    """The conditions of a role that a table or its contextdb.toml has."""
    names = dict.fromkeys((*table.schema.conditions, *(c.condition.name for c in table.conditions)))
    return tuple(name for name in names if name.partition(".")[0] == role and name.partition(".")[2])


def role_uses(table: Table, role: str) -> tuple[str, tuple[str, ...]]:
    """What speaks of a role, in words, and the other tables that do."""
    uses = [uses_of(table, fact) for fact in facts_of(table, role)]
    tables = tuple(dict.fromkeys(name for one in uses for name in one.tables))
    derived = {name for one in uses for name in one.derived if name.partition(".")[0] != role}
    counts = (
        (len(uses), "fact"),
        (len(tables), "other table"),
        (len(derived), "derived fact"),
        (max((one.n_assumptions for one in uses), default=0), "assumption"),
        (max((one.n_contracts for one in uses), default=0), "contract"),
        (len({project for one in uses for project in one.projects}), "extending project"),
        (max((one.n_rules for one in uses), default=0), "rule"),
        (max((one.n_cases for one in uses), default=0), "saved context"),
    )
    return ", ".join(plural(n, noun) for n, noun in counts if n), tables


def role_renaming(table: Table, old: str, new: str, only_here: bool = False) -> Renaming:
    """What is to be written so that a role has another name, in all the project or in this table only. Raises TableError,
    SchemaError or FileError where there is such a role already, or it is no name; a file cannot be read, or could not say what it
    should."""
    project = ProjectFiles.of(table)
    files = project.read(only_here)
    names = _names(project.schema, files, old, new)
    _require_role(new, {*project.schema.conditions, *(c.name for file in files for c in file.columns)})
    return Renaming(old, new, rewritten_projects(project, names, only_here, lambda file, own: _rewritten(file, own, old, new)))


def _names(schema: Schema, files: list[TableFile], old: str, new: str) -> dict[str, str]:
    """The conditions of the role, each with its other name."""
    columns = (c.name for file in files for c in file.columns if file.has_condition(c.name))
    named = (name for name in dict.fromkeys((*schema.conditions, *columns)) if name.startswith(f"{old}."))
    return {name: f"{new}.{name.removeprefix(f'{old}.')}" for name in named}


def _require_role(new: str, taken: set[str]) -> None:
    wrong = wrong_name(new) or ("a role has no dot in its name" if "." in new else "")
    if wrong:
        raise SchemaError(Fault(f"{in_quotes(new)} cannot be a role: {wrong}.", "a name without a dot"))
    if any(name.startswith(f"{new}.") for name in taken):
        raise SchemaError(Fault(f"there is a role {in_quotes(new)} already.", "a name that no role has yet"))


def _rewritten(file: TableFile, names: Mapping[str, str], old: str, new: str) -> Iterator[Rewrite]:
    def slots(column: TextColumn) -> TextColumn:
        if column.name not in SLOT_COLUMNS or column.name not in file.settings.outputs:
            return column
        return with_texts(column, {text: with_value(text, old, new) for text in column.texts})

    yield from rewritten_table(file, names, {old: new}, slots)
