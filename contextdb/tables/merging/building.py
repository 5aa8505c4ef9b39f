"""The edit that makes one table another: its rows, its columns, the settings of them, and the texts that then still differ."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from contextdb.columns import TextColumn
from contextdb.errors import SchemaError
from contextdb.schema.sections import condition_to_dict, differences, settings_to_dict
from contextdb.schema.settings import Schema, TableSettings
from contextdb.schema.table_settings import JOB_KEYS
from contextdb.tables.changes import CameFrom, Cells, Change, Columns, Edit, Rows, Sections
from contextdb.tables.data import TableData
from contextdb.tables.merging.conflicts import Shared

_EMPTY = TextColumn("", ("",), np.zeros(1, np.int32))


def edit_to(
    before: TableData,
    columns: Sequence[TextColumn],
    rows: CameFrom,
    fields: CameFrom,
    say: Callable[[TableData], Sections],
    name: str,
) -> Edit:
    """An edit that gives `before` these columns.

    `rows` and `fields` are, for each row and column, the one it was before or -1. `say` gives what changes in
    contextdb.toml for a table that has the columns already.
    """
    changes: list[Change] = []
    if not np.array_equal(rows, np.arange(before.n_rows)):
        changes.append(Rows(rows))
    layout = tuple((c.name, before.columns[f].name if f >= 0 else None) for c, f in zip(columns, fields.tolist(), strict=True))
    if layout != tuple((c.name, c.name) for c in before.columns):
        changes.append(Columns(layout))
    middle = Edit(name, tuple(c for c in changes if isinstance(c, Columns))).apply(before)
    name_of = say(middle)
    changes += [] if name_of.is_empty else [name_of]
    texts = {c.name: _differences(before, c, rows, f) for c, f in zip(columns, fields.tolist(), strict=True)}
    texts = {column: cells for column, cells in texts.items() if cells}
    return Edit(name, (*changes, Cells(texts)) if texts else tuple(changes))


def edit_under(
    before: TableData,
    columns: Sequence[TextColumn],
    rows: CameFrom,
    fields: CameFrom,
    settings: TableSettings,
    schema: Schema,
    name: str,
) -> Edit:
    """The same, with the jobs of columns from `settings` and what `schema` declares of these columns, unless the two cannot be said
    together: then `before` keeps what it says."""
    return edit_to(before, columns, rows, fields, lambda table: _sections_of(table, columns, settings, schema), name)


def _sections_of(table: TableData, columns: Sequence[TextColumn], settings: TableSettings, schema: Schema) -> Sections:
    changed = differences(settings_to_dict(table.settings), settings_to_dict(settings))
    jobs = {key: value for key, value in changed.items() if key in JOB_KEYS}
    known = table.schema.conditions
    wanted = (schema.conditions.get(c.name) for c in columns)
    declared = {c.name: condition_to_dict(c) for c in wanted if c is not None and known.get(c.name) != c}
    sections = Sections(jobs, {"conditions": declared} if declared else {})
    try:
        sections.apply(table.with_rows_taken([]))
    except SchemaError:
        return Sections()
    return sections


def _differences(before: TableData, column: TextColumn, rows: CameFrom, field: int) -> dict[int, str]:
    """The rows whose text is not what the column has after its rows and columns were put in place; new cells are empty then."""
    old = before.columns[field] if field >= 0 else None
    is_shared = old is not None and old.codes is column.codes and old.texts is column.texts
    if is_shared and np.array_equal(rows, np.arange(before.n_rows)):
        return {}
    shared = Shared.of((old, column, _EMPTY))
    was = shared.at(0, rows)
    was[was < 0] = int(shared.codes[2][0])
    differs = np.flatnonzero(shared.codes[1] != was).tolist()
    return {row: column[row] for row in differs}
