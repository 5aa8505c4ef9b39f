"""The rules of a compiled table, queried with the facts of many contexts: N contexts, W words a mask."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from contextdb import bitmask
from contextdb.bitmask import Flags, Rows, Words
from contextdb.cells.facts import Unknown
from contextdb.errors import ContextError, Fault, Place, plural
from contextdb.expressions import Expression
from contextdb.expressions.columns import NO, UNKNOWN, Column, missing_rows, read_column, taken
from contextdb.expressions.frame import run_frame
from contextdb.expressions.rules.rules import WhenRules, no_value

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
