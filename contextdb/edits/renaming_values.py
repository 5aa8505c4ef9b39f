"""Give a declared value of a condition another name in a whole project, so that what speaks of it still does.

The cells, saved and expected contexts of all tables, rules of rows, and in contextdb.toml the declared values, mirrors, derived
facts and assumptions; all that in the projects, too, that extend this one. An edge, as `contextdb.edits.renaming`: it reads the
files of a folder, and works out how they are to be written.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contextdb.cells.words import quoted, says_any
from contextdb.columns import TextColumn
from contextdb.disk import real_path
from contextdb.edits.project_files import ProjectFiles, Rewrite, TableFile
from contextdb.edits.renaming import Renaming, extending, rewritten, rewritten_contexts, rewritten_gaps, with_texts
from contextdb.edits.schema_file import require_declared_here
from contextdb.errors import ContextDBError, Fault, SchemaError, in_quotes, plural
from contextdb.expressions.tokens import Refusal, names_in, tokens_of
from contextdb.files.texts import read_texts
from contextdb.schema.settings import Schema
from contextdb.tables.other_files import CASE_COLUMNS, cases_path
from contextdb.tables.project import SCHEMA_FILE
from contextdb.tables.table import Table

_SIGNS = "~+-,;()"
_WORD = re.compile(r'"((?:[^"]|"")*)"|[^\s"]+')


@dataclass(frozen=True)
class ValueUses:
    """What speaks of a value elsewhere than in the cells of one table."""

    tables: tuple[str, ...] = ()
    """Other tables with cells that name it, or that cannot be read."""
    n_cases: int = 0
    n_expressions: int = 0
    """Rules of rows, derived facts and assumptions."""
    projects: tuple[str, ...] = ()
    """Projects that have it because they extend this one."""

    @property
    def text(self) -> str:
        """How many there are of each; nothing for none."""
        counts = (
            (len(self.tables), "other table"),
            (self.n_cases, "saved context"),
            (self.n_expressions, "expression"),
            (len(self.projects), "extending project"),
        )
        return ", ".join(plural(n, noun) for n, noun in counts if n)


def with_value(text: str, old: str, new: str) -> str:
    """A cell or a fact with a value under another name; every other character stays."""

    def renamed(word: re.Match[str]) -> str:
        if word[1] is not None:
            return quoted(new) if word[1].replace('""', '"') == old else word[0]
        bare = word[0].strip(_SIGNS)
        return word[0].replace(bare, quoted(new)) if bare == old else word[0]

    return _WORD.sub(renamed, text)


def value_uses(table: Table, condition: str, value: str) -> ValueUses:
    """What speaks of a value elsewhere than in the cells of a table: in the files of its project."""
    if table.path is None:
        return ValueUses()
    schema, others, n_cases, n_rules = table.schema, [], 0, 0
    project = ProjectFiles.of(table)
    for name, path in project.tables:
        is_own = real_path(path) == real_path(table.path)
        try:
            file = project.table_file(name, path)
        except ContextDBError:
            others += [] if is_own else [name]
            continue
        if not is_own and any(_names_value(c, value) for c in file.columns if c.name == condition):
            others.append(name)
        n_cases += sum(with_value(text, value, f"{value}_") != text for text in _case_facts(path, condition))
        n_rules += sum(_speaks(text, condition, value) for text in (file.rules.to_list() if file.rules is not None else ()))
    expressions = [(c.name, c.expr) for c in schema.conditions.values() if c.expr is not None]
    n_derived = sum(_speaks(text, condition, value, is_own=name == condition) for name, text in expressions)
    n_assumed = sum(_speaks(text, condition, value) for settings in schema.tables.values() for text in settings.assume)
    return ValueUses(tuple(others), n_cases, n_rules + n_derived + n_assumed, extending(project, condition))


def value_renaming(table: Table, condition: str, old: str, new: str) -> Renaming:
    """What is to be written so that a declared value has another name in all the project. Raises TableError, SchemaError or
    FileError where there is such a value already, an expression could mean another condition's value, or a file cannot be read."""
    own = ProjectFiles.of(table)
    if new in (own.schema.conditions[condition].domain.values or ()):
        raise SchemaError(Fault(f"{in_quotes(new)} is a value of {condition} already.", "a name that there is not yet"))
    require_declared_here([("conditions", condition)], own.schema, own.folder / SCHEMA_FILE)
    rewrites: list[Rewrite] = []
    for project, _ in own.carrying([condition]):
        _require_plain(project.schema, condition, old)
        rewrites += [rewrite for file in project.read() for rewrite in _rewritten_table(file, condition, old, new)]
        rewrites += project.rewritten_toml(lambda document: _change(document, condition, old, new), before=rewrites)
    return Renaming(old, new, tuple(rewrites))


# ---- expressions


def _texts(text: str, condition: str, value: str, is_own: bool = False) -> list[tuple[int, int]]:
    """Where an expression that names a condition says a value in quotes."""
    if not is_own and condition not in names_in(text):
        return []
    try:
        return [(token.start, token.stop) for token in tokens_of(text) if token.kind == "text" and token.value == value]
    except Refusal:
        return []


def _speaks(text: str, condition: str, value: str, is_own: bool = False) -> bool:
    return not says_any(text) and bool(_texts(text, condition, value, is_own))


def with_text(text: str, condition: str, old: str, new: str, is_own: bool = False) -> str:
    """An expression that names a condition with a value in quotes under another name."""
    for start, stop in reversed(_texts(text, condition, old, is_own)):
        sign = text[start]
        text = text[:start] + sign + new + sign + text[stop:]
    return text


def _require_plain(schema: Schema, condition: str, value: str) -> None:
    """Refuse where an expression names two conditions that both have the value: which one it means is not for us to say."""
    both = {c.name for c in schema.conditions.values() if c.name != condition and value in (c.domain.values or ())}
    expressions = [c.expr for c in schema.conditions.values() if c.expr is not None]
    expressions += [text for settings in schema.tables.values() for text in settings.assume]
    expressions += [contract.when for contract in schema.contracts.values() if contract.when is not None]
    for text in expressions:
        if _texts(text, condition, value) and (other := next((name for name in names_in(text) if name in both), None)):
            problem = f"{in_quotes(text)} names {condition} and {other}, and both have the value {in_quotes(value)}."
            raise SchemaError(Fault(problem, "expressions in which the value is of one condition", "to rename it there first"))


# ---- files


def _names_value(column: TextColumn, value: str) -> bool:
    return any(with_value(text, value, f"{value}_") != text for text in column.texts)


def _case_facts(table: Path, condition: str) -> Iterator[str]:
    path = cases_path(table)
    try:
        columns = read_texts(path)[1] if path.is_file() and condition not in CASE_COLUMNS else []
    except ContextDBError:
        return
    for column in columns:
        if column.name == condition:
            yield from column.to_list()


def _rewritten_table(file: TableFile, condition: str, old: str, new: str) -> Iterator[Rewrite]:
    """The table and its saved contexts with the value under its other name."""
    rules = file.rules
    columns = []
    for column in file.columns:
        if column.name == condition and file.has_condition(condition):
            columns.append(with_texts(column, {text: with_value(text, old, new) for text in column.texts}))
        elif rules is not None and column.name == rules.name:
            columns.append(with_texts(column, {text: with_text(text, condition, old, new) for text in column.texts}))
        else:
            columns.append(column)
    yield from rewritten(file.path, file.source, file.columns, columns)
    if condition not in CASE_COLUMNS:
        yield from rewritten_contexts(
            file, lambda c: with_texts(c, {text: with_value(text, old, new) for text in c.texts}) if c.name == condition else c
        )
    yield from rewritten_gaps(file.path, lambda name, cell: (name, with_value(cell, old, new) if name == condition else cell))


def _change(document: dict[str, Any], condition: str, old: str, new: str) -> None:
    """Change what contextdb.toml says, as plain data."""
    part = document.get("conditions", {}).get(condition, {})
    if "values" in part:
        part["values"] = [new if value == old else value for value in part["values"]]
    if isinstance(part.get("mirror"), dict):
        names = {old: new}
        part["mirror"] = {names.get(a, a): names.get(b, b) for a, b in part["mirror"].items()}
    for name, other in document.get("conditions", {}).items():
        if isinstance(other.get("expr"), str):
            other["expr"] = with_text(other["expr"], condition, old, new, is_own=name == condition)
    for table in document.get("tables", {}).values():
        if "assume" in table:
            table["assume"] = [with_text(text, condition, old, new) for text in table["assume"]]
    for contract in document.get("contracts", {}).values():
        if isinstance(contract.get("when"), str):
            contract["when"] = with_text(contract["when"], condition, old, new)
