"""The rules of a compiled table, queried with the facts of one context.

Masks are Python integers, row r as bit r. Each distinct rule stands once, with the rows that have it, and is computed at most once
for a question: when the cells leave one of its rows. A rule's truth is True, False, or open (None) where facts that it needs are
missing, or where it has no finite value.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, reduce
from operator import or_
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Flags, Rows, Words
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Fact, Unknown, describe
from contextdb.cells.grammar import format_cell
from contextdb.cells.sets import Cell
from contextdb.columns import TextColumn
from contextdb.errors import ContextError, Fault, Place, in_quotes, plural
from contextdb.expressions import Expression
from contextdb.expressions.boxes import Box, meets
from contextdb.expressions.columns import NO, UNKNOWN, Column, missing_rows, read_column, run_frame, taken
from contextdb.expressions.expression import NAN
from contextdb.expressions.rules.column import WhenColumn
from contextdb.expressions.scalar import Run, Value

FEW = 4
"""With so many times more rules than rows left, the rules are found by the rows."""
MOST_TOLD = 6
"""So many facts of a rule are named in a message."""


@dataclass(frozen=True, eq=False)
class Rule:
    """One distinct rule and the rows that have it."""

    expression: Expression
    rows: int

    def __reduce__(self) -> tuple[object, ...]:
        """What is worked out from the two is worked out again in another process."""
        return Rule, (self.expression, self.rows)

    @cached_property
    def run(self) -> Run:
        """Computes the truth from facts in canonical form, a missing number as NaN, another as None."""
        return self.expression.run

    @cached_property
    def true_boxes(self) -> list[Box] | None:
        """Where the rule is True, for facts that are known; None where boxes cannot tell."""
        return self.expression.as_boxes(True)

    @cached_property
    def false_boxes(self) -> list[Box] | None:
        """The same for False."""
        return self.expression.as_boxes(False)

    def truths(self, values: Mapping[str, Value], facts: Mapping[str, Fact]) -> tuple[bool | None, bool | None]:
        """Whether the rule is True for some value of set-valued facts, and for every one. Where that is not known the first is
        True and the second False; both are None where the rule is open without them.

        `values` are the facts as plans take them, sets as missing; `facts` in canonical form.
        """
        truth = self.run(values)
        if truth is not None:
            return bool(truth), bool(truth)
        own = {name: facts[name] for name in self.expression.names}
        if not any(isinstance(fact, Cell) for fact in own.values()):
            return None, None
        if self.true_boxes is None or self.false_boxes is None or None in own.values():
            return True, False
        is_anything = any(isinstance(fact, Cell) and fact.accepts is None for fact in own.values())
        return meets(self.true_boxes, own), not (is_anything or meets(self.false_boxes, own))


@dataclass(frozen=True, eq=False)
class WhenRules:
    """The distinct rules of a table's rows. Made by `WhenRules.of`."""

    texts: TextColumn
    """The column as it is written."""
    rules: tuple[Rule, ...]
    of_row: NDArray[np.int32]
    """The number of each row's rule; -1 for a row without one. int32 [n_rows]."""

    def __reduce__(self) -> tuple[object, ...]:
        """What computes the rules is functions, made again in another process."""
        return WhenRules, (self.texts, self.rules, self.of_row)

    @classmethod
    def of(cls, column: WhenColumn | None) -> WhenRules | None:
        """The rules of a column that can be read; None where no row has one, so that such a table pays nothing."""
        if column is None:
            return None
        held = set(np.unique(column.texts.codes).tolist())
        numbers: dict[str, int] = {}
        number_of = np.full(len(column.rules) + 1, -1, np.int32)
        for code, rule in enumerate(column.rules):
            if rule is not None and code in held:
                number_of[code] = numbers.setdefault(rule.text, len(numbers))
        if not numbers:
            return None
        of_row = number_of[column.texts.codes]
        read = {rule.text: rule for rule in column.rules if rule is not None}
        rows = [bitmask.to_int(bitmask.pack(of_row == number)) for number in numbers.values()]
        return cls(column.texts, tuple(Rule(read[t], r) for t, r in zip(numbers, rows, strict=True)), of_row)

    @property
    def name(self) -> str:
        return self.texts.name

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """The conditions that rules name, in the order of their first mention."""
        return tuple({c.name: c for rule in self.rules for c in rule.expression.conditions}.values())

    @cached_property
    def names(self) -> frozenset[str]:
        return frozenset(c.name for c in self.conditions)

    @cached_property
    def naming(self) -> Mapping[str, tuple[int, ...]]:
        """For each of these conditions the numbers of the rules that name it."""
        return {n: tuple(i for i, rule in enumerate(self.rules) if n in rule.expression.names) for n in sorted(self.names)}

    @cached_property
    def rows(self) -> int:
        return reduce(or_, (rule.rows for rule in self.rules))

    def numbers(self, left: int) -> Iterator[int]:
        """The numbers of the rules of some rows, each once."""
        left &= self.rows
        if FEW * left.bit_count() >= len(self.rules):
            return (n for n, rule in enumerate(self.rules) if rule.rows & left)
        return iter(dict.fromkeys(self._numbers_by_row(left)))

    def _numbers_by_row(self, left: int) -> Iterator[int]:
        while left:
            row = left.bit_length() - 1
            left ^= 1 << row
            yield int(self.of_row[row])

    def left_with_care(self, some: int, every: int, facts: Mapping[str, Fact], unknown: Unknown) -> tuple[int, int]:
        """Of rows that may and that always match by their cells those without a rule, or with one that is True. Facts are in
        canonical form, None where missing. Raises ContextError where a rule of a row is open, and `unknown` is "error"."""
        values = values_of(facts, self.conditions)
        for number in self.numbers(some):
            rule = self.rules[number]
            possible, always = rule.truths(values, facts)
            if possible is None and unknown == "error":
                raise no_value(rule.expression, values, self.name)
            if not (unknown == "any" if possible is None else possible):
                some &= ~rule.rows
            if not (unknown == "any" if always is None else always):
                every &= ~rule.rows
        return some, every & some


def values_of(facts: Mapping[str, Fact], conditions: tuple[Condition, ...]) -> dict[str, Value]:
    """Facts in canonical form as plans take them: a missing number as NaN, another missing fact or a set as None."""
    return {c.name: _value(facts.get(c.name), c) for c in conditions}


def _value(fact: Fact, condition: Condition) -> Value:
    if fact is None or isinstance(fact, Cell):
        return NAN if condition.domain.type.is_numeric else None
    return fact + 0.0 if type(fact) is float else fact


def no_value(rule: Expression, values: Mapping[str, Value], column: str) -> ContextError:
    """The error for a rule that is open though its facts are known: a division by 0, an overflow."""
    problem = f"the rule {in_quotes(rule.text)} has no finite value with {facts_text(rule, values)}."
    accepted = 'facts that it can be computed with, or unknown="any" or "never"'
    return ContextError(Fault(problem, accepted, place=Place(column=column), rule="missing-fact"))


def facts_text(rule: Expression, facts: Mapping[str, Fact | Value]) -> str:
    """The facts of a rule in words: speed = 3, gait = Walk."""
    phrases = [f"{c.name} = {_fact_text(facts.get(c.name), c)}" for c in rule.conditions]
    more = [f"{len(phrases) - MOST_TOLD} more"] if len(phrases) > MOST_TOLD else []
    return ", ".join([*phrases[:MOST_TOLD], *more]) or "no facts"


def _fact_text(fact: Fact | Value, condition: Condition) -> str:
    if isinstance(fact, Cell):
        return format_cell(fact, condition.domain)
    return describe(None if fact != fact else fact, condition.domain)


# ---- the rules of a compiled table, queried with the facts of many contexts: N contexts, W words a mask


MANY_ROWS = 32
"""With more rows than this left in a context, on average, rules are compared with whole masks instead of row by row."""

Side = tuple[Rows, Words]
"""The words of a mask that are not 0: where they are, and what they are."""


@dataclass(frozen=True, eq=False)
class ManyRules:
    """The rules of a table and the facts that they name, as columns of N contexts."""

    rules: WhenRules
    facts: Mapping[str, Column]
    unknown: Unknown

    @classmethod
    def read(cls, rules: WhenRules, columns: Mapping[str, Any], n_contexts: int, unknown: Unknown) -> ManyRules:
        """Read the columns that rules name, derived ones among them; raises ContextError for a fact that is wrong."""
        return cls(rules, {c.name: read_column(columns.get(c.name), c, n_contexts) for c in rules.conditions}, unknown)

    def missing(self, name: str) -> Rows:
        """The contexts in which a fact is missing: int64 [n ≤ N]."""
        return missing_rows(self.facts[name])

    def exclude(self, masks: Words, start: int = 0) -> None:
        """Take the rows whose rule does not hold out of the masks uint64 [n, W] of contexts `start` and on, in place. Raises
        ContextError where a rule of a row that is left has no finite value, and `unknown` is "error"; names the first context of
        that rule."""
        left = masks & self._ruled
        if int(np.bitwise_count(left).sum()) <= MANY_ROWS * len(masks):
            self._exclude_places(masks, *bitmask.places(left), start)
            return
        for number, (words, bits) in enumerate(self._sides):
            at = np.flatnonzero((masks[:, words] & bits).any(axis=1))
            if len(at):
                broken = at[self._is_broken(number, start + at)]
                masks[np.ix_(broken, words)] &= ~bits

    def _exclude_places(self, masks: Words, at: Rows, rows: Rows, start: int) -> None:
        """The same where few rows are left: mask `at[i]` holds row `rows[i]`."""
        numbers = self.rules.of_row[rows]
        order = np.argsort(numbers, kind="stable")
        distinct, first = np.unique(numbers[order], return_index=True)
        for number, own in zip(distinct.tolist(), np.split(order, first[1:]), strict=False):  # of nothing split gives one part
            contexts, which = np.unique(at[own], return_inverse=True)
            gone = own[self._is_broken(number, start + contexts)[which]]
            words, bits = np.divmod(rows[gone], 64)
            np.bitwise_and.at(masks, (at[gone], words), ~(np.uint64(1) << bits.astype(np.uint64)))

    def _is_broken(self, number: int, contexts: Rows) -> Flags:
        """Whether a rule does not hold, for each of some contexts."""
        rule = self.rules.rules[number].expression
        own = {name: taken(self.facts[name], contexts) for name in rule.names}
        truths = run_frame(rule.plan, own, len(contexts))
        assert isinstance(truths, np.ndarray)
        if self.unknown == "error" and (truths == UNKNOWN).any():
            raise self._no_value(rule, contexts[truths == UNKNOWN])
        return np.asarray(truths == NO if self.unknown == "any" else truths <= UNKNOWN)

    def _no_value(self, rule: Expression, contexts: Rows) -> ContextError:
        first = int(contexts[0])
        values = {c.name: _value_at(self.facts[c.name], first) for c in rule.conditions}
        fault = no_value(rule, values, self.rules.name).faults[0]
        more = f" So it is in {plural(len(contexts), 'context')}." if len(contexts) > 1 else ""
        place = Place(row=first, column=self.rules.name)
        return ContextError(Fault(fault.found + more, fault.accepted, place=place, rule=fault.rule))

    @cached_property
    def _ruled(self) -> Words:
        return bitmask.from_int(self.rules.rows, len(self.rules.of_row))

    @cached_property
    def _sides(self) -> list[Side]:
        sides = []
        for rule in self.rules.rules:
            mask = bitmask.from_int(rule.rows, len(self.rules.of_row))
            words = np.flatnonzero(mask)
            sides.append((words, mask[words]))
        return sides


def _value_at(column: Column, context: int) -> Any:
    if len(missing_rows(taken(column, np.array([context])))):
        return None
    if isinstance(column, np.ndarray):
        return bool(column[context]) if column.dtype == np.int8 else float(column[context])
    return column.values[column.codes[context]]
