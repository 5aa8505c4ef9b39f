"""A table as far as it can be read, for an editor that answers while somebody types: an unreadable cell never matches.

Rows with a cell or a rule that cannot be read, or that refer to a table that cannot be used, are disabled. The tables inside
are the same; where some table is in others, such cells are empty, so that the others of the way can be read together.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from contextdb.columns import TextColumn
from contextdb.errors import ContextDBError, Fault
from contextdb.tables.data import AnyTable, TableData
from contextdb.tables.nesting.links import Neighbours, Tables, inner_rows, is_nested, nesting_faults, reached
from contextdb.tables.nesting.names import asset_text

Flags = NDArray[np.bool_]


def readable(table: AnyTable) -> AnyTable:
    """The table with the rows disabled that cannot be read; the table itself where all can."""
    if not is_nested(table):
        off = unreadable_rows(table)
        return _without(table, off, table.around) if off.any() else table
    around = table.around or {}
    tables = reached(table, around)
    refused = {name: refused_rows(inner, around, name) for name, inner in tables.items()}
    if not any(refused.values()) and not any(unreadable_rows(inner).any() for inner in tables.values()):
        return table
    sound = Neighbours({name: _emptied(inner, refused[name]) for name, inner in tables.items()})
    return _without(_emptied(table, refused[table.name]), np.zeros(table.n_rows, np.bool_), sound)


def unreadable_rows(table: TableData) -> Flags:
    """Whether a cell of a condition, or the rule, of each row cannot be read: bool [n_rows]."""
    off = np.zeros(table.n_rows, np.bool_)
    for texts, faults in _faulty(table):
        off[_rows_of(texts, faults)] = True
    return off


def _faulty(table: TableData) -> list[tuple[TextColumn, Mapping[int, Fault]]]:
    """The columns of conditions and of rules in which texts cannot be read, with these."""
    parts = [(column.texts, column.faults) for column in table.conditions]
    parts += [(table.when.texts, table.when.faults)] if table.when is not None else []
    return [(texts, faults) for texts, faults in parts if faults]


def refused_rows(table: TableData, tables: Tables, name: str | None = None) -> dict[int, Fault]:
    """The rows of a table, known as `name`, that refer to one that cannot be used, and why."""
    faults = {fault.place.row: fault for fault in nesting_faults(table, tables, name)}
    unread = ((row, fault) for inner, rows in inner_rows(table).items() for fault in _unread(inner, tables) for row in rows)
    return {row: fault for row, fault in (*unread, *faults.items()) if row is not None}


def _unread(name: str, tables: Tables) -> Iterator[Fault]:
    """Why a table cannot be read."""
    try:
        tables.get(name)
    except ContextDBError as error:
        yield error.faults[0]


def _emptied(table: AnyTable, refused: Collection[int]) -> AnyTable:
    """A table without what cannot be read: such cells are empty, and rows that refer to no table that can be used name an asset."""
    off = unreadable_rows(table)
    off[list(refused)] = True
    if not off.any():
        return table
    cells = [(row, table.asset_column, asset_text(table.assets[row])) for row in refused]
    cells += [(row, texts.name, "") for texts, faults in _faulty(table) for row in _rows_of(texts, faults)]
    return _without(table.with_cells(cells), off, table.around)


def _rows_of(column: TextColumn, codes: Collection[int]) -> list[int]:
    rows: list[int] = np.flatnonzero(np.isin(column.codes, list(codes))).tolist()
    return rows


def _without(table: AnyTable, off: Flags, around: Mapping[str, TableData] | None) -> AnyTable:
    """A table with some rows disabled, among other tables."""
    after, plain = replace(table, around=around), replace(table._plain, enabled=table.enabled & ~off)
    after.__dict__.update(_plain=plain, when=table.when, _output_columns=table._output_columns)
    return after
