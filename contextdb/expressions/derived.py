"""Derived facts: conditions that are computed from others, in whichever order they are declared.

    derivation = derive(conditions)            # checks every expr, once
    derivation.complete({"speed": 3.0, "target_speed": 1.0})

A derived fact is never given. It is missing where its expression is; where that is so because a fact is a *set* of values, it may
be anything, and is the cell Any: queries then answer what may match, and what always does, soundly.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.facts import describe, read_fact
from contextdb.cells.intervals import wrap_angle, wrap_angles
from contextdb.cells.sets import ANY, Cell
from contextdb.errors import ContextError, Fault, Place, in_quotes, plural, safe_text, some
from contextdb.expressions.arithmetic import settled
from contextdb.expressions.columns import Coded, Column, as_facts, missing_rows, read_column, run_frame
from contextdb.expressions.expression import Expression, check_length, read_expression
from contextdb.expressions.scalar import Value, is_missing
from contextdb.expressions.tokens import ExpressionError

NAN = math.nan
_GIVE_OTHERS = 'facts that it can be computed with, or unknown="any" or "never"'


@dataclass(frozen=True)
class Step:
    """One derived fact and how it is computed."""

    condition: Condition
    expression: Expression


@dataclass(frozen=True)
class Derivation:
    """The derived facts of some conditions, each after those it is computed from."""

    steps: tuple[Step, ...]

    def __reduce__(self) -> tuple[object, ...]:
        """What is worked out from the steps is worked out again in another process."""
        return Derivation, (self.steps,)

    @cached_property
    def names(self) -> frozenset[str]:
        return frozenset(step.condition.name for step in self.steps)

    @cached_property
    def inputs(self) -> tuple[Condition, ...]:
        """The conditions whose facts must be given, in the order in which they are needed."""
        needed = {c.name: c for step in self.steps for c in step.expression.conditions}
        return tuple(c for name, c in needed.items() if name not in self.names)

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """The inputs and the derived facts."""
        return (*self.inputs, *(step.condition for step in self.steps))

    def only(self, wanted: Iterable[str]) -> Derivation:
        """What is needed to compute some of the derived facts; other names are passed over."""
        needed = set(wanted)
        for step in reversed(self.steps):
            if step.condition.name in needed:
                needed.update(step.expression.names)
        return Derivation(tuple(step for step in self.steps if step.condition.name in needed))

    def compute(self, facts: Mapping[str, object]) -> dict[str, object]:
        """The derived facts of one context: float (int for an int), bool, str, frozenset of tags; None where one is missing, Any
        where one may be anything. Raises ContextError where a derived fact is given, or a fact that is computed with is of the
        wrong type or outside the domain."""
        for name in self.names:
            if facts.get(name) is not None:
                self.refuse([name])
        values: dict[str, Value] = {}
        open_names: set[str] = set()
        for name, condition, usual, absent in self._reading:
            given = facts.get(name)
            fact = given if type(given) is usual else read_fact(given, condition)
            if isinstance(fact, Cell):
                open_names.add(name)
            values[name] = absent if fact is None or isinstance(fact, Cell) else fact  # type: ignore[assignment]
        computed: dict[str, object] = {}
        for name, condition, run, needs in self._running:
            value = values[name] = _fitted(run(values), condition)
            if not is_missing(value):
                computed[name] = condition.domain.type.given(value) if isinstance(value, float) else value
            elif open_names and _is_open(needs, values, open_names):
                open_names.add(name)
                computed[name] = ANY
            else:
                computed[name] = None
        return computed

    def complete(self, facts: Mapping[str, object]) -> dict[str, object]:
        """The facts of one context with the derived ones next to them; raises as `compute` does."""
        return {**facts, **self.compute(facts)}

    @cached_property
    def _reading(self) -> tuple[tuple[str, Condition, type | None, Value], ...]:
        """Each input, the type of which any value is in canonical form already, and its replacement where it is missing."""
        return tuple((c.name, c, c.domain.type.python, NAN if c.domain.type.is_numeric else None) for c in self.inputs)

    @cached_property
    def _running(self) -> tuple[tuple[str, Condition, Any, tuple[str, ...]], ...]:
        return tuple((s.condition.name, s.condition, s.expression.run, s.expression.names) for s in self.steps)

    def complete_frame(self, columns: Mapping[str, Any], n_contexts: int, needs_all: bool = False) -> dict[str, Any]:
        """The columns of N contexts with the derived ones next to them, as `query_many` takes them.

        Derived numbers are float64 arrays with NaN where missing, bools and texts polars series, sets of tags lists, with null
        where missing. The same values as `complete` gives. Raises ContextError as `complete`, and where a column is not N long;
        with `needs_all` also where a column is there and a fact of it is missing.
        """
        self.refuse(name for name in self.names if name in columns)
        read: dict[str, Column] = {}
        for condition in self.inputs:
            given = columns.get(condition.name)
            check_length(given, condition, n_contexts)
            read[condition.name] = read_column(given, condition, n_contexts)
            if needs_all and given is not None and len(rows := missing_rows(read[condition.name])):
                raise missing_in_contexts(condition.name, rows)
        for step in self.steps:
            own = {name: read[name] for name in step.expression.names}
            read[step.condition.name] = _all_fitted(run_frame(step.expression.plan, own, n_contexts), step.condition)
        return {**columns, **{step.condition.name: as_facts(read[step.condition.name]) for step in self.steps}}

    def missing(self, facts: Mapping[str, object]) -> list[str]:
        """The facts that something is computed from and that are missing."""
        return [c.name for c in self.inputs if read_fact(facts.get(c.name), c) is None]

    def no_value(self, name: str, facts: Mapping[str, object]) -> ContextError:
        """The error for a derived fact that a query needs and that has no finite value, though nothing is missing."""
        used = self.only([name]).steps[-1].expression
        known = {**facts, **self.compute(facts)}
        values = ", ".join(f"{c.name} = {describe(read_fact(known.get(c.name), c), c.domain)}" for c in used.conditions[:6])
        problem = f"the fact {in_quotes(name)} cannot be computed: {in_quotes(used.text)} has no finite value with {values}."
        return ContextError(Fault(problem, _GIVE_OTHERS, rule="missing-fact"))

    def no_values(self, name: str, rows: NDArray[np.int64]) -> ContextError:
        """The error for a derived fact that has no finite value in some of many contexts, though nothing is missing."""
        problem = f"the fact cannot be computed in {plural(len(rows), 'context')}: its expression has no finite value there."
        return ContextError(Fault(problem, _GIVE_OTHERS, place=Place(row=int(rows[0]), column=name), rule="missing-fact"))

    def refuse(self, given: Iterable[str]) -> None:
        """Raise ContextError when a derived fact is among those given."""
        for name in given:
            if name in self.names:
                problem = "this fact is derived, and never given."
                accepted = f"the facts that it is computed from: {some(c.name for c in self.only([name]).inputs)}"
                raise ContextError(Fault(problem, accepted, place=Place(column=name), rule="wrong-fact"))


def missing_in_contexts(name: str, rows: NDArray[np.int64]) -> ContextError:
    """The error for a fact that is missing in some of many contexts."""
    problem, accepted = f"the fact is missing in {plural(len(rows), 'context')}.", 'a value, or unknown="any" or "never"'
    return ContextError(Fault(problem, accepted, place=Place(row=int(rows[0]), column=name), rule="missing-fact"))


def _is_open(needs: Iterable[str], values: Mapping[str, Value], open_names: set[str]) -> bool:
    """Whether a value is missing only because facts that it needs are sets of values."""
    absent = {name for name in needs if is_missing(values[name])}
    return bool(absent) and absent <= open_names


def _fitted(value: Value, condition: Condition) -> Value:
    """A value as a fact of its condition: an angle wrapped."""
    kind = condition.domain.type
    if kind.is_circular and isinstance(value, float):
        return wrap_angle(value) if math.isfinite(value) else NAN
    low, high = kind.limits
    return NAN if isinstance(value, float) and not low <= value <= high else value


def _all_fitted(column: Column, condition: Condition) -> Column:
    kind = condition.domain.type
    low, high = kind.limits
    if math.isfinite(low) and not isinstance(column, Coded):
        return np.where((column >= low) & (column <= high), column, np.nan)
    if not kind.is_circular or isinstance(column, Coded):
        return column
    with np.errstate(invalid="ignore"):
        return settled(wrap_angles(column.astype(np.float64)))


def derive(conditions: Mapping[str, Condition]) -> Derivation:
    """The derivation of the conditions that have an `expr`. Raises ExpressionError with every fault: expressions that cannot be
    read, types that do not fit, and cycles with their path. The place of each names its condition."""
    faults = list(derivation_faults(conditions))
    if faults:
        raise ExpressionError(*(fault.at(Place(column=name)) for name, fault in faults))
    read = {name: read_expression(c.expr, conditions, c) for name, c in conditions.items() if c.expr is not None}
    order = TopologicalSorter({name: expression.names for name, expression in read.items()}).static_order()
    return Derivation(tuple(Step(conditions[name], read[name]) for name in order if name in read))


def derivation_faults(conditions: Mapping[str, Condition]) -> Iterator[tuple[str, Fault]]:
    """Every fault of the derived facts, with the name of the condition whose `expr` it is in."""
    needs: dict[str, list[str]] = {}
    for name, condition in conditions.items():
        if condition.expr is None:
            continue
        try:
            needs[name] = list(read_expression(condition.expr, conditions, condition).names)
        except ExpressionError as error:
            yield from ((name, fault) for fault in error.faults)
    while cycle := _cycle(needs):
        path = " → ".join(safe_text(name) for name in (cycle if len(cycle) < 9 else [*cycle[:7], "…", cycle[-1]]))
        yield cycle[0], Fault(f"{in_quotes(cycle[0])} is computed from itself: {path}.", "facts that are not computed from it")
        for name in cycle:
            needs.pop(name, None)


def _cycle(needs: Mapping[str, list[str]]) -> list[str] | None:
    """Names of which each needs the next, the first one again at the end."""
    try:
        TopologicalSorter(needs).prepare()
    except CycleError as error:
        names: list[str] = error.args[1]
        turned = names[::-1][:-1]
        first = turned.index(min(turned))
        return [*turned[first:], *turned[: first + 1]]
    return None
