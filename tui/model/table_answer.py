"""A table as the test row queries it: compiled, with the rows of the tables inside it, and what it answers to facts and actors.

Rows are those of the sheet. One that refers to another table is valid when some row of that table is; their number is stored. What
cannot be read never matches; where tables do not go together, the rows that refer to others have no answer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Fact, read_fact_text
from contextdb.compiled.casting import Actor, CastMatches
from contextdb.compiled.choosing import choose_as
from contextdb.compiled.data import CompiledData
from contextdb.compiled.explain import Explanation
from contextdb.compiled.matches import Matches
from contextdb.compiled.table import CompiledTable
from contextdb.errors import ContextDBError, ContextError, Fault, plural
from contextdb.tables.compiling import compile_table
from contextdb.tables.nesting.flat import FlatTable
from contextdb.tables.nesting.links import inner_rows, is_nested
from contextdb.tables.readable import readable, refused_rows
from contextdb.tables.table import EitherTable, flat_table
from contextdb.tables.variants import as_displayed, is_variant

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


@dataclass(frozen=True, slots=True)
class Inside:
    """What is behind a row that refers to a table."""

    table: str
    n_rows: int = 0
    n_valid: int | None = None
    """None: nothing is queried."""
    fault: Fault | None = None
    """Why it cannot be queried."""

    @property
    def text(self) -> str:
        """How much of it is valid."""
        if self.fault is not None:
            return "cannot be used"
        return plural(self.n_rows, "row") if self.n_valid is None else f"{self.n_valid:,} of {plural(self.n_rows, 'row')}"


class QueriedTable:
    """A table that is queried, as far as it can be read."""

    def __init__(self, table: EitherTable, before: QueriedTable | None = None) -> None:
        """`before`: another version of it."""
        table = _with_inherited(table)
        self.is_nested = is_nested(table)
        """Whether some row refers to another table."""
        self.sheet: EitherTable = readable(table)
        """The rows of the sheet; of a variant with the cells that they inherit."""
        self.flat: EitherTable = self.sheet
        """The same with the rows of tables inside instead of those that refer to them."""
        self.refused = refused_rows(table, table.around or {}) if self.is_nested else {}
        """The rows that refer to a table that cannot be used, and why."""
        self.inner = {row: name for name, rows in inner_rows(table).items() for row in rows} if self.is_nested else {}
        self._names: frozenset[str] | None = None
        self._compiled: CompiledData | None = before._compiled if before is not None else None
        """The rows of the sheet, with the conditions of `_names`; at first those of the version before."""
        self._is_current = False
        try:
            self.flat = flat_table(self.sheet, self.sheet.around) if self.is_nested else self.sheet
        except ContextDBError as error:
            self.refused = dict.fromkeys(self.inner, error.faults[0])

    @property
    def n_rows(self) -> int:
        """The number of rows of the sheet."""
        return self.sheet.n_rows

    def compiled(self, names: frozenset[str] | None = None) -> CompiledData:
        """The rows of the sheet, with the conditions of some names alone; None: with all."""
        if self._compiled is None or not self._is_current or self._names != names:
            compiled = compile_table(self.sheet, names)
            if self._compiled is not None:
                choose_as(compiled, self._compiled)
            self._compiled, self._names, self._is_current = compiled, names, True
        return self._compiled

    @cached_property
    def compiled_flat(self) -> CompiledData:
        """The rows of the flat table."""
        return self.compiled() if self.flat is self.sheet else compile_table(self.flat)

    @cached_property
    def own(self) -> NDArray[np.int64]:
        """For each row of the flat table the row of the sheet."""
        flat = self.flat
        return flat.expansion.rows[0].astype(np.int64) if isinstance(flat, FlatTable) else np.arange(flat.n_rows)

    def bits_of_sheet(self, bits: int) -> int:
        """The rows of the sheet that some rows of the flat table come from, as bits."""
        if not self.inner:
            return bits
        rows = self.own[bitmask.rows(bitmask.from_int(bits, self.flat.n_rows))]
        return bits_of_rows(rows, self.n_rows) & ~bitmask.int_of(sorted(self.refused))


def _with_inherited(table: EitherTable) -> EitherTable:
    """A variant with the cells of its base, as far as that can be used; else the table itself."""
    if not is_variant(table):
        return table
    try:
        return as_displayed(table, table.around)
    except ContextDBError:
        return table


class TableAnswer:
    """What a table answers to facts and actors."""

    def __init__(self, table: QueriedTable, compiled: CompiledData, facts: Mapping[str, Fact], actors: Offered) -> None:
        """`facts` are those that are given, without computed ones and those of roles that actors are offered for; `compiled` has
        the rows of the flat table. Raises ContextError for actors that cannot be read."""
        self._table = table
        self.compiled = compiled
        given = {name: fact for name, fact in facts.items() if name in compiled.asked}
        self.explained: Explanation = CompiledTable(compiled).explain(given, unknown="any", actors=actors or None)
        """Why rows are valid or not."""

    @property
    def matches(self) -> Matches:
        """The valid rows of the flat table."""
        return self.explained.matches

    @cached_property
    def bits(self) -> int:
        """The valid rows of the sheet, as bits."""
        return self._table.bits_of_sheet(self.matches.bits)

    @cached_property
    def undecided(self) -> int:
        """Those of them that may not be valid, for what is not known of the facts."""
        undecided = self.explained.undecided
        return self.bits & ~self._table.bits_of_sheet(self.matches.bits & ~undecided) if undecided else 0

    def rows_of(self, row: int) -> Rows:
        """The rows of the flat table that come from a row of the sheet."""
        return np.flatnonzero(self._table.own == row) if self._table.inner else np.array([row])

    def row_of_sheet(self, flat: int) -> int:
        """The row of the sheet that a row of the flat table comes from."""
        return int(self._table.own[flat])

    def valid_rows(self, row: int) -> list[int]:
        """The valid rows of the flat table that come from a row of the sheet."""
        return [flat for flat in self.rows_of(row).tolist() if self.matches.bits >> flat & 1]

    def inside(self, row: int) -> Inside | None:
        """What is behind a row of the sheet; None for the row of an asset."""
        name = self._table.inner.get(row)
        if name is None:
            return None
        if row in self._table.refused:
            return Inside(name, fault=self._table.refused[row])
        return Inside(name, len(self.rows_of(row)), len(self.valid_rows(row)))

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
