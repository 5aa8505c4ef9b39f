"""The roles of a table: their conditions, the rows that constrain them, and the rows whose slots name them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from operator import or_

from contextdb import bitmask
from contextdb.cells.conditions import Condition
from contextdb.cells.words import slot_words
from contextdb.columns import TextColumn
from contextdb.compiled.data import CompiledData


class TableRoles:
    """What a compiled table says of its roles, worked out once. Masks are Python integers, row r as bit r."""

    def __init__(self, compiled: CompiledData) -> None:
        self.conditions: dict[str, tuple[int, ...]] = {}
        """The roles, and the numbers of the conditions that belong to each."""
        for at, condition in enumerate(compiled.conditions):
            if role := role_of(condition.name):
                self.conditions[role] = (*self.conditions.get(role, ()), at)
        self.needed_by_rules = _needed_by_rules(compiled)
        """The facts that rules name, and those that they are computed from; each with the roles that it hangs on."""
        rules = compiled.when.rules if compiled.when is not None else ()
        self.of_rule = [frozenset[str]().union(*(self.needed_by_rules[n] for n in rule.expression.names)) for rule in rules]
        """For each rule the roles that it names."""
        self.ruled: dict[str, int] = {}
        """For each role the rows whose rule names it."""
        for rule, roles in zip(rules, self.of_rule, strict=True):
            for role in sorted(roles):
                self.ruled[role] = self.ruled.get(role, 0) | rule.rows
                self.conditions.setdefault(role, ())
        everything = (1 << compiled.n_rows) - 1
        self._constrained = [everything & ~compiled.condition_bits(at, None, "never")[0] for at in range(len(compiled.conditions))]
        self.slot_rows: Mapping[str, Mapping[str, int]] = {c.name: _slot_rows(c) for c in compiled.slots or ()}
        """For each column of slots, for each word, the rows that say it."""

    def told_to_rules(self, role: str, compiled: CompiledData) -> list[Condition]:
        """The conditions of a role that are not columns and that rules need: an actor tells them."""
        own = (name for name in self.needed_by_rules if role_of(name) == role and name not in compiled.places)
        return [compiled.asked[name] for name in own if name in compiled.asked]

    def constrained(self, places: Sequence[int]) -> int:
        """The rows with a cell that is not Any among some conditions; soft cells exclude nothing, and so need nobody."""
        return reduce(or_, (self._constrained[at] for at in places), 0)


def roles_of_table(compiled: CompiledData) -> TableRoles:
    """The roles of a table, worked out when they are first asked for."""
    return compiled.once(TableRoles)


def role_of(name: str) -> str:
    """The role that a condition belongs to: what is before its first dot, or nothing."""
    role, dot, fact = name.partition(".")
    return role if dot and fact else ""


def _needed_by_rules(compiled: CompiledData) -> dict[str, frozenset[str]]:
    if compiled.when is None:
        return {}
    steps = compiled.derivation.only(compiled.when.names).steps if compiled.derivation is not None else ()
    names = dict.fromkeys([*(n for step in steps for n in step.expression.names), *(c.name for c in compiled.when.conditions)])
    roles = {name: frozenset({role_of(name)} - {""}) for name in names}
    for step in steps:
        roles[step.condition.name] = roles[step.condition.name].union(*(roles[n] for n in step.expression.names))
    return roles


def _slot_rows(column: TextColumn) -> dict[str, int]:
    numbers: dict[str, int] = {}
    for code, text in enumerate(column.texts):
        rows = bitmask.to_int(bitmask.pack(column.codes == code))
        for word in slot_words(text):
            numbers[word] = numbers.get(word, 0) | rows
    return numbers
