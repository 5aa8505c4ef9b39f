"""The outputs of a table: what each cell gives the game, and which cells cannot be read.

A row that refers to a table may leave its cells empty: the rows of that table have their own. For a row behind such rows the
innermost cell of its way that is not empty counts, then the default.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.output_types import OutputValue
from contextdb.cells.outputs import Output
from contextdb.columns import TextColumn
from contextdb.compiled.outputs import NO_OUTPUTS, OutputCells, Outputs, cells_of, outputs_of_cells
from contextdb.errors import CellError, Fault, Place
from contextdb.schema.settings import TableSettings
from contextdb.tables.condition_column import MOST_MENDS

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
