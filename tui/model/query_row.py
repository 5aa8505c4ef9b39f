"""The test row: a context of one fact a condition, as texts, and what the table answers to it.

A fact is written as in `contextdb query`: a value, or a set of values as a cell; an empty one is left out of the question. A fact
that cannot be read has a fault and is left out too. Rows with a cell that cannot be read are never valid. For each condition the
mask of rows that accept its fact is kept, so a key pressed in one fact, or an edit in one column, works out one mask anew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import reduce
from operator import and_

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Flags, Rows
from contextdb.cells import Cell
from contextdb.columns import TextColumn
from contextdb.compiled import CompiledTable
from contextdb.errors import ContextError, Fault
from contextdb.explain import RowExplanation
from contextdb.facts import Fact, read_fact_text
from contextdb.schema import TableSettings
from contextdb.table import ConditionColumn, Table


class QueryRow:
    """The facts of the test row, and the answer of the table it was last shown."""

    def __init__(self, table: Table) -> None:
        self.texts: dict[str, str] = {}
        """The facts as they are written, also those of conditions that the table does not have at present."""
        self.facts: dict[str, Fact] = {}
        self.faults: dict[str, Fault] = {}
        self._columns: dict[str, ConditionColumn] = {}
        self._bits: dict[str, int] = {}
        self._words: dict[str, NDArray[np.uint64]] = {}
        self._readable: dict[str, int] = {}
        self._valid: int | None = None
        """The valid rows, once they were asked for."""
        self._table = table
        self.show(table)

    def show(self, table: Table) -> None:
        """Answer for this table from now on; columns that are the same as before are not looked at again."""
        before, self._table, self._valid = self._columns, table, None
        self._columns = {c.condition.name: c for c in table.conditions}
        for gone in before.keys() - self._columns.keys():
            self._forget(gone)
        for name, column in self._columns.items():
            if before.get(name) is not column:
                self._readable[name] = _readable(column)
                self._answer(name)

    def set(self, condition: str, text: str) -> Fault | None:
        """Write one fact; an empty text leaves it out. Gives what is wrong with it."""
        self.texts[condition] = text
        if condition in self._columns:
            self._answer(condition)
        return self.faults.get(condition)

    def load(self, texts: Mapping[str, str]) -> None:
        """Write all facts anew: those not named are left out."""
        self.texts = dict(texts)
        for condition in self._columns:
            self._answer(condition)

    @property
    def is_empty(self) -> bool:
        """Whether no fact is asked for."""
        return all(fact is None for fact in self.facts.values())

    @property
    def bits(self) -> int:
        """The valid rows as an integer."""
        if self._valid is None:
            enabled = bitmask.to_int(bitmask.pack(self._table.enabled))
            self._valid = reduce(and_, (*self._bits.values(), *self._readable.values()), enabled)
        return self._valid

    @property
    def n_valid(self) -> int:
        """How many rows are valid."""
        return self.bits.bit_count()

    @property
    def valid(self) -> Flags:
        """Whether each row is valid: bool [n_rows]."""
        n_rows = self._table.n_rows
        return bitmask.unpack(bitmask.from_int(self.bits, n_rows), n_rows)

    def leaves(self, condition: str) -> int | None:
        """How many rows the fact alone leaves; None when it is not asked for."""
        return self._bits[condition].bit_count() if self.facts.get(condition) is not None else None

    def failing(self, rows: Sequence[int] | Rows) -> NDArray[np.bool_]:
        """Which cells of some rows fail: bool [rows, conditions], the conditions in the order of the table."""
        chosen = np.asarray(rows, np.int64)
        fails = np.zeros((len(chosen), len(self._columns)), np.bool_)
        word, bit = chosen >> 6, (chosen & 63).astype(np.uint64)
        for at, name in enumerate(self._columns):
            if self.facts.get(name) is not None:
                fails[:, at] = (self._mask(name)[word] >> bit) & np.uint64(1) == 0
        return fails

    def nearest(self, most: int = 5) -> list[RowExplanation]:
        """The rows nearest to valid, each with its failing cells and what would mend them."""
        compiled = replace(CompiledTable.of(self._table), derivation=None)  # here a derived fact is given like any other
        context = {name: fact for name, fact in self.facts.items() if fact is not None}
        n_unreadable = self._table.n_rows - reduce(and_, self._readable.values(), (1 << self._table.n_rows) - 1).bit_count()
        found = compiled.explain(context, unknown="any").nearest(most + min(n_unreadable, 1000))
        return [row for row in found if all(bits >> row.row & 1 for bits in self._readable.values())][:most]

    def _answer(self, name: str) -> None:
        column, text, self._valid = self._columns[name], self.texts.get(name, ""), None
        self.faults.pop(name, None)
        self._words.pop(name, None)
        try:
            fact = read_fact_text(text, column.condition)
        except ContextError as error:
            fact = None
            self.faults[name] = error.faults[0]
        self.facts[name] = fact
        everything = (1 << column.texts.n_rows) - 1
        self._bits[name] = everything if fact is None else _accepting(column, fact)

    def _mask(self, name: str) -> NDArray[np.uint64]:
        if name not in self._words:
            self._words[name] = bitmask.from_int(self._bits[name], self._table.n_rows)
        return self._words[name]

    def _forget(self, name: str) -> None:
        for kept in (self.facts, self.faults, self._bits, self._words, self._readable):
            kept.pop(name, None)


def _accepting(column: ConditionColumn, fact: Fact) -> int:
    """The rows whose cell accepts some value of a fact.

    Each distinct cell is asked, which for a column that has just been edited is cheaper than its masks; the masks are taken for the
    sets of values that a cell cannot be asked for one by one.
    """
    if isinstance(fact, Cell):
        one = CompiledTable.of(_alone(column))
        return one.condition_bits(0, fact)[0]
    holds = np.array([c.is_soft or c.holds(fact) for c in column.cells], np.bool_)
    return bitmask.to_int(bitmask.pack(holds[column.texts.codes])) if len(holds) else 0


def _alone(column: ConditionColumn) -> Table:
    assets = TextColumn("", ("",), np.zeros(column.texts.n_rows, np.int32))
    return Table("", TableSettings(""), (assets, column.texts), (column,))


def _readable(column: ConditionColumn) -> int:
    if not column.faults:
        return (1 << column.texts.n_rows) - 1
    return bitmask.to_int(bitmask.pack(~np.isin(column.texts.codes, list(column.faults))))
