"""The columns of a table that are not conditions but mean something to it: enabled, priority, weight."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.words import truth_of
from contextdb.columns import TextColumn
from contextdb.errors import Fault, Place, in_quotes
from contextdb.schema.settings import TableSettings


@dataclass(frozen=True, eq=False)
class PlainColumns:
    """The columns that are not conditions but mean something: enabled, priority, weight."""

    enabled: NDArray[np.bool_]
    priorities: NDArray[np.int64]
    weights: NDArray[np.float64]
    faults: tuple[tuple[int, Fault], ...]
    """The rows that cannot be read, and why; the place of a fault names the column alone."""

    @classmethod
    def read(cls, columns: Sequence[TextColumn], settings: TableSettings) -> PlainColumns:
        """Read those of some columns that the settings give these jobs."""
        faults: list[tuple[int, Fault]] = []
        enabled = _plain_column(columns, settings.enabled, _enabled, True, '"True" or "False"', faults)
        priorities = _plain_column(columns, settings.priority, _priority, 0, "a whole number", faults)
        weights = _plain_column(columns, settings.weight, _weight, 1.0, "a number from 0 up", faults)
        return cls(enabled.astype(np.bool_), priorities.astype(np.int64), weights.astype(np.float64), tuple(faults))


def _plain_column(
    columns: Sequence[TextColumn],
    name: str | None,
    read: Callable[[str], float | None],
    default: float,
    accepted: str,
    faults: list[tuple[int, Fault]],
) -> NDArray[np.float64]:
    """Read a column of plain values; an empty cell is the default."""
    if name is None:
        return np.full(columns[0].n_rows if columns else 0, default)
    column = next(c for c in columns if c.name == name)
    values = [default if not t.strip() else read(t.strip()) for t in column.texts]
    for row in np.flatnonzero(np.array([v is None for v in values], np.bool_)[column.codes]).tolist() if values else ():
        fault = Fault(f"cannot read {in_quotes(column[row])}.", accepted, place=Place(column=name), rule="unreadable-cell")
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
