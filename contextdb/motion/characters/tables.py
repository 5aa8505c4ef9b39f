"""What a character's tables say is valid: each asked once with the facts of the moment, for all databases that it serves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal, Protocol, TypeAlias, runtime_checkable

from contextdb.cells.conditions import Condition
from contextdb.errors import ContextError, Fault
from contextdb.motion.arguments import HasAssets
from contextdb.motion.characters.facts import FactOf, is_asked
from contextdb.motion.selection.asked import OfValid

Facts = Mapping[str, object]
Unknown = Literal["error", "any", "never"]
A_TABLE = "a compiled table, a live context of one, or a mapping of databases to them"


@runtime_checkable
class CanAnswer(Protocol):
    """A compiled table."""

    @property
    def asked(self) -> Mapping[str, Condition]:
        """Its conditions, by name."""

    def query(self, context: Any, *, unknown: Any = "error") -> HasAssets:
        """The valid rows of a context."""


@runtime_checkable
class KeepsFacts(Protocol):
    """A live context: facts that are kept."""

    @property
    def asked(self) -> Mapping[str, Condition]:
        """The conditions of its table, by name."""

    def update(self, facts: Any) -> None:
        """Set some facts."""

    def matches(self) -> HasAssets:
        """The valid rows now."""


@runtime_checkable
class AnswersMany(CanAnswer, Protocol):
    """A compiled table that is asked with many contexts at once."""

    def query_many(self, contexts: Any, *, unknown: Any = "error") -> Iterable[HasAssets]:
        """The valid rows of each context, given in columns."""


Table: TypeAlias = CanAnswer | KeepsFacts
Tables: TypeAlias = Table | Mapping[str, Table] | None


def checked(tables: object) -> Tables:
    """The tables of a character; raises ContextError for what is no table."""
    if tables is None or isinstance(tables, (KeepsFacts, CanAnswer)):
        return tables
    if not isinstance(tables, Mapping):
        raise ContextError(Fault(f"tables is a {type(tables).__name__}.", A_TABLE))
    for name, table in tables.items():
        if not isinstance(name, str) or not isinstance(table, (KeepsFacts, CanAnswer)):
            raise ContextError(Fault(f"the table of {name!r} is a {type(table).__name__}.", A_TABLE))
    return dict(tables)


def each_of(tables: Tables) -> list[Table]:
    """Each table once."""
    if tables is None:
        return []
    every = [tables] if isinstance(tables, (KeepsFacts, CanAnswer)) else list(tables.values())
    return list({id(table): table for table in every}.values())


def own_facts_of(tables: Tables, functions: Mapping[str, FactOf]) -> dict[str, FactOf]:
    """The functions whose facts the tables ask for."""
    asked = {name: condition for table in each_of(tables) for name, condition in table.asked.items()}
    return {name: function for name, function in functions.items() if name in asked and is_asked(name, function, asked[name])}


def valid_of(tables: Tables, answers: Mapping[int, HasAssets]) -> OfValid | None:
    """What may play, for a controller: the answers of the tables, by their ids."""
    if tables is None:
        return None
    if isinstance(tables, (KeepsFacts, CanAnswer)):
        return answers[id(tables)]
    return {database: answers[id(table)] for database, table in tables.items()}


def answer(table: Table, facts: Facts, unknown: Unknown) -> HasAssets:
    """The rows that are valid with some facts."""
    if isinstance(table, KeepsFacts):
        table.update(facts)
        return table.matches()
    return table.query(facts, unknown=unknown)
