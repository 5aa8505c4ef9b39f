"""What a character's tables say is valid: each asked once with the facts of the moment, for all databases that it serves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias, TypeGuard, cast

from contextdb.cells.conditions import Condition
from contextdb.errors import ContextError, Fault
from contextdb.motion.answers import Answer
from contextdb.motion.characters.facts import FACTS, FactOf, fact_of_played, is_asked
from contextdb.motion.selection.search_options import OfValid

Facts = Mapping[str, object]
Unknown = Literal["error", "any", "never"]
A_TABLE = "a compiled table, a live context of one, or a mapping of databases to them"


class CanAnswer(Protocol):
    """A compiled table."""

    @property
    def asked(self) -> Mapping[str, Condition]:
        """Its conditions, by name."""

    def query(self, context: Any, *, unknown: Any = "error") -> Answer:
        """The valid rows of a context."""


class KeepsFacts(Protocol):
    """A live context: facts that are stored."""

    @property
    def asked(self) -> Mapping[str, Condition]:
        """The conditions of its table, by name."""

    def update(self, facts: Any) -> None:
        """Set some facts."""

    def matches(self) -> Answer:
        """The valid rows now."""


class AnswersMany(CanAnswer, Protocol):
    """A compiled table that is asked with many contexts at once."""

    def query_many(self, contexts: Any, *, unknown: Any = "error") -> Iterable[Answer]:
        """The valid rows of each context, given in columns."""


Table: TypeAlias = CanAnswer | KeepsFacts
Tables: TypeAlias = Table | Mapping[str, Table] | None


def can_answer(table: object) -> TypeGuard[CanAnswer]:
    """Whether it is a compiled table; by its names, as a check of the protocol takes long."""
    return hasattr(table, "query") and hasattr(table, "asked")


def keeps_facts(table: object) -> TypeGuard[KeepsFacts]:
    """Whether it is a live context."""
    return hasattr(table, "matches") and hasattr(table, "asked")


def answers_many(table: object) -> TypeGuard[AnswersMany]:
    """Whether it is a compiled table that is asked with many contexts at once."""
    return hasattr(table, "query_many") and can_answer(table)


def is_one(tables: object) -> TypeGuard[Table]:
    return keeps_facts(tables) or can_answer(tables)


def checked(tables: object) -> Tables:
    """The tables of a character; raises ContextError for what is no table."""
    if tables is None or is_one(tables):
        return tables
    if not isinstance(tables, Mapping):
        raise ContextError(Fault(f"tables is a {type(tables).__name__}.", A_TABLE))
    for name, table in tables.items():
        if not isinstance(name, str) or not is_one(table):
            raise ContextError(Fault(f"the table of {name!r} is a {type(table).__name__}.", A_TABLE))
    return dict(tables)


def each_of(tables: Tables) -> list[Table]:
    """All tables that were `checked`, each once."""
    if tables is None:
        return []
    if not isinstance(tables, dict):
        return [cast("Table", tables)]
    return list({id(table): table for table in tables.values()}.values())


class OwnFacts(NamedTuple):
    """What a character knows of itself, as far as its tables ask for it: all as functions, and apart those of the body, which the
    core has computed already, with their columns there."""

    tables: Tables
    own: Mapping[str, FactOf]
    functions: Mapping[str, FactOf]
    of_body: Mapping[str, int]
    others: Mapping[str, FactOf]

    @classmethod
    def of(cls, tables: Tables, own: Mapping[str, FactOf]) -> OwnFacts:
        """Those of some functions."""
        functions, columns = own_facts_of(tables, own), {function: i for i, function in enumerate(FACTS.values())}
        of_body = {name: columns[function] for name, function in functions.items() if function in columns}
        return cls(tables, own, functions, of_body, {name: of for name, of in functions.items() if name not in of_body})


def own_facts_of(tables: Tables, functions: Mapping[str, FactOf]) -> dict[str, FactOf]:
    """The functions whose facts the tables ask for, and those of what plays; of one name the given one."""
    conditions = {name: condition for table in each_of(tables) for name, condition in table.asked.items()}
    own_functions = {name: of for name, condition in conditions.items() if (of := fact_of_played(name, condition)) is not None}
    given = {
        name: function for name, function in functions.items() if name in conditions and is_asked(name, function, conditions[name])
    }
    return {**own_functions, **given}


def valid_of(tables: Tables, answers: Mapping[int, Answer]) -> OfValid | None:
    """What may play, for a controller: the answers of the tables, by their ids."""
    if isinstance(tables, dict):
        return {database: answers[id(table)] for database, table in tables.items()}
    return None if tables is None else answers[id(tables)]


def answer(table: Table, facts: Facts, unknown: Unknown) -> Answer:
    """The rows that are valid with some facts."""
    if keeps_facts(table):
        table.update(facts)
        return table.matches()
    return cast("CanAnswer", table).query(facts, unknown=unknown)
