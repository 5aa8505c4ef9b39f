"""The way of each row of a flat table through the tables that are in each other, as a compiled table keeps it.

D = depth, n = flat rows. A way tells the path of a row's name, where its rows are in their files, and which of two rows a
policy prefers: that of the table where their ways part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.words import MARK
from contextdb.compiled.layers import Layers
from contextdb.compiled.pick_columns import NOTHING, PickColumns
from contextdb.errors import Place
from contextdb.schema.policies import POLICIES, Policy, PolicyKind, ranks_of

Numbers = NDArray[np.int32]
Rows = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Step:
    """One row of a way: a row of a table, what its asset cell says, and where it is."""

    table: str
    row: int
    asset: str
    place: Place
    when: str | None = None
    """The table's column of rules."""

    def __str__(self) -> str:
        return str(self.place) if self.place.file else f'{self.place} of the table "{self.table}"'


class Placing(Protocol):
    """What knows where its rows stand: a table."""

    def place(self, row: int, /) -> Place:
        """The file and line of a row, where it has them."""
        ...


@dataclass(frozen=True, eq=False)
class WayTable:
    """What is kept of one table: R its rows."""

    name: str
    file: str | None
    policy: Policy
    priorities: NDArray[np.int64]
    """Higher first: [R]."""
    row_weights: NDArray[np.float64]
    lines: NDArray[np.int64] | None = None
    """The line of each row in its file, from 1, -1 where it has none: [R]. None where `table` tells it."""
    table: Placing | None = None
    when: str | None = None
    """Its column of rules."""
    picking: PickColumns = NOTHING
    """How specific its rows are, and how long they rest."""

    def place(self, row: int) -> Place:
        if self.table is not None:
            return self.table.place(row)
        line = -1 if self.lines is None else int(self.lines[row])
        return Place(self.file, None if line < 0 else line, None, row)

    @property
    def is_weighted(self) -> bool:
        """Whether chance decides between its rows, so that one of weight 0 is never picked."""
        return POLICIES[self.policy].choose == "chance"

    @cached_property
    def ranks(self) -> NDArray[np.float64]:
        """What its policy ranks rows by before chance, apart from costs, higher first: [R]."""
        return ranks_of(self.policy, self.priorities, self.picking.specificities)


@dataclass(frozen=True, eq=False)
class Ways:
    """The ways of all rows."""

    tables: tuple[WayTable, ...]
    """Every table once, the outer one first."""
    numbers: Numbers
    """Which of `tables` a way passes at each depth: int32 [D, n]; -1 below its end."""
    rows: Numbers
    """The row that it takes there: int32 [D, n]; -1 below its end."""
    leaves: Sequence[str]
    """The asset of each row without its path."""
    layers: tuple[Layers | None, ...]
    """For each condition what the tables of the ways say; None for one that none of them has, but a rule."""
    rules: Layers | None = None
    """The same for the rows' own rules."""

    def steps(self, row: int) -> tuple[Step, ...]:
        """The rows of a way, outermost first."""
        pairs = [(n, r) for n, r in zip(self.numbers[:, row].tolist(), self.rows[:, row].tolist(), strict=True) if n >= 0]
        assets = [*(MARK + self.tables[n].name for n, _ in pairs[1:]), self.leaves[row]]
        return tuple(self._step(n, r, asset) for (n, r), asset in zip(pairs, assets, strict=True))

    def table_at(self, row: int, depth: int) -> WayTable | None:
        """The table that a way passes at a depth; None below its end."""
        number = int(self.numbers[depth, row]) if depth < len(self.numbers) else -1
        return self.tables[number] if number >= 0 else None

    @cached_property
    def pickable(self) -> NDArray[np.bool_]:
        """Whether each row may be picked at all: no weight of its way is 0 where chance decides: bool [n]."""
        able = np.ones(self.rows.shape[1], np.bool_)
        for number, table in enumerate(self.tables):
            if table.is_weighted:
                for numbers, rows in zip(self.numbers, self.rows, strict=True):
                    here = np.flatnonzero(numbers == number)
                    able[here] &= table.row_weights[rows[here]] > 0.0
        return able

    @cached_property
    def resting(self) -> NDArray[np.int64]:
        """The rows that rest after they were picked, as a row of their way does, ascending."""
        at = [(self.numbers == n) & np.isin(self.rows, table.picking.limited) for n, table in enumerate(self.tables)]
        return np.flatnonzero(np.any(at, axis=(0, 1)))

    def preferred_to(self, row: int) -> NDArray[np.bool_]:
        """The rows that may be picked before a row, by the policy of the table where their ways part: bool [n]."""
        totals = np.zeros(self.rows.shape[1], np.bool_)
        alike = np.ones(len(totals), np.bool_)
        for depth, own in enumerate(self.rows[:, row].tolist()):
            table = self.table_at(row, depth)
            if table is None:
                break
            others = self.rows[depth]
            if POLICIES[table.policy].is_order:
                rows = np.flatnonzero(alike)
                totals[rows] |= (table.ranks[others[rows]] > table.ranks[own]) & self.pickable[rows]
            alike = alike & (others == own)
        return totals

    def policy_between(self, one: int, other: int) -> PolicyKind:
        """The policy of the table where the ways of two rows part."""
        parting = int(np.flatnonzero(self.rows[:, one] != self.rows[:, other])[0])
        table = self.table_at(one, parting)
        assert table is not None
        return POLICIES[table.policy]

    def _step(self, number: int, row: int, asset: str) -> Step:
        table = self.tables[number]
        return Step(table.name, row, asset, table.place(row), table.when)
