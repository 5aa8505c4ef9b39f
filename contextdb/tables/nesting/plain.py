"""A flat table as one that could be in a file, for what compares tables by the texts of their cells.

Its rows have the assets with their paths, a cell each for what all cells of a way accept, and no soft cells, which exclude nothing.
The policies of the tables are left aside: rows of one inner table are ordered among themselves only.
"""

from __future__ import annotations

from dataclasses import replace

from contextdb.cells.grammar import format_cell
from contextdb.cells.sets import ANY, Cell, TagMeet
from contextdb.columns import TextColumn
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.nesting.flat import FlatTable


def as_plain(flat: FlatTable) -> FlatTable | None:
    """The table; None where tags are required in a way that one cell cannot say."""
    columns = [_plain_column(column) for column in flat.conditions]
    conditions = tuple(column for column in columns if column is not None)
    if len(conditions) < len(columns):
        return None
    names = {column.condition.name for column in conditions}
    others = tuple(column for column in flat.columns if column.name not in names)
    settings = replace(flat.settings, policy="collect")
    return replace(flat, settings=settings, columns=(*others, *(c.texts for c in conditions)), conditions=conditions)


def _plain_column(column: ConditionColumn) -> ConditionColumn | None:
    cells = [ANY if cell.is_soft else Cell(cell.accepts) for cell in column.cells]
    if any(isinstance(cell.accepts, TagMeet) for cell in cells):
        return None
    written = [format_cell(cell, column.condition.domain) for cell in cells]
    texts = TextColumn.of(column.condition.name, [written[code] for code in column.texts.codes.tolist()])
    return ConditionColumn.read(texts, column.condition)
