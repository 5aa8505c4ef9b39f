"""The columns of a table that are not conditions but mean something to it: enabled, priority, weight, and how long rows rest."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.words import truth_of
from contextdb.columns import TextColumn
from contextdb.compiled.pick_columns import NOTHING, PickColumns
from contextdb.errors import Fault, Place, in_quotes
from contextdb.schema.settings import TableSettings


@dataclass(frozen=True, eq=False)
class PlainColumns:
    """The columns that are not conditions but mean something."""

    enabled: NDArray[np.bool_]
    priorities: NDArray[np.int64]
    weights: NDArray[np.float64]
    faults: tuple[tuple[int, Fault], ...]
    """The rows that cannot be read, and why; the place of a fault names the column alone."""
    resting: PickColumns = NOTHING
    """How long rows rest after they were picked."""

    @classmethod
    def read(cls, columns: Sequence[TextColumn], settings: TableSettings) -> PlainColumns:
        """Read those of some columns that the settings give these jobs."""
        faults: list[tuple[int, Fault]] = []
        enabled = _plain_column(columns, settings.enabled, _enabled, True, '"True" or "False"', faults)
        priorities = _plain_column(columns, settings.priority, _priority, 0, "a whole number", faults)
        weights = _plain_column(columns, settings.weight, _weight, 1.0, "a number from 0 up", faults)
        once = _resting_column(columns, settings.once, truth_of, '"True" or "False"', faults)
        seconds = _resting_column(columns, settings.cooldown_s, _weight, "a number of seconds from 0 up", faults)
        turns = _resting_column(columns, settings.cooldown_turns, _turns, "a whole number of picks from 0 up", faults)
        resting = PickColumns(
            None,
            None if once is None else once.astype(np.bool_),
            seconds,
            None if turns is None else turns.astype(np.int64),
        )
        return cls(enabled.astype(np.bool_), priorities.astype(np.int64), weights.astype(np.float64), tuple(faults), resting)


def _resting_column(
    columns: Sequence[TextColumn],
    name: str | None,
    read: Callable[[str], float | None],
    accepted: str,
    faults: list[tuple[int, Fault]],
) -> NDArray[np.float64] | None:
    """A column that says how long rows rest; an empty cell is not at all."""
    return None if name is None else _plain_column(columns, name, read, 0, accepted, faults)


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


def _turns(text: str) -> float | None:
    value = _priority(text)
    return value if value is not None and value >= 0.0 else None


def _weight(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if 0.0 <= value < math.inf else None
