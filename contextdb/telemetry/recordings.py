"""Recorded contexts, looked at a few rows at a time: telemetry of the game, however long, in CSV, Parquet or lines of a link.

One row is a moment, one column a fact. The rows stay in their file (Parquet) or its bytes (CSV) until they are requested. Texts of
a CSV are facts as on the command line; values of a Parquet file become such texts.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray
from polars.selectors import by_name

from contextdb.cells.conditions import Condition
from contextdb.disk import read_bytes
from contextdb.files.csv_source import find_rows, read_rows
from contextdb.files.texts import is_parquet, scanned_parquet
from contextdb.telemetry.link.lines import name_text
from contextdb.telemetry.link.recorded import facts_frame, indexed, is_recording

SEARCHED_AT_ONCE = 1 << 17
"""Rows that are searched in one go."""

Read = Callable[[int, int], pl.DataFrame]


@dataclass(frozen=True)
class Recording:
    """Recorded contexts that stay where they are until they are looked at."""

    path: Path
    n_rows: int
    facts: tuple[str, ...]
    """The columns that are facts, in the order of the file."""
    read: Read
    """The facts of the rows from the first up to the second number, as the file has them. A TableError where the file has been
    changed so that it cannot be read any more."""

    def search(self, text: str) -> Iterator[NDArray[np.int64]]:
        """The rows in which every word of a text stands, as in "gait=walk 3.5", capital letters or not.

        A part of the rows at a time, in order; there may be none in it.
        """
        words = text.casefold().split()
        for start in range(0, self.n_rows, SEARCHED_AT_ONCE):
            frame = self.read(start, min(start + SEARCHED_AT_ONCE, self.n_rows))
            yield _rows_with(frame, words) + start


def open_recording(path: Path, conditions: Collection[str], table: str = "") -> Recording:
    """Open recorded contexts; the columns of these conditions are facts, others are left out. Of the lines of a link those of the
    table are read. Raises TableError or FileError where the file cannot be read; with every fault of it."""
    if is_recording(path):
        return _open_lines(path, conditions, table)
    return _open_parquet(path, conditions) if is_parquet(path) else _open_csv(path, conditions)


def fact_text(value: object, condition: Condition) -> str:
    """A recorded value as the text of a fact; empty where the fact is missing."""
    if value is None or value != value:  # NaN
        return ""
    if isinstance(value, float):
        return condition.domain.type.spelling.write(value)
    if isinstance(value, list):
        return " ".join(name_text(str(v)) for v in value) or '""'
    is_name = isinstance(value, str) and condition.domain.type.is_named
    return name_text(str(value)) if is_name and value not in condition.domain.known else str(value)


def _rows_with(frame: pl.DataFrame, words: list[str]) -> NDArray[np.int64]:
    if not words:
        return np.arange(len(frame), dtype=np.int64)
    numbered = frame.rename({name: str(at) for at, name in enumerate(frame.columns)})  # polars reads some names as patterns
    texts = [_search_text(name, numbered[str(at)]) for at, name in enumerate(frame.columns)]
    line = pl.concat_str(texts or [pl.lit("")]).str.to_lowercase()
    holds = pl.all_horizontal([line.str.contains(word, literal=True) for word in words])
    return numbered.select(holds.arg_true()).to_series().to_numpy().astype(np.int64)


def _search_text(name: str, column: pl.Series) -> pl.Expr:
    """What a search finds of a fact: "gait=Walk "; nothing where the fact is missing."""
    value = pl.col(column.name)
    text = (
        value.cast(pl.List(pl.String)).list.join(" ") if isinstance(column.dtype, pl.List) else value.cast(pl.String, strict=False)
    )
    return pl.when(value.is_not_null()).then(pl.concat_str(pl.lit(f"{name}="), text, pl.lit(" "))).otherwise(pl.lit(""))


def _open_parquet(path: Path, conditions: Collection[str]) -> Recording:
    with scanned_parquet(path) as scan:
        facts = tuple(name for name in scan.collect_schema().names() if name in conditions)
        n_rows = scan.select(pl.len()).collect().item()

    def read(start: int, stop: int) -> pl.DataFrame:
        if not facts:
            return pl.DataFrame()
        with scanned_parquet(path) as scan:
            return scan.select(by_name(facts)).slice(start, stop - start).collect()

    return Recording(path, n_rows, facts, read)


def _open_csv(path: Path, conditions: Collection[str]) -> Recording:
    raw = read_bytes(path)
    records, names = find_rows(raw, str(path))
    starts, stops = records.starts[1:], records.stops[1:]
    facts = tuple(name for name in names if name in conditions)
    return Recording(path, len(starts), facts, lambda i, j: read_rows(raw, starts[i:j], stops[i:j], names, facts))


def _open_lines(path: Path, conditions: Collection[str], table: str) -> Recording:
    recorded = indexed(path, table)
    facts = tuple(name for name in recorded.names if name in conditions)
    return Recording(path, len(recorded.starts), facts, lambda i, j: facts_frame(recorded.facts(i, j), facts))
