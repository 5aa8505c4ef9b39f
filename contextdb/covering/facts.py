"""A fact of a class: the value that a person would write for it."""

from __future__ import annotations

import math
from typing import Any

from contextdb.cells.domains import Domain
from contextdb.cells.sets import tags_above
from contextdb.covering.draw import other_than
from contextdb.covering.factors import NumberFactor, TagFactor, ValueFactor, margin_of
from contextdb.covering.space import Space
from contextdb.covering.witness import Point

MOST_DIGITS = 17


def fact_of(space: Space, at: int, point: Point) -> object:
    """A fact of condition number `at` in the classes of a point, as a query takes it: numbers as short as the class allows, a date
    as text, tags as a list."""
    condition, numbers = space.conditions[at], space.of_condition[at]
    if condition.domain.type.is_tags:
        return _tags(space, at, point)
    factor, k = space.factors[numbers[0]], point[numbers[0]]
    if isinstance(factor, ValueFactor):
        return factor.values[k] if k < len(factor.values) else other_than(factor.values)
    assert isinstance(factor, NumberFactor)
    return written_fact(short_number(*_finite(factor, k), is_whole=factor.kind.is_whole), condition.domain)


def written_fact(value: Any, domain: Domain) -> object:
    """A fact in canonical form as JSON has it."""
    kind = domain.type
    if kind.is_numeric:
        return kind.spelling.write(value) if kind.is_spelt else kind.given(value)
    return sorted(value) if kind.is_tags else value


def short_number(low: float, high: float, *, is_whole: bool = False) -> float:
    """A number of a closed interval with as few digits as there can be, near its middle; 0 where that is in it."""
    if low <= 0.0 <= high:
        return 0.0
    middle = low + (high - low) / 2.0
    if is_whole:
        return float(min(max(math.floor(middle), math.ceil(low)), math.floor(high)))
    for digits in range(MOST_DIGITS):
        if low <= (value := round(middle, digits)) <= high:
            return value
    return low


def _finite(factor: NumberFactor, k: int) -> tuple[float, float]:
    """The ends of a class, with a number in place of an infinite one."""
    low, high = factor.spans[k]
    margin = margin_of(factor.spans, factor.kind) if len(factor.spans) > 1 else 100.0
    if math.isinf(low):
        low = high if math.isinf(high) and high < 0.0 else (-margin if math.isinf(high) else high - margin)
    if math.isinf(high):
        high = low if math.isinf(low) else low + margin
    return low, high


def _tags(space: Space, at: int, point: Point) -> list[str]:
    declared = space.conditions[at].domain.values
    tags: list[str] = []
    for f in space.of_condition[at]:
        factor = space.factors[f]
        assert isinstance(factor, TagFactor)
        answers = {tag for i, tag in enumerate(factor.tags) if factor.answers[point[f]] >> i & 1}
        own = factor.tags if declared is None else declared
        effects = {tag: {above for above in tags_above(tag) if above in factor.tags} for tag in own}
        tags += [tag for tag, effect in effects.items() if effect and effect <= answers]
    return tags
