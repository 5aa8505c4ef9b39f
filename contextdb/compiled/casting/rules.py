"""Rules that are about roles which are cast: they hold for a casting, and so are decided for each.

A rule names roles by their facts, or by facts derived from those. A role that stays empty has no facts; a rule that is open for
want of them excludes nothing, as the cells of an empty role do. So filling an optional role never makes a rule hold that did not,
and a row is valid when its rule holds with its needed roles alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, reduce
from itertools import product
from operator import and_, or_

from contextdb import bitmask
from contextdb.cells.facts import Context, Fact, Unknown, read_fact
from contextdb.compiled.casting.assigning import assignments
from contextdb.compiled.casting.facts import Offer
from contextdb.compiled.casting.roles import roles_of_table
from contextdb.compiled.data import CompiledData
from contextdb.expressions import Derivation
from contextdb.expressions.rules import WhenRules
from contextdb.expressions.rules.rules import no_value, values_of

Cast = Mapping[str, Offer]
Truths = tuple[bool, bool]
"""Whether a rule holds for some value of set-valued facts, and whether for every one."""


@dataclass(frozen=True, eq=False)
class CastRules:
    """The rules of a table that name cast roles, at one moment."""

    when: WhenRules
    derivation: Derivation | None
    context: Context
    roles: Mapping[int, tuple[str, ...]]
    """By the number of a rule, the cast roles that it names."""
    unknown: Unknown
    _known: dict[tuple[object, ...], Truths] = field(default_factory=dict)

    @classmethod
    def of(cls, compiled: CompiledData, context: Context, cast: Sequence[str], unknown: Unknown) -> CastRules | None:
        """The rules that name one of these roles; None where there are none."""
        named = {
            number: tuple(role for role in cast if role in roles) for number, roles in enumerate(roles_of_table(compiled).of_rule)
        }
        own = {number: roles for number, roles in named.items() if roles}
        if compiled.when is None or not own:
            return None
        return cls(compiled.when, compiled.derivation, context, own, unknown)

    @cached_property
    def rows(self) -> int:
        return reduce(or_, (self.when.rules[number].rows for number in self.roles))

    def holds(self, row: int, cast: Cast) -> bool:
        """Whether the rule of a row may hold with these actors; True for a row that has none of these rules."""
        number = int(self.when.of_row[row])
        return number not in self.roles or self._truths(number, cast)[0]

    def facts(self, row: int, cast: Cast) -> dict[str, Fact]:
        """The facts of a row's rule with these actors, in canonical form."""
        return self._facts(int(self.when.of_row[row]), cast)

    def left(
        self, rows: int, offers: Mapping[str, Sequence[Offer]], required: Mapping[str, int], fits: Callable[[Offer], int], at: int
    ) -> int:
        """Of some rows those that have a casting of the roles that they need with which their rule holds.

        `at` is 0 for rules that may hold, 1 for those that always do.
        """
        for number in [n for n in self.when.numbers(rows & self.rows) if n in self.roles]:
            own = rows & self.when.rules[number].rows
            bits = 0
            for needed, some_rows in _by_needs(own, self.roles[number], required):
                others = [role for role in offers if role not in needed]
                has_more = reduce(or_, (required[role] for role in others), 0)
                for chosen in product(*(offers[role] for role in needed)):
                    fitting = reduce(and_, map(fits, chosen), some_rows) & ~bits
                    if not fitting or len({o.key for o in chosen}) < len(chosen):
                        continue
                    if self._truths(number, dict(zip(needed, chosen, strict=True)))[at]:
                        bits |= fitting & ~has_more
                        taken = frozenset(o.key for o in chosen)
                        for row in _rows(fitting & has_more):
                            rest = [(n, [o for o in offers[n] if fits(o) >> row & 1]) for n in others if required[n] >> row & 1]
                            bits |= (next(assignments(rest, taken), None) is not None) << row
            rows &= ~own | bits
        return rows

    def _truths(self, number: int, cast: Cast) -> Truths:
        own = tuple(cast.get(role) for role in self.roles[number])
        key = number, *map(id, own)
        if key not in self._known:
            self._known[key] = self._truths_with(number, cast, None in own)
        return self._known[key]

    def _truths_with(self, number: int, cast: Cast, has_empty: bool) -> Truths:
        rule, facts = self.when.rules[number], self._facts(number, cast)
        values = values_of(facts, rule.expression.conditions)
        may, always = rule.truths(values, facts)
        if may is not None and always is not None:
            return may, always
        if self.unknown == "error" and not has_empty:
            raise no_value(rule.expression, values, self.when.name)
        is_ignored = has_empty or self.unknown == "any"
        return is_ignored, is_ignored

    def _facts(self, number: int, cast: Cast) -> dict[str, Fact]:
        """The facts of a rule in canonical form, those of roles from the actors, derived ones computed from both."""
        joint = dict(self.context)
        for role in self.roles[number]:
            if role in cast:
                joint |= cast[role].own_facts
        expression = self.when.rules[number].expression
        if self.derivation is not None and not self.derivation.names.isdisjoint(expression.names):
            joint |= self.derivation.only(expression.names).compute(joint)
        return {c.name: read_fact(joint.get(c.name), c) for c in expression.conditions}


def _by_needs(rows: int, roles: Sequence[str], required: Mapping[str, int]) -> Iterator[tuple[tuple[str, ...], int]]:
    groups: list[tuple[tuple[str, ...], int]] = [((), rows)]
    for role in roles:
        needing = [((*needed, role), own & required[role]) for needed, own in groups]
        groups = [(needed, own) for needed, own in (*needing, *((n, o & ~required[role]) for n, o in groups)) if own]
    return iter(groups)


def _rows(bits: int) -> list[int]:
    rows: list[int] = bitmask.rows(bitmask.from_int(bits, bits.bit_length())).tolist()
    return rows
