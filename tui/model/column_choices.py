"""The columns that a table could have too: declared conditions it lacks, blueprints, and new ones from a form."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from contextdb.cells.conditions import Condition
from contextdb.edits import edits
from contextdb.edits.edits import NewColumn
from contextdb.errors import ContextDBError, in_quotes, plural, safe_text
from contextdb.files.settings import settings_of
from contextdb.files.toml_shapes import wrong_name
from contextdb.schema.table_settings import PLAIN_JOBS, TableSettings
from contextdb.tables.changes import Edit
from contextdb.tables.table import Table

from .condition_form import ConditionForm, plain


def _words(job: str) -> str:
    about = settings_of(TableSettings)[job].about
    return f"{about[0].lower()}{about[1:-1]}"


JOB_WORDS = {"condition": "excludes rows that refuse the fact", "output": "data for the game"}
JOB_WORDS |= {job: _words(job) for job in edits.JOBS if job not in JOB_WORDS}
"""What a column can be, in a few words."""
JOB_NAMES = {"when": "rule"}
"""What a job is called, where it is not called as in contextdb.toml."""


@dataclass(frozen=True)
class Insertion:
    """Columns to insert before column `at`, and what contextdb.toml is to say of them."""

    at: int
    columns: tuple[NewColumn, ...]

    def edit(self, table: Table) -> Edit:
        """The edit that inserts them."""
        return edits.insert_columns(table, self.at, self.columns)


@dataclass(frozen=True)
class Choice:
    """Something that can be inserted: a declared condition, or what is missing of a blueprint."""

    name: str
    about: str
    """Its type and what it is, in a line."""
    columns: tuple[NewColumn, ...]
    is_blueprint: bool = False


@dataclass(frozen=True)
class Blueprint:
    """A blueprint, and which of its conditions the table has already."""

    name: str
    conditions: tuple[str, ...]
    missing: tuple[str, ...]

    @property
    def about(self) -> str:
        """How many columns it would add."""
        if not self.missing:
            return f"all {len(self.conditions)} are here" if self.conditions else "no conditions"
        return f"{plural(len(self.missing), 'column')} of {len(self.conditions)}: {', '.join(map(safe_text, self.missing))}"


def choices(table: Table, text: str = "") -> list[Choice]:
    """The declared conditions that a table lacks, then the blueprints it lacks something of; those in which all words occur."""
    declared = [Choice(c.name, about(c), (NewColumn(c.name),)) for c in missing_conditions(table)]
    made = [
        Choice(b.name, b.about, tuple(NewColumn(name) for name in b.missing), is_blueprint=True)
        for b in blueprints(table)
        if b.missing
    ]
    words = text.casefold().split()
    matching = [c for c in declared + made if all(word in f"{c.name} {c.about}".casefold() for word in words)]
    return sorted(matching, key=lambda c: not c.name.casefold().startswith(text.strip().casefold()))


def missing_conditions(table: Table) -> list[Condition]:
    """The declared conditions that a table has no column for."""
    names = {c.name for c in table.columns}
    return [c for c in table.schema.conditions.values() if c.name not in names and c.expr is None]


def about(condition: Condition) -> str:
    """A condition in a line: its type, its unit, what it is."""
    domain = condition.domain
    values = f" {' '.join(domain.values[:4])}{' …' if len(domain.values) > 4 else ''}" if domain.values else ""
    unit = f", {condition.unit}" if condition.unit else ""
    return safe_text(f"{domain.kind}{values}{unit}" + (f": {condition.description}" if condition.description else ""), 200)


def blueprints(table: Table) -> list[Blueprint]:
    """Every blueprint, and what of it the table lacks."""
    names = {c.name for c in table.columns}
    return [
        Blueprint(name, conditions, tuple(c for c in conditions if c not in names))
        for name, conditions in table.schema.blueprints.items()
    ]


def places(table: Table, column: int) -> dict[str, int]:
    """Where new columns can go, in words: behind the cursor's column, or the last one."""
    names = [c.name for c in table.columns]
    at = min(column, len(names) - 1)
    rows = {"at the end": len(names)}
    return {f"behind {safe_text(names[at])}": at + 1} | rows if 0 <= at < len(names) - 1 else rows


@dataclass(frozen=True)
class NewColumnForm:
    """A new column as it is typed: its name, what it is, and, for a condition, its form."""

    name: str
    job: str = "condition"
    condition: ConditionForm = field(default_factory=ConditionForm)

    def read(self, table: Table) -> tuple[NewColumn, dict[str, str]]:
        """The column, and for each invalid field why."""
        name = self.name.strip()
        declared, wrong = self.condition.declared() if self.job == "condition" else ({}, {})
        is_known = self.job == "condition" and name in table.schema.conditions
        column = NewColumn(name, self.job, None if is_known or self.job != "condition" else declared)
        faults = {"name": _wrong_name(table, name), "job": _wrong_job(table, self.job, name), **({} if is_known else wrong)}
        return column, {key: why for key, why in faults.items() if why} or _refused(table, column)


def _wrong_name(table: Table, name: str) -> str:
    if not name:
        return "A column needs a name."
    if any(c.name == name for c in table.columns):
        return f"The table has a column {in_quotes(name)} already."
    if fault := edits.unwritable(name):
        return plain(fault)
    return f"This cannot be a name: {wrong}." if (wrong := wrong_name(name)) else ""


def _wrong_job(table: Table, job: str, name: str) -> str:
    if job in ("when", *PLAIN_JOBS) and (column := getattr(table.settings, job)):
        return f"The table has one already: {in_quotes(column)}."
    is_declared = job != "condition" and name in table.schema.conditions
    return f"{in_quotes(name)} is declared as a condition." if is_declared else ""


def _refused(table: Table, column: NewColumn) -> dict[str, str]:
    """What the table itself says to the column."""
    try:
        edits.insert_columns(table, len(table.columns), [column]).apply(table.with_rows_taken([]))
    except ContextDBError as error:
        return {"name": plain(error.faults[0])}
    return {}


def blueprint_fault(table: Table, name: str, conditions: Sequence[str]) -> str:
    """Why conditions cannot be stored as a blueprint of this name."""
    if not name.strip():
        return "A blueprint needs a name."
    if name.strip() in table.schema.blueprints:
        return f"There is a blueprint {in_quotes(name.strip())} already."
    return "" if conditions else "No selected column is a condition."


def conditions_of(table: Table, columns: Iterable[str]) -> list[str]:
    """Those of some columns that are conditions."""
    conditions = {c.condition.name for c in table.conditions}
    return [name for name in columns if name in conditions]
