"""Columns of facts as they are given, where they are plainly typed: read without a Python step for each fact."""

from __future__ import annotations

from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from contextdb.cells.kinds import Kind


def as_series(given: Any, listed: pl.DataType) -> pl.Series | None:
    """A column as a polars series, or None when it has no single plain type.

    What is listed must be of the type `listed`: left to itself polars takes a list after its first items for float32 or for truth.
    """
    if isinstance(given, pl.Series):
        return given
    is_typed = isinstance(given, np.ndarray) and given.dtype.kind in "biufM"
    try:
        if is_typed:
            return pl.Series(given, nan_to_null=False)
        items = given.tolist() if isinstance(given, np.ndarray) else list(given)
        return pl.Series(items, dtype=listed, strict=True, nan_to_null=False) if items else None
    except (TypeError, ValueError, OverflowError, pl.exceptions.PolarsError, pl.exceptions.PanicException):
        return None


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
