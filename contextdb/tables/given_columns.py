"""Columns of a table as Python gives them: a mapping of columns, rows as mappings, or a polars DataFrame."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import polars as pl

from contextdb.cells.arguments import require_many, require_mapping, require_text
from contextdb.columns import TextColumn
from contextdb.errors import Fault, TableError, in_quotes
from contextdb.files.parquet import columns_of_frame

ACCEPTED = 'a mapping: {"Asset Name": [...], "speed": [...]}, a list of such mappings of one row each, or a polars DataFrame'


def columns_given(given: object) -> list[TextColumn]:
    """The texts of each column; what is None, or left out of a row, is empty. Raises ContextError where what is given, or a part of
    it, is of another type; TableError for columns of unequal length, or columns of a DataFrame of a type that no cell has."""
    if isinstance(given, pl.DataFrame):
        return columns_of_frame(given)
    columns = given if isinstance(given, Mapping) else _of_rows(require_many(given, "columns", ACCEPTED))
    found = []
    for name, values in columns.items():
        require_many(values, f"the column {in_quotes(require_text(name, 'a name of columns'))}", "a list of texts")
        found.append(TextColumn.of(name, map(_text, values)))
    lengths = {column.name: column.n_rows for column in found}
    if len(set(lengths.values())) > 1:
        raise TableError(Fault(f"the columns are not equally long: {lengths}.", "one text for each row in every column"))
    return found


def _of_rows(rows: Iterable[object]) -> Mapping[str, Sequence[object]]:
    listed = [require_mapping(row, "a row of columns", 'a mapping: {"Asset Name": "walk", "speed": "0..2"}') for row in rows]
    names = dict.fromkeys(name for row in listed for name in row)
    return {name: [row.get(name) for row in listed] for name in names}


def _text(value: object) -> str:
    return "" if value is None else str(value)
