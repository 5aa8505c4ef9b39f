"""The rows and columns of a merge, and the conflicts about whole ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from contextdb.cells.words import says_any
from contextdb.errors import shown
from contextdb.tables.changes import CameFrom
from contextdb.tables.data import TableData
from contextdb.tables.merging.alignment import Alignment, inverse, row_twins
from contextdb.tables.merging.cells import changed_in
from contextdb.tables.merging.conflicts import Conflict, Decided
from contextdb.tables.merging.order import Origins, Sides, merged_order
from contextdb.tables.merging.shared import Shared

MOST_CHANGES = 3
"""Changed cells of a row that a conflict tells."""


def merge_rows(
    base: TableData, ours: TableData, theirs: TableData, of_ours: Alignment, of_theirs: Alignment, decided: Decided
) -> tuple[Origins, list[Conflict]]:
    """Which rows are in the merge; a conflict for each that one side took away and the other changed."""
    twins = row_twins(ours, theirs, np.flatnonzero(of_ours.rows < 0), np.flatnonzero(of_theirs.rows < 0))
    sides = Sides(base.n_rows, of_ours.rows, of_theirs.rows, twins)
    gone = np.flatnonzero(sides.gone_from_theirs), np.flatnonzero(sides.gone_from_ours)
    changed = [
        found[changed_in((base, table), aligned.columns, (aligned.rows[found], found))]
        for table, aligned, found in ((ours, of_ours, gone[0]), (theirs, of_theirs, gone[1]))
    ]
    dropped, revived = sides.gone_from_theirs, np.zeros(theirs.n_rows, np.bool_)
    dropped[[r for r in changed[0].tolist() if decided.get(("row", int(of_ours.rows[r]))) != "theirs"]] = False
    revived[[r for r in changed[1].tolist() if decided.get(("row", int(of_theirs.rows[r]))) == "theirs"]] = True
    rows = merged_order(sides, dropped, revived)
    kept = [_row_conflict(base, ours, of_ours, r, is_ours=True) for r in changed[0].tolist()]
    lost = [_row_conflict(base, theirs, of_theirs, r, is_ours=False) for r in changed[1].tolist()]
    places = inverse(rows.base, base.n_rows)
    found = sorted((c for c in (*kept, *lost) if c.key not in decided), key=lambda c: c.row or 0)
    return rows, [_placed(c, int(places[c.row or 0])) for c in found]


def _row_conflict(base: TableData, side: TableData, aligned: Alignment, row: int, is_ours: bool) -> Conflict:
    """A row that this side changed and the other took away; its row is that of base."""
    was = int(aligned.rows[row])
    said = ", ".join(_changes(base, side, aligned.columns, was, row))
    asset = base.assets[was]
    return Conflict("row", asset, "", was, shown(asset), said if is_ours else None, None if is_ours else said, ("row", was))


def _changes(base: TableData, side: TableData, columns: CameFrom, was: int, row: int) -> Iterator[str]:
    changed = [
        at
        for at, b in enumerate(columns.tolist())
        if (base.columns[b][was] != side.columns[at][row] if b >= 0 else not says_any(side.columns[at][row]))
    ]
    yield from (f"{shown(side.columns[at].name)}: {shown(side.columns[at][row])}" for at in changed[:MOST_CHANGES])
    if len(changed) > MOST_CHANGES:
        yield f"{len(changed) - MOST_CHANGES} more"


def _placed(conflict: Conflict, row: int) -> Conflict:
    return replace(conflict, row=row if row >= 0 else None)


# ---- columns


def merge_columns(
    base: TableData, ours: TableData, theirs: TableData, of_ours: Alignment, of_theirs: Alignment, decided: Decided
) -> tuple[Origins, list[str], list[Conflict]]:
    """Which columns are in the merge and under which names; a conflict for each that one side took away and the other changed, or
    that has two names."""
    sides = Sides(len(base.columns), of_ours.columns, of_theirs.columns, _column_twins(ours, theirs, of_ours, of_theirs))
    gone = [
        [at for at in np.flatnonzero(flags).tolist() if _is_changed(base, table, aligned, at)]
        for table, aligned, flags in ((ours, of_ours, sides.gone_from_theirs), (theirs, of_theirs, sides.gone_from_ours))
    ]
    dropped, revived = sides.gone_from_theirs, np.zeros(len(theirs.columns), np.bool_)
    dropped[[at for at in gone[0] if decided.get(("column", int(of_ours.columns[at]))) != "theirs"]] = False
    revived[[at for at in gone[1] if decided.get(("column", int(of_theirs.columns[at]))) == "theirs"]] = True
    dropped[[c.name for c in ours.columns].index(ours.asset_column)] = False
    fields = merged_order(sides, dropped, revived)
    conflicts = [_column_conflict(ours, int(of_ours.columns[at]), at, is_ours=True) for at in gone[0]]
    conflicts += [_column_conflict(theirs, int(of_theirs.columns[at]), at, is_ours=False) for at in gone[1]]
    names, of_names = _names(base, ours, theirs, fields, decided)
    return fields, names, [c for c in (*conflicts, *of_names) if c.key not in decided]


def _column_twins(ours: TableData, theirs: TableData, of_ours: Alignment, of_theirs: Alignment) -> CameFrom:
    """For each new column of theirs the new one of ours with the same name."""
    new = {c.name: at for at, c in enumerate(ours.columns) if of_ours.columns[at] < 0}
    found = [new.get(c.name, -1) if of_theirs.columns[at] < 0 else -1 for at, c in enumerate(theirs.columns)]
    return np.array(found, np.int64)


def _is_changed(base: TableData, side: TableData, aligned: Alignment, at: int) -> bool:
    """Whether a side changed a text of a column in a row that it kept."""
    kept = np.flatnonzero(aligned.rows >= 0)
    shared = Shared.of((base.columns[int(aligned.columns[at])], side.columns[at]))
    return not np.array_equal(shared.at(0, aligned.rows[kept]), shared.at(1, kept))


def _column_conflict(side: TableData, was: int, at: int, is_ours: bool) -> Conflict:
    name = side.columns[at].name
    return Conflict("column", "", name, None, name, "changed" if is_ours else None, None if is_ours else "changed", ("column", was))


def _names(
    base: TableData, ours: TableData, theirs: TableData, fields: Origins, decided: Decided
) -> tuple[list[str], list[Conflict]]:
    """The name of each column: as the side has it that renamed it. Two that would have one name get a number behind it."""
    names: list[str] = []
    conflicts = []
    for b, o, t in zip(fields.base.tolist(), fields.ours.tolist(), fields.theirs.tolist(), strict=True):
        was, mine, yours = (table.columns[at].name if at >= 0 else None for table, at in ((base, b), (ours, o), (theirs, t)))
        key = ("name", b, o, t)
        is_two = None not in (was, mine, yours) and len({was, mine, yours}) == 3
        if is_two and key not in decided:
            conflicts.append(Conflict("name", "", mine or "", None, was, mine, yours, key))
        takes_theirs = mine is None or (yours is not None and (mine == was or decided.get(key) == "theirs"))
        names.append((yours if takes_theirs else mine) or "")
    return _distinct(names), conflicts


def _distinct(names: Sequence[str]) -> list[str]:
    found: list[str] = []
    for name in names:
        others = (name, *(f"{name} {i}" for i in range(2, len(names) + 2)))
        found.append(next(n for n in others if n not in found and (n == name or n not in names)))
    return found
