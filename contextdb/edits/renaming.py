"""Give a condition another name in a whole project, or in one table of it, so that what speaks of it still does.

    everywhere        the headers of all tables, rules of rows, saved contexts and actors, and in contextdb.toml the declaration,
                      derived facts, assumptions and blueprints
    in one table      its header, its rules, its saved contexts and actors, its assumptions; the new name is declared as the old
                      one is, which stays for all others

An edge: it reads the files of a folder, and writes them. All are worked out and read again before the first is written; when the
disk refuses one, those that were written are put back.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from contextdb.cells.words import says_any
from contextdb.columns import TextColumn
from contextdb.disk import ACTORS_SUFFIX, NOTES_SUFFIX, read_bytes, real_path, write_atomic
from contextdb.disk.together import putting_back
from contextdb.edits.schema_file import require_declared_here, schema_path
from contextdb.errors import ContextDBError, Fault, FileError, Place, SchemaError, TableError, in_quotes, plural
from contextdb.expressions.names import names_in, with_names
from contextdb.files.texts import AnySource, read_texts, written_over
from contextdb.schema import toml_edit
from contextdb.schema.settings import Schema, TableSettings, plain_names
from contextdb.tables.gap_work import FIELDS, gaps_path
from contextdb.tables.other_files import CASE_COLUMNS, cases_path
from contextdb.tables.project import SCHEMA_FILE, read_folder_schema, schema_of, table_files
from contextdb.tables.table import Table

NO_NAMES: Mapping[str, str] = {}
_BOM = b"\xef\xbb\xbf"


@dataclass(frozen=True)
class Uses:
    """What else speaks of a condition than the column of one table."""

    tables: tuple[str, ...] = ()
    """Other tables that have it as a column, or that cannot be read."""
    derived: tuple[str, ...] = ()
    """Derived facts that are computed from it."""
    n_assumptions: int = 0
    n_contracts: int = 0
    blueprints: tuple[str, ...] = ()
    n_rules: int = 0
    """Rows, of any table, whose own rule names it."""
    n_cases: int = 0
    """Saved contexts, of any table, that give its fact."""
    is_elsewhere: bool = False
    """Some of them are not of the table itself, and keep the old name when only the table takes another one."""

    @property
    def text(self) -> str:
        """How many there are of each: "1 table, 2 rules, 1 saved context"; nothing for none."""
        counts = (
            (len(self.tables), "table"),
            (len(self.derived), "derived fact"),
            (self.n_assumptions, "assumption"),
            (self.n_contracts, "contract"),
            (len(self.blueprints), "blueprint"),
            (self.n_rules, "rule"),
            (self.n_cases, "saved context"),
        )
        return ", ".join(plural(n, noun) for n, noun in counts if n)


@dataclass(frozen=True)
class Rewrite:
    """A file as it is to be written."""

    path: Path
    before: bytes
    after: bytes


@dataclass(frozen=True)
class Renaming:
    """The files of a project under another name of a condition, a value, a role or an asset."""

    old: str
    new: str
    files: tuple[Rewrite, ...]

    @property
    def reversed(self) -> Renaming:
        return Renaming(self.new, self.old, tuple(Rewrite(file.path, file.after, file.before) for file in self.files))

    def write(self) -> None:
        """Replace the files. Raises FileError where a file was changed since it was read, or the disk refuses: then all are as they
        were."""
        for file in self.files:
            if read_bytes(file.path) != file.before:
                fault = Fault("the file was changed since the rename was worked out.", "a file at rest", "to do it again")
                raise FileError(fault.at(Place(str(file.path))))
        for at, file in enumerate(self.files):
            try:
                write_atomic(file.path, file.after)
            except FileError:
                for written in self.files[:at]:
                    with putting_back(written.path, "to rename back once the disk can be written"):
                        write_atomic(written.path, written.before)
                raise


@dataclass(frozen=True)
class TableFile:
    """A table's file and what is in it."""

    name: str
    path: Path
    settings: TableSettings
    source: AnySource
    columns: tuple[TextColumn, ...]

    @classmethod
    def read(cls, name: str, path: Path, settings: TableSettings) -> TableFile:
        source, columns = read_texts(path)
        return cls(name, path, settings, source, tuple(columns))

    def has_condition(self, condition: str) -> bool:
        """Whether the table has a column that is this condition."""
        return condition not in plain_names(self.settings, self.columns) and any(c.name == condition for c in self.columns)

    @property
    def rules(self) -> TextColumn | None:
        return next((c for c in self.columns if c.name == self.settings.when), None)


@dataclass(frozen=True)
class ProjectFiles:
    """The project of a table as it is on the disk."""

    folder: Path
    raw: bytes
    """Its contextdb.toml; empty where there is none."""
    schema: Schema
    tables: tuple[tuple[str, Path], ...]
    own: str
    """The name of the table."""

    @classmethod
    def of(cls, table: Table) -> ProjectFiles:
        folder = folder_of(table)
        assert table.path is not None
        raw = read_bytes(folder / SCHEMA_FILE) if (folder / SCHEMA_FILE).is_file() else b""
        schema = read_folder_schema(folder) if raw else table.schema
        tables, here = tuple(table_files(folder, schema)), real_path(table.path)
        own = next((name for name, path in tables if real_path(path) == here), table.name)
        return cls(folder, raw, schema, tables, own)

    def read(self, only_own: bool = False) -> list[TableFile]:
        """The tables of the project, or the table alone."""
        named = [(name, path) for name, path in self.tables if name == self.own or not only_own]
        return [TableFile.read(name, path, self.schema.tables.get(name, TableSettings(name))) for name, path in named]

    def rewritten_toml(self, change: Callable[[dict[str, Any]], None], moved: Mapping[str, str] = NO_NAMES) -> Iterator[Rewrite]:
        """contextdb.toml with a change, where there is one; see the function of this name."""
        if self.raw:
            yield from rewritten_toml(self.folder / SCHEMA_FILE, self.raw, change, moved)

    def with_conditions(self, names: Mapping[str, str], only_here: bool) -> Iterator[Rewrite]:
        """contextdb.toml with other names of conditions, in all the project or in the table only."""
        if only_here:
            yield from self.rewritten_toml(lambda document: only_here_in(document, names, self.own))
        else:
            yield from self.rewritten_toml(lambda document: everywhere_in(document, names), names)


def uses_of(table: Table, condition: str) -> Uses:
    """What else speaks of a condition than the column of a table. Of the table its unsaved edits count, of others the files."""
    schema, own = table.schema, table.settings
    others: list[str] = []
    n_rules = n_own_rules = 0
    if table.when is not None:
        n_own_rules = _n_rules(table.text_column(table.when.name), condition)
    n_cases = n_own_cases = _n_cases(table.path, condition) if table.path is not None else 0
    for name, path in table_files(folder_of(table), schema) if table.path is not None else ():
        if table.path is not None and real_path(path) == real_path(table.path):
            continue
        try:
            file = TableFile.read(name, path, schema.tables.get(name, TableSettings(name)))
        except ContextDBError:  # what it holds is not known
            others.append(name)
            continue
        others += [name] if file.has_condition(condition) else []
        n_rules += _n_rules(file.rules, condition) if file.rules is not None else 0
        n_cases += _n_cases(path, condition)
    derived = tuple(c.name for c in schema.conditions.values() if c.expr is not None and condition in names_in(c.expr))
    blueprints = tuple(name for name, names in schema.blueprints.items() if condition in names)
    premises = {t: [c.when for c in schema.contracts.values() if c.when and (c.table == own.name) == t] for t in (True, False)}
    n_own_premises, n_premises = (_n_naming(premises[is_own], condition) for is_own in (True, False))
    elsewhere = [text for s in schema.tables.values() if s.name != own.name for text in s.assume]
    n_own_assumed, n_assumed = _n_naming(own.assume, condition), _n_naming(elsewhere, condition)
    is_elsewhere = bool(others or derived or blueprints or n_rules or n_cases > n_own_cases or n_assumed or n_premises)
    counts = n_own_assumed + n_assumed, n_own_premises + n_premises
    return Uses(tuple(others), derived, *counts, blueprints, n_rules + n_own_rules, n_cases, is_elsewhere)


def renaming(table: Table, old: str, new: str, only_here: bool = False) -> Renaming:
    """What is to be written so that a condition of a table has another name, in all the project or in this table only. Raises
    TableError, SchemaError or FileError where the new name is taken or no name; a file cannot be read, or could not say what it
    should."""
    files = ProjectFiles.of(table)
    if not only_here and new in files.schema.conditions:
        raise SchemaError(Fault(f"the condition {in_quotes(new)} is declared already.", "a name that nothing has yet"))
    if not only_here:
        require_declared_here([("conditions", old)], files.schema, files.folder / SCHEMA_FILE)
    rewrites = [rewrite for file in files.read(only_here) for rewrite in rewritten_table(file, {old: new})]
    return Renaming(old, new, (*rewrites, *files.with_conditions({old: new}, only_here)))


def folder_of(table: Table) -> Path:
    """The folder of the project that a table is in."""
    return schema_path(table).parent


# ---- what speaks of a condition


def _n_naming(texts: Sequence[str], condition: str) -> int:
    return sum(condition in names_in(text) for text in texts)


def _n_rules(column: TextColumn, condition: str) -> int:
    naming = [code for code, text in enumerate(column.texts) if not says_any(text) and condition in names_in(text)]
    return int(np.isin(column.codes, naming).sum())


def _n_cases(table: Path, condition: str) -> int:
    path = cases_path(table)
    try:
        columns = read_texts(path)[1] if path.is_file() and condition not in CASE_COLUMNS else []
    except ContextDBError:
        return 1
    return sum(bool(text.strip()) for column in columns if column.name == condition for text in column.to_list())


# ---- files under the new name


def rewritten_table(
    file: TableFile,
    names: Mapping[str, str],
    roles: Mapping[str, str] = NO_NAMES,
    change: Callable[[TextColumn], TextColumn] = lambda column: column,
) -> Iterator[Rewrite]:
    """The table, its saved contexts, notes and actors, where they speak of conditions and roles, under other names; `change` is of
    its other columns."""
    columns = [c.renamed(names[c.name]) if c.name in names and file.has_condition(c.name) else change(c) for c in file.columns]
    _require_free(file.path, columns)
    columns = [_with_rules(c, names) if file.rules is not None and c.name == file.rules.name else c for c in columns]
    yield from rewritten(file.path, file.source, file.columns, columns)
    cases, of_cases = cases_path(file.path), {old: new for old, new in names.items() if old not in CASE_COLUMNS}
    if cases.is_file() and of_cases:
        source, texts = read_texts(cases)
        renamed = [c.renamed(of_cases[c.name]) if c.name in of_cases else c for c in texts]
        _require_free(cases, renamed)
        yield from rewritten(cases, source, texts, renamed)
    gaps = gaps_path(file.path)
    if gaps.is_file():
        source, texts = read_texts(gaps)
        renamed = [c.renamed(names.get(c.name, c.name)) if at >= len(FIELDS) else c for at, c in enumerate(texts)]
        _require_free(gaps, renamed)
        yield from rewritten(gaps, source, texts, renamed)
    yield from rewritten_notes(file.path, "Column", names)
    yield from rewritten_actors(file.path, names, roles)


def rewritten_notes(table: Path, column: str, names: Mapping[str, str]) -> Iterator[Rewrite]:
    """The notes on a table with other names in one of their columns."""
    path = table.with_name(table.stem + NOTES_SUFFIX)
    if path.is_file():
        source, texts = read_texts(path)
        yield from rewritten(path, source, texts, [with_texts(c, names) if c.name == column else c for c in texts])


def with_texts(column: TextColumn, texts: Mapping[str, str]) -> TextColumn:
    """A column with other texts; the same one where none of it is."""
    if all(texts.get(text, text) == text for text in column.texts):
        return column
    return TextColumn.of(column.name, [texts.get(text, text) for text in column.to_list()])


def actors_path(table: Path) -> Path:
    """The file of the actors for a table's roles."""
    return table.with_name(table.stem + ACTORS_SUFFIX)


def rewritten_actors(table: Path, names: Mapping[str, str], roles: Mapping[str, str]) -> Iterator[Rewrite]:
    """The actors that are kept next to a table with other names of roles and of their facts, which actors have with the role before
    them or without."""
    path = actors_path(table)
    if not path.is_file():
        return
    whole: dict[str, str] = {}
    short: dict[str, dict[str, str]] = {}
    for old, new in names.items():
        (role, _, was), (new_role, _, now) = old.partition("."), new.partition(".")
        if was and now and roles.get(role, role) == new_role:
            whole[old] = new
            short.setdefault(role, {})[was] = now
    raw = read_bytes(path)
    try:
        teams, renamed = json.loads(raw), {}
        for role, team in teams.items():
            own = whole | short.get(role, {})
            renamed[roles.get(role, role)] = [{own.get(fact, fact): value for fact, value in actor.items()} for actor in team]
    except (ValueError, AttributeError, TypeError):  # no file of actors: reported where it is read
        return
    if renamed != teams:
        yield Rewrite(path, raw, (json.dumps(renamed, ensure_ascii=False, indent=2) + "\n").encode())


def _with_rules(column: TextColumn, names: Mapping[str, str]) -> TextColumn:
    texts = [text if says_any(text) else with_names(text, names) for text in column.texts]
    return column if texts == list(column.texts) else TextColumn.of(column.name, [texts[code] for code in column.codes.tolist()])


def _require_free(path: Path, columns: Sequence[TextColumn]) -> None:
    names = [c.name for c in columns]
    if twice := [name for name in dict.fromkeys(names) if names.count(name) > 1]:
        problem = f"the file would have two columns {in_quotes(twice[0])}."
        raise TableError(Fault(problem, "a name that no column has yet", place=Place(str(path))))


def rewritten(path: Path, source: AnySource, before: Sequence[TextColumn], after: Sequence[TextColumn]) -> Iterator[Rewrite]:
    """A file of columns as it is to be written, where one of them is another."""
    if all(one is other for one, other in zip(before, after, strict=True)):
        return
    yield Rewrite(path, source.raw, written_over(source, after, np.arange(after[0].n_rows)).raw)


# ---- contextdb.toml


def everywhere_in(document: dict[str, Any], names: Mapping[str, str]) -> None:
    """Change what the file says, as plain data."""
    conditions = document.get("conditions", {})
    if any(name in conditions for name in names):
        document["conditions"] = {names.get(name, name): part for name, part in conditions.items()}
    for part in document.get("conditions", {}).values():
        if isinstance(part.get("expr"), str):
            part["expr"] = with_names(part["expr"], names)
    for part in document.get("tables", {}).values():
        _assume(part, names)
    for part in document.get("contracts", {}).values():
        _premise(part, names)
    for part in document.get("blueprints", {}).values():
        part["conditions"] = [names.get(name, name) for name in part.get("conditions", [])]


def only_here_in(document: dict[str, Any], names: Mapping[str, str], table: str) -> None:
    """Change what the file says of one table; new names are declared as the old ones are."""
    conditions = document.get("conditions", {})
    for old, new in names.items():
        if old in conditions and new not in conditions:
            conditions[new] = deepcopy(conditions[old])
    _assume(document.get("tables", {}).get(table, {}), names)
    for part in document.get("contracts", {}).values():
        if part.get("table") == table:
            _premise(part, names)


def _assume(part: dict[str, Any], names: Mapping[str, str]) -> None:
    if "assume" in part:
        part["assume"] = [with_names(text, names) for text in part["assume"]]


def _premise(part: dict[str, Any], names: Mapping[str, str]) -> None:
    if isinstance(part.get("when"), str):
        part["when"] = with_names(part["when"], names)


def rewritten_toml(
    path: Path, raw: bytes, change: Callable[[dict[str, Any]], None], moved: Mapping[str, str], kind: str = "conditions"
) -> Iterator[Rewrite]:
    """contextdb.toml with a change; only the keys that say something else are written, and a section of `kind` that moves keeps its
    lines."""
    bom = _BOM if raw.startswith(_BOM) else b""
    text = raw.removeprefix(_BOM).decode()
    before, wanted = tomllib.loads(text), tomllib.loads(text)
    change(wanted)
    if wanted == before:
        return
    for old, new in moved.items():
        text = toml_edit.rename_section(text, (kind, old), (kind, new)) or text
    for section in ("conditions", "tables", "blueprints", "contracts"):
        text = _with_section(text, section, tomllib.loads(text).get(section, {}), wanted.get(section, {}))
    if tomllib.loads(text) != wanted:
        problem = "this cannot be renamed without changing more of the file."
        raise SchemaError(Fault(problem, "sections such as [conditions.NAME]", "to rename it in a text editor", Place(str(path))))
    schema_of(text.encode(), path)  # refuses what no project can be
    yield Rewrite(path, raw, bom + text.encode())


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
