"""The columns of a table that are not conditions but mean something to it: enabled, priority, weight."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contextdb.cell_words import truth_of
from contextdb.errors import Fault, in_quotes

if TYPE_CHECKING:
    from contextdb.table import Table


@dataclass(frozen=True, eq=False)
class PlainColumns:
    """The columns that are not conditions but mean something: enabled, priority, weight."""

    enabled: NDArray[np.bool_]
    priorities: NDArray[np.int64]
    weights: NDArray[np.float64]
    faults: tuple[tuple[int, Fault], ...]

    @classmethod
    def read(cls, table: Table) -> PlainColumns:
        faults: list[tuple[int, Fault]] = []
        enabled = _plain_column(table, table.settings.enabled, _enabled, True, '"True" or "False"', faults)
        priorities = _plain_column(table, table.settings.priority, _priority, 0, "a whole number", faults)
        weights = _plain_column(table, table.settings.weight, _weight, 1.0, "a number from 0 up", faults)
        return cls(enabled.astype(np.bool_), priorities.astype(np.int64), weights.astype(np.float64), tuple(faults))


def _plain_column(
    table: Table,
    name: str | None,
    read: Callable[[str], float | None],
    default: float,
    accepted: str,
    faults: list[tuple[int, Fault]],
) -> NDArray[np.float64]:
    """Read a column of plain values; an empty cell is the default."""
    if name is None:
        return np.full(table.n_rows, default)
    column = table.text_column(name)
    values = [default if not t.strip() else read(t.strip()) for t in column.texts]
    for row in np.flatnonzero(np.array([v is None for v in values], np.bool_)[column.codes]).tolist() if values else ():
        fault = Fault(f"cannot read {in_quotes(column[row])}.", accepted, place=table.place(row, name), rule="unreadable-cell")
        faults.append((row, fault))
    return np.array([default if v is None else v for v in values], np.float64)[column.codes]


def _enabled(text: str) -> float | None:
    return truth_of(text)


def _priority(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if value.is_integer() and abs(value) < 2.0**53 else None


def _weight(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if 0.0 <= value < math.inf else None
