"""One condition's column of a table: its texts, the cells that they mean, and the masks that they compile to.

Texts that cannot be read stay as they are, with their fault. What was worked out for a column is shared by all tables that hold it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import ANY, Cell, parse_cell
from contextdb.cells.numbers import ColumnCells, NumberCells, doubtful, has_soft
from contextdb.columns import TextColumn
from contextdb.compiled.classes import ColumnMasks, column_masks
from contextdb.errors import CellError, Fault

MOST_MENDS = 20
"""Texts of one column that get a mend when they cannot be read; looking for one is slow, and a column of the wrong type has
thousands."""


@dataclass(frozen=True, eq=False)
class ConditionColumn:
    """One condition's column: its texts, and the cell that each distinct text means."""

    condition: Condition
    texts: TextColumn
    cells: ColumnCells
    """The cell of `texts.texts[i]`; Any for a text that cannot be read."""
    faults: Mapping[int, Fault]
    """Why `texts.texts[i]` cannot be read."""

    @classmethod
    def read(cls, texts: TextColumn, condition: Condition) -> ConditionColumn:
        """Read every distinct text once."""
        cells, faults = _read_cells(texts.texts, condition)
        return cls(condition, texts, cells, faults)

    def with_texts(self, texts: TextColumn) -> ConditionColumn:
        """The column with other texts; those that it had already are not read again."""
        known = len(self.texts.texts)
        if texts.texts is self.texts.texts:
            return ConditionColumn(self.condition, texts, self.cells, self.faults)
        if texts.texts[:known] != self.texts.texts:
            return ConditionColumn.read(texts, self.condition)
        cells, faults = _read_cells(texts.texts[known:], self.condition)
        more = {known + i: fault for i, fault in faults.items()}
        all_cells = (
            self.cells.followed_by(texts.texts[known:], cells) if isinstance(self.cells, NumberCells) else (*self.cells, *cells)
        )
        return ConditionColumn(self.condition, texts, all_cells, {**self.faults, **more})

    def cell(self, row: int) -> Cell:
        """What the row accepts."""
        return self.cells[int(self.texts.codes[row])]

    def faulty_rows(self) -> Iterable[tuple[int, Fault]]:
        """Each row whose cell cannot be read, and why."""
        if not self.faults:
            return
        for row in np.flatnonzero(np.isin(self.texts.codes, list(self.faults))).tolist():
            yield row, self.faults[int(self.texts.codes[row])]

    @cached_property
    def masks(self) -> ColumnMasks:
        """The column compiled; worked out once, and shared by every table that holds the column."""
        return column_masks(self.cells, self.texts.codes, self.condition.domain)

    @cached_property
    def soft(self) -> tuple[ColumnMasks, NDArray[np.float64]] | None:
        """Of soft cells: masks of the rows they match, and the penalty float64 [n_rows] where they do not; None when none is
        soft."""
        if not has_soft(self.cells):
            return None
        hard = [Cell(c.accepts) if c.is_soft else ANY for c in self.cells]
        penalties = np.array([c.penalty or 0.0 for c in self.cells])
        return column_masks(hard, self.texts.codes, self.condition.domain), penalties[self.texts.codes]


def _read_cells(texts: Sequence[str], condition: Condition) -> tuple[ColumnCells, dict[int, Fault]]:
    unsure = doubtful(texts, condition.domain)
    cells: dict[int, Cell] = {}
    faults: dict[int, Fault] = {}
    for i in range(len(texts)) if unsure is None else unsure.tolist():
        try:
            cells[i] = parse_cell(texts[i], condition.domain, len(faults) < MOST_MENDS)
        except CellError as error:
            cells[i], faults[i] = ANY, error.faults[0]
    return tuple(cells.values()) if unsure is None else NumberCells(tuple(texts), condition.domain, cells), faults
