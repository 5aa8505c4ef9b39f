"""Actors read and checked: who is who, which rows take whom for a role, and who is preferred."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

from contextdb.cells.facts import Context, Fact, Unknown, missing_error, misspelt, read_fact
from contextdb.cells.mirroring import frozen_facts, mirrored_facts
from contextdb.compiled.casting.roles import roles_of_table
from contextdb.compiled.data import CompiledData
from contextdb.errors import ContextError, Fault, Place, in_quotes, mend_for, safe_text

Actor = Mapping[str, Any]
Actors = Mapping[str, Sequence[Actor]]
Prefer = str | Mapping[str, str] | Callable[[str, Actor], float] | None
Cost = tuple[int, float]
"""Whether there is no preference for the actor, 0 or 1, and the number that is the better the lower it is."""


@dataclass(frozen=True, eq=False, slots=True)
class Ask:
    """How a context is asked with actors: who is offered for each role, who is preferred, and how missing facts are treated."""

    actors: Actors
    prefer: Prefer = None
    unknown: Unknown = "error"


@dataclass(frozen=True, eq=False, slots=True)
class Offer:
    """One actor offered for one role."""

    actor: Actor
    key: object
    """Equal for one actor in several roles."""
    place: int
    """Where among the actors of the role."""
    facts: Mapping[int, Fact]
    """For each condition of the role, by its number, the fact in canonical form."""
    own_facts: Mapping[str, object]
    """What the actor tells, under the names of conditions."""
    some: int
    """The rows whose cells on the role accept the actor."""
    every: int
    """The same for every value of set-valued facts."""
    cost: Cost

    @property
    def label(self) -> str:
        """Which actor this is, for a listing: its number in the list, with its name or id where it has one."""
        name = name_of(self.actor, self.place)
        return f"[{self.place}]" if name == f"actor {self.place}" else f"[{self.place}] {name}"

    @property
    def name(self) -> str:
        """What people call the actor: its name or id, else its place."""
        return name_of(self.actor, self.place)


def name_of(actor: Actor, place: int) -> str:
    """What people call an actor: its name or id, else its place in the list."""
    name = next((actor[k] for k in ("name", "id") if actor.get(k) is not None), None)
    return f"actor {place}" if name is None else safe_text(str(name))


def read_offers(
    compiled: CompiledData, conditions: Mapping[str, Sequence[int]], context: Context, ask: Ask
) -> dict[str, tuple[Offer, ...]]:
    """The actors offered for each role, each once; raises ContextError with every fault of every actor."""
    reader = _Reader(compiled, context, ask)
    faults: list[Fault] = []
    offers: dict[str, tuple[Offer, ...]] = {}
    for role, places in conditions.items():
        listed: dict[object, Offer] = {}
        for place, actor in enumerate(_listed(ask.actors.get(role, ()), role)):
            try:
                offer = reader.read(role, places, place, actor)
                listed.setdefault(offer.key, offer)
            except ContextError as error:
                faults += [f for f in error.faults if f not in faults]
        offers[role] = tuple(listed.values())
    if faults:
        raise ContextError(*faults)
    reader.refuse_unknown_preference()
    return offers


def mirrored_offers(
    compiled: CompiledData,
    conditions: Mapping[str, Sequence[int]],
    context: Context,
    offers: Mapping[str, Sequence[Offer]],
    unknown: Unknown,
) -> dict[str, tuple[Offer, ...]]:
    """Actors that were read, with their facts as a mirror shows them, in a context that is mirrored already. They are the same
    actors, as much preferred."""
    reader = _Reader(compiled, context, Ask({}, None, unknown))
    return {role: tuple(reader.mirrored(role, conditions[role], offer) for offer in offered) for role, offered in offers.items()}


def _listed(offered: object, role: str) -> Sequence[Actor]:
    if isinstance(offered, Sequence) and not isinstance(offered, (str, bytes)):
        return offered
    problem = f"the actors for {in_quotes(role)} are {_kind(offered)}."
    raise ContextError(
        Fault(problem, "a list of mappings of facts", "[…]" if isinstance(offered, Mapping) else "", rule="wrong-fact")
    )


def _kind(value: object) -> str:
    return f"of type {type(value).__name__}"


class _Reader:
    def __init__(self, compiled: CompiledData, context: Context, ask: Ask) -> None:
        self.compiled, self.context, self.prefer, self.unknown = compiled, context, ask.prefer, ask.unknown
        self.known: dict[object, dict[str, object]] = {}
        """Every known fact of each actor with an id."""
        self.preferred: dict[str, bool] = {}
        """For each fact that actors are preferred by, whether some actor tells it."""
        self.names: set[str] = set()
        """The names of all facts of all actors."""

    def refuse_unknown_preference(self) -> None:
        """Raise ContextError when actors are preferred by a fact that none of them tells."""
        for name, is_told in self.preferred.items():
            if not is_told:
                problem = f"no actor has {in_quotes(name)}, by which actors are preferred."
                mend = mend_for(name, sorted(self.names))
                raise ContextError(Fault(problem, "a number fact of the actors", mend, rule="unknown-fact"))

    def read(self, role: str, places: Sequence[int], place: int, actor: Actor) -> Offer:
        where = f"{role}[{place}]"
        if not isinstance(actor, Mapping):
            raise ContextError(Fault(f"{where} is {_kind(actor)}.", "a mapping of facts", rule="wrong-fact"))
        key = self._key(where, actor)
        try:
            own_facts = _own_facts(role, actor)
            facts = self._facts(role, places, own_facts)
            cost = self._cost(role, actor, facts)
        except ContextError as error:
            raise ContextError(*(_in_actor(f, where) for f in error.faults)) from None
        return Offer(actor, key, place, facts, frozen_facts(own_facts), *self._bits(facts), cost)

    def mirrored(self, role: str, places: Sequence[int], offer: Offer) -> Offer:
        """An actor that was read, with facts as a mirror shows them."""
        try:
            own_facts = mirrored_facts(offer.own_facts, self.compiled.mirroring)
            facts = self._facts(role, places, own_facts)
        except ContextError as error:
            raise ContextError(*(_in_actor(f, f"{role}[{offer.place}]") for f in error.faults)) from None
        some_bits, every = self._bits(facts)
        return replace(offer, facts=facts, own_facts=own_facts, some=some_bits, every=every)

    def _bits(self, facts: Mapping[int, Fact]) -> tuple[int, int]:
        """The rows whose cells accept some, and those whose cells accept all values of facts."""
        some_bits = every = (1 << self.compiled.n_rows) - 1
        for at, fact in facts.items():
            one, all_ = self.compiled.condition_bits(at, fact, self.unknown)
            some_bits &= one
            every &= all_
        return some_bits, every

    def _key(self, where: str, actor: Actor) -> object:
        own = actor.get("id")
        if own is None:
            return "object", id(actor)
        try:
            known = self.known.setdefault(("id", own), {})
        except TypeError:
            raise ContextError(Fault(f"the id of {where} is {_kind(own)}.", "a text or a number", rule="wrong-fact")) from None
        for name, value in actor.items():
            if not _is_same(known.setdefault(name, value), value):
                difference = f"{where} says {_text(value)}, another {_text(known[name])}"
                problem = f"two actors have the id {in_quotes(str(own))}, and {in_quotes(str(name))} differs: {difference}."
                raise ContextError(Fault(problem, "one id for one actor, with the same facts in every role", rule="wrong-fact"))
        return "id", own

    def _facts(self, role: str, places: Sequence[int], given: Mapping[str, object]) -> dict[int, Fact]:
        """The facts of a role's conditions, read from what an actor tells; derived ones computed from that and from the context."""
        conditions = [self.compiled.conditions[at] for at in places]
        derivation = self.compiled.derivation
        derived: Mapping[str, object] = {}
        joint: Mapping[str, object] = given
        lacking: list[str] = []
        if derivation is not None and any(c.name in derivation.names for c in conditions):
            joint, own = {**self.context, **given}, derivation.only(c.name for c in conditions)
            derived, lacking = own.compute(joint), own.missing(joint)
            derivation.refuse(n for n in given if n in derivation.names and given[n] is not None)
        facts: dict[int, Fact] = {}
        faults: list[Fault] = []
        for at, condition in zip(places, conditions, strict=True):
            name = condition.name
            try:
                facts[at] = read_fact(derived.get(name) if name in derived else given.get(name), condition)
            except ContextError as error:
                faults += error.faults
        if faults:
            raise ContextError(*faults)
        ruled = roles_of_table(self.compiled).told_to_rules(role, self.compiled)
        lacking += [c.name for c in ruled if read_fact(given.get(c.name), c) is None]
        absent = [self.compiled.conditions[at].name for at, fact in facts.items() if fact is None]
        if missing := list(dict.fromkeys([*absent, *lacking])):
            self._refuse_missing(role, missing, given, joint)
        return facts

    def _refuse_missing(self, role: str, missing: list[str], given: Mapping[str, object], joint: Mapping[str, object]) -> None:
        derivation = self.compiled.derivation
        names = derivation.names if derivation is not None else frozenset()
        plain = [n for n in missing if n not in names]
        of_some_role = {name.partition(".")[2] for name in self.compiled.asked}  # one actor may be offered for several roles
        extra = [n for n in given if n.removeprefix(f"{role}.") not in of_some_role | {"id", "name"}]
        declared = self.compiled.declared
        if slip := misspelt(plain, [n for n in extra if n not in declared and f"{role}.{n}" not in declared]):
            raise slip
        if self.unknown == "error":
            if plain or derivation is None:
                raise missing_error(plain, extra)
            raise derivation.no_value(missing[0], joint)

    def _cost(self, role: str, actor: Actor, facts: Mapping[int, Fact]) -> Cost:
        """How little an actor is wanted: a number fact, lowest first (highest first with a "-" before its name)."""
        prefer = self.prefer
        if prefer is None:
            return 0, 0.0
        if callable(prefer):
            return _as_cost(prefer(role, actor), "prefer", 1.0)
        named = prefer.get(role) if isinstance(prefer, Mapping) else prefer
        if named is None:
            return 0, 0.0
        if not isinstance(named, str):
            raise ContextError(Fault(f"a preference is {_kind(named)}.", 'the name of a number fact, such as "distance"'))
        name = named.removeprefix("-").removeprefix(f"{role}.")
        at = self.compiled.places.get(f"{role}.{name}")
        own = _own_facts(role, actor)
        self.names.update(n.removeprefix(f"{role}.") for n in own)
        is_read = at is not None and at in facts
        self.preferred[name] = self.preferred.get(name, False) or is_read or f"{role}.{name}" in own
        value: object = facts[at] if at is not None and is_read else own.get(f"{role}.{name}")
        return _as_cost(value, name, -1.0 if named.startswith("-") else 1.0)


def _own_facts(role: str, actor: Actor) -> dict[str, object]:
    """What an actor says, under the names of the role's conditions; each may be reported with the role before it or without."""
    given: dict[str, object] = {}
    for name, value in actor.items():
        if not isinstance(name, str):
            raise ContextError(Fault(f"a fact's name is {_kind(name)}.", "text", rule="wrong-fact"))
        full = name if name.startswith(f"{role}.") else f"{role}.{name}"
        if full in given and not _is_same(given[full], value):
            problem = f"{in_quotes(full)} is given twice, {_text(given[full])} and {_text(value)}."
            raise ContextError(Fault(problem, "each fact once, with the role before it or without", rule="wrong-fact"))
        given[full] = value
    return given


def _as_cost(value: object, name: str, sign: float) -> Cost:
    if value is None or (isinstance(value, Real) and not isinstance(value, bool) and math.isnan(value)):
        return 1, 0.0
    if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
        problem = f"{in_quotes(name)} is {_text(value)}, which cannot be preferred by."
        raise ContextError(Fault(problem, "a finite number", rule="wrong-fact"))
    return 0, sign * float(value)


def _is_same(one: object, other: object) -> bool:
    if one is other:
        return True
    if isinstance(one, float) and isinstance(other, float) and math.isnan(one) and math.isnan(other):
        return True
    try:
        return bool(one == other)
    except ValueError:  # arrays
        return False


def _text(value: object) -> str:
    return in_quotes(safe_text(str(value)))


def _in_actor(fault: Fault, where: str) -> Fault:
    """A fault of an actor's fact, with the actor before it."""
    column = fault.place.column if fault.place else None
    return Fault(fault.found, fault.accepted, fault.mend, Place(column=f"{where}: {column}" if column else where), fault.rule)
