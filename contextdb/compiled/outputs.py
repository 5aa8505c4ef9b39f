"""What the rows of a compiled table give the game besides their assets: typed columns, read by row, for one row or for many.

R rows. Each column has R + 1 values: value r is that of row r, and the last is what there is without a row: what `fallback` gives,
else the default, else False, 0, NaN or "". So a row number of -1, as `pick_many` gives where no row is valid, reads the last.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.bitmask import Rows, read_only
from contextdb.cells.arguments import require_row, require_text
from contextdb.cells.output_types import OutputValue
from contextdb.cells.outputs import Output
from contextdb.cells.row_play import N_PLAY, read_play
from contextdb.columns import TextColumn
from contextdb.compiled.unchanging import Unchanging
from contextdb.errors import ContextError, Fault, NoSuchOutput, NoSuchPlace, no_such, safe_text, some

Column = NDArray[Any]
OutputCells = Column | TextColumn
"""R + 1 values: bool, int64, float64 or float64 [R + 1, size]; texts of an enum or a text."""


@dataclass(frozen=True, eq=False, repr=False)
class Outputs(Unchanging, Mapping[str, Column]):
    """The outputs of a compiled table by name, each as `column` gives it: a table without outputs has none, which is not an error.
    `fallback` is the value of each where no row is valid: what the table's fallback gives, else the default, else False, 0, NaN or
    ""."""

    declared: tuple[Output, ...] = ()
    cells: tuple[OutputCells, ...] = ()
    """One for each of `declared`."""

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the outputs, in the order in which they are declared."""
        return tuple(output.name for output in self.declared)

    def __getitem__(self, name: str) -> Column:
        return self.column(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.declared)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return id(self)

    def __repr__(self) -> str:
        return f"<Outputs: {', '.join(f'{safe_text(o.name)} ({o.kind})' for o in self.declared) or 'none'}>"

    def column(self, name: str) -> Column:
        """The output of every row, read-only: bool, int64 or float64 [n_rows], for `numbers` float64 [n_rows, size], for enum and
        text an array of str. Raises NoSuchOutput for a name that no output has."""
        return self._values(name)[:-1]

    def of(self, rows: ArrayLike, name: str) -> Column:
        """The output of some rows, int of any shape, such as `pick_many` gives, in an array of that shape; a row of -1 reads what
        there is without a row. Raises NoSuchOutput where the table has no such output, NoSuchPlace for a row that the table does
        not have."""
        values = self._values(name)
        numbers = np.asarray(rows)
        if not numbers.size:
            numbers = numbers.astype(np.int64)
        if numbers.dtype.kind not in "iu":
            raise ContextError(Fault(f"rows are of type {numbers.dtype}.", "whole numbers: the numbers of rows, -1 for none"))
        if numbers.size and (numbers.min() < -1 or numbers.max() >= len(values) - 1):
            wrong = next(row for row in numbers.reshape(-1).tolist() if not -1 <= row < len(values) - 1)
            raise NoSuchPlace(Fault(f"there is no row {wrong}.", f"rows 0 to {len(values) - 2}, or -1 for none"))
        return self.taken(numbers, values)

    def of_matches(self, rows: Rows, name: str) -> Column:
        """The output of rows that the table is known to have."""
        return self.taken(rows, self._values(name))

    @staticmethod
    def taken(rows: NDArray[Any], values: Column) -> Column:
        """Values by row, read-only."""
        return read_only(np.asarray(values[rows], values.dtype))

    def of_row(self, row: int) -> dict[str, OutputValue]:
        """All outputs of a row as Python has them: bool, int, float, str, and for `numbers` a tuple of float. Raises
        NoSuchPlace for a row that the table does not have."""
        if self.cells:
            require_row(row, len(self._values(self.names[0])) - 1)
        return self._of(row)

    @property
    def fallback(self) -> dict[str, OutputValue]:
        """All outputs where no row is valid: what `fallback` gives, else the default, else False, 0, NaN or ""."""
        return self._of(-1)

    def _of(self, row: int) -> dict[str, OutputValue]:
        values = (self._values(name)[row] for name in self.names)
        plain = ((value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value) for value in values)
        return {
            name: tuple(value) if isinstance(value, list) else cast("OutputValue", value)
            for name, value in zip(self.names, plain, strict=True)
        }

    @cached_property
    def plays(self) -> NDArray[np.float64] | None:
        """How each row plays, and last what plays without a row: float64 [R + 1, 8], see `contextdb.cells.outputs`; None where no
        reserved output is declared."""
        reserved = [output for output in self.declared if output.is_reserved]
        if not reserved:
            return None
        plays = np.full((len(self._values(reserved[0].name)), N_PLAY), np.nan)
        for output in reserved:
            values, codes = np.unique(self._values(output.name), return_inverse=True)
            for code, value in enumerate(values.tolist()):
                for column, number in read_play(output.name, output.written(value)).items():
                    plays[codes == code, column] = number
        return read_only(plays)

    @property
    def parts(self) -> tuple[object, ...]:
        """All that the outputs say, for a digest."""
        kinds = [(o.name, o.kind, o.size, o.values) for o in self.declared]
        return (kinds, *self.cells) if kinds else ()

    def _values(self, name: str) -> Column:
        """All R + 1 values of an output."""
        column = self._arrays.get(name) if isinstance(name, str) else None
        if column is None:
            at = self._place(name)
            cells = self.cells[at]
            values = np.array(cells.texts or ("",), object)[cells.codes] if isinstance(cells, TextColumn) else cells
            column = self._arrays.setdefault(name, read_only(values))
        return column

    def _place(self, name: str) -> int:
        if require_text(name, "name") in self.names:
            return self.names.index(name)
        accepted = some(self.names) or "no name: the table has no outputs"
        raise NoSuchOutput(no_such("output", name, self.names, accepted))

    @cached_property
    def _arrays(self) -> dict[str, Column]:
        return {}


NO_OUTPUTS = Outputs()


def outputs_of_cells(declared: Sequence[Output], cells: Sequence[OutputCells], fallback: Mapping[str, OutputValue]) -> Outputs:
    """Outputs from the values of each column's rows and from what the fallback gives."""
    pairs = zip(declared, cells, strict=True)
    return Outputs(tuple(declared), tuple(_with_last(o, column, fallback.get(o.name, o.nothing)) for o, column in pairs))


def cells_of(output: Output, values: list[OutputValue], codes: NDArray[Any]) -> OutputCells:
    """The values of R rows from some values and the place of each row's among them; of texts each once, those of an enum in their
    declared order, behind them "" for none."""
    if not output.type.is_text:
        taken: Column = output.array(values)[codes]
        return taken
    known = {value: code for code, value in enumerate((*output.values, "") if output.type.has_values else ())}
    places = [known.setdefault(str(value), len(known)) for value in values]
    return TextColumn(output.name, tuple(known), np.array(places, np.int32)[codes])


def _with_last(output: Output, cells: OutputCells, last: OutputValue) -> OutputCells:
    if not isinstance(cells, TextColumn):
        return np.concatenate([cells, output.array([last])])
    texts = cells.texts if last in cells.texts else (*cells.texts, str(last))
    return TextColumn(output.name, texts, np.append(cells.codes, np.int32(texts.index(str(last)))))
