"""How facts change in a mirror: what a table is queried with for animations that are played mirrored.

A clip played mirrored turns right where it turned left, so its row must be queried with the facts as the mirror shows them. A
condition says by `mirror` how its facts change:

    "negate"             the other sign: a number, an angle; of a bool the other value
    {Left = "Right"}     two names change places, both ways; a tag under one of them changes with it: Left.Hand and Right.Hand. A
                         condition whose facts are no names changes places with that of the other name: LeftFoot.Down has the
                         fact of RightFoot.Down. A table must ask for both
    "none"               nothing changes; what holds where nothing is said, but for angles, which are negated

Derived facts have no way of their own: they are computed from mirrored ones. Whatever is mirrored twice is as it was.

A condition says by `hysteresis` how far, in its own unit. A cell widened by h accepts a fact x when it accepts some value between
x - h and x + h; in tables inside tables, all cells of the condition that a row has accept one such value. So the fact is widened,
to a set of values, and no cell: a table queried with widened facts answers with the rows whose widened cells all accept. Only what
plays already is requested in this way; every other answer is exact.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache

from contextdb.cells import intervals
from contextdb.cells.conditions import Condition, Mirror, Swaps
from contextdb.cells.domains import Domain
from contextdb.cells.facts import Fact, read_fact
from contextdb.cells.intervals import wrap_angle
from contextdb.cells.sets import Accepted, Cell, NumberSet, TagSet, ValueSet
from contextdb.errors import ContextError, in_quotes

SIDES = (("Left", "Right"), ("left", "right"), ("LEFT", "RIGHT"))
"""How names of the two sides differ."""

Conditions = Mapping[str, Condition]


def way_of(condition: Condition) -> Mirror:
    """How the facts of a condition change: as it declares, else as its type lets one infer."""
    if condition.expr is not None:
        return "none"
    if condition.mirror is not None:
        return condition.mirror
    return "negate" if condition.domain.type.is_circular else "none"


def changed_in_mirror(conditions: Iterable[Condition]) -> dict[str, Condition]:
    """Of some conditions those whose facts change in a mirror, by name."""
    known = {c.name: c for c in conditions}
    return {c.name: c for c in known.values() if way_of(c) != "none" and (partner_of(c) or c.name) in known}


def partner_of(condition: Condition) -> str | None:
    """The condition with which one changes places: its name with the other side in it. None where only its own facts change."""
    way = condition.mirror
    if type(way) is not tuple or condition.domain.type.is_swapped:
        return None
    return next((other for other in _other_names(condition.name, way) if other != condition.name), None)


def _other_names(name: str, swaps: Swaps) -> Iterator[str]:
    for one, other in (*swaps, *((right, left) for left, right in swaps)):
        if one in name:
            yield name.replace(one, other)


def mirrored_fact(fact: Fact, condition: Condition) -> Fact:
    """A fact in canonical form as the mirror shows it; of a condition that changes places as it is, for its partner."""
    way = way_of(condition)
    if fact is None or way == "none" or partner_of(condition) is not None:
        return fact
    if isinstance(fact, Cell):
        return Cell(_mirrored_set(fact, way, condition.domain))
    if isinstance(fact, frozenset):
        return _mirrored_tags(fact, way)
    return _negated(fact, condition.domain) if isinstance(fact, float) else _mirrored_value(fact, way)


def mirrored_facts(facts: Mapping[str, object], conditions: Conditions) -> dict[str, object]:
    """Facts as they are given, those of `conditions` as the mirror shows them; the rest as it is. Raises ContextError for a fact
    that is none of its condition."""
    mirrored = dict(facts)
    for name, condition in conditions.items():
        fact = mirrored.get(name)
        if type(condition.mirror) is tuple and (partner := partner_of(condition)) is not None:
            mirrored[name] = facts.get(partner)
        elif type(fact) is float and condition.domain.type.is_numeric:  # the usual fact; an angle is wrapped when it is read
            mirrored[name] = 0.0 - fact
        elif fact is not None:
            mirrored[name] = mirrored_fact(read_fact(fact, condition), condition)
    return mirrored


def frozen_facts(facts: Mapping[str, object]) -> dict[str, object]:
    """Facts as they are now, whatever becomes of the mapping and of sets and lists in it."""
    return {name: frozen_fact(fact) for name, fact in facts.items()}


def frozen_fact(fact: object) -> object:
    """One fact as it is now, whatever becomes of the set or list that it may be."""
    return frozenset(fact) if type(fact) is set else tuple(fact) if type(fact) is list else fact


def in_mirror(error: ContextError) -> ContextError:
    """An error of a question with mirrored facts, which the caller has not given: its messages say so."""
    return ContextError(*(replace(fault, found=f"with mirrored facts {fault.found}") for fault in error.faults))


def swap_faults(swaps: Mapping[str, str], is_tags: bool) -> Iterator[tuple[str, str]]:
    """What is wrong with names that change places, whatever the names are: a name, and why it cannot."""
    partners: dict[str, str] = {}
    for left, right in swaps.items():
        if left == right:
            yield left, "it changes places with itself"
        elif partners.setdefault(left, right) != right or partners.setdefault(right, left) != left:
            yield left if partners[left] != right else right, "it has two partners"
    for name in partners if is_tags else ():
        for above in partners:
            if name.startswith(above + "."):
                yield name, f"it is below {in_quotes(above)}, with which it is exchanged anyway"


def sided_pairs(names: Iterable[str]) -> dict[str, str]:
    """The pairs of names that differ by a side alone, Left and Right, as `mirror` declares them."""
    known = dict.fromkeys(names)
    pairs = ((name, name.replace(left, right)) for name in known for left, right in SIDES if left in name)
    return {left: right for left, right in (*pairs, ("L", "R"), ("l", "r")) if left in known and right in known}


@lru_cache(maxsize=256)
def _partners(swaps: Swaps) -> dict[str, str]:
    return dict(swaps) | {right: left for left, right in swaps}


def swapped_tag(tag: str, swaps: Swaps) -> str:
    """The tag with which one changes places: its partner, or of a tag under one of a pair that under the other; else itself."""
    partners = _partners(swaps)
    end = len(tag)
    while end > 0:
        if (partner := partners.get(tag[:end])) is not None:
            return partner + tag[end:]
        end = tag.rfind(".", 0, end)
    return tag


# ---- one fact


def _mirrored_set(cell: Cell, way: Mirror, domain: Domain) -> Accepted | None:
    accepts = cell.accepts
    if isinstance(accepts, NumberSet):
        return NumberSet(_negated_spans(accepts.spans, domain), accepts.is_circular)
    if isinstance(accepts, ValueSet):
        return ValueSet(frozenset(_mirrored_value(value, way) for value in accepts.values), accepts.is_complement)
    if isinstance(accepts, TagSet):
        return TagSet(_mirrored_tags(accepts.needs, way), _mirrored_tags(accepts.bans, way), accepts.is_complement)
    return None


def _negated(value: float, domain: Domain) -> float:
    return wrap_angle(-value) if domain.type.is_circular else 0.0 - value


def _negated_spans(spans: intervals.Spans, domain: Domain) -> intervals.Spans:
    low, high = intervals.CIRCLE
    negated = [(-last, -first) for first, last in spans]
    if domain.type.is_circular and any(last == -low for _, last in negated):  # -180 and 180 are one angle, its own mirror image
        negated = [(first, min(last, high)) for first, last in negated] + [(low, low)]
    return intervals.union(negated)


def _mirrored_value(value: bool | str, way: Mirror) -> bool | str:
    if isinstance(value, bool):
        return not value
    return _partners(way).get(value, value) if isinstance(way, tuple) else value


def _mirrored_tags(tags: frozenset[str], way: Mirror) -> frozenset[str]:
    return frozenset(swapped_tag(tag, way) for tag in tags) if isinstance(way, tuple) else tags


# ---- hysteresis of numbers: what plays stays valid a little beyond the edges of its cells


def with_hysteresis(conditions: Iterable[Condition]) -> dict[str, Condition]:
    """Of some conditions those with a hysteresis, by name."""
    return {condition.name: condition for condition in conditions if condition.hysteresis}


def widened_fact(fact: Fact, condition: Condition) -> Fact:
    """A fact in canonical form, or a set of such, with what is within the condition's hysteresis of it."""
    reach, kind = condition.hysteresis, condition.domain.type
    if not reach or fact is None or (isinstance(fact, Cell) and not isinstance(fact.accepts, NumberSet)):
        return fact
    if isinstance(fact, Cell):
        assert isinstance(fact.accepts, NumberSet), "any other set is given back above"
        spans = fact.accepts.spans
    else:
        assert isinstance(fact, float), "the facts of a condition with a hysteresis are numbers"
        spans = ((fact, fact),)
    ends = [(low - reach, high + reach) for low, high in spans]
    wide = (span for low, high in ends for span in intervals.arc(low, high)) if kind.is_circular else ends
    return Cell(NumberSet(kind.fitted(intervals.union(wide)), kind.is_circular))
