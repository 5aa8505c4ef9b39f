"""Classes of a space as moments that a query takes: the facts of a point, what is derived from them, whether they can happen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.domains import Domain
from contextdb.cells.sets import tags_above
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.data import CompiledData
from contextdb.covering.assumed import assumptions_of
from contextdb.covering.draw import Drawer, other_than
from contextdb.covering.factors import NumberFactor, TagFactor, ValueFactor, margin_of
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import Point
from contextdb.expressions import Derivation, Expression, read_expression
from contextdb.expressions.assume import WANTS
from contextdb.schema.settings import derivation_of
from contextdb.tables.data import known_conditions
from contextdb.tables.table import EitherTable

TRIES = 4_096
"""So many draws look for a moment in a box."""
MOST_DRAWN = 12
"""So many moments of a box are given."""

Moment = dict[str, object]
"""The facts of a context that are given, as a query takes them."""


@dataclass(eq=False)
class Moments:
    """The moments of a space without rules."""

    space: Space
    table: EitherTable
    """The table that the space is of."""
    drawer: Drawer | None
    """What draws moments, where boxes do not tell all that can happen."""
    premises: Sequence[str] = ()
    """Expressions that must be known to hold."""

    def of_box(self, box: Box, point: Point, rng: np.random.Generator) -> Iterator[Moment]:
        """The given point of a box, or where only draws tell what can happen, some that are drawn."""
        if self.drawer is None:
            yield self.of_point(point)
            return
        codes, columns = self.drawer.moments(TRIES, rng, box)
        for i in range(min(len(codes), MOST_DRAWN)):
            yield self.drawn(codes[i], columns, i)

    def drawn(self, codes: NDArray[np.int32], columns: Mapping[str, list[Any]], i: int) -> Moment:
        assert self.drawer is not None
        domains = {name: condition.domain for name, condition in self.drawer.given.items()}
        given = {name: written_fact(_plain_value(column[i]), domains[name]) for name, column in columns.items()}
        return self.of_point(tuple(codes.tolist())) | given

    def of_point(self, point: Point) -> Moment:
        given = ((at, c) for at, c in enumerate(self.space.conditions) if not c.expr)
        return {c.name: fact_of(self.space, at, point) for at, c in given}

    def can_happen(self, moment: Mapping[str, object]) -> bool:
        """Whether what is assumed holds in a moment, and the premises."""
        facts = {**moment, **self._derived(moment)}
        is_possible = all(expression.evaluate(facts) is not False for expression in self._assumptions)
        return is_possible and all(premise.evaluate(facts) is True for premise in self._premises)

    def _derived(self, moment: Mapping[str, object]) -> Mapping[str, object]:
        if self._derivation is None:
            return {}
        needed = {c.name for c in self._derivation.inputs}
        columns = self._derivation.complete_frame({name: [value] for name, value in moment.items() if name in needed}, 1)
        return {name: _plain_value(column[0]) for name, column in columns.items()}

    @cached_property
    def _derivation(self) -> Derivation | None:
        names = [*(c.name for c in self.space.conditions), *(n for e in self._assumptions for n in e.names)]
        return derivation_of(self.table.schema, names)

    @cached_property
    def _premises(self) -> list[Expression]:
        known = known_conditions(self.table)
        return [read_expression(text, known, WANTS) for text in self.premises]

    @cached_property
    def _assumptions(self) -> tuple[Expression, ...]:
        return assumptions_of(self.table).expressions


def _plain_value(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


# ---- a fact of a class: the value that a person would write for it


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


# ---- which rows of a table its policy prefers to which, whatever was picked before, what rests, and what a search costs

Ranks = tuple[tuple[int, float], ...]
"""Group and rank of a row at each depth of tables inside tables."""


@dataclass(eq=False)
class Preferred:
    """The rows of a compiled table that are boxes of a space; sets of them are bits, a bit for each box."""

    compiled: CompiledData
    rows: tuple[int, ...]
    """The row of each box."""
    _above: dict[Ranks, int] = field(default_factory=dict)

    @cached_property
    def choosing(self) -> Choosing:
        return self.compiled.once(Choosing.of)

    @cached_property
    def pickable(self) -> int:
        """The rows that can be picked at all."""
        return self._bits(self.choosing.pickable)

    @cached_property
    def always(self) -> NDArray[np.bool_]:
        """The rows that are picked from whenever they are valid: those that never rest and have some weight. bool [n_rows]."""
        limits = self.choosing.limits
        rests = np.zeros(self.compiled.n_rows, np.bool_) if limits is None else (limits.of_row >= 0).any(axis=0)
        return self.choosing.pickable & ~rests

    def to(self, i: int) -> int:
        """The rows that keep box number `i` from being picked where they are valid: of a higher rank at some depth of one way."""
        row, ranks, groups = self.rows[i], self.choosing.ranks, self.choosing.groups
        key = tuple((int(g), float(r)) for g, r in zip(groups[:, row], ranks[:, row], strict=True))
        if key not in self._above:
            above = np.zeros(self.compiled.n_rows, np.bool_)
            for depth in range(len(ranks)):
                above |= (groups[depth] == groups[depth, row]) & (ranks[depth] > ranks[depth, row])
            self._above[key] = self._bits(above & self.always)
        return self._above[key]

    def beaten(self, valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which boxes are kept from being picked by others that hold a context, bool [N, boxes], where these hold it, bool [N,
        boxes]: those that meet one of `to`."""
        rows, beaten = np.array(self.rows, np.int64), np.zeros(valid.shape, np.bool_)
        counted = valid & self.always[rows]
        for groups, ranks in zip(self.choosing.groups[:, rows], self.choosing.ranks[:, rows], strict=True):
            names, of_box = np.unique(groups, return_inverse=True)
            best = np.full((len(valid), len(names)), -np.inf)
            for at in range(len(names)):
                own = np.flatnonzero(of_box == at)
                own = own[np.argsort(-ranks[own], kind="stable")]
                here = counted[:, own]
                best[:, at] = np.where(here.any(axis=1), ranks[own[here.argmax(axis=1)]], -np.inf)
            beaten |= ranks < (best[:, of_box] if len(names) > 1 else best)
        return beaten

    def _bits(self, flags: NDArray[np.bool_]) -> int:
        return bitmask.int_of([i for i, row in enumerate(self.rows) if flags[row]])
