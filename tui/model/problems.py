"""What is wrong with the table that is shown: the findings of `check`, and the facts of the test row that cannot be read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from contextdb.check import check
from contextdb.errors import Fault, plural
from contextdb.findings import LEVELS, Finding, Level
from contextdb.report.rules import RULES
from contextdb.table import Table
from tui.model.coverage_lines import rows_text

AT_ONCE = 200_000
"""Cells of a table that is checked in a fraction of a second."""
WORDS: Mapping[Level, str] = {"error": "error", "warning": "warning", "info": "information"}


@dataclass(frozen=True)
class Problem:
    """One line of the list. `row` is None for the test row and for the whole table."""

    level: Level
    rule: str
    message: str
    row: int | None = None
    asset: str = ""
    column: str | None = None
    is_of_test_row: bool = False
    by: tuple[int, ...] = ()
    """The rows that cause it."""

    @property
    def place(self) -> str:
        """Where it is: the row number of the grid, from 1."""
        if self.is_of_test_row:
            return "test row"
        return "table" if self.row is None else str(self.row + 1)

    @property
    def text(self) -> str:
        """Everything about it: the place, the message, and what the rule means with its cure."""
        parts = [self.place if self.row is None else f"row {self.place}", self.asset, self.column and f'column "{self.column}"']
        rule = RULES.get(self.rule)
        head = f"{WORDS[self.level].capitalize()} {self.rule}: {', '.join(p for p in parts if p)}"
        cure = f"\n{rule.summary} {rule.cure}" if rule else ""
        by = f" ({rows_text(self.by)})" if self.by else ""
        return f"{head}\n{self.message}{by}{cure}"


@dataclass(frozen=True)
class Problems:
    """All problems, errors first, else in the order of rows."""

    items: tuple[Problem, ...] = ()

    @classmethod
    def of(cls, table: Table, facts: Mapping[str, Fault]) -> Problems:
        """The problems of a table, and of the facts of the test row."""
        found = [Problem("error", fault.rule, fault.message, column=name, is_of_test_row=True) for name, fault in facts.items()]
        found += [_problem(finding) for finding in check(table)]
        return cls(tuple(sorted(found, key=lambda p: LEVELS.index(p.level))))

    def of_level(self, level: Level | None) -> tuple[Problem, ...]:
        """The problems of one level; None: all of them."""
        return self.items if level is None else tuple(p for p in self.items if p.level == level)

    @property
    def counts(self) -> dict[Level, int]:
        """How many there are of each level."""
        counted = Counter(p.level for p in self.items)
        return {level: counted[level] for level in LEVELS}

    @property
    def summary(self) -> str:
        """How many there are, in a sentence."""
        said = [f"{n:,} information" if level == "info" else plural(n, level) for level, n in self.counts.items() if n]
        return f"{', '.join(said)}." if said else "Nothing is wrong with this table, as far as check can tell."


def is_checked_at_once(table: Table) -> bool:
    """Whether a table is small enough to be checked between two keys."""
    return table.n_rows * len(table.columns) <= AT_ONCE


def _problem(finding: Finding) -> Problem:
    return Problem(finding.level, finding.rule, finding.message, finding.row, finding.asset or "", finding.column, by=finding.by)
