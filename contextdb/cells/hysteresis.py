"""Hysteresis of numbers: what plays stays valid a little beyond the edges of its cells.

A condition says by `hysteresis` how far, in its own unit. A cell widened by h accepts a fact x when it accepts some value between
x - h and x + h; in tables inside tables, all cells of the condition that a row has accept one such value. So the fact is widened,
to a set of values, and no cell: a table queried with widened facts answers with the rows whose widened cells all accept. Only what
plays already is requested in this way; every other answer is exact.
"""

from __future__ import annotations

from collections.abc import Iterable

from contextdb.cells import intervals
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Fact
from contextdb.cells.sets import Cell, NumberSet


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
