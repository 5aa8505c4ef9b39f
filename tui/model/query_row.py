"""The test row: a context of one fact a condition, as texts, and what the table answers to it.

A fact is written as in `contextdb query`: a value, or a set of values as a cell; an empty one is left out of the question. A fact
that cannot be read has a fault and is left out too. Derived facts are computed, never typed. Rows with a cell that cannot be read
are never valid. For each condition the mask of rows that accept its fact is kept, so a key pressed in one fact, or an edit in one
column, works out one mask again.

A valid row is *undecided* where it only may be valid: its cells accept some values of a set, or its rule lacks a fact. Which of the
valid rows is picked is for `contextdb.compiled.pick` to say.

Where actors are offered for a role, or rows refer to other tables, the compiled table is asked (`tui.model.asked`); where a table
inside cannot be read, each table is asked by itself (`tui.model.behind`).
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from operator import and_

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Flags, Rows
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Fact
from contextdb.cells.numbers import NumberCells, holding
from contextdb.cells.sets import Cell
from contextdb.columns import TextColumn
from contextdb.compiled.data import CompiledData
from contextdb.compiled.explain import Explanation, Failure, RowExplanation, describe_fact
from contextdb.compiled.mask_bits import costs_of
from contextdb.compiled.matches import layered_penalties, with_penalties
from contextdb.compiled.pick import Outcome, percent
from contextdb.compiled.table import CompiledTable
from contextdb.errors import Fault, some
from contextdb.expressions.rules import WhenColumn, WhenRules
from contextdb.schema.settings import TableSettings
from contextdb.tables.compiling import compile_table
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import picking_of
from contextdb.tables.nesting.links import is_nested
from contextdb.tables.nesting.names import asset_name
from contextdb.tables.table import Table
from tui.model.asked import Asked, Offered, bits_of_rows
from tui.model.behind import Behind, Counts, Inside
from tui.model.wanted import Wanted, flat_of

MOST_EXPLAINED = 50
"""So many rows behind one row are looked through for the cells of it that keep actors from a role."""
FEW_CELLS = 32
"""Of a column with fewer distinct cells, each is asked; that takes less than its masks."""


class QueryRow:
    """The facts of the test row, and the answer of the table it was last shown."""

    def __init__(self, table: Table) -> None:
        self.texts: dict[str, str] = {}
        """The facts as they are written, also those of conditions that the table does not ask for at present."""
        self.facts: dict[str, Fact] = {}
        """The facts that the table asks for, computed ones with them; None where one is not given."""
        self.faults: dict[str, Fault] = {}
        self._columns: dict[str, ConditionColumn] = {}
        self._bits: dict[str, tuple[int, int]] = {}
        """By condition the rows whose cell accepts some value of its fact, and those whose cell accepts every one."""
        self._words: dict[str, NDArray[np.uint64]] = {}
        self._masks: dict[str, CompiledData | None] = {}
        """Columns that were asked again, compiled: a running game asks them many times a second. None for one asked once."""
        self._has_made_masks = False
        """Whether the present facts had masks of a column made."""
        self._readable: dict[str, int] = {}
        self.actors: Offered = {}
        """Who may play each role. The facts of a role with actors are theirs, not those of the test row."""
        self._answered: tuple[int, int] | None = None
        """The valid rows, and those of them that are decided, once they were asked for."""
        self._asked: Asked | None = None
        self._behind: Behind | None = None
        self._outcome: Outcome | None = None
        self._inner: dict[str, QueryRow] = {}
        self._rules: tuple[WhenColumn | None, WhenRules | None] | None = None
        self._rules_left: tuple[int, int] | None = None
        self._ranked: tuple[TableSettings, tuple[object, ...], CompiledData] | None = None
        self._assets: TextColumn | None = None
        self.is_nested = False
        """Whether some row refers to another table."""
        self._table = table
        self.show(table)

    def show(self, table: Table) -> None:
        """Answer for this table from now on; columns that are the same as before are not looked at again."""
        before, self._table = self._columns, table
        assets = table.text_column(table.asset_column)
        if assets is not self._assets:
            self._assets, self.is_nested = assets, is_nested(table)
        self._flat = flat_of(table) if self.is_nested else table
        self.wanted = Wanted.of(self._flat or table)
        self._columns = {c.condition.name: c for c in table.conditions}
        for gone in before.keys() - self._columns.keys():
            self._forget(gone)
        fresh = {name for name, column in self._columns.items() if before.get(name) is not column}
        for name in fresh:
            self._readable[name] = _readable(self._columns[name])
        self._read(fresh)

    def set(self, condition: str, text: str) -> Fault | None:
        """Write one fact; an empty text leaves it out. Gives what is wrong with it."""
        self.texts[condition] = text
        self._read()
        return self.faults.get(condition)

    def offer(self, actors: Offered) -> None:
        """Offer actors for the roles, {role: [actor]}; roles without an actor are asked by the facts of the test row."""
        self.actors = {role: list(team) for role, team in actors.items() if team}
        self._read()

    def role_of(self, condition: str) -> str | None:
        """The role that a condition belongs to, if actors are offered for it."""
        role, dot, _ = condition.partition(".")
        return role if dot and role in self.actors else None

    def load(self, texts: Mapping[str, str]) -> None:
        """Write all facts again: those not named are left out."""
        self.texts = dict(texts)
        self._read()

    def follow(self, texts: Mapping[str, str], actors: Offered) -> None:
        """Write all facts again, and offer other actors: `load` and `offer` in one."""
        self.texts = dict(texts)
        self.offer(actors)

    def is_computed(self, condition: str) -> bool:
        """Whether a fact is computed from others, and so never typed."""
        return condition in self.wanted.computed

    def text(self, condition: str) -> str:
        """What the test row says of a condition: the text that was typed, or the fact that was computed."""
        if not self.is_computed(condition):
            return self.texts.get(condition, "") if condition in self.wanted.given else ""
        fact = self.facts.get(condition)
        return "" if fact is None else describe_fact(fact, self.wanted.conditions[condition])

    @property
    def extra(self) -> tuple[Condition, ...]:
        """The conditions that the table asks for and has no column for: those of rules, of expressions, of tables inside it."""
        return tuple(c for name, c in self.wanted.conditions.items() if name not in self._columns)

    @property
    def given(self) -> dict[str, Fact]:
        """The facts that are asked with: those that were typed, but for those of roles that actors are offered for."""
        found = {name: self.facts[name] for name in self.wanted.given if self.role_of(name) is None}
        return {name: fact for name, fact in found.items() if fact is not None}

    @property
    def is_empty(self) -> bool:
        """Whether no fact is given."""
        return not self.actors and not self._asks_inside and all(self.facts[name] is None for name in self.wanted.given)

    @property
    def _asks_inside(self) -> bool:
        """Whether tables that rows refer to are asked, each by itself, for facts that this one has no condition for."""
        is_alone = self.is_nested and self._flat is None
        return is_alone and any(text.strip() for name, text in self.texts.items() if name not in self.wanted.given)

    @property
    def asked(self) -> Asked | None:
        """The question put to the compiled table, with actors or the rows of tables inside; None without such."""
        if self._asked is None and (self.actors or (self.is_nested and self._flat is not None)):
            self._asked = Asked(self._table, self.given, self.actors)
        return self._asked

    @property
    def behind(self) -> Behind | None:
        """The tables that rows refer to, each asked by itself; None where there are none, or the compiled table is asked."""
        if self._behind is None and self.is_nested and self.asked is None:
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
    def counts(self) -> Counts:
        """The rows of the table, those behind its rows counted instead of them."""
        if self.is_nested and self.asked is not None and self.asked.fault is None and self.asked.explained is not None:
            explained = self.asked.explained
            return Counts(self.asked.flat.n_rows, len(explained.matches), len(explained.matches) - explained.undecided.bit_count())
        n_rows, n_valid, n_decided = self._table.n_rows, self.n_valid, self.n_valid - self.n_undecided
        for row, inside in self.behind.items() if self.behind is not None else ():
            if inside.fault is None:
                n_rows += inside.n_rows - 1
                n_valid += (inside.n_valid or 1) - 1 if self.bits >> row & 1 else 0
        return Counts(n_rows, n_valid, n_decided)

    def answers(self) -> Iterator[tuple[str, bool]]:
        """The assets of the table, those behind its rows instead of these, and whether each is valid."""
        if self.is_nested and self.asked is not None and self.asked.matches is not None:
            yield from zip(self.asked.matches.table_assets, self.asked.matches.flags.tolist(), strict=True)
            return
        for row, asset in enumerate(self._table.assets):
            is_valid = bool(self.bits >> row & 1)
            if self.behind is not None and self.behind.inside(row) is not None:
                yield from ((name, is_valid and is_so) for name, is_so in self.behind.answers(row))
            else:
                yield asset_name(asset), is_valid

    @property
    def bits(self) -> int:
        """The valid rows as an integer, those with them that only may be valid."""
        return self._answer()[0]

    @property
    def undecided(self) -> int:
        """The valid rows that only may be so, as an integer."""
        may, decided = self._answer()
        return may & ~decided

    def _answer(self) -> tuple[int, int]:
        if self._answered is None:
            own = [bits for name, bits in self._bits.items() if self.role_of(name) is None]
            enabled = bitmask.to_int(bitmask.pack(self._table.enabled))
            able = reduce(and_, self._readable.values(), enabled & self._left_by_rules[0])
            may = reduce(and_, (some for some, _ in own), able)
            if self.asked is not None:
                may &= self.asked.bits
                decided = may & self.asked.decided
            else:
                decided = reduce(and_, (every for _, every in own), may & self._left_by_rules[1])
                may &= self.behind.bits if self.behind is not None else -1
                decided &= self.behind.decided if self.behind is not None else -1
            self._answered = may, decided
        return self._answered

    @property
    def _left_by_rules(self) -> tuple[int, int]:
        """The rows whose own rule, the cell of a `when` column, may hold, and those of which it does, or that have none."""
        if self._rules_left is None:
            everything, column = (1 << self._table.n_rows) - 1, self._table.when
            rules = self._rules_of(column)
            self._rules_left = everything, everything
            if column is not None and rules is not None:
                facts = {c.name: None if self.role_of(c.name) is not None else self.facts.get(c.name) for c in rules.conditions}
                read = everything & ~bitmask.to_int(bitmask.pack(np.isin(column.texts.codes, list(column.faults))))
                may = rules.left_with_care(read, read, facts, "any")[0]
                self._rules_left = may, rules.left_with_care(read, read, facts, "never")[1]
        return self._rules_left

    def _rules_of(self, column: WhenColumn | None) -> WhenRules | None:
        """The rules compiled; those of a column that is the same as before are not compiled again."""
        if self._rules is None or self._rules[0] is not column:
            self._rules = column, WhenRules.of(column)
        return self._rules[1]

    def excluded_by_rule(self, rows: Sequence[int] | Rows) -> NDArray[np.bool_]:
        """Which of some rows their own rule excludes: bool [rows]; with actors those too whose rule holds for no casting."""
        left, when = self._left_by_rules[0], self._table.settings.when
        by_cast = (any(f.condition == when for f in self.failures(int(row))) if self.actors else False for row in rows)
        return np.array([not left >> int(row) & 1 or cast for row, cast in zip(rows, by_cast, strict=True)], np.bool_)

    def open_facts(self, row: int) -> tuple[str, ...] | None:
        """The facts that a row's own rule lacks, or has a set of, so that it is open; None where it is decided."""
        if self._left_by_rules[1] >> row & 1 or not self._left_by_rules[0] >> row & 1 or not self.undecided >> row & 1:
            return None
        rule = self._table.when.rule(row) if self._table.when is not None else None
        return () if rule is None else self.lacking(rule.names)

    def lacking(self, names: Sequence[str]) -> tuple[str, ...]:
        """Of some facts, and of those that they are computed from, those that are missing or a set."""
        derivation = self.wanted.derivation
        inputs = (
            [c.name for c in derivation.only([name]).inputs] if derivation is not None and self.is_computed(name) else [name]
            for name in names
        )
        found = dict.fromkeys(one for some_names in inputs for one in some_names)
        return tuple(name for name in found if self.facts.get(name) is None or isinstance(self.facts[name], Cell))

    @property
    def has_notes(self) -> bool:
        """Whether something is beside cells: who is cast, or how much of a table inside is valid."""
        return self.is_nested or bool(self.actors)

    def failures(self, row: int) -> tuple[Failure, ...]:
        """For a table with actors what keeps a row from being valid; of one that refers to a table what does in its own cells."""
        explained = self.asked.explained if self.actors and self.asked is not None else None
        if explained is None or self.asked is None or self.asked.fault is not None or self.bits >> row & 1:
            return ()
        of_ways = (explained.row(int(flat)).failures for flat in self.asked.rows_of(row)[:MOST_EXPLAINED])
        found = [
            f for failures in of_ways for f in failures if f.step is None or (f.step.table, f.step.row) == (self._table.name, row)
        ]
        is_one = self.asked.inside(row) is None
        return tuple(f for f in dict.fromkeys(found) if is_one or f.step is not None)

    def casting(self, row: int) -> dict[str, str]:
        """Who plays each role in a valid row, by name."""
        return self.asked.casting(row) if self.asked is not None and self.bits >> row & 1 else {}

    def inside(self, row: int) -> Inside | None:
        """What is behind a row that refers to another table, and how much of that is valid; None for other rows."""
        asked = self.asked or self.behind
        found = asked.inside(row) if asked is not None and self.is_nested else None
        if found is None:
            return None
        n_valid = None if self.is_empty else found.n_valid if self.bits >> row & 1 else 0
        return replace(found, n_valid=n_valid)

    # ---- what is picked

    @property
    def outcome(self) -> Outcome:
        """What the table's policy makes of the valid rows; of the flat table where tables are in this one."""
        if self._outcome is None:
            asked = self.asked
            if asked is not None and asked.fault is None and asked.matches is not None:
                found = may = asked.matches
                if not self.is_nested:
                    may = with_penalties(asked.compiled.matches(self.bits), lambda: layered_penalties(found))
                self._outcome = Outcome(asked.compiled, may)
            else:
                compiled = self._ranks()
                self._outcome = Outcome(compiled, with_penalties(compiled.matches(self.bits), self._costs))
        return self._outcome

    def _ranks(self) -> CompiledData:
        """The policy, priorities and weights of the rows, and how specific they are, without their cells: those are answered for
        here. Columns that are the same as before are not read again."""
        table, settings = self._table, replace(self._table.settings, when=None, enabled=None, assume=())
        names = (table.asset_column, settings.priority, settings.weight)
        columns: list[object] = [table.text_column(name) for name in names if name is not None]
        if settings.policy == "specific":
            columns += [*table.conditions, None if table.when is None else table.when.texts]
        known = self._ranked
        if (
            known is None
            or known[0] != settings
            or len(known[1]) != len(columns)
            or any(a is not b for a, b in zip(known[1], columns, strict=True))
        ):
            compiled = replace(compile_table(replace(table, conditions=(), settings=settings)), picking=picking_of(table))
            self._ranked = known = settings, tuple(columns), compiled
        return known[2]

    def _costs(self) -> NDArray[np.float64]:
        """What the soft cells of each row cost with the facts of the test row: float64 [1, n_rows]."""
        costs = np.zeros((1, self._table.n_rows))
        for name, column in self._columns.items():
            fact = self.facts.get(name)
            if column.soft is not None and fact is not None and self.role_of(name) is None:
                costs += costs_of(column.soft, fact)
        return costs

    @property
    def picked(self) -> int:
        """The valid rows that may be picked, as an integer."""
        rows = self.outcome.candidates
        if self.is_nested and self.asked is not None and self.asked.fault is None:
            return self.asked.of_sheet(rows) & self.bits
        return bits_of_rows(rows, self._table.n_rows)

    def standing(self, row: int) -> str:
        """How a valid row stands with the policy: "picked, chance 40 %", "outranked by B (priority 5)"; nothing for others."""
        if not self.bits >> row & 1:
            return ""
        is_flat = self.is_nested and self.asked is not None and self.asked.fault is None
        own = self.asked.valid_rows(row) if is_flat and self.asked is not None else [row]
        return self.outcome.said_of(own)

    def brief(self, row: int) -> str:
        """How a valid row stands, in the fewest words: "40 %", "outranked by B"; nothing for one that is picked in any case."""
        if not self.bits >> row & 1 or self.outcome.refusal is not None:
            return ""
        is_flat = self.is_nested and self.asked is not None and self.asked.fault is None
        own = self.asked.valid_rows(row) if is_flat and self.asked is not None else [row]
        if self.outcome.picks_one_of(own):
            chance = self.outcome.chance(own)
            return percent(chance) if chance < 1.0 else ""
        return self.outcome.why_not(own[0]).partition(" (")[0] if own else ""

    def doubt(self, row: int) -> str:
        """Why a valid row only may be valid; nothing for one that is decided."""
        if not self.undecided >> row & 1:
            return ""
        lacking = self.open_facts(row)
        if lacking is None:
            return "may be valid: for some values of the facts"
        named = some(name for name in lacking)
        return f"may be valid: its rule needs {named}" if named else "may be valid: its rule has no value"

    @property
    def said(self) -> str:
        """How many rows are valid, and what is played where that is none of them."""
        n_sure = self.n_valid - self.n_undecided
        parts = [f"{n_sure:,} valid", *([f"{self.n_undecided:,} may be"] if self.n_undecided else [])]
        if self.outcome.refusal is not None:
            parts.append("none is picked: the policy is unique")
        elif not len(self.outcome.candidates) and self._table.settings.fallback:
            parts.append(f"the fallback {self._table.settings.fallback} plays")
        return ", ".join(parts)

    # ---- counts and marks

    @property
    def n_valid(self) -> int:
        """How many rows are valid, those with them that only may be."""
        return self.bits.bit_count()

    @property
    def n_undecided(self) -> int:
        """How many rows only may be valid."""
        return self.undecided.bit_count()

    @property
    def valid(self) -> Flags:
        """Whether each row is valid: bool [n_rows]."""
        return bitmask.flags_of(self.bits, self._table.n_rows)

    def marks(self, rows: Rows) -> list[tuple[bool, bool, bool]]:
        """Of some rows whether each is valid, only may be so, and may be picked."""
        words = [bitmask.from_int(bits, self._table.n_rows) for bits in (self.bits, self.undecided, self.picked)]
        return list(zip(*(_has(one, rows).tolist() for one in words), strict=True))

    def leaves(self, condition: str) -> int | None:
        """How many rows the fact alone leaves; None when it is not asked for."""
        if self.role_of(condition) is not None or condition not in self._bits:
            return None
        return self._bits[condition][0].bit_count() if self.facts.get(condition) is not None else None

    def accepts_every(self, condition: str, row: int) -> bool:
        """Whether the cell of a row accepts every value of its fact."""
        return bool(self._bits[condition][1] >> row & 1)

    def failing(self, rows: Sequence[int] | Rows) -> NDArray[np.bool_]:
        """Which cells of some rows fail: bool [rows, conditions], the conditions in the order of the table."""
        chosen = np.asarray(rows, np.int64)
        fails = np.zeros((len(chosen), len(self._columns)), np.bool_)
        for at, name in enumerate(self._columns):
            if self.facts.get(name) is not None and self.role_of(name) is None:
                fails[:, at] = ~_has(self._mask(name), chosen)
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
        explained = self.asked.explained if self.actors and self.asked is not None and not self.is_nested else self._explained()
        if explained is None:
            return []
        found = explained.nearest(most + min(n_unreadable, 1000))
        return [row for row in found if all(bits >> row.row & 1 for bits in self._readable.values())][:most]

    def _explained(self) -> Explanation:
        compiled = CompiledTable(compile_table(self._table))
        return compiled.explain({name: fact for name, fact in self.given.items() if name in compiled.asked}, unknown="any")

    def _read(self, fresh: Container[str] = ()) -> None:
        """Read the facts again, and answer the conditions whose fact is another one, or whose column is."""
        before = self.facts
        self.facts, self.faults = self.wanted.read(self.texts, self.actors)
        self._answered = self._asked = self._behind = self._rules_left = self._outcome = None
        self._has_made_masks = False
        for name, column in self._columns.items():
            if name in fresh or before.get(name) != self.facts[name]:
                self._words.pop(name, None)
                if name in fresh:
                    self._masks.pop(name, None)
                everything, fact = (1 << column.texts.n_rows) - 1, self.facts[name]
                self._bits[name] = (everything, everything) if fact is None else self._accepting(name, column, fact)

    def _accepting(self, name: str, column: ConditionColumn, fact: Fact) -> tuple[int, int]:
        """As `_accepting`; a column of many cells that is asked again is asked by its masks, which take long to make: those of one
        column at a time, where each cell need not be asked by itself."""
        if len(column.cells) < FEW_CELLS or column.soft is not None or column.faults:
            return _accepting(column, fact)
        masks = self._masks.get(name)
        if masks is None and name in self._masks and not (self._has_made_masks and isinstance(column.cells, NumberCells)):
            masks, self._has_made_masks = compile_table(_alone(column)), True
        self._masks[name] = masks
        return _accepting(column, fact) if masks is None else masks.condition_bits(0, fact)

    def _mask(self, name: str) -> NDArray[np.uint64]:
        if name not in self._words:
            self._words[name] = bitmask.from_int(self._bits[name][0], self._table.n_rows)
        return self._words[name]

    def _forget(self, name: str) -> None:
        self._bits.pop(name, None)
        self._words.pop(name, None)
        self._masks.pop(name, None)
        self._readable.pop(name, None)


def _accepting(column: ConditionColumn, fact: Fact) -> tuple[int, int]:
    """The rows whose cell accepts some value of a fact, and those whose cell accepts every one.

    Each distinct cell is asked, which for a column that has just been edited is cheaper than its masks; the masks are taken for the
    sets of values that a cell cannot be asked for one by one.
    """
    if isinstance(column.cells, NumberCells) and isinstance(fact, int | float):
        return (bits := _rows_of(column, holding(column.cells, fact))), bits
    if all(c.is_any for c in column.cells):  # a column of any type: the tables inside say of which
        return (1 << column.texts.n_rows) - 1, (1 << column.texts.n_rows) - 1
    if isinstance(fact, Cell):
        one = compile_table(_alone(column))
        return one.condition_bits(0, fact)
    bits = _rows_of(column, np.array([c.is_soft or c.holds(fact) for c in column.cells], np.bool_))
    return bits, bits


def _has(words: NDArray[np.uint64], rows: Rows) -> Flags:
    """Whether each of some rows is in a mask."""
    flags: Flags = (words[rows >> 6] >> (rows & 63).astype(np.uint64)) & np.uint64(1) == 1
    return flags


def _rows_of(column: ConditionColumn, holds: NDArray[np.bool_]) -> int:
    """The rows with some of a column's cells."""
    return bitmask.to_int(bitmask.pack(holds[column.texts.codes])) if len(holds) else 0


def _alone(column: ConditionColumn) -> Table:
    assets = TextColumn("", ("",), np.zeros(column.texts.n_rows, np.int32))
    return Table("", TableSettings(""), (assets, column.texts), (column,))


def _readable(column: ConditionColumn) -> int:
    if not column.faults:
        return (1 << column.texts.n_rows) - 1
    return bitmask.to_int(bitmask.pack(~np.isin(column.texts.codes, list(column.faults))))
