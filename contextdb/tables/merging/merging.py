"""A three-way merge of tables: what two sides made of one base, cell by cell.

A cell that one side changed is as that side has it; what both changed alike is no conflict, nor is a change that only writes the
same otherwise. Rows and columns that come, go and move on either side do so in the merge (`contextdb.tables.merging.order`). What
the sides disagree about is in `conflicts`, and until somebody decides it ours holds. The result keeps the source of ours, so
that saving it changes only lines that theirs changed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Generic

from contextdb.cells.conditions import Condition
from contextdb.cells.outputs import Output
from contextdb.columns import TextColumn
from contextdb.schema.jobs import JOB_KEYS, JOBS
from contextdb.schema.sections import job_faults
from contextdb.schema.settings import Schema, TableSettings, settings_renamed, with_outputs
from contextdb.tables.changes import CameFrom, Edit
from contextdb.tables.data import AnyTable, TableData
from contextdb.tables.merging.alignment import align
from contextdb.tables.merging.building import edit_under
from contextdb.tables.merging.cells import merge_column
from contextdb.tables.merging.conflicts import Conflict, Decided, Side
from contextdb.tables.merging.order import Origins
from contextdb.tables.merging.structure import merge_columns, merge_rows


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
    """The merged texts."""
    settings: TableSettings
    schema: Schema
    conflicts: tuple[Conflict, ...]
    """What is not decided yet, by row; until then `columns` has it as ours."""
    decided: Decided

    @cached_property
    def table(self) -> AnyTable:
        """The merged table, with the source of ours: saving it changes only lines that theirs changed."""
        return self.edit_of_ours().apply(self.ours)

    def edit_of_ours(self, name: str = "Merge") -> Edit:
        """The edit that makes ours the merge."""
        return self._edit(self.ours, self.rows.ours, self.fields.ours, name)

    def edit_of_theirs(self, name: str = "Merge") -> Edit:
        """The edit that makes theirs the merge."""
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
    rows, about_rows = merge_rows(base, ours, theirs, of_ours, of_theirs, decided)
    merged = [
        merge_column((base, ours, theirs), rows, (int(b), int(o), int(t)), name, decided)
        for b, o, t, name in zip(fields.base, fields.ours, fields.theirs, names, strict=True)
    ]
    columns = tuple(column for column, _ in merged)
    schema = _schema(base.schema, ours.schema, theirs.schema)
    settings = _settings(base, ours, theirs, fields, names, schema)
    asset = next((c for c in columns if c.name == settings.asset), columns[0])
    cells = sorted((one for _, found in merged for one in found), key=lambda one: one.row or 0)
    named = tuple(replace(one, asset=asset[one.row] if one.row is not None else "") for one in cells)
    return Merge(base, ours, theirs, rows, fields, columns, settings, schema, (*about_columns, *about_rows, *named), decided)


# ---- what is said of the columns


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
    said: TableSettings = replace(ours.settings, **{key: mine[key] for key in (*JOB_KEYS, "fallback_outputs")})
    said = replace(said, typed=_merged_types(was["typed"], mine["typed"], yours["typed"]))
    for tried in (wanted, *({key: value} for key, value in wanted.items())):  # all at once, else what can be
        if not any(job_faults(now := replace(said, **tried), names, schema)):
            said = now
    return with_outputs(said, said.outputs)


def _merged_types(was: tuple[Output, ...], ours: tuple[Output, ...], theirs: tuple[Output, ...]) -> tuple[Output, ...]:
    """What is declared of outputs: as ours has it where ours changed it, else as theirs."""
    base, mine, yours = ({output.name: output for output in side} for side in (was, ours, theirs))
    found = [yours.get(name) if mine.get(name) == base.get(name) else mine.get(name) for name in {**mine, **yours}]
    return tuple(output for output in found if output is not None)


def _merged_names(was: tuple[str, ...], ours: tuple[str, ...], theirs: tuple[str, ...]) -> tuple[str, ...]:
    kept = [name for name in ours if name in theirs or name not in was]
    return (*kept, *(name for name in theirs if name not in kept and name not in was))


def _schema(base: Schema, ours: Schema, theirs: Schema) -> Schema:
    return ours if theirs is ours else replace(ours, conditions=merged_conditions(base, ours, theirs))


def merged_conditions(base: Schema, ours: Schema, theirs: Schema) -> dict[str, Condition]:
    """What is declared of conditions: as ours has it where ours changed it, else as theirs."""
    was, mine, yours = base.conditions, ours.conditions, theirs.conditions
    names = [*yours, *(name for name in mine if name not in yours)]
    found = {name: yours.get(name) if mine.get(name) == was.get(name) else mine.get(name) for name in names}
    return {name: condition for name, condition in found.items() if condition is not None}
