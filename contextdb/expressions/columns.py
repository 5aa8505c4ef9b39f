"""Columns of facts, as a plan computes with them for many contexts at once. N contexts.

    numbers               float64 [N], NaN where missing, -0.0 as 0.0, angles wrapped
    truths                int8 [N]: 0 False, 1 missing, 2 True, so that `and` is the least and `or` the greatest
    texts, sets of tags   `Coded`: each distinct value once, and int32 codes [N], -1 where missing

A plainly typed column is read without a Python step for each fact; anything else fact by fact, each distinct one once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.fact_columns import as_series, in_context, plain_numbers, read_each
from contextdb.cells.facts import read_fact
from contextdb.cells.intervals import wrap_angles
from contextdb.cells.kinds import Kind
from contextdb.columns import polars as pl
from contextdb.errors import ContextError

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
