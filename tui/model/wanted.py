"""The facts that a table asks for: what a person may type into the test row, and what is computed from that.

They are those of its columns, of its rows' own rules, of the tables that are in it, and those that derived facts are computed
from: the facts that `contextdb query` takes.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Fact, read_fact, read_fact_text
from contextdb.errors import ContextDBError, ContextError, Fault, safe_text, some
from contextdb.expressions import Derivation
from contextdb.schema.settings import derivation_of
from contextdb.tables.data import known_conditions
from contextdb.tables.readable import readable
from contextdb.tables.table import EitherTable


@dataclass(frozen=True)
class Wanted:
    """The facts that one table asks for, those of its columns first."""

    conditions: Mapping[str, Condition]
    """All of them, those that are computed too."""
    derivation: Derivation | None
    """How the computed ones are; None where none is."""

    @classmethod
    def of(cls, table: EitherTable) -> Wanted:
        """What a table asks for; with the tables inside it, where it was made flat."""
        ruled = table.when.names if table.when is not None else ()
        columns = [column.condition for column in table.conditions]
        derivation = derivation_of(table.schema, [*(c.name for c in columns), *ruled])
        known, inner = known_conditions(table), derivation.conditions if derivation is not None else ()
        conditions = [*columns, *(known[name] for name in ruled), *inner]
        return cls({c.name: c for c in conditions}, derivation)

    @cached_property
    def computed(self) -> frozenset[str]:
        """The facts that are never given."""
        return self.derivation.names if self.derivation is not None else frozenset()

    @cached_property
    def given(self) -> dict[str, Condition]:
        """The conditions whose facts a person may type."""
        return {name: c for name, c in self.conditions.items() if name not in self.computed}

    def read(self, texts: Mapping[str, str], cast: Collection[str] = ()) -> tuple[dict[str, Fact], dict[str, Fault]]:
        """The facts that texts say, computed ones with them, None where one is missing; and why some cannot be read.

        Facts of the roles in `cast` are those of actors: nothing is computed from what the texts say of them.
        """
        facts: dict[str, Fact] = {}
        faults: dict[str, Fault] = {}
        for name, condition in self.given.items():
            try:
                facts[name] = read_fact_text(texts.get(name, ""), condition)
            except ContextError as error:
                facts[name], faults[name] = None, error.faults[0]
        own = {name: fact for name, fact in facts.items() if fact is not None and name.partition(".")[0] not in cast}
        computed = self.derivation.compute(own) if self.derivation is not None else {}
        for name, value in computed.items():
            try:
                facts[name] = read_fact(value, self.conditions[name])
            except ContextError as error:
                facts[name], faults[name] = None, error.faults[0]
        return facts, faults

    def why_computed(self, name: str) -> str:
        """Why a fact cannot be typed, and what can be instead; nothing for one that can."""
        if self.derivation is None or name not in self.computed:
            return ""
        inputs = some(c.name for c in self.derivation.only([name]).inputs) or "no other fact"
        how = f"{safe_text(name)} is computed: {safe_text(self.conditions[name].expr or '')}."
        return f"{how} Type the facts that it is computed from: {inputs}."


def wanted_by(table: EitherTable) -> Wanted:
    """What a table asks for, and the tables inside it, where they can be read together."""
    try:
        return Wanted.of(readable(table).flat())
    except ContextDBError:
        return Wanted.of(table)
