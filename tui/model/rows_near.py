"""Which rows of a table are nearest to a box of contexts, and which of their cells do not hold it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.grammar import parse_cell
from contextdb.cells.sets import ANY, Cell, complement, meet_exactly
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.table import Table

SHORT, EVERY, SAYS = range(3)
"""A cell does not hold a box; holds every box; holds it and says so."""
MOST_TEXTS = 3_000
"""So many different cells are compared with a box between two keys."""


def is_near_at_once(table: Table) -> bool:
    """Whether a table says so few different things that its nearest rows are there at once."""
    return sum(len(column.texts.texts) for column in table.conditions) <= MOST_TEXTS


def rows_near(table: Table, box: Mapping[str, str], most: int, nearest: int | None = None) -> dict[int, tuple[str, ...]]:
    """The rows with fewest cells to change so that they hold all of a box, and the conditions of those cells.

    The row that a report names as the nearest comes first; of rows with equally many cells those come first that hold the box by
    most cells that say something, as `Any` holds every box.
    """
    held = {c.condition.name: _holding(c, box.get(c.condition.name, "")) for c in table.conditions}
    able = np.array(table.enabled, np.bool_)
    for column in table.conditions:
        able &= ~np.isin(column.texts.codes, list(column.faults))
    rows = np.flatnonzero(able)
    n_short, n_saying = (np.sum([np.zeros(table.n_rows), *(of == each for of in held.values())], axis=0) for each in (SHORT, SAYS))
    ranked = rows[np.lexsort((-n_saying[rows], n_short[rows], rows != (-1 if nearest is None else nearest)))][:most].tolist()
    return {row: tuple(name for name, of in held.items() if of[row] == SHORT) for row in ranked}


def _holding(column: ConditionColumn, text: str) -> NDArray[np.int64]:
    """For each row whether its cell accepts all that a cell of this text accepts; an empty text: everything."""
    domain = column.condition.domain
    inner = parse_cell(text, domain) if text else ANY
    whole = complement(complement(None, domain), domain) if inner.accepts is None else inner.accepts

    def holds(cell: Cell) -> int:
        if cell.is_any or cell.is_soft:
            return EVERY
        return SAYS if meet_exactly(complement(cell.accepts, domain), whole).is_empty else SHORT

    return np.array([holds(column.cells[i]) for i in range(len(column.texts.texts))], np.int64)[column.texts.codes]
