"""The rows of a table with the rows of its inner tables in place of those that refer to them.

D = depth, n = rows of the flat table. A flat row is a way through the tables: a row of the outer one, and where that refers to a
table, a row of that one, and so on. The order is that of the files: inner rows stand where the outer row is.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.columns import TextColumn
from contextdb.compiled.layers import Layers
from contextdb.errors import Fault, Place, TableError, in_quotes
from contextdb.tables.data import TableData
from contextdb.tables.nesting.links import inner_rows

Numbers = NDArray[np.int32]
MOST_ROWS = 1_000_000
"""A table may have so many rows with its inner tables' rows counted; one that is in two places counts twice."""


@dataclass(frozen=True, eq=False)
class Expansion:
    """The ways of all flat rows."""

    names: tuple[str, ...]
    tables: tuple[TableData, ...]
    """Every table once, the outer one first."""
    numbers: Numbers
    """Which of `tables` a way passes at each depth: int32 [D, n]; -1 below its end."""
    rows: Numbers
    """The row that it takes there: int32 [D, n]; -1 below its end."""

    @property
    def n_rows(self) -> int:
        return int(self.rows.shape[1])

    def layers(self, columns: Iterable[tuple[int, TextColumn]]) -> Layers:
        """The texts of some tables' columns, given with the numbers of the tables."""
        texts, codes = [""], np.zeros(self.rows.shape, np.int32)
        for number, column in columns:
            here = self.numbers == number
            codes[here] = column.codes[self.rows[here]] + len(texts)
            texts += column.texts
        return Layers(tuple(texts), codes)


NO_ROWS = Expansion((), (), np.empty((1, 0), np.int32), np.empty((1, 0), np.int32))


def expand(tables: Mapping[str, TableData]) -> Expansion:
    """The flat rows of the first of some sound tables; the others are those that are in it. Raises TableError where there are more
    than `MOST_ROWS`."""
    name, outer = next(iter(tables.items()))
    if (n_rows := _count(name, tables, {})) > MOST_ROWS:
        file = str(outer.path) if outer.path else None
        problem = f"with the rows of its inner tables the table {in_quotes(name)} has {n_rows:,} rows."
        raise TableError(Fault(problem, f"at most {MOST_ROWS:,}", place=Place(file), rule="too-many-rows"))
    numbers, rows = _ways(name, tables, {inner: number for number, inner in enumerate(tables)}, {})
    return Expansion(tuple(tables), tuple(tables.values()), numbers, rows)


def _count(name: str, tables: Mapping[str, TableData], known: dict[str, int]) -> int:
    if name not in known:
        inner = inner_rows(tables[name])
        plain = tables[name].n_rows - sum(map(len, inner.values()))
        known[name] = plain + sum(len(rows) * _count(other, tables, known) for other, rows in inner.items())
    return known[name]


def _ways(
    name: str, tables: Mapping[str, TableData], order: Mapping[str, int], known: dict[str, tuple[Numbers, Numbers]]
) -> tuple[Numbers, Numbers]:
    if name not in known:
        below = {row: _ways(other, tables, order, known) for other, rows in inner_rows(tables[name]).items() for row in rows}
        counts = np.ones(tables[name].n_rows, np.int64)
        counts[list(below)] = [ways[0].shape[1] for ways in below.values()]
        depth, stops = 1 + max((len(ways[0]) for ways in below.values()), default=0), np.cumsum(counts)
        numbers, rows = (np.full((depth, int(counts.sum())), -1, np.int32) for _ in range(2))
        numbers[0], rows[0] = order[name], np.repeat(np.arange(len(counts)), counts)
        for row, (inner_numbers, taken) in below.items():
            here = slice(int(stops[row] - counts[row]), int(stops[row]))
            numbers[1 : 1 + len(taken), here], rows[1 : 1 + len(taken), here] = inner_numbers, taken
        known[name] = numbers, rows
    return known[name]
