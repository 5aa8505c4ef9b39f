"""A variant: a table whose file holds what differs from another table, its base.

A row of the file is the row of the base with the same asset; where an asset is in several rows, the first is the first there, the
second the second. A cell that is empty, or whose column the file lacks, is that of the base; `Any` says Any. The column `remove`
takes rows of the base out, and rows of other assets are new, behind those of the base. `whole_of` gives all of it as one table,
which is what is compiled, measured and checked. Bases may be variants too. Nothing here touches the disk.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from contextdb.columns import TextColumn
from contextdb.compiled.table import CompiledTable
from contextdb.errors import ContextDBError, Fault, Place, TableError, in_quotes, mend_for, some
from contextdb.schema.settings import with_inherited
from contextdb.tables.compiling import compile_table
from contextdb.tables.data import TableData, removed_rows

Tables = Mapping[str, TableData]
Places = NDArray[np.int64]
NO_ROWS = np.empty(0, np.int64)


@dataclass(frozen=True, eq=False, repr=False)
class WholeTable(TableData):
    """All rows of a variant; get one from `Table.flat()`. Its row numbers are those of matches."""

    own: TableData | None = None
    """The table of the variant's file."""
    base: TableData | None = None
    """All rows of its base."""
    own_rows: Places = field(default_factory=lambda: NO_ROWS)
    """The row of `own` that each row has cells of: int64 [n_rows]; -1 where it has none."""
    base_rows: Places = field(default_factory=lambda: NO_ROWS)
    """The row of `base` that it has cells of; -1 for a new row."""

    def place(self, row: int, column: str | None = None) -> Place:
        """Where a row is, or its cell: in the variant's file, or in that of a base."""
        of_own, of_base = (int(rows[row]) if row < len(rows) else -1 for rows in (self.own_rows, self.base_rows))
        assert self.own is not None
        if of_base < 0 or self.base is None or (of_own >= 0 and (column is None or says(self.own, of_own, column))):
            return replace(self.own.place(of_own, column), row=row)
        return replace(self.base.place(of_base, column), row=row)

    def is_inherited(self, row: int, column: str | None = None) -> bool:
        """Whether the variant's file says nothing of a row, or of its cell in a column."""
        row_of_own = int(self.own_rows[row])
        if column == self.asset_column:  # by which a row belongs to its base
            return int(self.base_rows[row]) >= 0
        if row_of_own < 0 or column is None or int(self.base_rows[row]) < 0:
            return row_of_own < 0
        return self.own is not None and not says(self.own, row_of_own, column)

    def flat(self) -> Self:
        return self

    def compile(self) -> CompiledTable:
        """Compile into masks, as `Table.compile`."""
        return CompiledTable(compile_table(self))


def says(table: TableData, row: int, column: str) -> bool:
    """Whether a row has a text of its own in a column."""
    texts = next((one for one in table.columns if one.name == column), None)
    return texts is not None and bool(texts[row].strip())


def is_variant(table: TableData) -> bool:
    """Whether the file of a table holds only what differs from its base."""
    return table.settings.base is not None


def whole_of(table: TableData, tables: Tables | None) -> TableData:
    """All rows of a variant; the table itself where it is none. `tables` are those of its folder. Raises TableError where its base
    is missing, or cannot be read."""
    if not is_variant(table):
        return table
    last = table.__dict__.get("_whole")
    if last is None or last[0] is not tables:
        rows_of = _Matched(table, base_of(table, tables))
        last = table.__dict__["_whole"] = tables, rows_of.whole
    whole: WholeTable = last[1]
    return whole


def known_whole(table: TableData) -> WholeTable | None:
    """All rows of a variant among the tables that it knows; None for another table, or one whose base cannot be used."""
    try:
        whole = whole_of(table, table.around)
    except ContextDBError:
        return None
    return whole if isinstance(whole, WholeTable) else None


def as_displayed(table: TableData, tables: Tables | None) -> WholeTable:
    """The rows of a variant's own table, in their order, with the cells that they inherit; those that are taken out are disabled.
    Raises TableError as `whole_of`."""
    matched = _Matched(table, base_of(table, tables))
    rows = matched.made(np.arange(table.n_rows), matched.base_rows)
    rows.__dict__["_plain"] = replace(rows._plain, enabled=rows.enabled & ~removed_rows(table))
    return rows


def base_of(table: TableData, tables: Tables | None) -> TableData:
    """All rows of the base of a variant. Raises TableError as `whole_of`."""
    if faults := variant_faults(table, tables or {}):
        raise TableError(*faults)
    assert tables is not None
    return whole_of(tables[table.settings.base or ""], tables)


def variant_faults(table: TableData, tables: Tables) -> list[Fault]:
    """Why a table has no base of which it could be a variant."""
    chain, base = [table.name], table.settings.base
    while base is not None:
        of = chain[-1]
        place = Place(table.schema.file or (str(table.path) if table.path else None))
        prefix = f"[tables.{of}] base = {in_quotes(base)}"
        if base in chain:
            way = " > ".join((*chain[chain.index(base) :], base))
            accepted = "a table that is no variant of this one"
            return [Fault(f"{prefix}: the table is a variant of itself: {way}.", accepted, place=place, rule="cyclic-tables")]
        if base not in tables:
            others = [name for name in tables if name not in chain]
            accepted = some(others) or "a table of the folder; there is no other"
            return [Fault(f"{prefix}: there is no such table.", accepted, mend_for(base, others), place, "no-such-table")]
        chain.append(base)
        try:
            base = tables[base].settings.base
        except ContextDBError as error:
            return [Fault(f"{prefix}: the table cannot be read: {error.faults[0]}", "a table without faults", place=place)]
    return []


# ---- which rows belong together


def occurrences(assets: Iterable[str]) -> list[tuple[str, int]]:
    """Each asset with the number of the same before it."""
    counts: Counter[str] = Counter()
    keys = []
    for asset in assets:
        keys.append((asset, counts[asset]))
        counts[asset] += 1
    return keys


def base_rows_of(own: TableData, base: TableData) -> Places:
    """For each row of a variant's own table the row of its base that it belongs to; -1 for a new one."""
    places = {key: row for row, key in enumerate(occurrences(base.assets))}
    return np.array([places.get(key, -1) for key in occurrences(own.assets)], np.int64).reshape(-1)


class _Matched:
    """A variant's own table and its base, and which rows of the two belong together."""

    def __init__(self, own: TableData, base: TableData) -> None:
        self._own, self._base, self._removed = own, base, removed_rows(own)
        self.base_rows = base_rows_of(own, base)

    @property
    def whole(self) -> WholeTable:
        """The rows of the base that are not taken out, then the new ones."""
        own_rows = np.full(self._base.n_rows, -1, np.int64)
        is_known = self.base_rows >= 0
        own_rows[self.base_rows[is_known]] = np.flatnonzero(is_known)
        is_left = np.ones(self._base.n_rows, np.bool_)
        is_left[self.base_rows[is_known & self._removed]] = False
        of_base, new = np.flatnonzero(is_left), np.flatnonzero(~is_known & ~self._removed)
        return self.made(np.append(own_rows[of_base], new), np.append(of_base, np.full(len(new), -1, np.int64)))

    def made(self, own_rows: Places, base_rows: Places) -> WholeTable:
        """A table of such rows."""
        own, base = self._own, self._base
        settings = with_inherited(own.settings, replace(base.settings, asset=base.asset_column))
        names = {base.asset_column: own.asset_column} | {c.name: c.name for c in base.columns if c.name != base.asset_column}
        names |= {c.name: c.name for c in own.columns if c.name not in (own.asset_column, own.settings.remove)}
        of_own, of_base = ({c.name: c for c in table.columns} for table in (own, base))
        columns = [_column(name, of_own.get(mine), of_base.get(name), own_rows, base_rows) for name, mine in names.items()]
        known = {c.condition.name: c for c in base.conditions}
        settings = replace(settings, asset=base.asset_column, base=None, remove=None)
        built = WholeTable.build(own.name, columns, own.schema, settings, own.path, before=known)
        return replace(built, around=own.around, own=own, base=base, own_rows=own_rows, base_rows=base_rows)


def _column(name: str, own: TextColumn | None, base: TextColumn | None, own_rows: Places, base_rows: Places) -> TextColumn:
    """One column: the texts of the variant where it says something, and in its new rows; else those of the base."""
    known: dict[str, int] = {text: code for code, text in enumerate(base.texts)} if base is not None else {}
    codes = np.full(len(own_rows), -1, np.int64)
    if base is not None:
        here = base_rows >= 0
        codes[here] = base.codes[base_rows[here]]
    if own is not None:
        is_said = np.array([bool(text.strip()) for text in own.texts], np.bool_)
        mine = np.flatnonzero(own_rows >= 0)
        of_own = own.codes[own_rows[mine]]
        counts = is_said[of_own] | (base_rows[mine] < 0)
        numbers = _numbers(own.texts, known, of_own[counts])
        codes[mine[counts]] = numbers[of_own[counts]]
    if (codes < 0).any():
        codes[codes < 0] = known.setdefault("", len(known))
    if base is not None and len(known) == len(base.texts) and np.array_equal(codes, base.codes):
        return base
    return TextColumn(name, tuple(known), codes.astype(np.int32))


def _numbers(texts: Sequence[str], known: dict[str, int], used: NDArray[Any]) -> Places:
    """The code of each used text among known ones, which it joins."""
    numbers = np.full(len(texts), -1, np.int64)
    for code in np.unique(used).tolist():
        numbers[code] = known.setdefault(texts[code], len(known))
    return numbers
