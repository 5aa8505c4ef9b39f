"""What is wrong with the table that is displayed: what `contextdb check` finds, and the facts of the test row that cannot be read.

The findings of cells are there at once. Those of whole rows and of saved contexts take longer: `row_findings` is for a thread.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from contextdb.checks.cases import check_cases, read_cases
from contextdb.checks.rules import RULES
from contextdb.checks.run import check, check_rows
from contextdb.covering.progress import Stops
from contextdb.errors import ContextDBError, Fault, plural
from contextdb.findings import LEVELS, Finding, Level
from contextdb.tables.other_files import cases_path
from contextdb.tables.table import Table
from contextdb.tables.variants import known_whole

from .coverage_lines import in_rows, rows_text
from .coverage_run import is_quick

AT_ONCE = 200_000
"""Cells of a table that is checked in a fraction of a second."""
OF_CASES = ("case-failed", "unreadable-case", "unknown-fact")
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
    is_of_cases: bool = False
    """It is about a saved context."""

    @property
    def place(self) -> str:
        """Where it is: the row number of the grid, from 1."""
        if self.is_of_test_row:
            return "test row"
        if self.is_of_cases:
            return "contexts"
        return "table" if self.row is None else str(self.row + 1)

    @property
    def text(self) -> str:
        """Everything about it: the place, the message, and what the rule means with its cure."""
        parts = [self.place if self.row is None else f"row {self.place}", self.asset, self.column and f'column "{self.column}"']
        rule = RULES.get(self.rule)
        head = f"{WORDS[self.level].capitalize()} {self.rule}: {', '.join(p for p in parts if p)}"
        cure = f"\n{rule.summary} {rule.cure}" if rule else ""
        is_named = all(f"row {row + 1:,} " in f"{self.message} " for row in self.by)
        by = "" if is_named else f" ({rows_text(self.by)})"
        return f"{head}\n{self.message}{by}{cure}"


@dataclass(frozen=True)
class Problems:
    """All problems, errors first, else in the order of rows."""

    items: tuple[Problem, ...] = ()

    @classmethod
    def of(cls, findings: Sequence[Finding], facts: Mapping[str, Fault]) -> Problems:
        """The findings, and the facts of the test row that cannot be read."""
        problems = [Problem("error", fault.rule, fault.message, column=name, is_of_test_row=True) for name, fault in facts.items()]
        problems += [_problem(finding) for finding in findings]
        return cls(tuple(sorted(problems, key=lambda p: LEVELS.index(p.level))))

    def of_level(self, level: Level | None) -> tuple[Problem, ...]:
        """The problems of one level; None: all of them."""
        return self.items if level is None else tuple(p for p in self.items if p.level == level)

    def grouped(self, level: Level | None) -> tuple[Problem, ...]:
        """One problem for all of a kind in a column, the first of them, with how many there are; the most frequent kinds first."""
        groups: dict[tuple[Level, str, str | None, bool], list[Problem]] = {}
        for problem in self.of_level(level):
            groups.setdefault((problem.level, problem.rule, problem.column, problem.is_of_test_row), []).append(problem)
        ordered = sorted(groups.values(), key=lambda group: (LEVELS.index(group[0].level), -len(group)))
        return tuple(
            group[0] if len(group) == 1 else replace(group[0], message=f"{len(group):,} like this: {group[0].message}")
            for group in ordered
        )

    @property
    def counts(self) -> dict[Level, int]:
        """How many there are of each level."""
        counted = Counter(p.level for p in self.items)
        return {level: counted[level] for level in LEVELS}

    @property
    def summary(self) -> str:
        """How many there are, in a sentence."""
        counts = [f"{n:,} for information" if level == "info" else plural(n, level) for level, n in self.counts.items() if n]
        return f"{', '.join(counts)}." if counts else "The check finds nothing wrong with this table."


def cell_findings(table: Table) -> list[Finding]:
    """What `contextdb check` says of the cells and settings of a table."""
    return _in_rows(check(table), table)


def _in_rows(findings: Sequence[Finding], table: Table) -> list[Finding]:
    whole = known_whole(table)
    if whole is not None:
        own = whole.own_rows.tolist()
        findings = [replace(f, row=None if f.row is None else own[f.row], by=tuple(own[row] for row in f.by)) for f in findings]
    return [replace(one, message=in_rows(one, table)) if one.by else one for one in findings]


def row_findings(table: Table, should_stop: Stops | None = None) -> list[Finding]:
    """What it says beside: rows that others make redundant, that are dead or never chosen, and saved contexts that fail. Raises
    Cancelled when `should_stop` says so."""
    try:
        rows = check_rows(table, should_stop=should_stop)
    except MemoryError:
        rows = []
    return [*_in_rows(rows, table), *_of_cases(table)]


def findings_at_once(table: Table) -> list[Finding]:
    """What can be checked between two keys: all of it for a small table, what is wrong with cells for a larger one."""
    return [*cell_findings(table), *(row_findings(table) if is_quick(table) else ())]


def _of_cases(table: Table) -> list[Finding]:
    if table.path is None:
        return []
    path = cases_path(table.path)
    try:
        return check_cases(table, read_cases(path), str(path))
    except ContextDBError as error:
        return [Finding.of(fault, "error", table.name) for fault in error.faults]


def is_checked_at_once(table: Table) -> bool:
    """Whether a table is small enough to be checked between two keys."""
    return table.n_rows * len(table.columns) <= AT_ONCE


def _problem(finding: Finding) -> Problem:
    is_of_cases = finding.row is None and finding.rule in OF_CASES
    row, asset = finding.row, finding.asset or ""
    return Problem(finding.level, finding.rule, finding.message, row, asset, finding.column, False, finding.by, is_of_cases)
