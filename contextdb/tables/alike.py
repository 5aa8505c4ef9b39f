"""Rows of a table that accept the same, and how a finding names a row of a table."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from contextdb.errors import in_quotes, row_name
from contextdb.findings import Finding, Level
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import TableData


def where(table: TableData, row: int, other: int) -> str:
    """Where a row is, in a sentence about another: its line, else its number; where one is an inner table's with the file."""
    place = table.place(row)
    if place.line is None:
        return row_name(row)
    is_inside = table.path is not None and {place.file, table.place(other).file} != {str(table.path)}
    return f"line {place.line} of {place.file}" if is_inside else f"line {place.line}"


def identical_rows(table: TableData) -> Iterator[Finding]:
    """Rows whose every condition accepts the same values, whatever way it is written. A disabled row is like no other.

    Each is caused by the first such row of the same asset, or else by the first of all.
    """
    if table.n_rows < 2 or not (table.conditions or table.when):
        return
    disabled = np.where(table.enabled, -1, np.arange(table.n_rows))
    rules = [] if table.when is None else [table.when.meanings]
    meanings = [disabled, *rules, *(_meanings(column) for column in table.conditions)]
    group = np.zeros(table.n_rows, np.int64)
    for own in meanings:  # one number at a time: rows of numbers are sorted far more slowly
        group = np.unique(group * (int(own.max()) + 2) + own + 1, return_inverse=True)[1]
    _, first, counts = np.unique(group, return_index=True, return_counts=True)
    first_of: dict[tuple[int, str], int] = {}
    for row in np.flatnonzero(counts[group] > 1).tolist():
        start = int(first[group[row]])
        same = first_of.setdefault((start, table.assets[row]), row)
        other = start if same == row else same
        if other != row:
            message = f"every condition is the same as in {named(table, other, row)}."
            yield finding_at(table, row, "identical-rows", "warning", message, None, (other,))


def named(table: TableData, other: int, row: int) -> str:
    """A row by its place and its asset, in a sentence about another."""
    return f"{where(table, other, row)} ({in_quotes(table.assets[other])})"


def finding_at(
    table: TableData, row: int, rule: str, level: Level, message: str, column: str | None, by: tuple[int, ...] = ()
) -> Finding:
    """A finding at a row of a table, or at one of its cells."""
    place = table.place(row, column)
    return Finding(rule, level, message, table.name, place.file, row, table.assets[row], place.line, column, by)


def _meanings(column: ConditionColumn) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """For each row a number that is the same for cells that mean the same; a cell that cannot be read means itself."""
    known: dict[object, int] = {}
    keys = [("fault", i) if i in column.faults else (c.accepts, c.penalty, c.per) for i, c in enumerate(column.cells)]
    numbers = np.array([known.setdefault(k, len(known)) for k in keys], np.int64)
    return numbers[column.texts.codes]
