"""A three-way merge of tables: what two sides made of one base, cell by cell.

A cell that one side changed is as that side has it; what both changed alike is no conflict, nor is a change that only writes the
same otherwise. Rows and columns that come, go and move on either side do so in the merge (`contextdb.tables.merging.order`). What
the sides disagree about is in `conflicts`, and until somebody decides it ours holds. The result keeps the source of ours, so
that saving it changes only lines that theirs changed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Generic

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.cells.outputs import Output
from contextdb.cells.words import says_any
from contextdb.columns import TextColumn
from contextdb.errors import safe_text
from contextdb.files.texts import is_parquet, texts_of, written_over
from contextdb.schema.sections import job_faults
from contextdb.schema.settings import EMPTY, Schema, TableSettings, settings_renamed, with_outputs
from contextdb.schema.table_settings import JOB_KEYS, JOBS
from contextdb.tables.changes import CameFrom, Edit
from contextdb.tables.data import AnyTable, TableData
from contextdb.tables.merging.alignment import Alignment, align, inverse, row_twins
from contextdb.tables.merging.building import edit_under
from contextdb.tables.merging.conflicts import Conflict, Decided, LostCell, Places, Shared, Side
from contextdb.tables.merging.meaning import changed_in, merge_column, new_cells
from contextdb.tables.merging.order import Origins, Sides, merged_order


@dataclass(frozen=True, eq=False)
class Merge(Generic[AnyTable]):
    """The merge of `ours` and `theirs`, which were both made of `base`."""

    base: AnyTable
    ours: AnyTable
    theirs: AnyTable
    rows: Origins
    fields: Origins
    """The same for columns."""
    columns: tuple[TextColumn, ...]
    settings: TableSettings
    schema: Schema
    conflicts: tuple[Conflict, ...]
    """What is not decided yet, by row; until then `columns` has it as ours."""
    decided: Decided
    lost: tuple[LostCell, ...] = ()

    @cached_property
    def table(self) -> AnyTable:
        """The merged table, with the source of ours: saving it changes only lines that theirs changed."""
        return self.edit_of_ours().apply(self.ours)

    def edit_of_ours(self, name: str = "Merge") -> Edit:
        return self._edit(self.ours, self.rows.ours, self.fields.ours, name)

    def edit_of_theirs(self, name: str = "Merge") -> Edit:
        return self._edit(self.theirs, self.rows.theirs, self.fields.theirs, name)

    def resolved(self, sides: Mapping[int, Side]) -> Merge[AnyTable]:
        """The merge with some of its conflicts decided, each by its place in `conflicts`."""
        decided = {**self.decided, **{self.conflicts[at].key: side for at, side in sides.items()}}
        return merge(self.base, self.ours, self.theirs, decided)

    def _edit(self, side: TableData, rows: CameFrom, fields: CameFrom, name: str) -> Edit:
        return edit_under(side, self.columns, rows, fields, self.settings, self.schema, name)


def merge(base: AnyTable, ours: AnyTable, theirs: AnyTable, decided: Decided | None = None) -> Merge[AnyTable]:
    """Join what two sides made of a table. Cells may be unreadable; such a text means itself. Merging a table with itself gives it
    byte for byte. `decided` are conflicts that are decided already, by their `key`; use `Merge.resolved`."""
    decided = decided or {}
    of_ours, of_theirs = align(base, ours), align(base, theirs)
    fields, names, about_columns = merge_columns(base, ours, theirs, of_ours, of_theirs, decided)
    rows, about_rows, lost = merge_rows(base, ours, theirs, of_ours, of_theirs, decided)
    merged = [
        merge_column((base, ours, theirs), rows, (int(b), int(o), int(t)), name, decided)
        for b, o, t, name in zip(fields.base, fields.ours, fields.theirs, names, strict=True)
    ]
    columns = tuple(column for column, _ in merged)
    schema = _schema(base.schema, ours.schema, theirs.schema)
    settings = _settings(base, ours, theirs, fields, names, schema)
    asset = next((c for c in columns if c.name == settings.asset), columns[0])
    cells = sorted((one for _, of_column in merged for one in of_column), key=lambda one: one.row or 0)
    named = tuple(replace(one, asset=asset[one.row] if one.row is not None else "") for one in cells)
    conflicts = (*about_columns, *about_rows, *named)
    return Merge(base, ours, theirs, rows, fields, columns, settings, schema, conflicts, decided, lost)


# ---- the settings of the columns


def _settings(
    base: TableData, ours: TableData, theirs: TableData, fields: Origins, names: Sequence[str], schema: Schema
) -> TableSettings:
    """The settings of ours, with what only theirs changed where that goes together, under the names of the merge."""
    was, mine, yours = (
        vars(
            settings_renamed(
                table.settings, {table.columns[at].name: name for at, name in zip(places, names, strict=True) if at >= 0}.get
            )
        )
        for table, places in ((base, fields.base), (ours, fields.ours), (theirs, fields.theirs))
    )
    is_same = yours["outputs"] == was["outputs"]
    wanted: dict[str, Any] = {} if is_same else {"outputs": _merged_names(was["outputs"], mine["outputs"], yours["outputs"])}
    wanted |= {key: yours[key] for key in JOBS if mine[key] == was[key] != yours[key]}
    settings: TableSettings = replace(ours.settings, **{key: mine[key] for key in (*JOB_KEYS, "fallback_outputs")})
    settings = replace(settings, typed=_merged_types(was["typed"], mine["typed"], yours["typed"]))
    for tried in (wanted, *({key: value} for key, value in wanted.items())):  # all at once, else what can be
        if not any(job_faults(now := replace(settings, **tried), names, schema)):
            settings = now
    return with_outputs(settings, settings.outputs)


def _merged_types(was: tuple[Output, ...], ours: tuple[Output, ...], theirs: tuple[Output, ...]) -> tuple[Output, ...]:
    """What is declared of outputs: as ours has it where ours changed it, else as theirs."""
    base, mine, yours = ({output.name: output for output in side} for side in (was, ours, theirs))
    outputs = [yours.get(name) if mine.get(name) == base.get(name) else mine.get(name) for name in {**mine, **yours}]
    return tuple(output for output in outputs if output is not None)


def _merged_names(was: tuple[str, ...], ours: tuple[str, ...], theirs: tuple[str, ...]) -> tuple[str, ...]:
    names_left = [name for name in ours if name in theirs or name not in was]
    return (*names_left, *(name for name in theirs if name not in names_left and name not in was))


def _schema(base: Schema, ours: Schema, theirs: Schema) -> Schema:
    return ours if theirs is ours else replace(ours, conditions=merged_conditions(base, ours, theirs))


def merged_conditions(base: Schema, ours: Schema, theirs: Schema) -> dict[str, Condition]:
    """What is declared of conditions: as ours has it where ours changed it, else as theirs."""
    was, mine, yours = base.conditions, ours.conditions, theirs.conditions
    names = [*yours, *(name for name in mine if name not in yours)]
    merged = {name: yours.get(name) if mine.get(name) == was.get(name) else mine.get(name) for name in names}
    return {name: condition for name, condition in merged.items() if condition is not None}


# ---- rows and columns


MOST_CHANGES = 3
"""Changed cells of a row that a conflict tells."""


def merge_rows(
    base: TableData, ours: TableData, theirs: TableData, of_ours: Alignment, of_theirs: Alignment, decided: Decided
) -> tuple[Origins, list[Conflict], tuple[LostCell, ...]]:
    """Which rows are in the merge; a conflict for each that one side took away and the other changed; what others that one side
    took away had in new columns of the other."""
    twins = row_twins(ours, theirs, np.flatnonzero(of_ours.rows < 0), np.flatnonzero(of_theirs.rows < 0))
    sides = Sides(base.n_rows, of_ours.rows, of_theirs.rows, twins)
    gone = np.flatnonzero(sides.gone_from_theirs), np.flatnonzero(sides.gone_from_ours)
    changed = [
        conflicts[changed_in((base, table), aligned.columns, (aligned.rows[conflicts], conflicts))]
        for table, aligned, conflicts in ((ours, of_ours, gone[0]), (theirs, of_theirs, gone[1]))
    ]
    dropped, revived = sides.gone_from_theirs, np.zeros(theirs.n_rows, np.bool_)
    dropped[[r for r in changed[0].tolist() if decided.get(("row", int(of_ours.rows[r]))) != "theirs"]] = False
    revived[[r for r in changed[1].tolist() if decided.get(("row", int(of_theirs.rows[r]))) == "theirs"]] = True
    rows = merged_order(sides, dropped, revived)
    unaffected = [_row_conflict(base, ours, of_ours, r, is_ours=True) for r in changed[0].tolist()]
    lost = [_row_conflict(base, theirs, of_theirs, r, is_ours=False) for r in changed[1].tolist()]
    places = inverse(rows.base, base.n_rows)
    conflicts = sorted((c for c in (*unaffected, *lost) if c.key not in decided), key=lambda c: c.row or 0)
    cells = (
        *_lost(ours, of_ours, np.setdiff1d(gone[0], changed[0]), "ours"),
        *_lost(theirs, of_theirs, np.setdiff1d(gone[1], changed[1]), "theirs"),
    )
    return rows, [_placed(c, int(places[c.row or 0])) for c in conflicts], cells


def _lost(table: TableData, aligned: Alignment, rows: Places, side: Side) -> Iterator[LostCell]:
    for row, at in new_cells(table, aligned.columns, rows):
        yield LostCell(table.assets[row], table.columns[at].name, table.columns[at][row], side)


def _row_conflict(base: TableData, side: TableData, aligned: Alignment, row: int, is_ours: bool) -> Conflict:
    """A row that this side changed and the other took away; its row is that of base."""
    was = int(aligned.rows[row])
    changes = ", ".join(_changes(base, side, aligned.columns, was, row))
    asset = base.assets[was]
    return Conflict(
        "row", asset, "", was, safe_text(asset), changes if is_ours else None, None if is_ours else changes, ("row", was)
    )


def _changes(base: TableData, side: TableData, columns: CameFrom, was: int, row: int) -> Iterator[str]:
    changed = [
        at
        for at, b in enumerate(columns.tolist())
        if (base.columns[b][was] != side.columns[at][row] if b >= 0 else not says_any(side.columns[at][row]))
    ]
    yield from (f"{safe_text(side.columns[at].name)}: {safe_text(side.columns[at][row])}" for at in changed[:MOST_CHANGES])
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
    twins = [new.get(c.name, -1) if of_theirs.columns[at] < 0 else -1 for at, c in enumerate(theirs.columns)]
    return np.array(twins, np.int64)


def _is_changed(base: TableData, side: TableData, aligned: Alignment, at: int) -> bool:
    """Whether a side changed a text of a column in a row that it retained."""
    retained = np.flatnonzero(aligned.rows >= 0)
    shared = Shared.of((base.columns[int(aligned.columns[at])], side.columns[at]))
    return not np.array_equal(shared.at(0, aligned.rows[retained]), shared.at(1, retained))


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
    texts: list[str] = []
    for name in names:
        others = (name, *(f"{name} {i}" for i in range(2, len(names) + 2)))
        texts.append(next(n for n in others if n not in texts and (n == name or n not in names)))
    return texts


# ---- tables from bytes whose file may have any name, as git hands them to a merge driver, and the bytes of a merge


def table_of(
    kind: type[AnyTable], raw: bytes, file: str, schema: Schema = EMPTY, settings: TableSettings | None = None
) -> AnyTable:
    """A table from bytes, CSV or Parquet as they are; `file` is its name in messages, `kind` the class to make.

    Jobs of columns that this version of the table does not have yet are left out. Raises TableError where the bytes are not a
    table.
    """
    source, columns = texts_of(raw, file, is_parquet(raw))
    settings = settings_renamed(settings or TableSettings(Path(file).stem), {c.name: c.name for c in columns}.get)
    return kind.build(settings.name, columns, schema, settings, Path(file), source)


def merged_bytes(merge: Merge[AnyTable]) -> bytes:
    """The bytes of a merge, written over those of ours: what theirs did not change stays, under a renamed column too."""
    table, fields = merge.table, merge.fields.ours.tolist()
    return written_over(table.source, table.columns, table.origin, fields).raw
