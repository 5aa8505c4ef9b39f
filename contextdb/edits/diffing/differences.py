"""What changed from one table to another: rows, columns, and cells, those of meaning apart from those of writing only."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import plural
from contextdb.tables.changes import CameFrom, Edit
from contextdb.tables.merging.alignment import Alignment, align, inverse, moved
from contextdb.tables.merging.building import edit_under
from contextdb.tables.merging.conflicts import Places, Shared
from contextdb.tables.merging.meaning import is_same, meaning_of
from contextdb.tables.table import EitherTable

FORMAT = 1


@dataclass(frozen=True, slots=True)
class CellChange:
    """A cell with another text."""

    row: int
    """The row after."""
    asset: str
    column: str
    before: str
    after: str
    is_meaning: bool
    """False where only the writing changed: `20.0, 9.99` to `20.00, 9.990`."""


@dataclass(frozen=True, slots=True)
class Renamed:
    """A row or a column with another name, and its places before and after."""

    before: str
    after: str
    place_before: int
    place_after: int


@dataclass(frozen=True, slots=True)
class RowMove:
    """A row or a column that is elsewhere among the others, and its places before and after."""

    name: str
    place_before: int
    place_after: int


@dataclass(frozen=True, eq=False)
class Diff:
    """What changed from `before` to `after`. False when every text, row and column is the same."""

    before: EitherTable
    after: EitherTable
    alignment: Alignment
    changed: Mapping[int, Places]
    """Column of after to the rows of after whose text is another, of rows and columns that were there before."""
    rewritten: Mapping[int, NDArray[np.bool_]]
    """Beside each of these rows, whether only the writing changed."""

    def __bool__(self) -> bool:
        is_as_before = all(np.array_equal(rows, np.arange(n)) for rows, n in self._sizes)
        return not is_as_before or bool(self.changed) or bool(self.columns_renamed)

    @property
    def _sizes(self) -> tuple[tuple[CameFrom, int], tuple[CameFrom, int]]:
        alignment = self.alignment
        return (alignment.rows, self.before.n_rows), (alignment.columns, len(self.before.columns))

    @cached_property
    def rows_added(self) -> list[int]:
        """Rows of after that were not there."""
        return np.flatnonzero(self.alignment.rows < 0).tolist()

    @cached_property
    def rows_removed(self) -> list[int]:
        return np.flatnonzero(inverse(*self._sizes[0]) < 0).tolist()

    @cached_property
    def rows_renamed(self) -> list[Renamed]:
        """Rows whose asset has another name."""
        asset = self._asset_place
        rows = self.changed.get(asset, np.empty(0, np.int64)).tolist()
        was = self.before.columns[int(self.alignment.columns[asset])] if rows else None
        places = ((int(self.alignment.rows[row]), row) for row in rows)
        return [Renamed(was[b], self.after.assets[a], b, a) for b, a in places if was is not None]

    @cached_property
    def rows_moved(self) -> list[RowMove]:
        """The fewest rows that, put elsewhere, give the order of after."""
        places = np.flatnonzero(moved(self.alignment.rows)).tolist()
        return [RowMove(self.after.assets[a], int(self.alignment.rows[a]), a) for a in places]

    @cached_property
    def columns_added(self) -> list[str]:
        return [self.after.columns[a].name for a in np.flatnonzero(self.alignment.columns < 0).tolist()]

    @cached_property
    def columns_removed(self) -> list[str]:
        return [self.before.columns[b].name for b in np.flatnonzero(inverse(*self._sizes[1]) < 0).tolist()]

    @cached_property
    def columns_renamed(self) -> list[Renamed]:
        pairs = ((b, a) for a, b in enumerate(self.alignment.columns.tolist()) if b >= 0)
        named = (Renamed(self.before.columns[b].name, self.after.columns[a].name, b, a) for b, a in pairs)
        return [one for one in named if one.before != one.after]

    @cached_property
    def columns_moved(self) -> list[RowMove]:
        """The fewest columns that, put elsewhere, give the order of after."""
        places = np.flatnonzero(moved(self.alignment.columns)).tolist()
        return [RowMove(self.after.columns[a].name, int(self.alignment.columns[a]), a) for a in places]

    @property
    def cells(self) -> Iterator[CellChange]:
        """Every cell that changed, in rows and columns that were there before, by row; renamed assets are in `rows_renamed`."""
        columns = [at for at in self.changed if at != self._asset_place]
        places = [(row, at, i) for at in columns for i, row in enumerate(self.changed[at].tolist())]
        for row, at, i in sorted(places):
            now = self.after.columns[at]
            was = self.before.columns[int(self.alignment.columns[at])][int(self.alignment.rows[row])]
            yield CellChange(row, self.after.assets[row], now.name, was, now[row], not self.rewritten[at][i])

    @cached_property
    def n_changed(self) -> int:
        """Cells whose meaning changed."""
        return sum(int((~flags).sum()) for at, flags in self.rewritten.items() if at != self._asset_place)

    @cached_property
    def n_rewritten(self) -> int:
        """Cells that mean the same and are written differently."""
        return sum(int(flags.sum()) for at, flags in self.rewritten.items() if at != self._asset_place)

    @property
    def summary(self) -> str:
        """How much changed, in one line."""
        phrases = [f"{plural(n, 'row')} {verb}" for verb, n in self._row_counts.items() if n]
        phrases += [f"{plural(n, 'column')} {verb}" for verb, n in self._column_counts.items() if n]
        phrases += [f"{plural(self.n_changed, 'cell')} changed"] if self.n_changed else []
        phrases += [f"{plural(self.n_rewritten, 'cell')} written differently"] if self.n_rewritten else []
        return ", ".join(phrases) or "no difference"

    @property
    def _row_counts(self) -> dict[str, int]:
        added, removed = len(self.rows_added), len(self.rows_removed)
        return {"added": added, "removed": removed, "renamed": len(self.rows_renamed), "moved": len(self.rows_moved)}

    @property
    def _column_counts(self) -> dict[str, int]:
        added, removed = len(self.columns_added), len(self.columns_removed)
        return {"added": added, "removed": removed, "renamed": len(self.columns_renamed), "moved": len(self.columns_moved)}

    def edit(self, name: str = "Changes") -> Edit:
        """The edit that makes the texts of `before` those of `after`, and the settings of its columns too."""
        after, alignment = self.after, self.alignment
        return edit_under(self.before, after.columns, alignment.rows, alignment.columns, after.settings, after.schema, name)

    def to_json(self) -> dict[str, object]:
        """The differences as plain data. Rows count from 0; "line" is that of the file, where there is one."""
        return {
            "format": FORMAT,
            "before": str(self.before.path) if self.before.path else None,
            "after": str(self.after.path) if self.after.path else None,
            "same": not self,
            "rows": {
                "added": [_row(self.after, row) for row in self.rows_added],
                "removed": [_row(self.before, row) for row in self.rows_removed],
                "renamed": [{"row": r.place_after, "before": r.before, "after": r.after} for r in self.rows_renamed],
                "moved": [{"asset": r.name, "before": r.place_before, "after": r.place_after} for r in self.rows_moved],
            },
            "columns": {
                "added": self.columns_added,
                "removed": self.columns_removed,
                "renamed": [{"before": c.before, "after": c.after} for c in self.columns_renamed],
                "moved": [{"column": c.name, "before": c.place_before, "after": c.place_after} for c in self.columns_moved],
            },
            "cells": [
                {"row": c.row, "asset": c.asset, "column": c.column, "before": c.before, "after": c.after, "meaning": c.is_meaning}
                for c in self.cells
            ],
        }

    @cached_property
    def _asset_place(self) -> int:
        return [c.name for c in self.after.columns].index(self.after.asset_column)


def diff(before: EitherTable, after: EitherTable) -> Diff:
    """What changed from one table to another.

    Near-linear in cells: 100,000 rows x 60 columns with 1,000 changed cells take about half a second. Cells may be unreadable; such
    a text means itself.
    """
    alignment = align(before, after)
    retained = np.flatnonzero(alignment.rows >= 0)
    changed, rewritten = {}, {}
    for a, b in enumerate(alignment.columns.tolist()):
        rows = _changed_rows(before, after, b, a, alignment.rows[retained], retained) if b >= 0 else retained[:0]
        if len(rows):
            changed[a] = rows
            rewritten[a] = _is_writing_only(before, after, b, a, alignment.rows[rows], rows)
    return Diff(before, after, alignment, changed, rewritten)


def _changed_rows(before: EitherTable, after: EitherTable, b: int, a: int, rows_before: Places, rows_after: Places) -> Places:
    old, new = before.columns[b], after.columns[a]
    if old.codes is new.codes and old.texts is new.texts and np.array_equal(rows_before, rows_after):
        return rows_after[:0]
    shared = Shared.of((old, new))
    is_changed = shared.at(0, rows_before) != shared.at(1, rows_after)
    return np.asarray(rows_after[is_changed], np.int64)


def _is_writing_only(
    before: EitherTable, after: EitherTable, b: int, a: int, rows_before: Places, rows_after: Places
) -> NDArray[np.bool_]:
    old, new = before.columns[b], after.columns[a]
    read_old, read_new = meaning_of(before, b), meaning_of(after, a)
    pairs = np.stack([old.codes[rows_before], new.codes[rows_after]], axis=1)
    distinct, which = np.unique(pairs, axis=0, return_inverse=True)
    same = [is_same(read_old, old.texts[x], read_new, new.texts[y]) for x, y in distinct.tolist()]
    return np.array(same, np.bool_)[which.reshape(-1)]


def _row(table: EitherTable, row: int) -> dict[str, object]:
    return {"row": row, "asset": table.assets[row], "line": table.place(row).line}
