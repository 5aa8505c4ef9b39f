"""The column that says how often each row's moment was seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import polars as pl

from contextdb.errors import Fault, Place, TableError, in_quotes, no_such, plural
from contextdb.telemetry.chunks import Chunk
from contextdb.telemetry.keys import Counts

MOST_COUNT = 1 << 40
"""The largest number in a count column."""


def moments_of(count: str | None, names: Sequence[str], chunk: Chunk, file: str) -> Counts:
    """The number of moments of each row: int64 [N]; 1 without a count column. Raises TableError where there is no such column, or a
    count is missing or no whole number from 0 up; file and line, else row, are named."""
    if count is None:
        return np.ones(chunk.n_rows, np.int64)
    if count not in names:
        raise TableError(no_such("count column", count, names, f"one of {plural(len(names), 'column')}", Place(file)))
    if not chunk.n_rows:
        return np.zeros(0, np.int64)
    given = chunk.frame[count]
    is_number = given.dtype.is_numeric() or given.dtype in (pl.String, pl.Null)
    plain = given if is_number else pl.repeat(None, chunk.n_rows, dtype=pl.Null, eager=True)
    numbers = (plain.str.strip_chars() if plain.dtype == pl.String else plain).cast(pl.Float64, strict=False)
    right = (numbers.is_finite() & (numbers >= 0) & (numbers <= MOST_COUNT) & (numbers.floor() == numbers)).fill_null(False)
    if not is_number or not right.all():
        at = 0 if not is_number else int(np.flatnonzero(~right.to_numpy())[0])
        value = given[at]
        said = "is missing" if value is None else f"{in_quotes(str(value))} is not a count"
        place = Place(file, chunk.line(at), count, chunk.first_row + at)
        raise TableError(Fault(f"the count {said}.", f"a whole number from 0 to {MOST_COUNT:,}", place=place))
    return numbers.cast(pl.Int64).to_numpy()
