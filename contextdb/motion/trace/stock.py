"""What recorded searches are asked of again: the databases of a project, and its tables.

A table is seen as something that can be asked and edited; nothing of it is known here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any, Protocol, runtime_checkable

from contextdb.cells.arguments import require_kind, require_mapping
from contextdb.cells.conditions import Condition
from contextdb.cells.mirroring import changed_in_mirror, mirrored_facts
from contextdb.errors import ContextDBError, Fault, MotionError, in_quotes, mend_for, some
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.storage.building import open_or_build
from contextdb.motion.storage.config import MotionConfig

UNKNOWN = "any"
"""How a table is asked where the recorded facts leave one out: the condition is ignored."""


class Failing(Protocol):
    """A cell that does not accept its fact, and the one that would."""

    condition: str
    cell: str
    fact: str
    mend: str


class Row(Protocol):
    """Why a row is valid or not."""

    row: int
    asset: str
    is_enabled: bool
    failures: Sequence[Failing]


class Queryable(Protocol):
    """A compiled table."""

    @property
    def leaves(self) -> Sequence[str]: ...

    @property
    def asked(self) -> Mapping[str, Condition]: ...

    def query(self, context: Any, *, unknown: Any) -> Any: ...

    def explain(self, context: Any, *, unknown: Any) -> Any: ...


@runtime_checkable
class Edited(Protocol):
    """A table."""

    def compile(self) -> Queryable: ...

    def with_cell(self, row: int, column: str, text: str) -> Edited: ...


@runtime_checkable
class Described(Protocol):
    """A project: what its contextdb.toml says, its folder, and its tables."""

    @property
    def schema(self) -> Any: ...

    @property
    def folder(self) -> str | PathLike[str]: ...

    @property
    def tables(self) -> Mapping[str, Any]: ...


@dataclass(frozen=True, eq=False)
class Stock:
    """Databases, and the tables that say which of their assets are valid; `table_of` names the table of a database."""

    databases: Mapping[str, MotionDatabase]
    tables: Mapping[str, Edited] = field(default_factory=dict)
    table_of: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, project: object, names: Iterable[str]) -> Stock:
        """The databases of some names and the tables of a project; or a mapping of databases, without tables."""
        if isinstance(project, Described):
            config = MotionConfig.from_dict(project.schema.motion, tables=project.tables)
            wanted = [name for name in names if name in config.databases]
            assets = {name: table.compile().leaves for name, table in project.tables.items()}
            databases = open_or_build(config, project.folder, assets, names=wanted)
            return cls.with_tables(databases, project)
        given = require_mapping(project, "project", "a Project, or a mapping of names to databases")
        for each in given.values():
            require_kind(each, MotionDatabase, "one of project", "a MotionDatabase")
        return cls(given)

    @classmethod
    def with_tables(cls, databases: Mapping[str, MotionDatabase], project: Described) -> Stock:
        config = MotionConfig.from_dict(project.schema.motion, tables=project.tables)
        """The tables of the databases: what contextdb.toml names, else the only table that has assets of a database, as a game that
        hands its characters a table does not name it there."""
        assets = {name: {*table.compile().leaves} for name, table in project.tables.items()}
        table_of: dict[str, str] = {}
        for name, database in databases.items():
            named = config.databases[name].table if name in config.databases else None
            having = [named] if named else [table for table, own in assets.items() if not own.isdisjoint(database.assets)]
            if len(having) == 1:
                table_of[name] = having[0]
        return cls(databases, project.tables, table_of)

    def table(self, database: str) -> Edited | None:
        return self.tables.get(self.table_of.get(database, ""))


def failing_rows(table: Queryable, asset: str, context: Mapping[str, Any], is_mirrored: bool) -> list[Row]:
    """The rows of an asset that are not valid, with the facts mirrored for one that plays so; none where these cannot be asked."""
    try:
        facts = mirrored_facts(context, changed_in_mirror(table.asked.values())) if is_mirrored else dict(context)
        return [row for row in table.explain(facts, unknown=UNKNOWN).asset(asset) if not row.is_valid]
    except ContextDBError:
        return []


def require_name(name: object, what: str, known: Iterable[str]) -> None:
    """Raise MotionError for a name that is not among some, with the nearest."""
    names = list(known)
    if name not in names:
        raise MotionError(Fault(f"there is no {what} {in_quotes(str(name))}.", some(names) or "none", mend_for(str(name), names)))
