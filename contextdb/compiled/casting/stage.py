"""Who plays which part: actors cast for the roles of a table's rows.

A condition named `Role.fact` belongs to the role before its first dot. Each actor offered for a role gives a mask of the rows
whose cells on that role accept it. A row is valid when the roles that it needs can be filled by distinct actors: by Hall's theorem
when every set of k of them is fitted by at least k actors together. That is counted for all rows at once, in bit slices; the
casting of one row is searched for when it is asked for.

An actor is one by its `"id"`, else by being one object. Nothing here reads a file or prints.

Source: Hall, "On representatives of subsets", J. London Math. Soc. 10, 1935.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from operator import or_

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_whole
from contextdb.cells.facts import Context, Fact, Unknown, check_mode, require_context
from contextdb.cells.mirroring import frozen_facts, in_mirror, mirrored_facts, widened_fact
from contextdb.compiled.casting.assigning import CastRows, Chosen, Holds, Part, best, casts_of, every
from contextdb.compiled.casting.facts import Actor, Actors, Ask, Offer, mirrored_offers, read_offers
from contextdb.compiled.casting.plain import PlainRoles, offers_of
from contextdb.compiled.casting.roles import roles_of_table
from contextdb.compiled.casting.rules import CastRules
from contextdb.compiled.data import CompiledData
from contextdb.compiled.matches import Answering, SetMatches, Stages, with_mirrored, with_penalties, with_widened
from contextdb.errors import ContextError, Fault, in_quotes, no_such, some

Casting = dict[str, Actor]
CastBy = tuple[tuple[int, "Stage"], ...]
"""For some rows, as bits, the stage that casts them."""


@dataclass(frozen=True, eq=False)
class Roles:
    """What a table says of its roles. Masks are Python integers, row r as bit r."""

    names: tuple[str, ...]
    """The roles that conditions belong to, in the order of columns, then other words of the slots that actors are offered for."""
    conditions: Mapping[str, tuple[int, ...]]
    """The numbers of the conditions of each role."""
    required: Mapping[str, int]
    """The rows that cannot do without the role."""
    optional: Mapping[str, int]
    """The rows in which the role is cast when somebody fits."""


class CastMatches(SetMatches):
    """The valid rows for a context and actors. `casting(row)` says who plays what."""

    __slots__ = ("_cast_by",)

    def __init__(self, bits: int, always: int, cast_by: CastBy | Callable[[], CastBy], table: Answering) -> None:
        super().__init__(bits, table, always)
        self._cast_by = cast_by

    @property
    def _stages(self) -> CastBy:
        """Who plays what, for some rows; the first that has a row counts. Worked out when it is first asked for."""
        if not isinstance(self._cast_by, tuple):
            self._cast_by = self._cast_by()
        return self._cast_by

    def casting(self, row: int) -> Casting:
        """The best casting of a valid row, as {role: actor}: most optional roles filled, then by preference, then as offered."""
        return self._stage(row).best(row)

    def cast(self, row: int) -> dict[str, Offer]:
        """The same as `casting`, each actor with where it was offered."""
        return dict(self._stage(row).cast(row))

    def castings(self, row: int) -> list[Casting]:
        """All castings of a valid row that fill as many optional roles as can be, best first."""
        return self._stage(row).all(row)

    def casts(self, roles: Sequence[str]) -> list[CastRows]:
        """Every way to give these roles to distinct actors, with the valid rows in which they may play them. Empty where nobody is
        offered for one of the roles."""
        casts: dict[tuple[object, ...], CastRows] = {}
        left = self.bits
        for rows, stage in self._stages:
            for key, each in stage.casts(left & rows, roles):
                casts[key] = casts[key].joined(each, self.n_rows) if key in casts else each
            left &= ~rows
        return list(casts.values())

    def _stage(self, row: int) -> Stage:
        if not (0 <= require_whole(row, "row") < self.n_rows and self.bits >> row & 1):
            raise ContextError(Fault(f"row {row} is not valid, so nobody is cast for it.", "one of the valid rows, m.indices"))
        for rows, stage in self._stages:
            if rows >> row & 1:
                return stage
        raise ContextError(Fault(f"row {row} is of an answer without actors, so nobody is cast.", "query(facts, actors={...})"))


@dataclass(frozen=True, eq=False)
class Offered:
    """Who is offered for the roles of a table, and the rows whose needed roles they can fill."""

    roles: Roles
    offers: Mapping[str, tuple[Offer, ...]]
    """Who is offered for each role, without repeats."""
    n_rows: int

    @cached_property
    def bits(self) -> int:
        """The rows whose needed roles can be filled, going by what the cells accept of each actor."""
        return self._castable([{o.key: o.some for o in self.offers[n]} for n in self.roles.names])

    @cached_property
    def always(self) -> int:
        """The same where an actor must fit with every value of its set-valued facts: rows that certainly match."""
        return self._castable([{o.key: o.every for o in self.offers[n]} for n in self.roles.names])

    def _castable(self, fits: Sequence[Mapping[object, int]]) -> int:
        """The rows in which every set of k needed roles is fitted by at least k actors together."""
        all_rows = (1 << self.n_rows) - 1
        required = [self.roles.required[n] for n in self.roles.names]
        return all_rows & ~_lacking(fits, required, 0, {}, all_rows, 0)


@dataclass(frozen=True, eq=False)
class Stage:
    """The actors of one moment against the roles of a table."""

    compiled: CompiledData
    offered: Offered
    plain_facts: Mapping[int, Fact]
    """The facts of the conditions that are no role's, by their number."""
    unknown: Unknown
    rule_facts: Mapping[str, Fact]
    """The facts of plain rules."""
    context: Context
    """The facts as they were given, kept where the table asks in a mirror."""
    rules: CastRules | None = None
    """The rules that are decided for each casting; None where there are none."""

    @property
    def roles(self) -> Roles:
        """What the table says of its roles."""
        return self.offered.roles

    @property
    def offers(self) -> Mapping[str, tuple[Offer, ...]]:
        """Who is offered for each role, without repeats."""
        return self.offered.offers

    def matches(self, plain: Mapping[int, tuple[int, int]]) -> CastMatches:
        """The valid rows, from those that may and those that always accept each plain fact, or whose rule does."""
        some_bits, all_bits = (self.compiled.enabled_bits & rows for rows in (self.offered.bits, self.offered.always))
        for some_rows, all_rows in plain.values():
            some_bits &= some_rows
            all_bits &= all_rows
        some_bits, all_bits = self.left_by_rules(some_bits, all_bits)
        answer = self.answer(some_bits, all_bits, ((some_bits, self),), self.compiled.answering)
        if self.compiled.mirroring:
            with_mirrored(answer, self.mirrored)
        if self.compiled.widening:
            with_widened(answer, self.widened)
        if self.compiled.is_soft:
            with_penalties(answer, lambda: self.penalties(answer))
        return answer

    def answer(self, bits: int, always: int, stages: Stages, table: Answering) -> CastMatches:
        """An answer of some rows, with the castings of several."""
        return CastMatches(bits, always, tuple((rows, stage) for rows, stage in stages if isinstance(stage, Stage)), table)

    def widened(self) -> CastMatches:
        """The answer with the plain facts widened; those of actors are as they are."""
        conditions, unknown = self.compiled.conditions, self.unknown
        facts = {at: widened_fact(fact, conditions[at]) for at, fact in self.plain_facts.items()}
        plain = {at: self.compiled.condition_bits(at, fact, unknown) for at, fact in facts.items()}
        answer = replace(self, plain_facts=facts).matches(plain)
        del answer._widened  # nothing is widened twice
        if self.compiled.mirroring:
            with_mirrored(answer, lambda: self.mirrored().widened)
        return answer

    def mirrored(self) -> CastMatches:
        """The answer with the facts of the context and of the actors as a mirror shows them. The actors stay who they are, and as
        much preferred."""
        compiled, unknown = self.compiled, self.unknown
        try:
            context = mirrored_facts(self.context, compiled.mirroring)
            offers = mirrored_offers(compiled, self.roles.conditions, context, self.offers, unknown)
            offered = Offered(self.roles, offers, compiled.n_rows)
            stage, plain = set_stage(compiled, context, Ask({}, None, unknown), offered)
            return stage.matches(plain)
        except ContextError as error:
            raise in_mirror(error) from None

    def left_by_rules(self, some_rows: int, all_rows: int) -> tuple[int, int]:
        """Of rows that may and that always match by their cells, those whose rule holds: with plain facts, or for some casting."""
        when = self.compiled.when
        if when is None:
            return some_rows, all_rows
        cast = self.rules.rows if self.rules is not None else 0
        plain, plain_always = when.left_with_care(some_rows & ~cast, all_rows & ~cast, self.rule_facts, self.unknown)
        if self.rules is None:
            return plain, plain_always
        given = self.offers, self.roles.required
        some_cast = self.rules.left(some_rows & cast, *given, lambda offer: offer.some, 0)
        return plain | some_cast, plain_always | self.rules.left(all_rows & some_cast, *given, lambda offer: offer.every, 1)

    def penalties(self, matches: CastMatches) -> NDArray[np.float64]:
        """What the soft cells of valid rows cost at each depth with the best casting of each: float64 [D, n_rows]. A role that is
        not cast costs nothing."""
        compiled = self.compiled
        costs = np.zeros((compiled.n_depths, compiled.n_rows))
        for at, fact in self.plain_facts.items():
            costs += compiled.column_penalties(at, fact, self.unknown)
        for row in matches.rows.tolist():
            for _, offer in self.cast(row):
                costs[:, row] += sum(compiled.column_penalties(at, f, self.unknown)[:, row] for at, f in offer.facts.items())
        return costs

    def best(self, row: int) -> Casting:
        return _as_casting(self.cast(row))

    def cast(self, row: int) -> Chosen:
        """The same, as offers."""
        return best(*self.parts(row), self._holds(row))

    def all(self, row: int) -> list[Casting]:
        """Every casting of a row with the most optional roles, best first."""
        return [_as_casting(c) for c in every(*self.parts(row), self._holds(row))]

    def casts(self, rows: int, roles: Sequence[str]) -> Iterator[tuple[tuple[object, ...], CastRows]]:
        """Every cast of these roles in some of the rows that can be cast, with the keys of its actors."""
        ruled = 0 if self.rules is None else self.rules.rows
        is_soft = self.compiled.is_soft
        plain = self._soft_costs(self.plain_facts) if is_soft else None
        offers = [offer for role in roles for offer in self.offers.get(role, ())] if is_soft else []
        own = {id(offer): self._soft_costs(offer.facts) for offer in offers}
        for cast, bits in casts_of(rows, roles, self.offers, self.roles.required, ruled, self._holds):
            penalties = None if plain is None else plain + sum(own[id(offer)] for _, offer in cast)
            yield tuple([offer.key for _, offer in cast]), CastRows(tuple([offer.actor for _, offer in cast]), bits, penalties)

    def _soft_costs(self, facts: Mapping[int, Fact]) -> NDArray[np.float64]:
        """What the soft cells of all rows cost with some facts, over all depths: float64 [n_rows]."""
        costs = np.zeros(self.compiled.n_rows)
        for at, fact in facts.items():
            costs += self.compiled.column_penalties(at, fact, self.unknown).sum(axis=0)
        return costs

    def _holds(self, row: int) -> Holds | None:
        rules = self.rules
        return None if rules is None or not rules.rows >> row & 1 else lambda cast: rules.holds(row, cast)

    def parts(self, row: int) -> tuple[list[Part], list[Part]]:
        """The roles that a row needs and those that it may fill, each with the actors who fit, best first."""
        needed, wanted = [], []
        for name in self.roles.names:
            fitting = sorted((o for o in self.offers[name] if o.some >> row & 1), key=lambda o: (o.cost, o.place))
            if self.roles.required[name] >> row & 1:
                needed.append((name, fitting))
            elif self.roles.optional[name] >> row & 1:
                wanted.append((name, fitting))
        return needed, wanted


def _lacking(
    fits: Sequence[Mapping[object, int]], required: Sequence[int], at: int, joint: dict[object, int], rows: int, k: int
) -> int:
    """The rows of `rows` in which some set of needed roles, `joint` and more from number `at` on, has too few actors."""
    lacking = 0
    for i in range(at, len(fits)):
        left = rows & required[i] & ~lacking
        if left:
            union = dict(joint)
            for key, bits in fits[i].items():
                union[key] = union.get(key, 0) | bits
            lacking |= left & ~_at_least(k + 1, union)
            lacking |= _lacking(fits, required, i + 1, union, left & ~lacking, k + 1)
    return lacking


def _at_least(k: int, masks: Mapping[object, int]) -> int:
    """The rows that at least k of the masks hold."""
    if k == 1:
        return reduce(or_, masks.values(), 0)
    counts = [0] * k
    """Entry i: the rows that more than i of the masks so far hold."""
    for mask in masks.values():
        for i in range(k - 1, 0, -1):
            counts[i] |= counts[i - 1] & mask
        counts[0] |= mask
    return counts[-1]


def _as_casting(chosen: Chosen) -> Casting:
    return {name: offer.actor for name, offer in chosen}


def query_with_actors(compiled: CompiledData, context: Context, ask: Ask) -> CastMatches:
    """The rows valid for a context and actors; see `CompiledTable.query`. Raises ContextError as `query`, and for actors that
    cannot be read, with the role and the actor."""
    own = compiled.once(PlainRoles.of)
    read = None if own is None else own.read(context, ask)
    if read is None:
        stage, plain = set_stage(compiled, context, ask)
        return stage.matches(plain)
    rows, accepted = read
    roles = compiled.once(_all_roles)
    fits = [{key: own[0] for key, own in accepted[name].items()} for name in roles.names]
    bits = rows & ~_lacking(fits, [roles.required[name] for name in roles.names], 0, {}, rows, 0)

    def cast_by() -> CastBy:
        offered = Offered(roles, {name: offers_of(own) for name, own in accepted.items()}, compiled.n_rows)
        return ((bits, Stage(compiled, offered, {}, ask.unknown, {}, context)),)

    return CastMatches(bits, bits, cast_by, compiled.answering)


def _all_roles(compiled: CompiledData) -> Roles:
    """The roles of a table where all of them are cast."""
    return roles_of(compiled, {}, dict.fromkeys(roles_of_table(compiled).conditions, ()))


def set_stage(
    compiled: CompiledData, context: Context, ask: Ask, offered: Offered | None = None
) -> tuple[Stage, dict[int, tuple[int, int]]]:
    """The actors of a moment against the roles, and for each condition that is no role's the rows that may and always accept.

    With `offered` the actors are those, and not read.
    """
    unknown = ask.unknown
    check_mode(unknown)
    roles = offered.roles if offered is not None else roles_of(compiled, context, ask.actors)
    cast = {at for places in roles.conditions.values() for at in places}
    names = {at: c.name for at, c in enumerate(compiled.conditions) if at not in cast}
    rules = CastRules.of(compiled, context, roles.names, unknown)
    read = compiled.read_context(context, unknown, list(dict.fromkeys([*names.values(), *_ruled_names(compiled, roles)])))
    facts = {at: read[name] for at, name in names.items()}
    plain = {at: compiled.condition_bits(at, fact, unknown) for at, fact in facts.items()}
    if offered is None:
        offers = read_offers(compiled, roles.conditions, context, ask)
        offered = Offered(roles, offers, compiled.n_rows)
    return Stage(compiled, offered, facts, unknown, read, frozen_facts(context) if compiled.mirroring else context, rules), plain


def _ruled_names(compiled: CompiledData, roles: Roles) -> list[str]:
    """The facts that rules need and that no actor tells; of one derived from what actors tell, those that it is computed from."""
    steps = compiled.derivation.steps if compiled.derivation is not None else ()
    inputs = {step.condition.name: step.expression.names for step in steps}
    waiting = [*compiled.when.names] if compiled.when is not None else []
    names: dict[str, None] = {}
    for name in waiting:
        if roles_of_table(compiled).needed_by_rules[name].isdisjoint(roles.names):
            names[name] = None
        else:
            waiting += [n for n in inputs.get(name, ()) if n not in waiting]
    return list(names)


def roles_of(compiled: CompiledData, context: Context, actors: Actors) -> Roles:
    """The roles that are cast: all but those whose facts are in the context, as plain facts. Raises ContextError for actors for a
    role that the table does not have, or for one whose facts the context gives."""
    if not isinstance(actors, Mapping):
        raise ContextError(Fault(f"actors are a mapping of roles, not {type(actors).__name__}.", '{"Defender": [{...}, {...}]}'))
    if compiled.slots is None:
        problem = "this compiled file does not say which slots are mandatory."
        raise ContextError(Fault(problem, "the table itself, compiled by Table.compile()"))
    require_context(context)
    members, slots = roles_of_table(compiled).conditions, roles_of_table(compiled).slot_rows
    _require_roles(actors, list(dict.fromkeys([*members, *(w for words in slots.values() for w in words)])))
    plain = {n for n in members if n not in actors and _given(compiled, n, context)}
    _refuse_both(compiled, actors, context)
    names = tuple(n for n in (*members, *(a for a in actors if a not in members)) if n not in plain)
    mandatory, maybe = (slots.get(c, {}) for c in ("Mandatory_Slots", "Optional_Slots"))
    conditions = {n: members.get(n, ()) for n in names}
    optional = {n: maybe.get(n, 0) & ~mandatory.get(n, 0) for n in names}
    constrained = {n: roles_of_table(compiled).constrained(conditions[n]) | roles_of_table(compiled).ruled.get(n, 0) for n in names}
    required = {n: (mandatory.get(n, 0) | constrained[n]) & ~optional[n] for n in names}
    return Roles(names, conditions, required, optional)


def _given(compiled: CompiledData, role: str, context: Context) -> list[str]:
    """The facts of a role that are in the context itself."""
    known = (n for n in (*compiled.asked, *compiled.places) if n.startswith(f"{role}."))
    return [n for n in known if context.get(n) is not None]


def _refuse_both(compiled: CompiledData, actors: Actors, context: Context) -> None:
    for role in actors:
        for name in _given(compiled, role, context):
            problem = f"{in_quotes(name)} is given as a fact, and actors are offered for {in_quotes(role)}."
            raise ContextError(Fault(problem, "the facts of a role from its actors, or without actors for it", rule="wrong-fact"))


def _require_roles(actors: Actors, known: Sequence[str]) -> None:
    faults = []
    for role in actors:
        if role not in known:
            accepted = some(known) if known else "no actors: the table has no roles"
            faults.append(no_such("role", role, known, accepted, rule="unknown-fact"))
    if faults:
        raise ContextError(*faults)
