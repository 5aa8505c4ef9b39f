"""Columns of facts as they are given: those of plain types without a Python step for each fact, others each distinct fact once."""

from __future__ import annotations

import datetime
import sys
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Fact, read_fact
from contextdb.cells.kinds import Kind
from contextdb.cells.sets import Cell
from contextdb.columns import polars as pl
from contextdb.errors import ContextError, Fault, Place

_PLAIN: dict[str, tuple[type, ...]] = {
    "Boolean": (bool, np.bool_),
    "String": (str,),
    "Float64": (int, float, np.integer, np.floating, np.ndarray),
    "Date": (datetime.date,),
}
"""The types of which every value is a fact; of others polars takes some that a query refuses, such as an int for a date."""
_SEVERAL = (list, set, tuple)
"""What has no hash, or may hold what has none."""


def is_series(given: object) -> TypeGuard[pl.Series]:
    """Whether it is a polars series; nobody has one who has not loaded polars."""
    polars = sys.modules.get("polars")
    return polars is not None and isinstance(given, polars.Series)


def is_frame(given: object) -> TypeGuard[pl.DataFrame]:
    """Whether it is a polars DataFrame."""
    polars = sys.modules.get("polars")
    return polars is not None and isinstance(given, polars.DataFrame)


def column_type(kind: Kind) -> pl.DataType:
    """The polars type of a column of facts."""
    dtype: pl.DataType = pl.List(pl.String()) if kind.is_tags else getattr(pl, kind.dtype)()
    return dtype


def listed(given: Any) -> list[Any]:
    """A column as a list of single facts; dates and times of numpy as they are, because many of them are ints to Python."""
    if is_series(given):
        return given.to_list()
    return given.tolist() if isinstance(given, np.ndarray) and given.dtype.kind not in "mM" else list(given)


def as_series(given: Any, dtype: str) -> pl.Series | None:
    """A column as a polars series, or None when it has no single plain type.

    A list must be of the polars type named `dtype`: left to itself polars takes a list after its first items
    for float32 or for truth.
    """
    if is_series(given):
        return given
    is_typed = isinstance(given, np.ndarray) and given.dtype.kind in "biufM"
    try:
        if is_typed:
            return pl.Series(given, nan_to_null=False)
        items = listed(given)
        if not items or not all(_is_plain(kind, _PLAIN[dtype]) for kind in set(map(type, items))):
            return None
        return pl.Series(items, dtype=getattr(pl, dtype), strict=True, nan_to_null=False)
    except (TypeError, ValueError, OverflowError, pl.exceptions.PolarsError, pl.exceptions.PanicException):
        return None


def _is_plain(kind: type, plain: tuple[type, ...]) -> bool:
    return kind is type(None) or (issubclass(kind, plain) and not issubclass(kind, (datetime.datetime, np.timedelta64)))


def plain_numbers(given: Any, kind: Kind) -> NDArray[np.float64] | None:
    """A column of numbers as doubles, NaN where missing, angles not yet wrapped; None when it must be read fact by fact."""
    if isinstance(given, np.ndarray) and given.dtype == np.float64 and given.ndim == 1 and not kind.is_whole:
        return None if kind.is_circular and np.isinf(given).any() else given
    series = as_series(given, kind.dtype)
    if series is None or not kind.is_column(series.dtype):
        return None
    physical = series.to_physical()
    facts = physical.cast(pl.Float64).to_numpy(writable=False)
    if physical.null_count():
        facts = physical.cast(pl.Float64).fill_null(np.nan).to_numpy()
    if kind.is_whole and not physical.dtype.is_integer() and not (np.isnan(facts) | (facts == np.trunc(facts))).all():
        return None
    return None if kind.is_circular and np.isinf(facts).any() else facts


def read_each(given: Any, condition: Condition) -> tuple[list[Any], NDArray[np.int64]]:
    """The distinct facts in canonical form, each of them read once, and which of them each context has."""
    known: dict[object, int] = {}
    facts: list[Any] = []
    numbers: list[int] = []
    for row, value in enumerate(listed(given)):
        try:
            key = (type(value), _hashable(value))
            number = known.get(key)
            if number is None:
                facts.append(_read_one(value, condition))
                number = known[key] = len(known)
        except (ContextError, TypeError) as error:
            raise in_context(error, row, condition.name, value) from None
        numbers.append(number)
    return facts, np.array(numbers, np.int64)


def _hashable(value: Any) -> object:
    """A fact as a key; what cannot be one, and is no fact, raises TypeError when it is used."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return value[()]
    return tuple(value) if isinstance(value, _SEVERAL) else value


def _read_one(value: object, condition: Condition) -> Fact:
    fact = read_fact(value, condition)
    if isinstance(fact, Cell):
        mend = "to query these contexts one by one: query(facts)"
        raise ContextError(Fault("a set of values is for one query at a time.", "one value in each context", mend))
    return fact


def in_context(error: Exception, row: int, name: str, value: object) -> ContextError:
    """The error of a fact with its place: the context, and the condition."""
    place = Place(row=row, column=name)
    if isinstance(error, ContextError):
        return ContextError(*(f.at(place) for f in error.faults))
    return ContextError(Fault(f"{type(value).__name__} is not a fact.", "one value in each context", place=place))
