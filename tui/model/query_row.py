"""The test row: a context of one fact a condition, as texts, and what the table answers to it.

A fact is written as in `contextdb query`: a value, or a set of values as a cell; an empty one is left out of the question. A fact
that cannot be read has a fault and is left out too. Derived facts are computed, never typed. The answer is that of the compiled
table, in which what cannot be read never matches: see `tui.model.table_answer`.

A valid row is *undecided* where it only may be valid: its cells accept some values of a set, or its rule lacks a fact. Which of the
valid rows is picked is for `contextdb.compiled.pick` to say.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Flags, Rows
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Fact
from contextdb.cells.sets import Cell
from contextdb.compiled.explain import Explanation, Failure, RowExplanation, describe_fact, told_fact
from contextdb.compiled.pick import Outcome, percent
from contextdb.errors import ContextError, Fault, some
from contextdb.tables.readable import unreadable_rows
from contextdb.tables.table import Table
from contextdb.tables.variants import WholeTable

from .table_answer import Inside, Offered, QueriedTable, TableAnswer, bits_of_rows
from .wanted import Wanted

MOST_PLAYED = 50
"""So many rows that may be picked are looked at, to name the asset where it is one."""
MOST_EXPLAINED = 50
"""So many rows behind one row are looked through for the cells of it that keep actors from a role."""


class QueryRow:
    """The facts of the test row, and the answer of the table it was last displayed for."""

    def __init__(self, table: Table) -> None:
        self.texts: dict[str, str] = {}
        """The facts as they are written, also those of conditions that the table does not ask for at present."""
        self.facts: dict[str, Fact] = {}
        """The facts that the table asks for, computed ones with them; None where one is not given."""
        self.faults: dict[str, Fault] = {}
        self.actors: Offered = {}
        """Who may play each role. The facts of a role with actors are theirs, not those of the test row."""
        self._take(table, QueriedTable(table))

    def show(self, table: Table) -> None:
        """Answer for this table from now on; columns that are the same as before are not looked at again."""
        self._take(table, QueriedTable(table, self._queried))

    def _take(self, table: Table, queried: QueriedTable) -> None:
        self._table, self._queried = table, queried
        self._places = {column.condition.name: at for at, column in enumerate(table.conditions)}
        self.wanted = Wanted.of(self._queried.flat)
        self._read()

    @property
    def is_nested(self) -> bool:
        """Whether some row refers to another table."""
        return self._queried.is_nested

    @property
    def whole(self) -> WholeTable | None:
        """The rows of the sheet with the cells that they inherit, where the table is a variant whose base can be used."""
        return self._queried.sheet if isinstance(self._queried.sheet, WholeTable) else None

    def set(self, condition: str, text: str) -> Fault | None:
        """Write one fact; an empty text leaves it out. Gives what is wrong with it."""
        self.texts[condition] = text
        self._read()
        return self.faults.get(condition)

    def offer(self, actors: Offered) -> None:
        """Offer actors for the roles, {role: [actor]}; roles without an actor are queried by the facts of the test row."""
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
        return tuple(c for name, c in self.wanted.conditions.items() if name not in self._places)

    @property
    def given(self) -> dict[str, Fact]:
        """The facts that are queried with: those that were typed, but for those of roles that actors are offered for."""
        facts = {name: self.facts[name] for name in self.wanted.given if self.role_of(name) is None}
        return {name: fact for name, fact in facts.items() if fact is not None}

    @property
    def is_empty(self) -> bool:
        return not self.actors and all(self.facts[name] is None for name in self.wanted.given)

    # ---- what the table answers

    @cached_property
    def _own(self) -> Explanation:
        """What the rows of the sheet alone say to the facts of the test row, without actors and the tables inside."""
        return self._answer_of({}).explained

    @cached_property
    def answer(self) -> TableAnswer | None:
        """The answer of the table with its actors and the tables inside it; None where it cannot be asked."""
        try:
            return self._answer_of(self.actors, is_flat=True)
        except ContextError:
            return None

    def _answer_of(self, actors: Offered, is_flat: bool = False) -> TableAnswer:
        queried = self._queried
        if is_flat and (actors or queried.is_nested):
            return TableAnswer(queried, queried.compiled_flat, self.given, actors)
        if not is_flat and not self.actors and not queried.is_nested and self.answer is not None:
            return self.answer
        names = None if self.actors else frozenset(name for name in self._places if self.facts[name] is not None)
        return TableAnswer(queried, queried.compiled(names), self.given, actors)

    def answers(self) -> Iterator[tuple[str, bool]]:
        """The assets of the table, those behind its rows instead of these, and whether each is valid."""
        if self.answer is not None:
            yield from zip(self.answer.matches.table_assets, self.answer.matches.flags.tolist(), strict=True)

    @property
    def bits(self) -> int:
        """The valid rows as an integer, those with them that only may be valid."""
        return self.answer.bits if self.answer is not None else 0

    @property
    def undecided(self) -> int:
        """The valid rows that only may be so, as an integer."""
        return self.answer.undecided if self.answer is not None else 0

    def excluded_by_rule(self, rows: Sequence[int] | Rows) -> NDArray[np.bool_]:
        """Which of some rows their own rule excludes: bool [rows]; with actors those too whose rule holds for no casting."""
        excluded, when = self._own.breaks_rule[np.asarray(rows, np.int64)], self._table.settings.when
        if self.actors:
            excluded = excluded | [any(f.condition == when for f in self.failures(int(row))) for row in rows]
        return excluded

    def open_facts(self, row: int) -> tuple[str, ...] | None:
        """The facts that a row's own rule lacks, or has a set of, so that it is open; None where it is decided."""
        if not self.undecided >> row & 1 or self._own.decided(1 << row):
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
        inputs_named = dict.fromkeys(one for some_names in inputs for one in some_names)
        return tuple(name for name in inputs_named if self.facts.get(name) is None or isinstance(self.facts[name], Cell))

    @property
    def has_notes(self) -> bool:
        """Whether something is beside cells: who is cast, or how much of a table inside is valid."""
        return self.is_nested or bool(self.actors)

    def failures(self, row: int) -> tuple[Failure, ...]:
        """For a table with actors what keeps a row from being valid; of one that refers to a table what does in its own cells."""
        if not self.actors or self.answer is None or self.bits >> row & 1:
            return ()
        explained, is_one = self.answer.explained, row not in self._queried.inner
        failures = dict.fromkeys(f for flat in self.answer.rows_of(row)[:MOST_EXPLAINED] for f in explained.row(int(flat)).failures)
        own = (self._table.name, row)
        return tuple(f for f in failures if (is_one if f.step is None else (f.step.table, f.step.row) == own))

    def casting(self, row: int) -> dict[str, str]:
        """Who plays each role in a valid row, by name."""
        return self.answer.casting(row) if self.answer is not None else {}

    def inside(self, row: int) -> Inside | None:
        """What is behind a row that refers to another table, and how much of that is valid; None for other rows."""
        inside = self.answer.inside(row) if self.answer is not None else None
        return replace(inside, n_valid=None) if inside is not None and self.is_empty else inside

    # ---- what is picked

    @cached_property
    def outcome(self) -> Outcome:
        """What the table's policy makes of the valid rows; of the flat table where tables are in this one."""
        if self.answer is None:
            compiled = self._queried.compiled_flat
            return Outcome(compiled, compiled.matches(0))
        return Outcome(self.answer.compiled, self.answer.matches)

    @cached_property
    def picked(self) -> int:
        """The valid rows that may be picked, as an integer."""
        return self._queried.bits_of_sheet(bits_of_rows(self.outcome.candidates, self._queried.flat.n_rows))

    def standing(self, row: int) -> str:
        """How a valid row stands with the policy: "picked, chance 40 %", "outranked by B (priority 5)"; nothing for others."""
        return self.outcome.said_of(self._valid_rows(row)) if self.bits >> row & 1 else ""

    def _valid_rows(self, row: int) -> list[int]:
        return self.answer.valid_rows(row) if self.answer is not None else []

    def brief(self, row: int) -> str:
        """How a valid row stands, in the fewest words: "40 %", "outranked by B"; nothing for one that is picked in any case."""
        if not self.bits >> row & 1 or self.outcome.refusal is not None:
            return ""
        own = self._valid_rows(row)
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
    def pickable(self) -> list[str]:
        """The assets that may be picked, in the order of the table; else the fallback."""
        rows = self.outcome.candidates[:MOST_PLAYED].tolist() if self.answer is not None else []
        assets = list(dict.fromkeys(self.outcome.compiled.assets[row] for row in rows))
        return assets or [name for name in (self._table.settings.fallback,) if name]

    @property
    def headline(self) -> str:
        """What plays for these facts, how many rows are valid, and how many of those the policy passes over."""
        rows = self.outcome.candidates
        assets = list(dict.fromkeys(self.outcome.compiled.assets[row] for row in rows[:MOST_PLAYED].tolist()))
        if self.outcome.refusal is not None:
            plays = "none is picked: the policy is unique"
        elif not assets:
            fallback = self._table.settings.fallback
            plays = f"plays the fallback {fallback}" if fallback else "nothing plays"
        else:
            plays = f"plays {assets[0]}" if len(assets) == 1 else f"plays one of {len(rows):,}"
        n_passed_over = 0 if self.outcome.refusal is not None else len(self.outcome.rows) - len(rows)
        return " · ".join([plays, *self._counts, *([f"{n_passed_over:,} outranked"] if n_passed_over else [])])

    @property
    def summary(self) -> str:
        """How many rows are valid, and what is played where that is none of them."""
        parts = self._counts
        if self.outcome.refusal is not None:
            parts.append("none is picked: the policy is unique")
        elif not len(self.outcome.candidates) and self._table.settings.fallback:
            parts.append(f"the fallback {self._table.settings.fallback} plays")
        return ", ".join(parts)

    @property
    def _counts(self) -> list[str]:
        n_sure = self.n_valid - self.n_undecided
        return [f"{n_sure:,} valid", *([f"{self.n_undecided:,} may be"] if self.n_undecided else [])]

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
        words = np.array([bitmask.from_int(bits, self._table.n_rows) for bits in (self.bits, self.undecided, self.picked)])
        marks = words[:, rows >> 6] >> (rows & 63).astype(np.uint64) & np.uint64(1) == 1
        return list(map(tuple, marks.T.tolist()))

    def leaves(self, condition: str) -> int | None:
        """How many rows the fact alone leaves; None when it is not requested."""
        at = self._asked_at(condition)
        return None if at is None else int(bitmask.count(self._own.accepted[at]))

    def accepts_every(self, condition: str, row: int) -> bool:
        """Whether the cell of a row accepts every value of its fact."""
        at = self._asked_at(condition)
        return at is None or bool(self._own.compiled.condition_bits(at, self.facts[condition])[1] >> row & 1)

    def _asked_at(self, condition: str) -> int | None:
        """Where a condition is among those that are asked; None without a fact of the test row."""
        has_fact = self.facts.get(condition) is not None and self.role_of(condition) is None
        return self._own.compiled.places.get(condition) if has_fact else None

    def fact_text(self, condition: Condition) -> str:
        """A fact of the test row with its unit, as `explain` says it; empty without one."""
        fact = self.facts.get(condition.name)
        if fact is None:
            return ""
        at = self._asked_at(condition.name)
        text = describe_fact(fact, condition) if at is None else told_fact(self._own.compiled, at, fact)
        return f"{text} {condition.unit}".rstrip()

    def failing(self, rows: Sequence[int] | Rows) -> NDArray[np.bool_]:
        """Which cells of some rows fail: bool [rows, conditions], the conditions in the order of the table."""
        chosen = np.asarray(rows, np.int64)
        fails = np.zeros((len(chosen), len(self._places)), np.bool_)
        fails[:, [self._places[c.name] for c in self._own.compiled.conditions]] = self._own.failing(chosen)
        if self.actors:
            self._mark_roles(fails, chosen)
        return fails

    def _mark_roles(self, fails: NDArray[np.bool_], rows: Rows) -> None:
        """Mark the cells that keep actors from a role; the whole role where nobody is left for it."""
        for i, row in enumerate(rows.tolist()):
            wrong = {failure.condition for failure in self.failures(row)}
            for name, at in self._places.items():
                role = self.role_of(name)
                if role is not None and (name in wrong or (role in wrong and not self._table.conditions[at].cell(row).is_any)):
                    fails[i, at] = True

    def nearest(self, most: int = 5) -> list[RowExplanation]:
        """The rows nearest to valid, each with its failing cells and what would mend them."""
        unreadable = unreadable_rows(self._table)
        explained = self._own if self.is_nested or self.answer is None else self.answer.explained
        nearest = explained.nearest(most + min(int(unreadable.sum()), 1000))
        return [row for row in nearest if not unreadable[row.row]][:most]

    def _read(self) -> None:
        """Read the facts again; what they are answered is worked out when it is asked for."""
        self.facts, self.faults = self.wanted.read(self.texts, self.actors)
        for name in ("answer", "outcome", "picked", "_own"):
            self.__dict__.pop(name, None)
