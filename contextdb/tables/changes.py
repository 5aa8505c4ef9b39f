"""The kinds of change that edits are made of, each plain data that can be applied, written down and read back.

    Rows      which rows there are and in what order: insert, delete, duplicate, move, sort
    Cells     texts of some cells
    Columns   which columns there are, in what order and under what name: insert, delete, move, rename
    Sections  what contextdb.toml says: the table's settings, conditions, blueprints, selectors

A change never changes a table: `apply` gives a new one, and columns that it does not touch are shared. Texts are taken as they are,
readable or not. Nothing here touches the disk.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from contextdb.columns import TextColumn
from contextdb.errors import Fault, SchemaError, TableError
from contextdb.files.csv_source import name_faults
from contextdb.schema import sections
from contextdb.schema.settings import expression_faults, settings_renamed
from contextdb.tables.data import AnyTable, TableData, conditions_of, with_columns

CameFrom = NDArray[np.int64]
"""For each row the row it was before, or -1 for a new one."""

FEW_TEXTS = 8
"""Up to so many new texts are looked up one by one; for more, all texts of the column are indexed first."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Which rows there are: row i is what was row `came_from[i]`, or, where that is -1, new and empty (Any)."""

    came_from: CameFrom

    def apply(self, table: AnyTable) -> AnyTable:
        """The table with these rows; a row taken twice is new the second time."""
        taken, n_before = self.came_from, table.n_rows
        wrong = taken[(taken < -1) | (taken >= n_before)]
        if len(wrong):
            raise TableError(Fault(f"there is no row {int(wrong[0])}.", f"rows 0 to {n_before - 1}"))
        new, at_least_0 = np.flatnonzero(taken < 0), np.maximum(taken, 0)
        columns = [_with_rows(c, at_least_0, new) for c in table.columns]
        return with_columns(table, columns, self._origin(table.origin, n_before))

    def _origin(self, origin: CameFrom, n_before: int) -> CameFrom:
        taken = self.came_from
        first = np.full(n_before + 1, -1, np.int64)
        first[taken[::-1]] = np.arange(len(taken))[::-1]
        is_old = (taken >= 0) & (first[taken] == np.arange(len(taken)))
        now = np.full(len(taken), -1, np.int64)
        now[is_old] = origin[taken[is_old]]
        return now

    def to_json(self) -> dict[str, object]:
        """The change as plain data: runs of consecutive rows, each its first row (-1: new ones) and how many."""
        return {"change": "rows", "runs": list(_runs(self.came_from))}


@dataclass(frozen=True)
class Cells:
    """Texts of some cells: column to row to text."""

    texts: Mapping[str, Mapping[int, str]]

    def apply(self, table: AnyTable) -> AnyTable:
        changed = {name: _with_texts(table.text_column(name), texts) for name, texts in self.texts.items()}
        return with_columns(table, [changed.get(c.name, c) for c in table.columns], table.origin)

    def to_json(self) -> dict[str, object]:
        """The change as plain data: for each column the rows and their texts."""
        return {"change": "cells", "cells": [[name, list(t), list(t.values())] for name, t in self.texts.items()]}


@dataclass(frozen=True)
class Columns:
    """Which columns there are: the name of each, and what it was named before; None for a new, empty one."""

    layout: tuple[tuple[str, str | None], ...]

    def apply(self, table: AnyTable) -> AnyTable:
        """The table with these columns. Its settings and schema follow what was renamed."""
        faults = list(name_faults([name for name, _ in self.layout]))
        if faults or not self.layout:
            raise TableError(*faults or [Fault("the table has no columns.", "at least one column, the assets")])
        before = {c.name: c for c in table.columns}
        renamed = {old: new for new, old in self.layout if old is not None}
        conditions = dict(table.schema.conditions)
        for old, new in renamed.items():
            if old != new and old in conditions and new not in conditions:
                conditions[new] = replace(conditions[old], name=new)
        columns = [_column(table, before, new, old) for new, old in self.layout]
        schema = replace(table.schema, conditions=conditions)
        settings, known = settings_renamed(table.settings, renamed.get), {c.condition.name: c for c in table.conditions}
        moved = {new: known[old] for new, old in self.layout if old in known}
        by_condition = conditions_of(columns, schema, settings, moved)
        return replace(table, columns=tuple(columns), conditions=by_condition, settings=settings, schema=schema)

    def to_json(self) -> dict[str, object]:
        return {"change": "columns", "layout": self.layout}


@dataclass(frozen=True)
class Sections:
    """What changes in contextdb.toml, as plain data in its own form; what is not named stays.

    It becomes part of the file when the table is saved: see `contextdb.edits.schema_file`.
    """

    settings: Mapping[str, Any] = field(default_factory=dict)
    """Keys of the table's own section: `{"enabled": "Enabled", "fallback": None}`; None takes a key away."""
    parts: Mapping[str, Mapping[str, Mapping[str, object] | None]] = field(default_factory=dict)
    """Section to name to all keys: `{"conditions": {"speed": {"type": "number"}}}`; None takes the name away."""

    @classmethod
    def between(cls, before: TableData, after: TableData) -> Sections:
        """What leads from what one table says to what another says."""
        settings = sections.differences(sections.settings_to_dict(before.settings), sections.settings_to_dict(after.settings))
        old, new = sections.schema_to_dict(before.schema), sections.schema_to_dict(after.schema)
        parts = {section: cast(Any, sections.differences(old[section], new[section])) for section in sections.EDITED_SECTIONS}
        return cls(settings, {section: part for section, part in parts.items() if part})

    @property
    def is_empty(self) -> bool:
        return not self.settings and not any(self.parts.values())

    def apply(self, table: AnyTable) -> AnyTable:
        """The table under these settings and this schema; columns whose meaning stays are not read again."""
        schema = sections.schema_with(table.schema, self.parts)
        settings = sections.settings_with(table.settings, self.settings)
        names = [c.name for c in table.columns]
        faults = [*sections.job_faults(settings, names, schema), *sections.blueprint_faults(schema)]
        if "conditions" in self.parts or "assume" in self.settings:
            faults += expression_faults(replace(schema, tables={**schema.tables, settings.name: settings}))
        if faults:
            raise SchemaError(*faults)
        conditions = conditions_of(table.columns, schema, settings, {c.condition.name: c for c in table.conditions})
        return replace(table, conditions=conditions, settings=settings, schema=schema)

    def to_json(self) -> dict[str, object]:
        return {"change": "sections", "settings": dict(self.settings), "parts": {k: dict(v) for k, v in self.parts.items()}}


Change = Rows | Cells | Columns | Sections


def change_from_json(data: Mapping[str, Any]) -> Change:
    if data["change"] == "cells":
        return Cells({name: dict(zip(rows, texts, strict=True)) for name, rows, texts in data["cells"]})
    if data["change"] == "columns":
        return Columns(tuple((new, old) for new, old in data["layout"]))
    if data["change"] == "sections":
        return Sections(data["settings"], data["parts"])
    parts = [np.arange(n) + first if first >= 0 else np.full(n, -1) for first, n in data["runs"]]
    return Rows(np.concatenate([np.empty(0, np.int64), *parts]))


@dataclass(frozen=True)
class Edit:
    """One step that a person takes: its name, and the changes it is made of, in order."""

    name: str
    changes: tuple[Change, ...]

    def apply(self, table: AnyTable) -> AnyTable:
        """The table after the edit. Raises TableError or SchemaError where the edit does not fit the table: a row or column that is
        missing, a name that appears twice."""
        for change in self.changes:
            table = change.apply(table)
        return table

    @property
    def moves_rows(self) -> bool:
        """Whether rows come, go or change their places."""
        return any(isinstance(change, Rows) for change in self.changes)

    def came_from(self, n_rows: int) -> CameFrom:
        """For each row after the edit the row it was before, -1 for a new one: int64; `n_rows` is how many there were before."""
        origins = np.arange(n_rows)
        for change in self.changes:
            if isinstance(change, Rows):
                origins = np.append(origins, -1)[change.came_from]
        return origins

    def to_json(self) -> dict[str, object]:
        """The edit as plain data, for a journal."""
        return {"name": self.name, "changes": [change.to_json() for change in self.changes]}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Edit:
        return cls(data["name"], tuple(change_from_json(change) for change in data["changes"]))


# ---- parts


def _with_rows(column: TextColumn, taken: CameFrom, new: CameFrom) -> TextColumn:
    """The column with rows `taken`, of which those at `new` are empty."""
    if not len(new):
        return column.with_rows_taken(taken)
    texts, [empty] = _codes(column.texts, [""])
    codes = column.codes[taken] if column.n_rows else np.empty(len(taken), np.int32)
    codes[new] = empty
    return TextColumn(column.name, texts, codes)


def _with_texts(column: TextColumn, texts: Mapping[int, str]) -> TextColumn:
    rows = np.fromiter(texts, np.int64, len(texts))
    if len(rows) and not (rows.min() >= 0 and rows.max() < column.n_rows):
        raise TableError(Fault(f"there is no row {int(rows.max())}.", f"rows 0 to {column.n_rows - 1}"))
    known, codes = _codes(column.texts, list(texts.values()))
    now = column.codes.copy()
    now[rows] = codes
    return TextColumn(column.name, known, now)


def _codes(known: tuple[str, ...], texts: Sequence[str]) -> tuple[tuple[str, ...], list[int]]:
    """The code of each text, and the texts known then: those that were, and behind them the new ones."""
    distinct = dict.fromkeys(texts)
    if len(distinct) <= FEW_TEXTS:
        code_of = {text: known.index(text) for text in distinct if text in known}
    else:
        code_of = {text: code for code, text in enumerate(known)}
    new = [text for text in distinct if text not in code_of]
    code_of |= {text: len(known) + i for i, text in enumerate(new)}
    return (*known, *new) if new else known, [code_of[text] for text in texts]


def _column(table: TableData, before: Mapping[str, TextColumn], name: str, old: str | None) -> TextColumn:
    if old is None:
        return TextColumn(name, ("",) if table.n_rows else (), np.zeros(table.n_rows, np.int32))
    if old not in before:
        table.text_column(old)  # says what is there
    return before[old] if old == name else before[old].renamed(name)


def _runs(taken: CameFrom) -> Iterator[list[int]]:
    if not len(taken):
        return
    is_new = taken < 0
    goes_on = (taken[1:] == taken[:-1] + 1) & ~is_new[:-1] | (is_new[1:] & is_new[:-1])
    starts = [0, *(np.flatnonzero(~goes_on) + 1).tolist(), len(taken)]
    for start, stop in pairwise(starts):
        yield [int(taken[start]), stop - start]
