"""Compute a plan for many contexts at once, block by block, so that what lies between stays in the cache.

N contexts. Values are columns as in `contextdb.expressions.columns`; a constant has no axis and takes part by broadcasting. The
same answers, bit by bit, as `contextdb.expressions.scalar` gives for one context.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.intervals import wrap_angles
from contextdb.cells.sets import Cell, NumberSet
from contextdb.expressions.arithmetic import settled
from contextdb.expressions.columns import NO, UNKNOWN, YES, Coded, Column, Doubles, Truths
from contextdb.expressions.plan import Apply, Compare, Const, Given, Held, Link, Logic, Negation, Part, Select

BLOCK = 1 << 14

Columns = Mapping[str, Column]
_COMPARE = {
    "==": np.equal, "!=": np.not_equal, "<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal,
}  # fmt: skip


def run_frame(plan: Part, columns: Columns, n_contexts: int) -> Column:
    """The values of a plan in N contexts, from the columns of the facts that it names."""
    blocks: list[Column] = []
    with np.errstate(all="ignore"):
        for start in range(0, max(n_contexts, 1), BLOCK):
            stop = min(start + BLOCK, n_contexts)
            part = {name: _cut(column, start, stop) for name, column in columns.items()}
            blocks.append(_spread(_run(plan, part), stop - start))
    return _concatenated(blocks)


def _cut(column: Column, start: int, stop: int) -> Column:
    if isinstance(column, Coded):
        return Coded(column.codes[start:stop], column.values)
    return column[start:stop]


def _spread(value: Any, n_contexts: int) -> Column:
    if isinstance(value, Coded):
        return Coded(np.broadcast_to(value.codes, n_contexts), value.values)
    spread: Doubles | Truths = np.broadcast_to(value, n_contexts)
    return spread


def _concatenated(blocks: Sequence[Column]) -> Column:
    """The blocks as one column. What values a text can have is the plan's, so it is the same in every block."""
    first = blocks[0]
    if isinstance(first, Coded):
        return Coded(np.concatenate([b.codes for b in blocks if isinstance(b, Coded)]), first.values)
    return np.concatenate([b for b in blocks if not isinstance(b, Coded)])


@singledispatch
def _run(plan: Part, columns: Columns) -> Any:
    raise AssertionError(plan)


@_run.register
def _run_const(plan: Const, columns: Columns) -> Any:
    if isinstance(plan.value, bool):
        return np.asarray(YES if plan.value else NO)
    return Coded(np.array(0, np.int32), (plan.value,)) if isinstance(plan.value, str) else np.asarray(plan.value)


@_run.register
def _run_given(plan: Given, columns: Columns) -> Any:
    return columns[plan.name]


@_run.register
def _run_apply(plan: Apply, columns: Columns) -> Any:
    return settled(plan.function.many(*[_run(part, columns) for part in plan.parts]))


@_run.register
def _run_compare(plan: Compare, columns: Columns) -> Any:
    values = [_run(part, columns) for part in plan.parts]
    answer: Any = YES
    for i, link in enumerate(plan.links):
        answer = np.minimum(answer, _linked(link, values[i], values[i + 1]))
    return answer


def _linked(link: Link, left: Any, right: Any) -> Truths:
    if isinstance(left, Coded):
        left, right, is_missing = left.codes, _recoded(right, left), (left.codes < 0) | (right.codes < 0)
    elif left.dtype == np.int8:
        is_missing = (left == UNKNOWN) | (right == UNKNOWN)
    else:
        is_missing = np.isnan(left) | np.isnan(right)
        left, right = _angles(link, left, right)
    holds = _COMPARE[link.sign](left, right)
    return np.where(is_missing, UNKNOWN, np.where(holds, YES, NO))


def _angles(link: Link, left: Doubles, right: Doubles) -> tuple[Doubles, Doubles]:
    if link.is_wrapped:
        return wrap_angles(left), wrap_angles(right)
    return _high(left) if link.left_is_high else left, _high(right) if link.right_is_high else right


def _high(degrees: Doubles) -> Doubles:
    return np.where(degrees == -180.0, 180.0, degrees)


def _recoded(column: Coded, like: Coded) -> NDArray[np.int32]:
    """The codes of a column in the numbering of another, -2 for values that the other does not have."""
    code_of = {value: code for code, value in enumerate(like.values)}
    return column.looked_up([code_of.get(v, -2) for v in column.values], -1, np.int32)


@_run.register
def _run_held(plan: Held, columns: Columns) -> Any:
    value, cell = _run(plan.part, columns), plan.cell
    if isinstance(value, Coded):
        return value.looked_up([YES if cell.holds(v) else NO for v in value.values], UNKNOWN, np.int8)
    if value.dtype == np.int8:
        answers = [YES if cell.holds(False) else NO, UNKNOWN, YES if cell.holds(True) else NO]
        return np.array(answers, np.int8)[value]
    return np.where(np.isnan(value), UNKNOWN, np.where(_held(cell, value), YES, NO))


def _held(cell: Cell, values: Doubles) -> NDArray[np.bool_]:
    """Whether the cell holds each number; angles are wrapped already."""
    if not isinstance(cell.accepts, NumberSet):
        return np.full(np.shape(values), cell.is_any)
    if cell.is_empty:
        return np.zeros(np.shape(values), np.bool_)
    lows, highs = np.array(cell.accepts.spans, np.float64).reshape(-1, 2).T
    span = np.searchsorted(lows, values, "right") - 1
    return (span >= 0) & (values <= highs[span])


@_run.register
def _run_logic(plan: Logic, columns: Columns) -> Any:
    join = np.minimum if plan.word == "and" else np.maximum
    answer = _run(plan.parts[0], columns)
    for part in plan.parts[1:]:
        answer = join(answer, _run(part, columns))
    return answer


@_run.register
def _run_negation(plan: Negation, columns: Columns) -> Any:
    return YES - _run(plan.part, columns)


@_run.register
def _run_select(plan: Select, columns: Columns) -> Any:
    truth, then, otherwise = (_run(part, columns) for part in (plan.condition, plan.then, plan.otherwise))
    if isinstance(then, Coded):
        return _chosen_values(truth, then, otherwise)
    missing = UNKNOWN if then.dtype == np.int8 else np.nan
    return np.where(truth == UNKNOWN, missing, np.where(truth == YES, then, otherwise))


def _chosen_values(truth: Truths, then: Coded, otherwise: Coded) -> Coded:
    values = tuple(dict.fromkeys((*then.values, *otherwise.values)))
    both = Coded(np.empty(0, np.int32), values)
    chosen = np.where(truth == YES, _recoded(then, both), _recoded(otherwise, both))
    return Coded(np.where(truth == UNKNOWN, np.int32(-1), chosen), values)
