"""Columns of recorded facts, read so that no fact can stop the evaluation: N rows.

What is outside a condition's domain becomes missing, and is noted; numbers outside their bounds stay, and are noted too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import polars as pl
from numpy.typing import NDArray

from contextdb.bitmask import Flags
from contextdb.cells import Cell
from contextdb.conditions import Condition
from contextdb.domains import NUMERIC
from contextdb.errors import ContextError
from contextdb.facts import Fact, describe, read_fact, read_fact_text

PLAIN_NUMBER = r"^[ \t]*[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?[ \t]*$"
MOST_EXAMPLES = 5


@dataclass(frozen=True, eq=False)
class FactColumn:
    """The facts of one condition: what `query_many` takes, which are missing, and which lie outside the domain."""

    values: pl.Series
    missing: Flags
    outside: Flags
    given: pl.Series
    """As the file has them."""

    def examples(self, counted: Flags) -> tuple[str, ...]:
        """A few of the values outside, the first by their letters, of the rows that count."""
        found = self.given.filter(pl.Series(self.outside & counted))
        if isinstance(found.dtype, pl.Float32 | pl.Float64 | pl.String) or found.dtype.is_integer():
            texts = found.unique().to_list()
        else:
            texts = found.to_list()
        return tuple(sorted({_shown(value) for value in texts})[:MOST_EXAMPLES])


def read_facts(given: pl.Series, condition: Condition, is_text: bool) -> FactColumn:
    """Read one column of a file."""
    kind = condition.domain.kind
    if kind in NUMERIC:
        return _numbers(given, condition, is_text)
    if kind == "bool" and given.dtype == pl.Boolean:
        nothing = np.zeros(len(given), np.bool_)
        return FactColumn(given, given.is_null().to_numpy(), nothing, given)
    if kind == "enum" and given.dtype == pl.String and not is_text:
        return _names(given, condition)
    return _each(given, condition, is_text)


def _names(given: pl.Series, condition: Condition) -> FactColumn:
    """Values of an enum, all at once."""
    known = given.cast(pl.Enum(list(condition.domain.values or ())), strict=False)
    missing = given.is_null()
    outside = (known.is_null() & ~missing).to_numpy()
    return FactColumn(known if outside.any() else given, missing.to_numpy(), outside, given)


def _numbers(given: pl.Series, condition: Condition, is_text: bool) -> FactColumn:
    domain = condition.domain
    if is_text and given.dtype == pl.String:
        facts, read = _number_texts(given, condition)
    elif given.dtype.is_numeric() and not given.dtype.is_decimal():
        facts, read = given.cast(pl.Float64).fill_null(np.nan).to_numpy().copy(), None
    else:
        read = _each(given, condition, is_text)
        facts = read.values.cast(pl.Float64).fill_null(np.nan).to_numpy().copy()
    wrong = np.zeros(len(facts), np.bool_) if read is None else read.outside.copy()
    if domain.kind == "int":
        wrong |= ~np.isnan(facts) & (facts != np.trunc(facts))
    if domain.kind == "angle":
        wrong |= np.isinf(facts)
    facts[wrong] = np.nan
    missing = np.isnan(facts) & ~wrong
    if domain.kind != "angle":
        wrong = wrong | (facts < domain.minimum) | (facts > domain.maximum)
    return FactColumn(pl.Series(facts, nan_to_null=False), missing, wrong, given)


def _number_texts(given: pl.Series, condition: Condition) -> tuple[NDArray[np.float64], FactColumn]:
    """Numbers written as texts: plain ones at once, all others one by one."""
    is_plain = given.str.contains(PLAIN_NUMBER).fill_null(False).to_numpy()
    plain = given.str.strip_chars(" \t").cast(pl.Float64, strict=False)
    others = np.flatnonzero(~is_plain)
    facts = plain.fill_null(np.nan).to_numpy().copy()
    outside = np.zeros(len(given), np.bool_)
    read = _each(given.gather(others), condition, True)
    facts[others] = read.values.cast(pl.Float64).fill_null(np.nan).to_numpy()
    outside[others] = read.outside
    return facts, FactColumn(plain, np.isnan(facts) & ~outside, outside, given)


def _each(given: pl.Series, condition: Condition, is_text: bool) -> FactColumn:
    """Read every distinct value once."""
    codes, values = _coded(given)
    read: Callable[[object], Fact] = (
        (lambda v: None if v is None else read_fact_text(str(v), condition)) if is_text else (lambda v: read_fact(v, condition))
    )
    facts: list[object] = []
    wrong: list[bool] = []
    for value in values:
        try:
            fact = read(value)
        except (ContextError, TypeError):
            fact = Cell(None)
        wrong.append(isinstance(fact, Cell))
        facts.append(None if isinstance(fact, Cell) else sorted(fact) if isinstance(fact, frozenset) else fact)
    distinct = pl.Series(facts, dtype=_dtype(condition), strict=False)
    taken = distinct.gather(codes) if len(codes) else distinct.clear()
    is_wrong = np.array(wrong, np.bool_)[codes] if len(codes) else np.zeros(0, np.bool_)
    return FactColumn(taken, taken.is_null().to_numpy() & ~is_wrong, is_wrong, given)


def _coded(given: pl.Series) -> tuple[NDArray[np.int64], list[object]]:
    """A number for each value, and the value of each number."""
    if isinstance(given.dtype, (pl.Categorical, pl.Enum)):
        given = given.cast(pl.String)
    if given.dtype == pl.String:
        distinct = given.drop_nulls().unique(maintain_order=True)
        codes = given.cast(pl.Enum(distinct)).to_physical().cast(pl.Int64).fill_null(len(distinct))
        return codes.to_numpy(), [*distinct.to_list(), None]
    known: dict[object, int] = {}
    values: list[object] = []
    found = []
    for value in given.to_list():
        key = (type(value), str(value))
        if key not in known:
            known[key] = len(values)
            values.append(value)
        found.append(known[key])
    return np.array(found, np.int64), values


def _dtype(condition: Condition) -> pl.DataType:
    kind = condition.domain.kind
    if kind in NUMERIC:
        return pl.Float64()
    return pl.Boolean() if kind == "bool" else pl.List(pl.String) if kind == "tags" else pl.String()


def _shown(value: object) -> str:
    if isinstance(value, (bool, float, int, str)):
        return describe(value)
    return " ".join(sorted(map(str, value))) if isinstance(value, list) else describe(str(value))
