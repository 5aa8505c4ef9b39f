"""A table read again that keeps what its older version had worked out.

Columns are compared by what they say. One that says the same is taken from the older table, with its cells and masks; of one that
changed, only texts that are new are read. So a reload costs the columns that changed. Nothing here touches the disk.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.cells.numbers import NumberCells
from contextdb.columns import TextColumn
from contextdb.files.texts import AnySource
from contextdb.schema.settings import Schema, TableSettings
from contextdb.tables.condition_column import ConditionColumn, infer_condition
from contextdb.tables.table import Table


def table_like(
    old: Table | None, columns: Sequence[TextColumn], schema: Schema, settings: TableSettings, path: Path, source: AnySource
) -> Table:
    """The table that `Table.build` gives; equal columns of `old` are shared.

    Raises
    ------
    TableError
        As `Table.build`. Cells that cannot be read are in the table's `faults`.
    """
    if old is None:
        return Table.build(settings.name, columns, schema, settings, path, source)
    empty = [TextColumn(c.name, (), np.empty(0, np.int32)) for c in columns]
    frame = Table.build(settings.name, empty, schema, settings, path, source)  # which columns are conditions
    texts = {c.name: _shared_texts(c, old) for c in columns}
    known = {c.condition.name: c for c in old.conditions}
    conditions = tuple(
        _condition_column(texts[name], known.get(name), schema.conditions.get(name))
        for name in (c.condition.name for c in frame.conditions)
    )
    n_rows = columns[0].n_rows if columns else 0
    return replace(frame, columns=tuple(texts.values()), conditions=conditions, origin=np.arange(n_rows))


def _shared_texts(column: TextColumn, old: Table) -> TextColumn:
    found = next((c for c in old.columns if c.name == column.name), None)
    is_same = found is not None and found.texts == column.texts and np.array_equal(found.codes, column.codes)
    return found if found is not None and is_same else column


def _condition_column(texts: TextColumn, old: ConditionColumn | None, declared: Condition | None) -> ConditionColumn:
    is_same = old is not None and old.texts is texts
    if is_same and old is not None and (old.condition == declared if declared else not old.condition.is_declared):
        return old
    condition = declared or infer_condition(texts)
    if old is None or old.condition.domain != condition.domain:
        return ConditionColumn.read(texts, condition)
    return _with_new_texts_read(texts, condition, old)


def _with_new_texts_read(texts: TextColumn, condition: Condition, old: ConditionColumn) -> ConditionColumn:
    """A column of which only those texts are read that the older one did not have. Many numbers are read again: it is faster."""
    if isinstance(old.cells, NumberCells):
        return ConditionColumn.read(texts, condition)
    known = dict(zip(old.texts.texts, zip(old.cells, map(old.faults.get, range(len(old.cells))), strict=True), strict=True))
    others = tuple(t for t in texts.texts if t not in known)
    read = ConditionColumn.read(TextColumn(texts.name, others, np.empty(0, np.int32)), condition)
    known |= {t: (read.cells[i], read.faults.get(i)) for i, t in enumerate(others)}
    cells = [known[t] for t in texts.texts]
    faults = {i: fault for i, (_, fault) in enumerate(cells) if fault is not None}
    return ConditionColumn(condition, texts, tuple(cell for cell, _ in cells), faults)
