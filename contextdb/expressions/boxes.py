"""The contexts in which an expression over conditions holds, or does not, as boxes of cells.

A box maps conditions to cells and holds the contexts whose facts are all in their cells; what it does not name is free. An
expression whose comparisons are each about one condition and constants is turned into boxes exactly, open and closed ends told
apart, for facts that are known.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain, islice, product

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, NUMBER, Domain
from contextdb.cells.facts import Fact
from contextdb.cells.grammar import parse_cell
from contextdb.cells.kinds import Kind
from contextdb.cells.sets import Accepted, Cell, NumberSet, TagSet, ValueSet, complement, meet_plainly, plain_parts, union
from contextdb.expressions.plan import Apply, Compare, Const, Given, Held, Link, Logic, Negation, Part, Select
from contextdb.expressions.scalar import constant

MOST_BOXES = 4096
"""With more boxes than this, also on the way, an expression has none."""

MOST_PAIRS = 1 << 16
"""So many pairs of boxes are intersected for one `and` at most."""

Box = Mapping[str, Cell]
Sets = dict[str, Accepted]
"""A box as sets; a set of tags here is never a complement."""

_TURNED = {"==": "==", "!=": "!=", "<": ">", "<=": ">=", ">": "<", ">=": "<="}
_OF_CELLS = {"==": "=", "!=": "="}


class NoBoxes(Exception):
    """The expression computes with facts, compares them with each other, or would need too many boxes."""


def boxes_of(plan: Part, conditions: Mapping[str, Condition], truth: bool) -> list[Box] | None:
    """The boxes in which a bool plan is `truth`; None where there are none to tell exactly."""
    try:
        boxes = _Boxes(conditions).of(plan, truth)
    except NoBoxes:
        return None
    return [{name: Cell(accepts) for name, accepts in box.items()} for box in boxes]


def false_half_turns(name: str, plans: Sequence[Part], conditions: Mapping[str, Condition]) -> list[Box]:
    """The boxes of contexts with an angle at half a turn in which one of some bool plans is false, be that -180 or 180 throughout.

    Each comparison alone takes the one of the two for which it holds: `-90 <= a <= 90` is true there. Where that takes too
    many boxes there are none.
    """
    half_turn = Cell(NumberSet(((-180.0, -180.0),), is_circular=True))
    ends = [_Boxes(conditions, name, end) for end in (-180.0, 180.0)]
    try:
        boxes = all_of(any_of(end.of(plan, False) for plan in plans) for end in ends)
    except NoBoxes:
        return []
    return [{name: half_turn, **{n: Cell(accepts) for n, accepts in box.items()}} for box in boxes]


def meets(boxes: Iterable[Box], facts: Mapping[str, Fact]) -> bool:
    """Whether some values of set-valued facts lie in one of the boxes, the others as they are; True where that is not known."""
    return any(all(_meets(cell.accepts, facts[name]) for name, cell in box.items()) for box in boxes)


def _meets(accepts: Accepted | None, fact: Fact) -> bool:
    if not isinstance(fact, Cell):
        return accepts is None or Cell(accepts).holds(fact)
    own = fact.accepts
    if accepts is None or own is None or (isinstance(own, TagSet) and own.is_complement):
        return True
    return not meet_plainly(accepts, own).is_empty


class _Boxes:
    def __init__(self, conditions: Mapping[str, Condition], turned: str = "", half_turn: float = 180.0) -> None:
        self.conditions = conditions
        self.turned = turned
        """An angle that is at half a turn, if any: -180 or 180."""
        self.half_turn = Const(half_turn)

    def of(self, plan: Part, truth: bool) -> list[Sets]:
        if isinstance(plan, Const):
            return [{}] if plan.value is truth else []
        if isinstance(plan, Given):
            return [{plan.name: ValueSet(frozenset((truth,)))}]
        if isinstance(plan, Negation):
            return self.of(plan.part, not truth)
        if isinstance(plan, Logic):
            alternatives = [self.of(part, truth) for part in plan.parts]
            return all_of(alternatives) if (plan.word == "and") is truth else any_of(alternatives)
        if isinstance(plan, Held):
            return self._held(plan.part, plan.cell, truth)
        if isinstance(plan, Select):
            yes = all_of([self.of(plan.condition, True), self.of(plan.then, truth)])
            return any_of([yes, all_of([self.of(plan.condition, False), self.of(plan.otherwise, truth)])])
        if isinstance(plan, Compare):
            links = zip(plan.parts, plan.links, plan.parts[1:], strict=False)
            alternatives = [self._link(left, link, right, truth) for left, link, right in links]
            return all_of(alternatives) if truth else any_of(alternatives)
        raise NoBoxes

    def _held(self, part: Part, cell: Cell, truth: bool) -> list[Sets]:
        part = self.half_turn if self._is_turned(part) else part
        if isinstance(part, Const):
            return [{}] if cell.holds(part.value) is truth else []
        if _is_truth(part):
            return any_of([self.of(part, value) for value in (False, True) if cell.holds(value) is truth])
        if not isinstance(part, Given):
            raise NoBoxes
        if cell.accepts is None:
            return [{}] if truth else []
        return _alternatives(part.name, cell.accepts, self.conditions[part.name].domain, truth)

    def _link(self, left: Part, link: Link, right: Part, truth: bool) -> list[Sets]:
        """The boxes of one comparison of a chain."""
        if self._is_turned(left) or self._is_turned(right):
            left, right = (self.half_turn if self._is_turned(part) else part for part in (left, right))
            link = replace(link, left_is_high=False, right_is_high=False)
        if isinstance(left, Const) and isinstance(right, Const):
            return [{}] if constant(Compare((left, right), (link,))) is truth else []
        if _is_truth(left):
            is_alike = (link.sign == "==") is truth
            return any_of([all_of([self.of(left, value), self.of(right, value is is_alike)]) for value in (False, True)])
        if isinstance(left, Const):
            left, right, link = right, left, replace(link, sign=_TURNED[link.sign])
        if not (isinstance(left, Given) and isinstance(right, Const)):
            raise NoBoxes
        is_on_circle = link.is_wrapped or link.left_is_high or link.right_is_high
        if is_on_circle and not left.kind.is_circular:
            raise NoBoxes
        accepts, is_other = _compared(left.kind, link.sign, right.value)
        return _alternatives(left.name, accepts, self.conditions[left.name].domain, truth is not is_other)

    def _is_turned(self, part: Part) -> bool:
        return isinstance(part, Given) and part.name == self.turned


def _is_truth(plan: Part) -> bool:
    if isinstance(plan, Select):
        return _is_truth(plan.then)
    if isinstance(plan, (Const, Given)):
        return isinstance(plan.value, bool) if isinstance(plan, Const) else plan.kind.is_truth
    return not isinstance(plan, Apply)


def _compared(kind: Kind, sign: str, value: float | str | bool) -> tuple[Accepted, bool]:
    """The values that a comparison accepts, or (True) those that it does not."""
    if isinstance(value, (str, bool)):
        return ValueSet(frozenset((value,))), sign == "!="
    accepts = parse_cell(f"{_OF_CELLS.get(sign, sign)}{value!r}", ANGLE if kind.is_circular else NUMBER).accepts
    assert isinstance(accepts, NumberSet)
    return NumberSet(kind.fitted(accepts.spans), kind.is_circular), sign == "!="


def _alternatives(name: str, accepts: Accepted, domain: Domain, truth: bool) -> list[Sets]:
    """The boxes that hold what a set of one condition accepts, or what it does not."""
    if isinstance(accepts, TagSet):
        return [{name: tags} for tags in plain_parts(accepts, truth) if not tags.is_empty]
    sets = accepts if truth else complement(accepts, domain, is_bounded=False)
    return [] if sets.is_empty else [{name: sets}]


def all_of(alternatives: Iterable[list[Sets]]) -> list[Sets]:
    """The boxes of what lies in a box of each list. Raises NoBoxes where they are too many."""
    common: list[Sets] = [{}]
    for boxes in alternatives:
        pairs = product(common, boxes)
        common = any_of([[both] for a, b in islice(pairs, MOST_PAIRS) if (both := _intersection(a, b)) is not None])
        if next(pairs, None) is not None:
            raise NoBoxes
    return common


def any_of(alternatives: Iterable[list[Sets]]) -> list[Sets]:
    """The boxes of some lists together; those on the same single condition are joined where one set can tell them."""
    single: dict[str, NumberSet | ValueSet] = {}
    others: dict[tuple[tuple[str, Accepted], ...], Sets] = {}
    for box in chain.from_iterable(alternatives):
        if not box:
            return [{}]
        (name, accepts), *more = sorted(box.items(), key=_first)
        if more or isinstance(accepts, TagSet):
            others.setdefault(((name, accepts), *more), box)
        else:
            single[name] = union(single[name], accepts) if name in single else accepts
    if len(single) + len(others) > MOST_BOXES:
        raise NoBoxes
    joined: list[Sets] = [{name: accepts} for name, accepts in single.items()]
    return [*joined, *others.values()]


def _first(pair: tuple[str, Accepted]) -> str:
    return pair[0]


def _intersection(a: Sets, b: Sets) -> Sets | None:
    """What two boxes share; None where that is nothing."""
    both = dict(a)
    for name, accepts in b.items():
        both[name] = meet_plainly(both[name], accepts) if name in both else accepts
        if both[name].is_empty:
            return None
    return both
