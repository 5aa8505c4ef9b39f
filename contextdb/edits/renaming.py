"""Give a condition another name in a whole project, or in one table of it, so that what speaks of it still does.

    everywhere        the headers of all tables, rules of rows, saved and expected contexts and actors, and in contextdb.toml the
                      declaration, derived facts, assumptions and blueprints; all that in the projects, too, that have the condition
                      because they extend this one
    in one table      its header and those of its variants, their rules, their saved contexts and actors, their assumptions; the new
                      name is declared as the old one is, which stays for all others

An edge: it reads the files of a folder, and writes them. All are worked out and read again before the first is written; when the
disk refuses one, those that were written are put back.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from contextdb.cells.words import says_any
from contextdb.columns import TextColumn
from contextdb.disk import ACTORS_SUFFIX, NOTES_SUFFIX, read_bytes, write_atomic
from contextdb.disk.together import putting_back
from contextdb.edits.project_files import NO_NAMES, ProjectFiles, Rewrite, TableFile
from contextdb.edits.schema_file import require_declared_here
from contextdb.errors import ContextDBError, Fault, FileError, Place, SchemaError, TableError, in_quotes, plural
from contextdb.expressions.tokens import names_in, with_names
from contextdb.files.texts import AnySource, read_texts, written_over
from contextdb.tables.gap_work import GapWork, gaps_path, key_of
from contextdb.tables.other_files import CASE_COLUMNS, cases_path
from contextdb.tables.project import SCHEMA_FILE
from contextdb.tables.table import Table


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
    projects: tuple[str, ...] = ()
    """Projects that have it because they extend this one."""
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
            (len(self.projects), "extending project"),
            (self.n_rules, "rule"),
            (self.n_cases, "saved context"),
        )
        return ", ".join(plural(n, noun) for n, noun in counts if n)


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


def uses_of(table: Table, condition: str) -> Uses:
    """What else speaks of a condition than the column of a table. Of the table its unsaved edits count, of others the files."""
    schema, own = table.schema, table.settings
    others: list[str] = []
    n_rules = n_own_rules = 0
    if table.when is not None:
        n_own_rules = _n_rules(table.text_column(table.when.name), condition)
    n_cases = n_own_cases = _n_cases(table.path, condition) if table.path is not None else 0
    project = ProjectFiles.of(table) if table.path is not None else None
    for name, path in project.tables if project is not None else ():
        if project is None or name == project.own:
            continue
        try:
            file = project.table_file(name, path)
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
    projects = extending(project, condition) if project is not None else ()
    is_elsewhere = bool(others or derived or blueprints or projects or n_rules or n_cases > n_own_cases or n_assumed or n_premises)
    counts = n_own_assumed + n_assumed, n_own_premises + n_premises
    return Uses(tuple(others), derived, *counts, blueprints, projects, n_rules + n_own_rules, n_cases, is_elsewhere)


def extending(project: ProjectFiles, condition: str) -> tuple[str, ...]:
    """The folders of the projects that have a condition because they extend this one."""
    return tuple(str(other.folder) for other, _ in project.carrying([condition])[1:])


def renaming(table: Table, old: str, new: str, only_here: bool = False) -> Renaming:
    """What is to be written so that a condition of a table has another name, in all the project or in this table only. Raises
    TableError, SchemaError or FileError where the new name is taken or no name; a file cannot be read, or could not say what it
    should."""
    project = ProjectFiles.of(table)
    return Renaming(old, new, rewritten_projects(project, {old: new}, only_here, lambda file, names: rewritten_table(file, names)))


def rewritten_projects(
    project: ProjectFiles,
    names: Mapping[str, str],
    only_here: bool,
    rewritten_file: Callable[[TableFile, Mapping[str, str]], Iterator[Rewrite]],
) -> tuple[Rewrite, ...]:
    """All files that speak of conditions under their other names: of a project and those that extend it, or of a table and its
    variants only. Raises errors as `renaming` does."""
    if not only_here:
        require_declared_here((("conditions", name) for name in names), project.schema, project.folder / SCHEMA_FILE)
    rewrites: list[Rewrite] = []
    for each, carried in [(project, frozenset(names))] if only_here else project.carrying(names):
        own = {old: new for old, new in names.items() if old in carried}
        files = each.read(only_here)
        for old, new in own.items():
            if not only_here and new in each.schema.conditions:
                fault = Fault(f"the condition {in_quotes(new)} is declared already.", "a name that nothing has yet")
                raise SchemaError(fault.at(Place(str(each.folder / SCHEMA_FILE))))
            each.require_free(files, old, new, TableFile.has_condition, "a condition")
        rewrites += [rewrite for file in files for rewrite in rewritten_file(file, own)]
        if only_here:
            rewrites += each.rewritten_toml(partial(only_here_in, names=own, tables=each.family))
        else:
            rewrites += each.rewritten_toml(partial(everywhere_in, names=own), own, rewrites)
    return tuple(rewrites)


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
    of_cases = {old: new for old, new in names.items() if old not in CASE_COLUMNS}
    yield from rewritten_contexts(file, lambda column: column.renamed(of_cases.get(column.name, column.name)))
    yield from rewritten_gaps(file.path, lambda name, cell: (names.get(name, name), cell))
    yield from rewritten_notes(file.path, "Column", names)
    yield from rewritten_actors(file.path, names, roles)


def rewritten_contexts(file: TableFile, change: Callable[[TextColumn], TextColumn]) -> Iterator[Rewrite]:
    """The saved contexts of a table and those that are expected, with other columns."""
    for path in (cases_path(file.path), file.expected):
        if path is not None and path.is_file():
            source, columns = read_texts(path)
            after = [c if (changed := change(c)).name == c.name and changed.texts == c.texts else changed for c in columns]
            _require_free(path, after)
            yield from rewritten(path, source, columns, after)


def rewritten_gaps(table: Path, change: Callable[[str, str], tuple[str, str]]) -> Iterator[Rewrite]:
    """The work on a table's gaps with other conditions, or other cells of them."""
    path = gaps_path(table)
    if path.is_file():
        raw = read_bytes(path)
        lines = GapWork.of(raw, str(path)).lines
        after = GapWork({key_of(dict(change(*cell) for cell in key)): work for key, work in lines.items()}).to_bytes()
        if after != raw:
            yield Rewrite(path, raw, after)


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


def only_here_in(document: dict[str, Any], names: Mapping[str, str], tables: Collection[str]) -> None:
    """Change what the file says of some tables; new names are declared as the old ones are."""
    conditions = document.get("conditions", {})
    for old, new in names.items():
        if old in conditions and new not in conditions:
            conditions[new] = deepcopy(conditions[old])
    for table in tables:
        _assume(document.get("tables", {}).get(table, {}), names)
    for part in document.get("contracts", {}).values():
        if part.get("table") in tables:
            _premise(part, names)


def _assume(part: dict[str, Any], names: Mapping[str, str]) -> None:
    if "assume" in part:
        part["assume"] = [with_names(text, names) for text in part["assume"]]


def _premise(part: dict[str, Any], names: Mapping[str, str]) -> None:
    if isinstance(part.get("when"), str):
        part["when"] = with_names(part["when"], names)
