"""Plain actors: each role of a table as a table of the core, whose contexts are actors.

A table without rules, derived facts, soft cells and facts that change in a mirror asks nothing of an actor but which rows accept
its facts. An actor that the core cannot read, or with which something may be wrong, leaves the question to the careful way,
`contextdb.compiled.casting.stage`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

from contextdb import bitmask
from contextdb.cells.facts import Context
from contextdb.compiled.casting.facts import Actor, Ask, Cost, Offer
from contextdb.compiled.casting.roles import roles_of_table
from contextdb.compiled.core_table import UNKNOWN, core_table
from contextdb.compiled.data import CompiledData
from contextdb.core import Table

Accepted = dict[object, tuple[int, int, Actor, Cost]]
"""The actors of a role, each once, by their keys: the rows that accept each, its place among those that are offered, the actor, and
how little it is wanted."""
_TEXTS = {str}
_NO_FACTS: Mapping[Any, Any] = {}
_NO_COST = 0, 0.0


@dataclass(frozen=True, eq=False)
class PlainRoles:
    """The roles of a table, and what is no role's, each as a table of the core."""

    outside: Table
    """The conditions that are no role's."""
    tables: Mapping[str, Table]
    """For each role its conditions, under their names without the role."""
    full_names: frozenset[str]
    """The names of all conditions of roles."""
    changed: frozenset[str]
    """Those whose facts are not the numbers that are given: all but numbers."""

    @classmethod
    def of(cls, compiled: CompiledData) -> Self | None:
        """Those of a table; None where it asks more than which rows accept an actor, or has no roles."""
        roles = roles_of_table(compiled).conditions
        if compiled.derivation is not None or compiled.when is not None or compiled.is_bound or compiled.slots is None or not roles:
            return None
        cast = {at for places in roles.values() for at in places}
        columns = list(zip(compiled.conditions, compiled.masks, strict=True))
        outside = [column for at, column in enumerate(columns) if at not in cast]
        tables = {}
        for role, places in roles.items():
            own = [(replace(columns[at][0], name=columns[at][0].name.removeprefix(f"{role}.")), columns[at][1]) for at in places]
            tables[role] = core_table(own, bitmask.full(compiled.n_rows), compiled.answering, None, None)
        plain = core_table(outside, compiled.enabled, compiled.answering, None, None)
        own_conditions = [columns[at][0] for at in cast]
        changed = frozenset(c.name for c in own_conditions if not c.domain.type.is_decimal or c.domain.type.is_circular)
        return cls(plain, tables, frozenset(c.name for c in own_conditions), changed)

    def read(self, context: Context, ask: Ask) -> tuple[int, dict[str, Accepted]] | None:
        """The rows that accept what is no role's, and the actors of each role; None where the careful way must read them."""
        actors = ask.actors
        if callable(ask.prefer) or type(context) is not dict or type(actors) is not dict:
            return None
        unknown = UNKNOWN.get(ask.unknown)
        if unknown is None or not self.full_names.isdisjoint(context) or not self.tables.keys() >= actors.keys():
            return None
        outside = self.outside.query(context, unknown)
        if outside is None:
            return None
        accepted: dict[str, Accepted] = {}
        known: dict[object, dict[str, object]] = {}
        try:
            for role, table in self.tables.items():
                prefer = ask.prefer.get(role) if isinstance(ask.prefer, Mapping) else ask.prefer
                own = self._accepted(role, table, actors.get(role, ()), unknown, known, prefer)
                if own is None:
                    return None
                accepted[role] = own
        except (TypeError, ValueError):  # an id that cannot be a key, facts that cannot be compared
            return None
        return outside.bits, accepted

    def _accepted(
        self, role: str, table: Table, listed: object, unknown: int, known: dict[object, dict[str, object]], prefer: object
    ) -> Accepted | None:
        """The actors of one role; `known` are the facts of each actor that has an id."""
        if type(listed) is not list and type(listed) is not tuple:
            return None
        accepted: Accepted = {}
        for place, actor in enumerate(listed):
            rows = table.query(actor, unknown) if type(actor) is dict and self.full_names.isdisjoint(actor) else None
            if rows is None or {*map(type, actor)} != _TEXTS:
                return None
            own = actor.get("id")
            key = ("object", id(actor)) if own is None else ("id", own)
            if own is not None and (other := known.setdefault(own, actor)) is not actor and other != actor:
                return None
            cost = _NO_COST if prefer is None else self._cost(role, actor, prefer)
            if cost is None:
                return None
            if key not in accepted:
                accepted[key] = rows.bits, place, actor, cost
        return accepted

    def _cost(self, role: str, actor: Actor, prefer: object) -> Cost | None:
        """How little an actor is wanted by a number that it tells; None where the careful way must look."""
        if type(prefer) is not str:
            return None
        name = prefer.removeprefix("-").removeprefix(f"{role}.")
        value: Any = actor.get(name)
        is_number = type(value) is float or (type(value) is int and abs(value) < 2**53)
        if not is_number or value - value != 0.0 or f"{role}.{name}" in self.changed:
            return None
        return 0, -1.0 * value if prefer.startswith("-") else 1.0 * value


def offers_of(accepted: Accepted) -> tuple[Offer, ...]:
    """The same actors as the careful way has them; in a table like this nothing asks for their facts."""
    offers = accepted.items()
    return tuple(Offer(actor, key, place, _NO_FACTS, _NO_FACTS, rows, rows, cost) for key, (rows, place, actor, cost) in offers)
