"""The columns of a table that are not conditions but mean something to it: enabled, priority, weight, and how long rows rest."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.words import truth_of
from contextdb.columns import TextColumn
from contextdb.compiled.pick_columns import NOTHING, PickColumns
from contextdb.errors import Fault, Place, in_quotes
from contextdb.schema.settings import TableSettings
from contextdb.schema.table_settings import PLAIN_JOBS

ONE_NUMBER = re.compile(r"\s*(-?\d+(?:[.,]\d+)?)\s*[^\W\d_]*\s*")
"""A number, perhaps with a unit, as people write it."""


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
    removed: NDArray[np.bool_] | None = None
    """Whether each row of a variant takes that of its base out; None where no column says so."""

    @classmethod
    def read(cls, columns: Sequence[TextColumn], settings: TableSettings) -> PlainColumns:
        """Read those of some columns that the settings give these jobs."""
        faults: list[tuple[int, Fault]] = []
        of: dict[str, NDArray[np.float64] | None] = {job: _read(columns, settings, job, faults) for job in PLAIN_JOBS}
        n_rows = columns[0].n_rows if columns else 0

        def filled(job: str) -> NDArray[np.float64]:
            values = of[job]
            return np.full(n_rows, READERS[job].empty) if values is None else values

        once, turns = of["once"], of["cooldown_turns"]
        resting = PickColumns(
            None,
            None if once is None else once.astype(np.bool_),
            of["cooldown_s"],
            None if turns is None else turns.astype(np.int64),
        )
        enabled, priorities = filled("enabled").astype(np.bool_), filled("priority").astype(np.int64)
        removed = None if of["remove"] is None else of["remove"].astype(np.bool_)
        return cls(enabled, priorities, filled("weight"), tuple(faults), resting, removed)


@dataclass(frozen=True)
class Reader:
    """How the cells of a job are read: a number for a text, None for one that cannot be read, what an empty cell means, and what is
    accepted."""

    read: Callable[[str], float | None]
    empty: float
    accepted: str

    def number(self, text: str) -> float | None:
        """What a cell says; None for one that cannot be read."""
        return self.read(text.strip()) if text.strip() else self.empty

    def fault(self, column: str, text: str) -> Fault:
        """That a cell cannot be read."""
        only = ONE_NUMBER.fullmatch(text)
        number = only[1].replace(",", ".") if only else ""
        mend = in_quotes(number) if number and self.read(number) is not None else ""
        return Fault(f"cannot read {in_quotes(text)}.", self.accepted, mend, Place(column=column), "unreadable-cell")


def plain_fault(job: str, column: str, text: str) -> Fault | None:
    """Why a cell of a column with a job cannot be read."""
    reader = READERS[job]
    return reader.fault(column, text) if reader.number(text) is None else None


def _read(
    columns: Sequence[TextColumn], settings: TableSettings, job: str, faults: list[tuple[int, Fault]]
) -> NDArray[np.float64] | None:
    """What the cells of the column with a job say; None where no column has it."""
    name: str | None = getattr(settings, job)
    if name is None:
        return None
    reader, column = READERS[job], next(c for c in columns if c.name == name)
    values = [reader.number(text) for text in column.texts]
    wrong = np.array([value is None for value in values], np.bool_)
    faults += [(row, reader.fault(name, column[row])) for row in np.flatnonzero(wrong[column.codes]).tolist() if values]
    return np.array([reader.empty if value is None else value for value in values], np.float64)[column.codes]


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


READERS: dict[str, Reader] = {
    "enabled": Reader(truth_of, True, '"True" or "False"'),
    "priority": Reader(_priority, 0, "a whole number"),
    "weight": Reader(_weight, 1.0, "a number from 0 up"),
    "remove": Reader(truth_of, False, '"True" or "False"'),
    "once": Reader(truth_of, False, '"True" or "False"'),
    "cooldown_s": Reader(_weight, 0.0, "a number of seconds from 0 up"),
    "cooldown_turns": Reader(_turns, 0, "a whole number of picks from 0 up"),
}
