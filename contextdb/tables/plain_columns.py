"""The columns of a table that are not conditions but mean something to it: enabled, priority, weight, and how long rows rest.

A row that refers to a table may leave its cells empty: the rows of that table have their own. For a row behind such rows the
innermost cell of its way that is not empty counts, then the default.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.output_types import OutputValue
from contextdb.cells.outputs import Output
from contextdb.cells.words import truth_of
from contextdb.columns import TextColumn
from contextdb.compiled.outputs import NO_OUTPUTS, OutputCells, Outputs, cells_of, outputs_of_cells
from contextdb.compiled.pick_columns import NOTHING, PickColumns
from contextdb.errors import CellError, Fault, Place, in_quotes
from contextdb.schema.settings import TableSettings
from contextdb.schema.table_settings import PLAIN_JOBS
from contextdb.tables.condition_column import MOST_MENDS

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


# ---- the outputs of a table: what each cell gives the game, and which cells cannot be read


Read = tuple[list[OutputValue], dict[int, Fault]]
"""The value of each text, and why some cannot be read."""


@dataclass(frozen=True, eq=False)
class OutputColumn:
    """One output's column: its texts, and what each distinct text gives."""

    output: Output
    texts: TextColumn

    @property
    def values(self) -> list[OutputValue]:
        """The value of `texts.texts[i]`; what there is without a cell for one that is empty or cannot be read."""
        return self._read[0]

    @property
    def faults(self) -> Mapping[int, Fault]:
        """Why `texts.texts[i]` cannot be read."""
        return self._read[1]

    @cached_property
    def _read(self) -> Read:
        return self._read_on(self.texts.texts, (), {})

    def _read_on(self, texts: Iterable[str], known: Sequence[OutputValue], wrong: Mapping[int, Fault]) -> Read:
        """What texts give, behind others that are known."""
        output, values, faults = self.output, list(known), dict(wrong)
        if output.is_free:
            return values + [text if text.strip() else output.nothing for text in texts], faults
        for text in texts:
            try:
                values.append(output.read(text, len(faults) < MOST_MENDS))
            except CellError as error:
                faults[len(values)] = error.faults[0].at(Place(column=output.name))
                values.append(output.nothing)
        return values, faults

    @cached_property
    def cells(self) -> OutputCells:
        return cells_of(self.output, self.values, self.texts.codes)

    def with_texts(self, texts: TextColumn) -> OutputColumn:
        """The column with other texts; those that were read before are not read again."""
        if texts is self.texts:
            return self
        column, known = OutputColumn(self.output, texts), len(self.texts.texts)
        if "_read" in self.__dict__ and texts.texts[:known] == self.texts.texts:
            column.__dict__["_read"] = self._read_on(texts.texts[known:], *self._read)
        return column

    def faulty_rows(self, may_be_empty: Set[int]) -> Iterator[tuple[int, Fault]]:
        """Each row whose cell cannot be read, and why; some rows may be empty."""
        if not self.faults:
            return
        codes = self.texts.codes
        for row in np.flatnonzero(np.isin(codes, list(self.faults))).tolist():
            fault = self.faults[int(codes[row])]
            if fault.rule != "missing-output" or row not in may_be_empty:
                yield row, fault


def output_columns(columns: Sequence[TextColumn], settings: TableSettings) -> tuple[OutputColumn, ...]:
    """The outputs among some columns, in the order of the settings."""
    texts = {column.name: column for column in columns}
    return tuple(OutputColumn(output, texts[output.name]) for output in settings.declared_outputs if output.name in texts)


def outputs_of(columns: Iterable[OutputColumn], settings: TableSettings) -> Outputs:
    """The outputs of a table, to be read by row."""
    outputs = list(columns)
    if not outputs:
        return NO_OUTPUTS
    return outputs_of_cells([c.output for c in outputs], [c.cells for c in outputs], dict(settings.fallback_outputs))


def layered(
    columns: Sequence[tuple[int, OutputColumn]], numbers: NDArray[np.int32], rows: NDArray[np.int32], nothing: OutputValue
) -> tuple[list[OutputValue], NDArray[np.int64]]:
    """The values of one output of several tables, given with the tables' numbers, and which of them each flat row has.

    That is the value of the innermost cell of its way that is not empty, then the default of the innermost table. `numbers` and
    `rows` are int32 [D, n], as in `contextdb.tables.nesting.expansion`; `nothing` is for rows no table of whose way has the output.
    """
    values, codes = [nothing], np.zeros(numbers.shape[1], np.int64)
    placed: list[tuple[int, OutputColumn, int]] = []
    for number, column in columns:
        placed.append((number, column, len(values)))
        values += column.values
    for is_said in (False, True):
        for numbers_here, rows_here in zip(numbers, rows, strict=True):
            for number, column, start in placed:
                here = np.flatnonzero(numbers_here == number)
                own = column.texts.codes[rows_here[here]]
                if is_said:
                    says = np.array([bool(text.strip()) for text in column.texts.texts], np.bool_)[own]
                    here, own = here[says], own[says]
                codes[here] = own + start
    return values, codes
