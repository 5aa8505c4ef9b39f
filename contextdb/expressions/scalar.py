"""Compute a plan for one context: a function of the facts, made once.

Facts are in canonical form, a missing number as NaN, any other missing fact as None. The same answers, bit by bit, as
`contextdb.expressions.columns` gives for many contexts.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from functools import singledispatch
from typing import Any

from contextdb.cells.intervals import wrap_angle
from contextdb.expressions.plan import Apply, Compare, Const, Given, Held, Link, Logic, Negation, Part, Select

Value = float | bool | str | frozenset[str] | None
Facts = Mapping[str, Value]
Run = Callable[[Facts], Value]

SIGNS: Mapping[str, Callable[[Any, Any], Any]] = {
    "==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
}  # fmt: skip


def constant(plan: Part) -> float | str | bool | None:
    """The value of a plan whose parts are constants; None for another."""
    if isinstance(plan, Const):
        return plan.value
    if isinstance(plan, Given) or not all(isinstance(part, Const) for part in _parts(plan)):
        return None
    value = runner(plan)({})
    assert not isinstance(value, frozenset)
    return value


def _parts(plan: Part) -> tuple[Part, ...]:
    if isinstance(plan, Select):
        return plan.condition, plan.then, plan.otherwise
    if isinstance(plan, (Held, Negation)):
        return (plan.part,)
    return plan.parts if isinstance(plan, (Apply, Compare, Logic)) else ()


@singledispatch
def runner(plan: Part) -> Run:
    """The function of the facts that computes a plan."""
    raise AssertionError(plan)


@runner.register
def _runner_const(plan: Const) -> Run:
    value = plan.value
    return lambda facts: value


@runner.register
def _runner_given(plan: Given) -> Run:
    return operator.itemgetter(plan.name)


@runner.register
def _runner_apply(plan: Apply) -> Run:
    one, parts = plan.function.one, [runner(part) for part in plan.parts]

    def run(facts: Facts) -> Value:
        value: float = one(*[part(facts) for part in parts])
        return value + (value - value)  # NaN where it is not finite, 0.0 for -0.0

    return run


@runner.register
def _runner_compare(plan: Compare) -> Run:
    first, *rest = [runner(part) for part in plan.parts]
    links = [(_test(link), part) for link, part in zip(plan.links, rest, strict=True)]

    def run(facts: Facts) -> Value:
        answer: bool | None = True
        left = first(facts)
        for test, part in links:
            right = part(facts)
            is_so = None if is_missing(left) or is_missing(right) else test(left, right)
            if is_so is False:
                return False
            answer = None if is_so is None else answer
            left = right
        return answer

    return run


def is_missing(value: Value) -> bool:
    """Whether a value is missing: None or NaN."""
    return value is None or value != value


def _test(link: Link) -> Callable[[Value, Value], bool]:
    sign = SIGNS[link.sign]
    if link.is_wrapped:
        return lambda a, b: sign(_angle(a), _angle(b))
    if link.left_is_high:
        return lambda a, b: sign(_high(a), b)
    if link.right_is_high:
        return lambda a, b: sign(a, _high(b))
    return sign


def _angle(value: Value) -> Value:
    return wrap_angle(value) if isinstance(value, float) and math.isfinite(value) else value


def _high(value: Value) -> Value:
    return 180.0 if value == -180.0 else value


@runner.register
def _runner_held(plan: Held) -> Run:
    part, holds = runner(plan.part), plan.cell.holds

    def run(facts: Facts) -> Value:
        value = part(facts)
        return None if is_missing(value) else holds(value)

    return run


@runner.register
def _runner_logic(plan: Logic) -> Run:
    parts, decides = [runner(part) for part in plan.parts], plan.word == "or"

    def run(facts: Facts) -> Value:
        answer: bool | None = not decides
        for part in parts:
            value = part(facts)
            if value is decides:
                return decides
            answer = None if value is None else answer
        return answer

    return run


@runner.register
def _runner_negation(plan: Negation) -> Run:
    part = runner(plan.part)

    def run(facts: Facts) -> Value:
        value = part(facts)
        return None if value is None else not value

    return run


@runner.register
def _runner_select(plan: Select) -> Run:
    condition, then, otherwise = runner(plan.condition), runner(plan.then), runner(plan.otherwise)
    missing = float("nan") if is_number(plan) else None

    def run(facts: Facts) -> Value:
        value = condition(facts)
        return missing if value is None else then(facts) if value else otherwise(facts)

    return run


def is_number(plan: Part) -> bool:
    """Whether the value of a plan is a number, so that a missing one is NaN."""
    if isinstance(plan, Select):
        return is_number(plan.then)
    if isinstance(plan, Const):
        return isinstance(plan.value, float)
    return isinstance(plan, Apply) or (isinstance(plan, Given) and plan.kind.is_numeric)
