"""A variant as an editor has it: with a row for each row of its base, and a column for each.

What the variant's file does not have is empty, so that it means the same, and typing into it is what makes a difference. `expanded`
puts a table so, `contracted` gives what its file has of it. Nothing here touches the disk.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from contextdb.columns import TextColumn
from contextdb.errors import ContextDBError
from contextdb.schema.settings import with_inherited
from contextdb.tables.data import AnyTable, TableData
from contextdb.tables.variants import base_of, base_rows_of, is_variant, occurrences

Places = NDArray[np.int64]


def known_base(table: TableData) -> TableData | None:
    """All rows of the base of a variant; None for a table that is none, or whose base cannot be used."""
    try:
        return base_of(table, table.around) if is_variant(table) else None
    except ContextDBError:
        return None


def expanded(table: AnyTable) -> AnyTable:
    """A variant with a row for each row of its base, in the order there, and new ones behind; the table itself where it is none, or
    its base cannot be used."""
    base = known_base(table)
    if base is None:
        return table
    base_rows = base_rows_of(table, base)
    own_rows, is_new = np.full(base.n_rows, -1, np.int64), base_rows < 0
    own_rows[base_rows[~is_new]] = np.flatnonzero(~is_new)
    rows = np.append(own_rows, np.flatnonzero(is_new))
    names = [column.name for column in table.columns]
    assets = TextColumn.of(table.asset_column, [*base.assets, *(table.assets[row] for row in np.flatnonzero(is_new).tolist())])
    columns = [assets if column.name == assets.name else _spread(column, rows) for column in table.columns]
    more = [column.name for column in base.columns if column.name not in (*names, base.asset_column)]
    columns += [TextColumn(name, ("",), np.zeros(len(rows), np.int32)) for name in more]
    settings = replace(with_inherited(table.settings, base.settings), asset=table.settings.asset)
    built = type(table).build(table.name, columns, table.schema, settings, table.path, table.source)
    return replace(built, around=table.around, origin=np.append(table.origin, -1)[rows])


def contracted(table: AnyTable) -> tuple[AnyTable, Places]:
    """What the file of a variant has of an expanded table, and which of its rows these are: those that say something, those by
    which others of their asset are counted, and those that the file had. The whole table where it is no variant."""
    base = known_base(table)
    if base is None:
        return table, np.arange(table.n_rows)
    rows = _in_file_order(_rows_that_differ(table, base), table.origin)
    before = {column.name for column in table.source.columns} if table.source is not None else set()
    of_base = {column.name for column in base.columns}
    taken = table.with_rows_taken(rows)
    columns = [c for c in taken.columns if c.name in before or c.name not in of_base or _says(c) or c.name == table.asset_column]
    names = {column.name for column in columns}
    conditions = tuple(column for column in taken.conditions if column.condition.name in names)
    return replace(taken, columns=tuple(columns), conditions=conditions), rows


def _rows_that_differ(table: TableData, base: TableData) -> Places:
    known, keys = set(occurrences(base.assets)), occurrences(table.assets)
    differs = table.origin >= 0
    for column in table.columns:
        if column.name != table.asset_column:
            differs = differs | np.array([bool(text.strip()) for text in column.texts], np.bool_)[column.codes]
    differs |= np.array([key not in known for key in keys], np.bool_).reshape(-1)
    last = {keys[row][0]: keys[row][1] for row in np.flatnonzero(differs).tolist()}
    is_counted = np.array([n < last.get(asset, -1) for asset, n in keys], np.bool_).reshape(-1)
    return np.flatnonzero(differs | is_counted)


def _in_file_order(rows: Places, origin: Places) -> Places:
    """Rows in the order of the file; a new one stays behind the one before it."""
    heads, last = [], -1
    for row in rows.tolist():
        last = int(origin[row]) if origin[row] >= 0 else last
        heads.append(last)
    return rows[np.argsort(np.array(heads, np.int64), kind="stable")] if len(rows) else rows


def _spread(column: TextColumn, rows: Places) -> TextColumn:
    """A column with other rows; -1 is an empty one."""
    texts = column.texts if "" in column.texts else (*column.texts, "")
    return TextColumn(column.name, texts, np.append(column.codes, texts.index(""))[rows].astype(np.int32))


def _says(column: TextColumn) -> bool:
    return any(column.texts[code].strip() for code in np.unique(column.codes).tolist())
