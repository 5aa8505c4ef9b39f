"""What a check hands to its renderers: the tables that were read and what was found. Data only.

A renderer is a pure function of a `CheckReport` that gives text: the same report gives the same bytes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import PurePath

from contextdb.console import printable
from contextdb.errors import plural
from contextdb.findings import LEVELS, Finding, Level, worst

Block = tuple[Level, str, tuple[Finding, ...]]
"""The findings of one level and rule in one group."""


@dataclass(frozen=True, slots=True)
class TableSummary:
    """A table that was read: its name, its file, and its size. `file` is None where it has none."""

    name: str
    file: str | None
    n_rows: int
    n_conditions: int

    @property
    def size(self) -> str:
        """The size in words."""
        return f"{plural(self.n_rows, 'row')}, {plural(self.n_conditions, 'condition')}"


@dataclass(frozen=True, slots=True)
class Group:
    """All that was found in one table, or in one file that is no table: contextdb.toml, or a file that could not be read."""

    label: str
    """The table's name, with its file where another table has the same name; the file where there is no name."""
    file: str | None
    table: TableSummary | None
    findings: tuple[Finding, ...]

    def blocks(self) -> list[Block]:
        """The findings by level and rule: errors first, else in the order found."""
        found: dict[tuple[Level, str], list[Finding]] = {}
        for finding in self.findings:
            found.setdefault((finding.level, finding.rule), []).append(finding)
        ordered = sorted(found, key=lambda key: LEVELS.index(key[0]))
        return [(level, rule, tuple(found[level, rule])) for level, rule in ordered]


@dataclass(frozen=True, slots=True)
class CheckReport:
    """The tables that were read, and every finding; those of a file that could not be read have no table."""

    tables: tuple[TableSummary, ...]
    findings: tuple[Finding, ...]

    @property
    def summary(self) -> str:
        """How many findings of each level there are, in one sentence."""
        counts = Counter(f.level for f in self.findings)
        said = ", ".join(plural(counts[level], level) for level in LEVELS if counts[level])
        return f"{plural(len(self.tables), 'table')} checked: {said or 'nothing found'}."

    def groups(self) -> list[Group]:
        """What was found, by table and file: the worst first, else in the order given; tables without a finding last."""
        members: list[tuple[TableSummary | None, list[Finding]]] = [(table, []) for table in self.tables]
        at: dict[tuple[str, str | None], int] = {}
        for i, table in enumerate(self.tables):
            at.setdefault(("table", table.name), i)
            at[_key(table.name, table.file)] = i
        for finding in self.findings:
            key = _key(finding.table, finding.file)
            if key not in at:
                at[key] = len(members)
                members.append((None, []))
            members[at[key]][1].append(finding)
        found = [_group(table, findings) for table, findings in members]
        return sorted(_with_labels(found), key=_rank)


def place_in(finding: Finding) -> str:
    """Where in its file a finding stands: "line 12", "row 3" where lines are not known, or nothing."""
    if finding.line is not None:
        return f"line {finding.line}"
    return "" if finding.row is None else f"row {finding.row}"


def told(finding: Finding) -> str:
    """The message with the asset and the column that it is about, on one line without control characters."""
    about = [f'"{finding.asset}"'] if finding.asset else []
    if finding.line is None and finding.row is not None:
        about.insert(0, f"row {finding.row}")
    if finding.column is not None:
        about.append(f'column "{finding.column}"')
    return printable(f"{', '.join(about)}: {finding.message}" if about else finding.message)


def as_path(file: str) -> str:
    """A file as reports name it: with "/" on every system."""
    return printable(PurePath(file).as_posix())


def worst_first(findings: Iterable[Finding]) -> list[Finding]:
    """The findings with errors first, else in the order found; CI systems show the first ones only."""
    return sorted(findings, key=lambda f: LEVELS.index(f.level))


def _rank(group: Group) -> int:
    level = worst(group.findings)
    return LEVELS.index(level) if level else len(LEVELS)


def _key(table: str | None, file: str | None) -> tuple[str, str | None]:
    return ("file", file) if file else ("table", table)


def _group(table: TableSummary | None, findings: list[Finding]) -> Group:
    named = table.name if table else next((f.table for f in findings if f.table), None)
    file = table.file if table else next((f.file for f in findings if f.file), None)
    return Group(printable(named or (as_path(file) if file else "no file")), file, table, tuple(findings))


def _with_labels(groups: list[Group]) -> list[Group]:
    """The groups with their file in the label where the name alone could mean another one."""
    times = Counter(group.label for group in groups)
    return [
        Group(f"{g.label} ({as_path(g.file)})", g.file, g.table, g.findings) if times[g.label] > 1 and g.file else g for g in groups
    ]
