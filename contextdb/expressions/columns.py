"""Columns of facts, as a plan computes with them for many contexts at once. N contexts.

    numbers               float64 [N], NaN where missing, -0.0 as 0.0, angles wrapped
    truths                int8 [N]: 0 False, 1 missing, 2 True, so that `and` is the least and `or` the greatest
    texts, sets of tags   `Coded`: each distinct value once, and int32 codes [N], -1 where missing

A plainly typed column is read without a Python step for each fact; anything else fact by fact, each distinct one once.

N contexts. Values are columns as in `contextdb.expressions.columns`; a constant has no axis and takes part by broadcasting. The
same answers, bit by bit, as `contextdb.expressions.scalar` gives for one context.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.fact_columns import as_series, in_context, plain_numbers, read_each
from contextdb.cells.facts import read_fact
from contextdb.cells.intervals import wrap_angles
from contextdb.cells.kinds import Kind
from contextdb.cells.sets import Cell, NumberSet
from contextdb.columns import polars as pl
from contextdb.errors import ContextError
from contextdb.expressions.arithmetic import settled
from contextdb.expressions.plan import Apply, Compare, Const, Given, Held, Link, Logic, Negation, Part, Select

Doubles = NDArray[np.float64]
Truths = NDArray[np.int8]
Codes = NDArray[np.int32]

NO, UNKNOWN, YES = np.int8(0), np.int8(1), np.int8(2)


@dataclass(frozen=True, eq=False)
class Coded:
    """Texts or sets of tags: context i has values[codes[i]]; -1 is missing."""

    codes: Codes
    values: tuple[Any, ...]

    def looked_up(self, table: Sequence[Any], missing: Any, dtype: Any) -> NDArray[Any]:
        """What a table says of each context's value."""
        return np.array([*table, missing], dtype)[self.codes]


Column = Doubles | Truths | Coded


def read_column(given: Any, condition: Condition, n_contexts: int) -> Column:
    """One column of facts; None is a column that was not given, all of it missing. Raises ContextError where a fact is of the wrong
    type, outside the domain, or a set of values; names its row."""
    kind = condition.domain.type
    if given is None:
        if kind.is_numeric:
            return np.full(n_contexts, np.nan)
        return np.full(n_contexts, UNKNOWN) if kind.is_truth else Coded(np.full(n_contexts, -1, np.int32), ())
    plain = _plain_numbers(given, kind) if kind.is_numeric else _plain_truths(given) if kind.is_truth else None
    if plain is None and kind.is_named:
        return _texts(given, condition)
    return plain if plain is not None else _column_of(*read_each(given, condition), kind)


def _plain_numbers(given: Any, kind: Kind) -> Doubles | None:
    """A column of plain numbers; None when it must be read fact by fact."""
    facts = plain_numbers(given, kind)
    return None if facts is None else (wrap_angles(facts) if kind.is_circular else facts) + 0.0


def _plain_truths(given: Any) -> Truths | None:
    series = as_series(given, "Boolean")
    if series is None or series.dtype != pl.Boolean:
        return None
    truths: Truths = (series.cast(pl.Int8) * 2).fill_null(int(UNKNOWN)).to_numpy()
    return truths


def _texts(given: Any, condition: Condition) -> Coded:
    """A column of texts; only the distinct ones are read."""
    series = as_series(given, "String")
    if series is not None and isinstance(series.dtype, (pl.Categorical, pl.Enum)):
        series = series.cast(pl.String)
    if series is None or series.dtype != pl.String:
        return _coded(*read_each(given, condition))
    distinct = series.drop_nulls().unique(maintain_order=True)
    texts = distinct.to_list()
    for value in texts:
        try:
            read_fact(value, condition)
        except ContextError as error:
            row = series.index_of(value)
            raise in_context(error, row or 0, condition.name, value) from None
    codes = series.cast(pl.Enum(distinct)).to_physical().cast(pl.Int32).fill_null(-1)
    return Coded(codes.to_numpy(), tuple(texts))


def _column_of(facts: Sequence[Any], numbers: NDArray[np.int64], kind: Kind) -> Column:
    coded = _coded(facts, numbers)
    if kind.is_numeric:
        return coded.looked_up(coded.values, np.nan, np.float64)
    return coded.looked_up([YES if v else NO for v in coded.values], UNKNOWN, np.int8) if kind.is_truth else coded


def _coded(facts: Sequence[Any], numbers: NDArray[np.int64]) -> Coded:
    """Codes of distinct facts, None where missing: two ways to write one fact are one."""
    distinct: dict[Any, int] = {}
    table = [-1 if fact is None else distinct.setdefault(fact, len(distinct)) for fact in facts]
    return Coded(np.array(table, np.int32)[numbers], tuple(distinct))


def as_array(column: Column) -> NDArray[Any]:
    """A column as plain numpy: float64 with NaN for numbers, else objects with None where missing."""
    if isinstance(column, Coded):
        values = np.empty(len(column.values) + 1, object)
        values[:-1] = column.values
        return values[column.codes]
    if column.dtype == np.int8:
        return np.array([False, None, True], object)[column]
    return column


def as_facts(column: Column) -> Any:
    """A column as `query_many` takes it: doubles, or a series or list with None where missing."""
    if isinstance(column, Coded):
        is_text = all(isinstance(value, str) for value in column.values)
        return _text_series(column) if is_text else as_array(column).tolist()
    if column.dtype != np.int8:
        return column
    return pl.select(pl.when(pl.lit(pl.Series(column)) != 1).then(pl.lit(pl.Series(column)) == 2)).to_series()


def _text_series(column: Coded) -> pl.Series:
    texts = pl.Series([*column.values, None], dtype=pl.String)
    return texts.gather(np.where(column.codes < 0, len(column.values), column.codes))


def missing_rows(column: Column) -> NDArray[np.int64]:
    """The contexts in which a column has no value: int64 [n ≤ N]."""
    if isinstance(column, Coded):
        return np.flatnonzero(column.codes < 0)
    return np.flatnonzero(column == UNKNOWN if column.dtype == np.int8 else np.isnan(column))


def taken(column: Column, contexts: NDArray[np.int64]) -> Column:
    """The values of a column in some contexts."""
    return Coded(column.codes[contexts], column.values) if isinstance(column, Coded) else column[contexts]


# ---- compute a plan for many contexts at once, block by block, so that what lies between stays in the cache


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


def _run(plan: Part, columns: Columns) -> Any:
    match plan:
        case Const(bool(value)):
            return np.asarray(YES if value else NO)
        case Const(str(value)):
            return Coded(np.array(0, np.int32), (value,))
        case Const(value):
            return np.asarray(value)
        case Given(name):
            return columns[name]
        case Apply(function, parts):
            return settled(function.many(*[_run(part, columns) for part in parts]))
        case Compare(parts, links):
            values = [_run(part, columns) for part in parts]
            return reduce(np.minimum, (_linked(link, *pair) for link, pair in zip(links, pairwise(values), strict=True)))
        case Held(part, cell):
            return _where_held(_run(part, columns), cell)
        case Logic(word, parts):
            return reduce(np.minimum if word == "and" else np.maximum, (_run(part, columns) for part in parts))
        case Negation(part):
            return YES - _run(part, columns)
        case Select():
            return _selected(*(_run(part, columns) for part in (plan.condition, plan.then, plan.otherwise)))


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


def _where_held(value: Any, cell: Cell) -> Any:
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


def _selected(truth: Truths, then: Any, otherwise: Any) -> Any:
    if isinstance(then, Coded):
        return _chosen_values(truth, then, otherwise)
    missing = UNKNOWN if then.dtype == np.int8 else np.nan
    return np.where(truth == UNKNOWN, missing, np.where(truth == YES, then, otherwise))


def _chosen_values(truth: Truths, then: Coded, otherwise: Coded) -> Coded:
    values = tuple(dict.fromkeys((*then.values, *otherwise.values)))
    both = Coded(np.empty(0, np.int32), values)
    chosen = np.where(truth == YES, _recoded(then, both), _recoded(otherwise, both))
    return Coded(np.where(truth == UNKNOWN, np.int32(-1), chosen), values)
