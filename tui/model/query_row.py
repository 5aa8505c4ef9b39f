"""The test row: a context of one fact a condition, as texts, and what the table answers to it.

A fact is written as in `contextdb query`: a value, or a set of values as a cell; an empty one is left out of the question. A fact
that cannot be read has a fault and is left out too. Rows with a cell that cannot be read are never valid. For each condition the
mask of rows that accept its fact is kept, so a key pressed in one fact, or an edit in one column, works out one mask anew.

Where actors are offered for a role the compiled table is asked beside (`tui.model.asked`), and where rows stand for other tables
those tables are (`tui.model.behind`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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
from contextdb.condition_column import ConditionColumn
from contextdb.conditions import Condition
from contextdb.errors import ContextError, Fault
from contextdb.explain import Explanation, Failure, RowExplanation
from contextdb.facts import Fact, read_fact_text
from contextdb.nesting.links import is_nested
from contextdb.nesting.names import asset_name
from contextdb.schema import TableSettings
from contextdb.table import Table
from contextdb.when import WhenColumn, WhenRules
from tui.model.asked import Asked, Offered
from tui.model.behind import Behind, Inside


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
        self.actors: Offered = {}
        """Who may play each role. The facts of a role with actors are theirs, not those of the test row."""
        self._asked: Asked | None = None
        self._behind: Behind | None = None
        self._inner: dict[str, QueryRow] = {}
        self._rules: tuple[WhenColumn | None, WhenRules | None] | None = None
        self._rules_left: int | None = None
        self._assets: TextColumn | None = None
        self.is_nested = False
        """Whether some row stands for another table."""
        self._table = table
        self.show(table)

    def show(self, table: Table) -> None:
        """Answer for this table from now on; columns that are the same as before are not looked at again."""
        before, self._table = self._columns, table
        self._changed()
        assets = table.text_column(table.asset_column)
        if assets is not self._assets:
            self._assets, self.is_nested = assets, is_nested(table)
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
        self._changed()
        if condition in self._columns:
            self._answer(condition)
        return self.faults.get(condition)

    def offer(self, actors: Offered) -> None:
        """Offer actors for the roles, {role: [actor]}; roles without an actor are asked by the facts of the test row."""
        self.actors = {role: list(team) for role, team in actors.items() if team}
        self._changed()

    def role_of(self, condition: str) -> str | None:
        """The role that a condition belongs to, if actors are offered for it."""
        role, dot, _ = condition.partition(".")
        return role if dot and role in self.actors else None

    def load(self, texts: Mapping[str, str]) -> None:
        """Write all facts anew: those not named are left out."""
        self.texts = dict(texts)
        for condition in self._columns:
            self._answer(condition)

    @property
    def is_empty(self) -> bool:
        """Whether no fact is asked for."""
        return not self.actors and not self._asks_inside and all(fact is None for fact in self.facts.values())

    @property
    def _asks_inside(self) -> bool:
        """Whether tables that rows stand for are asked for facts that this one has no condition for."""
        return self.is_nested and any(text.strip() for name, text in self.texts.items() if name not in self._columns)

    @property
    def asked(self) -> Asked | None:
        """The question put to the compiled table, with actors; None without."""
        if self._asked is None and self.actors:
            self._asked = Asked(self._table, self.texts, self.actors)
        return self._asked

    @property
    def behind(self) -> Behind | None:
        """The tables that rows stand for, asked for the same facts; None where there is no such row."""
        if self._behind is None and self.is_nested:
            self._behind = Behind(self._table, self._ask)
        return self._behind

    def _ask(self, table: Table) -> QueryRow:
        if table.name not in self._inner:
            self._inner[table.name] = QueryRow(table)
        inner = self._inner[table.name]
        if inner._table is not table:
            inner.show(table)
        if inner.texts != self.texts:
            inner.load(self.texts)
        return inner

    @property
    def n_behind(self) -> tuple[int, int]:
        """The rows of the table, those behind its rows counted instead of them, and how many of these are valid."""
        n_rows, n_valid = self._table.n_rows, self.n_valid
        for row, inside in self.behind.items() if self.behind is not None else ():
            if inside.fault is None:
                n_rows += inside.n_rows - 1
                n_valid += (inside.n_valid or 1) - 1 if self.bits >> row & 1 else 0
        return n_rows, n_valid

    def answers(self) -> Iterator[tuple[str, bool]]:
        """The assets of the table, those behind its rows instead of these, and whether each is valid."""
        for row, asset in enumerate(self._table.assets):
            is_valid = bool(self.bits >> row & 1)
            if self.behind is not None and self.behind.inside(row) is not None:
                yield from ((name, is_valid and is_so) for name, is_so in self.behind.answers(row))
            else:
                yield asset_name(asset), is_valid

    @property
    def bits(self) -> int:
        """The valid rows as an integer."""
        if self._valid is None:
            enabled = bitmask.to_int(bitmask.pack(self._table.enabled))
            cells = [bits for name, bits in self._bits.items() if self.role_of(name) is None]
            self._valid = reduce(and_, (*cells, *self._readable.values()), enabled) & self._left_by_rules
            if self.asked is not None:
                self._valid &= self.asked.bits
            elif self.behind is not None:
                self._valid &= self.behind.bits
        return self._valid

    @property
    def _left_by_rules(self) -> int:
        """The rows whose own rule, the cell of a `when` column, does not exclude them."""
        if self._rules_left is None:
            everything, column = (1 << self._table.n_rows) - 1, self._table.when
            rules = self._rules_of(column)
            self._rules_left = everything
            if column is not None and rules is not None:
                facts = self._facts_of(rules)
                unreadable = np.isin(column.texts.codes, list(column.faults))
                left = rules.left_with_care(everything, everything, facts, "any")[0]
                self._rules_left = left & ~bitmask.to_int(bitmask.pack(unreadable))
        return self._rules_left

    def _facts_of(self, rules: WhenRules) -> dict[str, Fact]:
        """The facts that rules name, also those that no column asks for; None where one is not given, or is the actors'."""
        return {c.name: None if self.role_of(c.name) is not None else self._fact(c) for c in rules.conditions}

    def _fact(self, condition: Condition) -> Fact:
        if condition.name in self._columns:
            return self.facts.get(condition.name)
        try:
            return read_fact_text(self.texts.get(condition.name, ""), condition)
        except ContextError:
            return None

    def _rules_of(self, column: WhenColumn | None) -> WhenRules | None:
        """The rules compiled; those of a column that is the same as before are not compiled again."""
        if self._rules is None or self._rules[0] is not column:
            self._rules = column, WhenRules.of(column)
        return self._rules[1]

    def excluded_by_rule(self, rows: Sequence[int] | Rows) -> NDArray[np.bool_]:
        """Which of some rows their own rule excludes: bool [rows]."""
        left = self._left_by_rules
        return np.array([not left >> int(row) & 1 for row in rows], np.bool_)

    @property
    def has_notes(self) -> bool:
        """Whether something stands beside cells: who is cast, or how much of a table inside is valid."""
        return self.is_nested or bool(self.actors)

    def failures(self, row: int) -> tuple[Failure, ...]:
        """For a table with actors what keeps a row from being valid."""
        explained = self.asked.explain() if self.actors and self.asked is not None and not self.is_nested else None
        return explained.row(row).failures if explained is not None else ()

    def casting(self, row: int) -> dict[str, str]:
        """Who plays each role in a valid row, by name."""
        return self.asked.casting(row) if self.asked is not None and self.bits >> row & 1 else {}

    def inside(self, row: int) -> Inside | None:
        """What stands behind a row that stands for another table, and how much of that is valid; None for other rows."""
        asked = self.asked or self.behind
        found = asked.inside(row) if asked is not None and self.is_nested else None
        if found is None:
            return None
        n_valid = None if self.is_empty else found.n_valid if self.bits >> row & 1 else 0
        return replace(found, n_valid=n_valid)

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
        if self.role_of(condition) is not None:
            return None
        return self._bits[condition].bit_count() if self.facts.get(condition) is not None else None

    def failing(self, rows: Sequence[int] | Rows) -> NDArray[np.bool_]:
        """Which cells of some rows fail: bool [rows, conditions], the conditions in the order of the table."""
        chosen = np.asarray(rows, np.int64)
        fails = np.zeros((len(chosen), len(self._columns)), np.bool_)
        word, bit = chosen >> 6, (chosen & 63).astype(np.uint64)
        for at, name in enumerate(self._columns):
            if self.facts.get(name) is not None and self.role_of(name) is None:
                fails[:, at] = (self._mask(name)[word] >> bit) & np.uint64(1) == 0
        if self.actors:
            self._mark_roles(fails, chosen)
        return fails

    def _mark_roles(self, fails: NDArray[np.bool_], rows: Rows) -> None:
        """Mark the cells that keep actors from a role; the whole role where nobody is left for it."""
        names = list(self._columns)
        for i, row in enumerate(rows.tolist()):
            wrong = {failure.condition for failure in self.failures(row)}
            for at, name in enumerate(names):
                role = self.role_of(name)
                says_any = self._columns[name].cells[int(self._columns[name].texts.codes[row])].is_any
                if role is not None and (name in wrong or (role in wrong and not says_any)):
                    fails[i, at] = True

    def nearest(self, most: int = 5) -> list[RowExplanation]:
        """The rows nearest to valid, each with its failing cells and what would mend them."""
        n_unreadable = self._table.n_rows - reduce(and_, self._readable.values(), (1 << self._table.n_rows) - 1).bit_count()
        asked = self.asked if self.actors and not self.is_nested else None
        explained = asked.explain() if asked is not None else self._explained()
        if explained is None:
            return []
        found = explained.nearest(most + min(n_unreadable, 1000))
        return [row for row in found if all(bits >> row.row & 1 for bits in self._readable.values())][:most]

    def _explained(self) -> Explanation:
        compiled = replace(CompiledTable.of(self._table), derivation=None)  # here a derived fact is given like any other
        rules = self._rules_of(self._table.when)
        facts = {**({} if rules is None else self._facts_of(rules)), **self.facts}
        return compiled.explain({name: fact for name, fact in facts.items() if fact is not None}, unknown="any")

    def _changed(self) -> None:
        """Something else is asked, or of another table."""
        self._valid = self._asked = self._behind = self._rules_left = None

    def _answer(self, name: str) -> None:
        column, text = self._columns[name], self.texts.get(name, "")
        self._changed()
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
