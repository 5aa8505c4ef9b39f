"""Give a role another name in a whole project, or in one table of it: Defender.DepthChart and all other facts of it go along.

The headers of tables, rules of rows, slots, saved contexts and actors, and in contextdb.toml declarations, derived facts,
assumptions and blueprints. An edge, as `contextdb.edits.renaming`: it reads the files of a folder, and works out how they are to be
written.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from contextdb.cells.outputs import SLOT_COLUMNS
from contextdb.columns import TextColumn
from contextdb.edits.project_files import ProjectFiles, Rewrite, TableFile
from contextdb.edits.renaming import Renaming, rewritten_projects, rewritten_table, uses_of, with_texts
from contextdb.edits.renaming_values import with_value
from contextdb.errors import Fault, SchemaError, in_quotes, plural
from contextdb.files.toml_shapes import wrong_name
from contextdb.schema.settings import Schema
from contextdb.tables.table import Table


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
