"""The test row's question put to a compiled table: with actors to cast for its roles, or with the rows of tables inside it.

Rows are those of the sheet. One that refers to another table is valid when some row of that table is; how many are is kept for it.
Where a table inside another cannot be read, the rows that refer to tables have no answer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Fact, read_fact_text
from contextdb.compiled.casting import Actor, CastMatches
from contextdb.compiled.explain import Explanation
from contextdb.compiled.matches import Matches
from contextdb.compiled.table import CompiledTable
from contextdb.errors import ContextDBError, ContextError, Fault
from contextdb.tables.compiling import compile_table
from contextdb.tables.nesting.flat import FlatTable
from contextdb.tables.nesting.links import inner_rows
from contextdb.tables.table import EitherTable, Table
from tui.model.behind import Inside

Offered = Mapping[str, Sequence[Actor]]
"""The actors of each role."""


def fact_fault(text: str, condition: Condition | None) -> Fault | None:
    """Why a text cannot be read as a fact of a condition; None where it can, or where there is nothing to read."""
    if condition is None or not text.strip():
        return None
    try:
        read_fact_text(text, condition)
    except ContextError as error:
        return error.faults[0]
    return None


class Asked:
    """A table that is asked with facts and actors."""

    def __init__(self, table: Table, facts: Mapping[str, Fact], actors: Offered) -> None:
        """`facts` are those that are given, without computed ones and those of roles that actors are offered for."""
        self.fault: Fault | None = None
        """Why the question cannot be put."""
        self._table = table
        self._inner = {row: name for name, rows in inner_rows(table).items() for row in rows}
        self.explained: Explanation | None = None
        """Why rows are valid or not; None where the question cannot be put."""
        try:
            self.flat: EitherTable = table.flat()
        except ContextDBError as error:
            self.flat, self.fault = table, error.faults[0]
        try:
            self.compiled = compile_table(self.flat)
            given = {name: fact for name, fact in facts.items() if fact is not None and name in self.compiled.asked}
            self.explained = CompiledTable(self.compiled).explain(given, unknown="any", actors=actors or None)
        except ContextError as error:
            self.fault = self.fault or error.faults[0]

    @property
    def matches(self) -> Matches | None:
        """The valid rows of the flat table."""
        return None if self.explained is None else self.explained.matches

    @cached_property
    def own(self) -> NDArray[np.int64]:
        """For each row that is asked the row of the sheet."""
        flat = self.flat
        return flat.expansion.rows[0].astype(np.int64) if isinstance(flat, FlatTable) else np.arange(flat.n_rows)

    @property
    def bits(self) -> int:
        """The valid rows of the sheet, as bits."""
        return 0 if self.matches is None else self._of_sheet(self.matches.bits)

    @cached_property
    def decided(self) -> int:
        """Those of them that are valid whatever is not known of the facts."""
        return 0 if self.explained is None else self._of_sheet(self.explained.matches.bits & ~self.explained.undecided)

    def of_sheet(self, rows: Rows) -> int:
        """The rows of the sheet that some rows of the flat table come from, as bits."""
        if not self._inner:
            return bits_of_rows(rows, self._table.n_rows)
        found = bitmask.to_int(bitmask.pack(np.bincount(self.own[rows], minlength=self._table.n_rows) > 0))
        if self.fault is not None:  # the flat table could not be made: rows that refer to others have no answer
            found &= ~sum(1 << row for row in self._inner)
        return found

    def _of_sheet(self, bits: int) -> int:
        return self.of_sheet(bitmask.rows(bitmask.from_int(bits, self.flat.n_rows))) if self._inner else bits

    def rows_of(self, row: int) -> Rows:
        """The rows of the flat table that come from a row of the sheet."""
        return np.flatnonzero(self.own == row)

    def valid_rows(self, row: int) -> list[int]:
        """The valid rows of the flat table that come from a row of the sheet."""
        if self.matches is None:
            return []
        indices = self.matches.indices
        return [int(r) for r in indices[self.own[indices] == row]]

    def inside(self, row: int) -> Inside | None:
        """What is behind a row of the sheet; None for the row of an asset."""
        name = self._inner.get(row)
        if name is None:
            return None
        if self.fault is not None or self.matches is None:
            return Inside(name, 0, fault=self.fault)
        return Inside(name, int(self._n_own[row]), int(self._n_valid[row]))

    @cached_property
    def _n_own(self) -> NDArray[np.int64]:
        return np.bincount(self.own, minlength=self._table.n_rows)

    @cached_property
    def _n_valid(self) -> NDArray[np.int64]:
        rows = self.matches.indices if self.matches is not None else np.empty(0, np.int64)
        return np.bincount(self.own[rows], minlength=self._table.n_rows)

    def casting(self, row: int) -> dict[str, str]:
        """Who plays each role in a valid row, by name; nothing for others."""
        rows = self.valid_rows(row)
        if not rows or not isinstance(self.matches, CastMatches):
            return {}
        return {role: str(actor.get("name", "")) for role, actor in self.matches.casting(rows[0]).items()}


def bits_of_rows(rows: Rows, n_rows: int) -> int:
    """Rows of a table as bits."""
    flags = np.zeros(n_rows, np.bool_)
    flags[rows] = True
    return bitmask.to_int(bitmask.pack(flags))
