"""A `when` column as it is written: its texts, and the rule that each distinct text is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import BOOL
from contextdb.cells.words import says_any
from contextdb.columns import TextColumn
from contextdb.errors import Fault, in_quotes, some
from contextdb.expressions import Expression, ExpressionError, read_expression
from contextdb.expressions.tokens import unknown_in

MOST_MENDS = 20
"""Rules of one column that get a mend when they cannot be read; looking for one is slow."""
MOST_KNOWN = 1 << 13
"""Texts that are cached as read, so that an edit of one cell reads one."""

_TRUTH = Condition("", BOOL)


@dataclass(frozen=True, eq=False)
class WhenColumn:
    """The rules of a table's rows."""

    texts: TextColumn
    rules: tuple[Expression | None, ...]
    """The rule of `texts.texts[i]`; None where it has none, or cannot be read."""
    faults: Mapping[int, Fault]
    """Why `texts.texts[i]` cannot be read."""

    @classmethod
    def read(cls, texts: TextColumn, conditions: Mapping[str, Condition]) -> WhenColumn:
        """Read every distinct text once; rules may name these conditions."""
        known = _Known(tuple(conditions.values()))
        rules: list[Expression | None] = []
        faults: dict[int, Fault] = {}
        for i, text in enumerate(texts.texts):
            few = len(faults) < MOST_MENDS
            rule = None if says_any(text) else _read(text.strip(), known) if few else _read_fast(text.strip(), known)
            rules.append(None if isinstance(rule, Fault) else rule)
            if isinstance(rule, Fault):
                faults[i] = rule
        return cls(texts, tuple(rules), faults)

    @property
    def name(self) -> str:
        return self.texts.name

    def rule(self, row: int) -> Expression | None:
        """The rule of a row; None where it has none."""
        return self.rules[int(self.texts.codes[row])]

    def faulty_rows(self) -> Iterator[tuple[int, Fault]]:
        """The rows whose rule cannot be read, and why."""
        if self.faults:
            for row in np.flatnonzero(np.isin(self.texts.codes, list(self.faults))).tolist():
                yield row, self.faults[int(self.texts.codes[row])]

    @property
    def has_rule(self) -> NDArray[np.bool_]:
        """Whether each row has a rule: bool [n_rows]."""
        return np.array([rule is not None for rule in self.rules], np.bool_)[self.texts.codes]

    @property
    def meanings(self) -> NDArray[np.int64]:
        """For each row a number that is the same for rows of the same rule; what cannot be read means itself. int64 [n_rows]."""
        known: dict[object, int] = {}
        keys = [("fault", i) if i in self.faults else rule and rule.text for i, rule in enumerate(self.rules)]
        return np.array([known.setdefault(key, len(known)) for key in keys], np.int64)[self.texts.codes]

    @property
    def names(self) -> tuple[str, ...]:
        """The conditions that rules of some row name, in the order of their first mention."""
        held = np.unique(self.texts.codes).tolist()
        rules = (self.rules[code] for code in held)
        return tuple(dict.fromkeys(name for rule in rules if rule is not None for name in rule.names))


def check_rule(text: str, conditions: Mapping[str, Condition]) -> Fault | None:
    """What is wrong with the text of a rule over some conditions; None where it can be read."""
    return next(iter(WhenColumn.read(TextColumn.of("", [text]), conditions).faults.values()), None)


@dataclass(frozen=True)
class _Known:
    """Conditions that rules may name, as a key whose hash is worked out once."""

    conditions: tuple[Condition, ...]

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def names(self) -> frozenset[str]:
        return frozenset(c.name for c in self.conditions)

    @cached_property
    def _hash(self) -> int:
        return hash(self.conditions)


@lru_cache(maxsize=MOST_KNOWN)
def _read(text: str, known: _Known) -> Expression | Fault:
    """The rule that a text is, or why it is none."""
    try:
        return read_expression(text, known.conditions, _TRUTH)
    except ExpressionError as error:
        return replace(error.faults[0], rule="unreadable-cell")


def _read_fast(text: str, known: _Known) -> Expression | Fault:
    """The same without a mend for a name that no condition has."""
    unknown = unknown_in(text, known.names)
    if unknown is None:
        return _read(text, known)
    name, at = unknown
    problem = f"{in_quotes(text)}, character {at + 1}: there is no condition {in_quotes(name)}."
    return Fault(problem, some(c.name for c in known.conditions), rule="unreadable-cell")
