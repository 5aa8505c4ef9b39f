"""Random contexts as plain facts, where boxes cannot tell what can happen: where facts are computed from others, and where
assumptions compute with facts or compare them.

Facts are drawn as the factors of the space weigh them, a number evenly within its class. What is derived is computed, what an
assumption rules out is left out, and so is a derived fact that is missing or outside its declared domain.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.conditions import Condition
from contextdb.cells.sets import covers
from contextdb.covering.factors import Factor, NumberFactor, TagFactor, ValueFactor, margin_of
from contextdb.covering.space import Box, Space, factors_of
from contextdb.expressions import Derivation, Expression

Codes = NDArray[np.int32]
UNBOUNDED = 100.0
"""A number that has no bounds and that no cell names is drawn from minus to plus this."""


@dataclass(frozen=True, eq=False)
class Drawer:
    """Draws contexts of a space of which each can happen."""

    space: Space
    derivation: Derivation | None
    assumptions: tuple[Expression, ...]
    """Those that boxes cannot tell."""
    premises: tuple[Expression, ...] = ()
    """What must be known to hold, besides."""

    @cached_property
    def given(self) -> dict[str, Condition]:
        """The conditions whose facts are drawn: those of the table, and what is needed to compute and to assume."""
        derived = self.derivation.names if self.derivation else frozenset()
        inputs = self.derivation.inputs if self.derivation else ()
        named = [c for expression in (*self.assumptions, *self.premises) for c in expression.conditions]
        return {c.name: c for c in (*self.space.conditions, *inputs, *named) if c.name not in derived}

    @cached_property
    def _needed(self) -> frozenset[str]:
        """The facts that something is computed from, in values."""
        inputs = {c.name for c in self.derivation.inputs} if self.derivation else set()
        return frozenset(inputs | {name for expression in (*self.assumptions, *self.premises) for name in expression.names})

    @cached_property
    def _at(self) -> dict[str, int]:
        return {condition.name: at for at, condition in enumerate(self.space.conditions)}

    def draw(self, n: int, rng: np.random.Generator, within: Box | None = None) -> Codes:
        """Contexts out of `n` draws as classes of the factors, int32 [N ≤ n, factors]; of a box, where one is given."""
        codes, _, accepted = self._drawn(n, rng, within)
        return codes[accepted]

    def moments(self, n: int, rng: np.random.Generator, within: Box | None = None) -> tuple[Codes, dict[str, list[Any]]]:
        """The same, and for each fact that something is computed from its values in these contexts."""
        codes, columns, accepted = self._drawn(n, rng, within)
        rows = np.flatnonzero(accepted).tolist()
        return codes[accepted], {name: [column[i] for i in rows] for name, column in columns.items()}

    def _drawn(self, n: int, rng: np.random.Generator, within: Box | None) -> tuple[Codes, dict[str, Any], NDArray[np.bool_]]:
        """All draws: their classes, the values of facts that something is computed from, and which can happen."""
        codes = np.zeros((n, len(self.space.factors)), np.int32)
        columns: dict[str, Any] = {}
        for name, condition in self.given.items():
            numbers = self.space.of_condition[self._at[name]] if name in self._at else None
            if condition.domain.type.is_tags:
                values = self._draw_tags(condition, numbers, n, rng, codes)
            else:
                values = self._draw_values(condition, numbers, n, rng, codes, within)
            if values is not None:
                columns[name] = values
        accepted = self._compute(columns, codes, n)
        for f, side in enumerate(within or ()):
            if side != self.space.full[f]:
                accepted &= bitmask.flags_of(side, len(self.space.factors[f].weights))[codes[:, f]]
        return codes, columns, accepted

    def may_happen(self, box: Box, rng: np.random.Generator, n_tries: int = 4096) -> bool:
        """Whether a context of a box was found that can happen."""
        return bool(len(self.draw(n_tries, rng, box)))

    def _draw_values(
        self,
        condition: Condition,
        numbers: Sequence[int] | None,
        n: int,
        rng: np.random.Generator,
        codes: Codes,
        within: Box | None,
    ) -> Any:
        factor = factors_of((), condition)[0] if numbers is None else self.space.factors[numbers[0]]
        weights = factor.weights
        if numbers is not None and within is not None:
            inside = np.where(bitmask.flags_of(within[numbers[0]], len(weights)), weights, 0.0)
            weights = inside if inside.sum() > 0.0 else bitmask.flags_of(within[numbers[0]], len(weights)).astype(np.float64)
        drawn = rng.choice(len(weights), n, p=weights / weights.sum())
        uniform = rng.random(n)
        if numbers is not None:
            codes[:, numbers[0]] = drawn
        if condition.name not in self._needed:
            return None
        if isinstance(factor, NumberFactor):
            return _numbers(factor, drawn, uniform)
        assert isinstance(factor, ValueFactor)
        values: list[Any] = [*factor.values]
        if factor.has_others:
            values.append(other_than(factor.values))
        return [values[k] for k in drawn.tolist()]

    def _draw_tags(
        self, condition: Condition, numbers: Sequence[int] | None, n: int, rng: np.random.Generator, codes: Codes
    ) -> Any:
        factors = [self.space.factors[f] for f in numbers or ()]
        tags = condition.domain.values
        declared = tuple(t for f in factors if isinstance(f, TagFactor) for t in f.tags) if tags is None else tags
        has = rng.random((n, len(declared))) < 0.5
        for f, factor in zip(numbers or (), factors, strict=True):
            assert isinstance(factor, TagFactor)
            answers = np.zeros(n, np.int64)
            for i, named in enumerate(factor.tags):
                under = [j for j, tag in enumerate(declared) if covers(named, frozenset((tag,)))]
                answers |= has[:, under].any(axis=1).astype(np.int64) << i
            codes[:, f] = np.searchsorted(np.array(factor.answers), answers)
        if condition.name not in self._needed:
            return None
        return [[declared[j] for j in np.flatnonzero(row).tolist()] for row in has]

    def _compute(self, columns: Mapping[str, Any], codes: Codes, n: int) -> NDArray[np.bool_]:
        """Compute what is derived, and say which contexts can happen."""
        accepted = np.ones(n, np.bool_)
        if self.derivation is not None:
            needed = {c.name for c in self.derivation.inputs}
            inputs = {name: column for name, column in columns.items() if name in needed}
            columns = {**columns, **self.derivation.complete_frame(inputs, n)}
            for name in self.derivation.names & self._at.keys():
                accepted &= self._encode(self._at[name], columns[name], codes)
        for expression in self.assumptions:
            accepted &= expression.flags(columns, n, missing=True)
        for expression in self.premises:
            accepted &= expression.flags(columns, n)
        return accepted

    def _encode(self, at: int, column: Any, codes: Codes) -> NDArray[np.bool_]:
        """Write the classes of derived facts; say which of them are known and inside the domain."""
        domain, numbers = self.space.conditions[at].domain, self.space.of_condition[at]
        if domain.type.is_numeric:
            values = np.asarray(column, np.float64)
            factor = self.space.factors[numbers[0]]
            assert isinstance(factor, NumberFactor)
            lows, last = np.array([low for low, _ in factor.spans]), factor.spans[-1][1]
            with np.errstate(invalid="ignore"):
                known = (values >= lows[0]) & (values <= last)
            codes[:, numbers[0]] = np.clip(np.searchsorted(lows, values, "right") - 1, 0, len(lows) - 1)
            return np.asarray(known, np.bool_)
        listed = column if isinstance(column, list) else column.to_list()
        if domain.type.is_tags:
            listed = [None if value is None else frozenset(value) for value in listed]
        for f in numbers:
            classes = {value: 0 if value is None else _class_of(self.space.factors[f], value) for value in set(listed)}
            codes[:, f] = [classes[value] for value in listed]
        return np.array([value is not None for value in listed], np.bool_)


def _class_of(factor: Factor, value: Any) -> int:
    if isinstance(factor, TagFactor):
        return factor.answers.index(sum(1 << i for i, named in enumerate(factor.tags) if covers(named, value)))
    assert isinstance(factor, ValueFactor)
    return factor.values.index(value) if value in factor.values else len(factor.values)


def _numbers(factor: NumberFactor, drawn: NDArray[np.int64], uniform: NDArray[np.float64]) -> NDArray[np.float64]:
    """A number in the drawn class of each context, all of a class alike; beyond the last ends as far as the factor measures."""
    ends = np.array([_ends(span, factor) for span in factor.spans])
    low, high = ends[drawn, 0], ends[drawn, 1]
    if factor.kind.is_whole:
        return np.asarray(np.clip(np.floor(low + uniform * (high - low + 1.0)), low, high))
    return np.asarray(np.clip(low + uniform * (high - low), low, high))


def _ends(span: tuple[float, float], factor: NumberFactor) -> tuple[float, float]:
    low, high = span
    if len(factor.spans) == 1:
        return max(low, min(-UNBOUNDED, high - 2 * UNBOUNDED)), min(high, max(UNBOUNDED, low + 2 * UNBOUNDED))
    margin = margin_of(factor.spans, factor.kind)
    if math.isinf(low):
        low = high if math.isinf(high) else high - margin
    return low, (low + margin if math.isinf(high) else high)


def other_than(values: Sequence[object]) -> str:
    """A text that is none of some values."""
    name = "other"
    while name in values:
        name += "_"
    return name
