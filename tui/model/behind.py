"""What is behind the rows of a sheet that refer to other tables, where not all of these can be read together.

A row behind is valid when its own cells hold and those of the row that refers to its table. Each table is asked by itself, so that
a cell that cannot be read takes away its own row only. Tables that come back to themselves are not gone into.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

from contextdb.errors import ContextDBError, Fault, plural
from contextdb.tables.nesting.links import inner_rows, nesting_faults
from contextdb.tables.table import Table


@dataclass(frozen=True, slots=True)
class Inside:
    """What is behind a row that refers to a table."""

    table: str
    n_rows: int = 0
    n_valid: int | None = None
    """None: nothing is asked."""
    fault: Fault | None = None
    """Why it cannot be asked."""

    @property
    def text(self) -> str:
        """How much of it is valid."""
        if self.fault is not None:
            return "cannot be used"
        return plural(self.n_rows, "row") if self.n_valid is None else f"{self.n_valid:,} of {plural(self.n_rows, 'row')}"


class Counts(NamedTuple):
    """The rows of a table, those behind its rows counted instead of them."""

    n_rows: int
    n_valid: int
    """Of these the valid ones."""
    n_decided: int
    """Of those the ones that are valid whatever is not known."""


class Counted(Protocol):
    """A table that was asked."""

    @property
    def counts(self) -> Counts:
        """Its rows and those behind them."""
        ...

    def answers(self) -> Iterator[tuple[str, bool]]:
        """The assets of these rows, and whether each is valid."""
        ...


class Behind:
    """The rows behind those of one table."""

    def __init__(self, table: Table, ask: Callable[[Table], Counted]) -> None:
        """`ask` puts the question to another table."""
        self._rows = {row: name for name, rows in inner_rows(table).items() for row in rows}
        faults = {fault.place.row: fault for fault in nesting_faults(table, table.around or {})}
        self._found: dict[str, Inside] = {}
        self._asked: dict[str, Counted] = {}
        for row, name in self._rows.items():
            if name not in self._found:
                self._found[name] = Inside(name, fault=faults[row]) if row in faults else self._ask(table, name, ask)

    @property
    def bits(self) -> int:
        """The rows of the sheet that have a valid row behind them, or are the row of an asset, as bits; -1 but for the others."""
        bits = -1
        for row, name in self._rows.items():
            if not self._found[name].n_valid:
                bits &= ~(1 << row)
        return bits

    @property
    def decided(self) -> int:
        """Those of them that have a row behind them that is valid whatever is not known."""
        bits = self.bits
        for row, name in self._rows.items():
            if name not in self._asked or not self._asked[name].counts.n_decided:
                bits &= ~(1 << row)
        return bits

    def items(self) -> Iterator[tuple[int, Inside]]:
        """The rows that refer to tables, each with what is behind it."""
        return ((row, self._found[name]) for row, name in self._rows.items())

    def inside(self, row: int) -> Inside | None:
        """What is behind a row; None for the row of an asset."""
        return self._found.get(self._rows.get(row, ""))

    def answers(self, row: int) -> Iterator[tuple[str, bool]]:
        """The assets behind a row that refers to a table, and whether each is valid."""
        asked = self._asked.get(self._rows[row])
        return asked.answers() if asked is not None else iter(())

    def _ask(self, table: Table, name: str, ask: Callable[[Table], Counted]) -> Inside:
        try:
            inner = (table.around or {})[name]
            inner = inner if inner.around is not None else replace(inner, around=table.around)
            asked = self._asked[name] = ask(inner)
            n_rows, n_valid, _ = asked.counts
        except ContextDBError as error:
            return Inside(name, fault=error.faults[0])
        return Inside(name, n_rows, n_valid)
