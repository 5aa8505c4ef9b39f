"""Undo and redo: the tables that were, the edits between them, and which of them is on the disk.

Tables share what an edit does not touch, so a step back is the table that was there, with its source: its bytes are those it had.
Where tables are many and large only some are retained, and a step to another starts from the nearest before it and makes the
edits again. Nothing here touches the disk; whoever saves says so with `saved`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from contextdb.tables.changes import CameFrom, Edit
from contextdb.tables.table import Table

MOST_BYTES = 256 << 20
RECENT = 8
"""So many tables next to the present one are retained whatever they take."""


@dataclass(frozen=True)
class Step:
    """A step that was made, forwards or back: its name, and the row each row was before (-1: new); None when all rows stayed."""

    name: str
    came_from: CameFrom | None


class History:
    """The past, the present and the future of one table. `position` counts the edits that lie behind the present."""

    def __init__(self, table: Table, most_bytes: int = MOST_BYTES) -> None:
        self.table = table
        self.position = 0
        self._most_bytes = most_bytes
        self._edits: list[Edit] = []
        self._n_rows = [table.n_rows]
        """How many rows each state has."""
        self._cached = {0: table}
        self._pinned = {0}
        """States that are no result of an edit alone: the first, and those that were saved."""
        self._every = 1
        self._bytes = 0
        self._saved: int | None = 0

    def do(self, edit: Edit) -> Step:
        """Make an edit; what was undone before is then gone. One that changes nothing is no step. Raises TableError or SchemaError
        where the edit does not fit; nothing has changed."""
        if not edit.changes:
            return Step(edit.name, None)
        table = edit.apply(self.table)
        self._forget_future()
        self._bytes += _own_bytes(table, self.table)
        self._edits.append(edit)
        self._n_rows.append(table.n_rows)
        self.position += 1
        self.table = self._cached[self.position] = table
        self._thin_out()
        return self._step(self.position - 1, self.position)

    def undo(self) -> Step | None:
        """Take back the last edit; None when there is none."""
        return self.go(self.position - 1) if self.can_undo else None

    def redo(self) -> Step | None:
        """Make the edit again that was taken back last; None when there is none."""
        return self.go(self.position + 1) if self.can_redo else None

    def go(self, position: int) -> Step:
        """Go to the state after so many edits; the name is that of the edit nearest the present."""
        assert 0 <= position <= len(self._edits), "no such state"
        step = self._step(self.position, position)
        self.table = self._table_at(position)
        self.position = position
        return step

    @property
    def can_undo(self) -> bool:
        return self.position > 0

    @property
    def can_redo(self) -> bool:
        return self.position < len(self._edits)

    @property
    def names(self) -> list[str]:
        """The names of all edits, those taken back too; the first `position` of them are made."""
        return [edit.name for edit in self._edits]

    @property
    def undo_name(self) -> str | None:
        return self._edits[self.position - 1].name if self.can_undo else None

    @property
    def redo_name(self) -> str | None:
        return self._edits[self.position].name if self.can_redo else None

    @property
    def is_modified(self) -> bool:
        """Whether the table differs from what was loaded or saved last, as far as steps tell."""
        return self.position != self._saved

    def saved(self, table: Table) -> None:
        """The present table is on the disk, and this is how `Table.save` gave it back. Its past stays."""
        self.table = self._cached[self.position] = table
        self._pinned.add(self.position)
        self._saved = self.position
        later = [p for p in self._cached if p > self.position]
        for p in later:  # they were made of the source before
            del self._cached[p]
        self._pinned -= set(later)

    def based_on(self, table: Table, is_saved: bool) -> None:
        """The present texts are on another source now, that somebody else wrote; `is_saved` when the file holds just them."""
        self.saved(table)
        if not is_saved:
            self._saved = None

    def renewed(self, change: Callable[[Table], Table]) -> None:
        """Put every table that is retained, past ones too, under another schema."""
        self._cached = {position: change(table) for position, table in self._cached.items()}
        self.table = self._cached[self.position]

    def _step(self, start: int, stop: int) -> Step:
        forwards = range(start, stop) if stop > start else range(stop, start)
        name = self._edits[max(start, stop) - 1].name if stop != start else ""
        if not any(self._edits[i].moves_rows for i in forwards):
            return Step(name, None)
        origins = np.arange(self._n_rows[forwards[0]])
        for i in forwards:
            origins = np.append(origins, -1)[self._edits[i].came_from(self._n_rows[i])]
        return Step(name, origins if stop > start else where_now(origins, self._n_rows[stop]))

    def _table_at(self, position: int) -> Table:
        nearest = max(p for p in self._cached if p <= position)
        table = self._cached[nearest]
        for edit in self._edits[nearest:position]:
            table = edit.apply(table)
        self._cached[position] = table
        return table

    def _forget_future(self) -> None:
        del self._edits[self.position :], self._n_rows[self.position + 1 :]
        self._cached = {p: t for p, t in self._cached.items() if p <= self.position}
        self._pinned = {p for p in self._pinned if p <= self.position}
        if self._saved is not None and self._saved > self.position:
            self._saved = None

    def _thin_out(self) -> None:
        """Keep fewer tables of the past, and of those that are far back each second one less, until they take less."""
        while self._bytes > self._most_bytes and self._every <= len(self._edits):
            self._every *= 2
            self._cached = {p: t for p, t in self._cached.items() if self._is_retained(p)}
            tables = [self._cached[p] for p in sorted(self._cached)]
            self._bytes = sum(_own_bytes(b, a) for a, b in pairwise(tables))
        if self._every > 1 and not self._is_retained(self.position - RECENT):
            self._cached.pop(self.position - RECENT, None)

    def _is_retained(self, position: int) -> bool:
        return position in self._pinned or position > self.position - RECENT or position % self._every == 0


def where_now(came_from: CameFrom, n_before: int) -> CameFrom:
    """Where each row of before is now, -1 where it is gone; of a row that was copied, the first."""
    places = np.full(n_before + 1, -1, np.int64)
    places[came_from[::-1]] = np.arange(len(came_from))[::-1]
    return places[:n_before]


def _own_bytes(table: Table, before: Table) -> int:
    """About what a table takes next to the one before it: its own codes, and twice as much for the masks made of them."""
    shared = {id(c.codes) for c in before.columns}
    return sum(3 * c.codes.nbytes for c in table.columns if id(c.codes) not in shared)
