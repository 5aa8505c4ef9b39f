"""The test row's question put to a compiled table, with actors to cast for its roles.

Rows are those of the sheet. One that stands for another table is valid when some row of that table is; how many are is kept for it.
What a table inside another cannot answer, because it cannot be read, is told as a fault, and its rows are not valid.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.casting import Actor, CastMatches
from contextdb.compiled import CompiledTable
from contextdb.errors import ContextDBError, ContextError, Fault
from contextdb.explain import Explanation
from contextdb.facts import Fact, read_fact_text
from contextdb.matches import Matches
from contextdb.nesting.links import inner_rows
from contextdb.table import Table
from tui.model.behind import Inside

Offered = Mapping[str, Sequence[Actor]]
"""The actors of each role."""


class Asked:
    """A table that is asked with facts and actors."""

    def __init__(self, table: Table, texts: Mapping[str, str], actors: Offered) -> None:
        self.fault: Fault | None = None
        """Why the question cannot be put."""
        self._table, self._actors = table, actors
        self._inner = {row: name for name, rows in inner_rows(table).items() for row in rows}
        self._matches: Matches | None = None
        self._compiled: CompiledTable | None = None
        self._explained: Explanation | None = None
        try:
            self.flat = table.flat()
        except ContextDBError as error:
            self.flat, self.fault = table, error.faults[0]
        self.facts = facts_of(self.flat, texts, actors)
        try:
            self._compiled = replace(CompiledTable.of(self.flat), derivation=None)  # a derived fact is given like any other
            self._matches = self._compiled.query(self.facts, "any", actors)
        except ContextError as error:
            self.fault = self.fault or error.faults[0]

    @property
    def own(self) -> NDArray[np.int64]:
        """For each row that is asked the row of the sheet."""
        expansion = getattr(self.flat, "expansion", None)
        return np.arange(self.flat.n_rows) if expansion is None else expansion.rows[0].astype(np.int64)

    @property
    def bits(self) -> int:
        """The valid rows of the sheet, as bits."""
        if self._matches is None:
            return 0
        if not self._inner:
            return bitmask.to_int(self._matches.mask)
        counts = np.bincount(self.own[self._matches.indices], minlength=self._table.n_rows)[: self._table.n_rows]
        found = bitmask.to_int(bitmask.pack(counts > 0))
        if self.fault is not None:  # the flat table could not be made: rows that stand for others have no answer
            found &= ~sum(1 << row for row in self._inner)
        return found

    def inside(self, row: int) -> Inside | None:
        """What stands behind a row of the sheet; None for the row of an asset."""
        name = self._inner.get(row)
        if name is None:
            return None
        if self.fault is not None or self._matches is None:
            return Inside(name, 0, fault=self.fault)
        is_here = self.own == row
        return Inside(name, int(is_here.sum()), int(is_here[self._matches.indices].sum()))

    def casting(self, row: int) -> dict[str, str]:
        """Who plays each role in a valid row, by name; nothing for others."""
        flat_row = self._first_valid(row)
        if flat_row is None or not isinstance(self._matches, CastMatches):
            return {}
        return {role: str(actor.get("name", "")) for role, actor in self._matches.casting(flat_row).items()}

    def explain(self) -> Explanation | None:
        """Why rows are valid or not; None where the question cannot be put."""
        if self._explained is None and self._compiled is not None and self._matches is not None:
            self._explained = self._compiled.explain(self.facts, "any", self._actors)
        return self._explained

    def _first_valid(self, row: int) -> int | None:
        if self._matches is None:
            return None
        found = self._matches.indices[self.own[self._matches.indices] == row]
        return int(found[0]) if len(found) else None


def facts_of(table: Table, texts: Mapping[str, str], actors: Offered) -> dict[str, Fact]:
    """The facts that can be read, without those of roles that actors are offered for."""
    cast = {role + "." for role in actors}
    facts: dict[str, Fact] = {}
    for column in table.conditions:
        name = column.condition.name
        if name.startswith(tuple(cast)) or not texts.get(name, "").strip():
            continue
        try:
            facts[name] = read_fact_text(texts[name], column.condition)
        except ContextError:  # told where it stands, in the test row
            continue
    return facts
