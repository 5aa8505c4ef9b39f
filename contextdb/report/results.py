"""What a check hands to its renderers: the tables that were read, and their findings. Data only.

A renderer is a pure function of a `Report` that gives text: the same report gives the same bytes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, chain, count
from pathlib import PurePath
from typing import ClassVar, Literal, Protocol

from contextdb.console import printable
from contextdb.covering.contracts import Proof
from contextdb.errors import plural, row_name
from contextdb.findings import LEVELS, Finding, Level, worst

Subject = Literal["check", "coverage", "measures", "motion coverage"]
"""What a report is about."""

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
        return f"{plural(self.n_rows, 'row')}, {plural(self.n_conditions, 'condition')}"

    def to_json(self) -> dict[str, object]:
        return {"table": self.name, "file": self.file, "rows": self.n_rows, "conditions": self.n_conditions}


@dataclass(frozen=True, slots=True)
class Group:
    """The findings of one table, or of one file that is not a table: contextdb.toml, or a file that could not be read."""

    label: str
    """The table's name, with its file where another table has the same name; the file where there is no name."""
    file: str | None
    table: TableSummary | None
    findings: tuple[Finding, ...]

    def blocks(self) -> list[Block]:
        """The findings by level and rule: errors first, else in their order."""
        blocks: dict[tuple[Level, str], list[Finding]] = {}
        for finding in self.findings:
            blocks.setdefault((finding.level, finding.rule), []).append(finding)
        ordered = sorted(blocks, key=lambda key: LEVELS.index(key[0]))
        return [(level, rule, tuple(blocks[level, rule])) for level, rule in ordered]


@dataclass(frozen=True, slots=True)
class Gate:
    """A threshold of a table or a session, or a comparison with the baseline."""

    name: str
    """The option, such as fail-under."""
    limit: float
    value: float | None
    passed: bool
    message: str
    rule: str | None = None
    """The rule that a table breaks which misses the bar, where it has a name of its own."""
    is_accepted: bool = False
    """Whether it passes only because an option of the command says so, or because it has nothing to look at."""

    @property
    def word(self) -> str:
        return "failed" if not self.passed else "skipped" if self.is_accepted and self.value is None else "passed"

    def findings(self, table: str, file: str | None = None) -> Iterator[Finding]:
        """What a gate that fails, or that passes without having measured, is in formats that know only findings."""
        if not self.passed or self.is_accepted:
            yield Finding(self.rule or self.name, "info" if self.passed else "error", self.message, table, file)

    def to_json(self) -> dict[str, object]:
        return {"name": self.name, "limit": self.limit, "value": self.value, "passed": self.passed, "message": self.message}


class Report(Protocol):
    """What can be rendered: the findings of a check, or measurements."""

    subject: ClassVar[Subject]

    def to_json(self) -> dict[str, object]:
        """The JSON document."""

    def as_check(self) -> CheckReport:
        """All that matters as findings, for formats that know nothing else."""


@dataclass(frozen=True, slots=True)
class CheckReport:
    """The tables that were read, and every finding; those of a file that could not be read have no table."""

    subject: ClassVar[Subject] = "check"
    tables: tuple[TableSummary, ...]
    findings: tuple[Finding, ...]
    contracts: tuple[Proof, ...] = ()

    @property
    def summary(self) -> str:
        """How many findings of each level there are, and how many contracts hold, in one sentence each."""
        n_held = sum(proof.holds is True for proof in self.contracts)
        held = f" {n_held} of {plural(len(self.contracts), 'contract')} proved." if self.contracts else ""
        counts = Counter(f.level for f in self.findings)
        totals = ", ".join(plural(counts[level], level) for level in LEVELS if counts[level])
        return f"{plural(len(self.tables), 'table')} checked: {totals or 'nothing found'}.{held}"

    def to_json(self) -> dict[str, object]:
        findings = [finding.to_json() for finding in self.findings]
        contracts = [proof.to_json() for proof in self.contracts]
        return {"format": 1, "findings": findings, "tables": [table.to_json() for table in self.tables], "contracts": contracts}

    def as_check(self) -> CheckReport:
        return self

    def groups(self) -> list[Group]:
        """The findings, by table and file: the worst first, else in the order given; tables without a finding last."""
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
        groups = [_group(table, findings) for table, findings in members]
        return sorted(_with_labels(groups), key=_rank)


def place_of(finding: Finding) -> str:
    """Where a finding is, so that editors and terminals can open it: "tables/jog.csv:12", without a line only the file."""
    if not finding.file:
        return ""
    return as_path(finding.file) if finding.line is None else f"{as_path(finding.file)}:{finding.line}"


def message_of(finding: Finding, names_asset: bool = True) -> str:
    """The message on one printable line, after what it is about: the row where no line is known, the asset, the column."""
    about = [row_name(finding.row)] if finding.line is None and finding.row is not None else []
    if names_asset and finding.asset:
        about.append(f'"{finding.asset}"')
    if finding.column is not None:
        about.append(f'column "{finding.column}"')
    return printable(f"{', '.join(about)}: {finding.message}" if about else finding.message)


def as_path(file: str) -> str:
    """A file as reports name it: with "/" on every system."""
    return printable(PurePath(file).as_posix())


def worst_first(findings: Iterable[Finding]) -> list[Finding]:
    """The findings with errors first, else in their order; CI systems show the first ones only."""
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


def _with_labels(groups: list[Group]) -> Iterator[Group]:
    """The groups with different labels: with the file where a name appears twice, and a number where that does not help."""
    times = Counter(group.label for group in groups)
    taken: set[str] = set()
    for group in groups:
        label = f"{group.label} ({as_path(group.file)})" if times[group.label] > 1 and group.file else group.label
        label = next(text for text in chain([label], (f"{label} #{n}" for n in count(2))) if text not in taken)
        taken.add(label)
        yield replace(group, label=label)


# ---- how a report for people stays short: the first findings of each rule, then how many more there are


FINDING_STEPS = (20, 10, 5, 3, 2, 1)
"""How many findings of one rule are listed: the first that fits."""


def fitted(sections_at: Callable[[int], Sequence[str]], size: Callable[[str], int], room: int) -> tuple[list[str], int]:
    """The sections of the longest form of a report that fits into `room`, and that number.

    `sections_at` gives the sections with at most a number of findings of one rule, `size` how much room a section takes. Where not
    even one finding of each rule fits, the last sections are left out; the first one never is.
    """
    sections: Sequence[str] = ()
    for most in FINDING_STEPS:
        sections = sections_at(most)
        if sum(map(size, sections)) <= room:
            return list(sections), most
    n_fitting = sum(total <= room for total in accumulate(map(size, sections)))
    return list(sections[: max(1, n_fitting)]), FINDING_STEPS[-1]


def n_hidden(groups: Sequence[Group], n_listed: int, most: int) -> int:
    """How many findings are left out: of the first `n_listed` groups those past `most` of each rule, of the others all."""
    cut = sum(max(0, len(findings) - most) for group in groups[:n_listed] for _, _, findings in group.blocks())
    return cut + sum(len(group.findings) for group in groups[n_listed:])
