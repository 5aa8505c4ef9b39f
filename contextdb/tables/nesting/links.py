"""Which tables the rows of a table refer to, and what is wrong with that: a table that is missing, tables that come back to
themselves. Tables are given as a mapping by name, whose reading may fail; nothing here touches the disk."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from contextdb.cells.words import MARK
from contextdb.columns import TextColumn
from contextdb.errors import ContextDBError, Fault, TableError, in_quotes, nearest, some
from contextdb.tables.data import AnyTable, TableData
from contextdb.tables.nesting.names import inner_name, says_nesting
from contextdb.tables.variants import whole_of

Tables = Mapping[str, TableData]


class Neighbours(Mapping[str, AnyTable]):
    """The tables that the rows of one table may refer to, by name, and what was worked out with them last.

    The versions of a table that come of edits share it, so that flattening again costs what changed.
    """

    def __init__(self, tables: Mapping[str, AnyTable], last: object = None) -> None:
        self.tables = tables
        self.last = last
        """The flat table that was made last."""

    def __getstate__(self) -> dict[str, object]:
        """What is pickled: not what can be worked out again."""
        return {"tables": self.tables, "last": None}

    def __getitem__(self, name: str) -> AnyTable:
        return self.tables[name]

    def __contains__(self, name: object) -> bool:
        return name in self.tables

    def __iter__(self) -> Iterator[str]:
        return iter(self.tables)

    def __len__(self) -> int:
        return len(self.tables)


def is_nested(table: TableData) -> bool:
    """Whether an asset cell of the table says more than the name of an asset."""
    return bool(table.columns) and table.text_column(table.asset_column).once(_is_nesting)


def _is_nesting(assets: TextColumn) -> bool:
    return says_nesting(assets.texts)


def inner_rows(table: TableData) -> dict[str, list[int]]:
    """The tables that rows refer to, by name, with those rows."""
    if not table.columns:
        return {}
    column = table.text_column(table.asset_column)
    names = {code: name for code, text in enumerate(column.texts) if MARK in text and (name := inner_name(text)) is not None}
    rows_by_name: dict[str, list[int]] = {}
    for row in np.flatnonzero(np.isin(column.codes, list(names))).tolist() if names else ():
        rows_by_name.setdefault(names[int(column.codes[row])], []).append(row)
    return rows_by_name


def inner_tables(tables: Iterable[TableData]) -> set[str]:
    """The names of the tables that rows of some tables refer to."""
    return {name for table in tables for name in inner_rows(table)}


def sources(table: TableData, tables: Tables) -> dict[str, TableData]:
    """The tables whose files say what is in a table, by name: itself, those inside it, and the bases of variants."""
    tables_by_name = {table.name: table}
    waiting = [table]
    while waiting:
        at = waiting.pop()
        for name in (*inner_rows(at), *([at.settings.base] if at.settings.base else [])):
            if name in tables and name not in tables_by_name:
                tables_by_name[name] = tables[name]
                waiting.append(tables[name])
    return tables_by_name


def reached(table: TableData, tables: Tables) -> dict[str, TableData]:
    """The table and all that are in it, by name, each once; the table itself first. Those that cannot be read are left out, and
    variants are whole."""
    tables_by_name = {table.name: table}
    waiting = [table]
    while waiting:
        for name in inner_rows(waiting.pop()):
            if name not in tables_by_name and (inner := _read(name, tables)) is not None:
                tables_by_name[name] = inner
                waiting.append(inner)
    return tables_by_name


def nesting_faults(table: TableData, tables: Tables, name: str | None = None) -> list[Fault]:
    """What is wrong with the rows of one table, known as `name`, that refer to others, in the order of its rows."""
    placed: list[tuple[int, Fault]] = []
    for inner, rows in inner_rows(table).items():
        if fault := _missing(name or table.name, inner, tables) or _cycle(name or table.name, inner, tables):
            placed += [(row, fault.at(table.place(row, table.asset_column))) for row in rows]
    return [fault for _, fault in sorted(placed, key=lambda item: item[0])]


def require_sound(table: TableData, tables: Tables) -> dict[str, TableData]:
    """The tables that are in a table, as `reached`. Raises TableError with what is wrong in any of them: files and cells that
    cannot be read, tables that are missing, cycles."""
    reachable = reached(table, tables)
    faults = dict.fromkeys(_unread(reachable.values(), tables))
    for name, inner in reachable.items():
        faults |= dict.fromkeys((*inner.faults, *nesting_faults(inner, tables, name)))
    if faults:
        raise TableError(*faults)
    return reachable


def _unread(reachable: Iterable[TableData], tables: Tables) -> Iterator[Fault]:
    for name in dict.fromkeys(name for table in reachable for name in inner_rows(table)):
        if name in tables:
            try:
                whole_of(tables[name], tables)
            except ContextDBError as error:
                yield from error.faults


def _read(name: str, tables: Tables) -> TableData | None:
    try:
        return whole_of(tables[name], tables) if name in tables else None
    except ContextDBError:  # reported by `require_sound`, and in the file itself
        return None


def _missing(outer: str, name: str, tables: Tables) -> Fault | None:
    if name in tables or name == outer:
        return None
    others = [other for other in tables if other != outer]
    near = nearest(name, others)
    known = some(f"{MARK}{other}" for other in others) or "an asset, as there is no other table"
    mend = in_quotes(MARK + near) if near else f'to put an asset of this name in quotes: "{MARK}{name}"' if name else ""
    problem = f"there is no table {in_quotes(name)}." if name else f'after "{MARK}" the name of a table is missing.'
    return Fault(problem, known, mend, rule="no-such-table")


def _cycle(outer: str, name: str, tables: Tables) -> Fault | None:
    """A fault when the table `outer` is in itself through the table `name`; the shortest way is reported."""
    ways: dict[str, tuple[str, ...]] = {name: (outer, name)}
    waiting = [name]
    while waiting:
        at = waiting.pop(0)
        if at == outer:
            way = " > ".join(ways[at])
            return Fault(f"the table contains itself: {way}.", "tables that do not contain themselves", rule="cyclic-tables")
        inner = _read(at, tables)
        for following in inner_rows(inner) if inner is not None else ():
            if following not in ways:
                ways[following] = (*ways[at], following)
                waiting.append(following)
    return None
