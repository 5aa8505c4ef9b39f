"""A table read again that keeps what its older version had worked out.

Columns are compared by what they say. One that says the same is taken from the older table, with its cells and masks; of one that
changed, only texts that are new are read. So a reload costs the columns that changed. Nothing here touches the disk.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from contextdb.columns import TextColumn
from contextdb.files.texts import AnySource
from contextdb.schema.settings import Schema, TableSettings
from contextdb.tables.table import Table


def table_like(
    old: Table | None, columns: Sequence[TextColumn], schema: Schema, settings: TableSettings, path: Path, source: AnySource
) -> Table:
    """The table that `Table.build` gives, and its errors; equal columns of `old` are shared. Cells that cannot be read are in the
    table's `faults`."""
    texts = [_shared_texts(c, old) for c in columns] if old else columns
    known = {c.condition.name: c for c in old.conditions} if old else {}
    return Table.build(settings.name, texts, schema, settings, path, source, known)


def _shared_texts(column: TextColumn, old: Table) -> TextColumn:
    match = next((c for c in old.columns if c.name == column.name), None)
    is_same = match is not None and match.texts == column.texts and np.array_equal(match.codes, column.codes)
    return match if match is not None and is_same else column
