"""What `contextdb coverage` hands to its renderers: measured tables, the bars they are held to, what changed. Data only."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

from contextdb.covering import CoverageReport, Gap, PairTable, Slice, format_percent
from contextdb.covering.baseline import Change
from contextdb.covering.pairs import left_out
from contextdb.covering.shares import told_apart
from contextdb.errors import in_quotes, plural, row_name, some
from contextdb.files.reports import sealed
from contextdb.findings import Finding
from contextdb.report.results import CheckReport, Gate, Subject, TableSummary
from contextdb.telemetry.observed import Observed, SeenGap

ROUNDING = 1e-12
"""Shares are as exact as this; a bar of 100 % takes nothing less all the same."""
MOST_GAP_FINDINGS = 10


@dataclass(frozen=True)
class Measured:
    """One table with its coverage."""

    report: CoverageReport
    file: str | None
    assets: tuple[str, ...]
    lines: tuple[int | None, ...]
    """For each row its line in the file."""
    pairs: PairTable | None = None
    change: Change | None = None
    telemetry: Observed | None = None
    gates: tuple[Gate, ...] = ()
    inside: Mapping[int, str] = field(default_factory=dict)
    """For the rows of inner tables that are in other files: the file, from the folder of the table."""

    @property
    def summary(self) -> TableSummary:
        """The table as a check names it."""
        return TableSummary(self.report.table, self.file, self.report.n_rows, self.report.n_conditions)

    def named(self, row: int) -> str:
        """A row as people find it: its line, else its number, and its asset; of an inner table's row also the file."""
        line = self.lines[row]
        file = f" in {self.inside[row]}" if row in self.inside else ""
        return f"{row_name(row) if line is None else f'line {line}'} {self.assets[row]}".rstrip() + file

    @property
    def seen_elsewhere(self) -> tuple[SeenGap, ...]:
        """The gaps of the recording that are not in the list of gaps."""
        listed = {gap.id for gap in self.report.gaps}
        return () if self.telemetry is None else tuple(gap for gap in self.telemetry.gaps if gap.id not in listed)

    @property
    def left_out(self) -> str:
        """What was not measured as the table is too large for it, as a sentence; "" where nothing was left out."""
        return left_out(self.report.n_conditions) if self.pairs is None else ""

    def worst_pairs(self, most: int) -> list[Slice]:
        """Of each pair of conditions the combination that is covered least; the worst of these, the largest of equals first."""
        return self._worst_pairs[:most]

    @cached_property
    def _worst_pairs(self) -> list[Slice]:
        if self.pairs is None:
            return []
        worst = [self.pairs.worst(i, j) for i, j in self.pairs.pairs()]
        measured = [s for s in worst if s is not None and s.covered is not None and s.covered < 1.0 and s.share > 0.0]
        return sorted(measured, key=lambda s: (*s.rank, *s.cells.items()))

    def to_json(self) -> dict[str, object]:
        """One entry of `tables` in the JSON document."""
        report = self.report.to_json()
        shown = [s.to_json() for s in self.worst_pairs(20)]
        return report | {
            "file": self.file,
            "hits": list(self.report.hits),
            "pairs": shown,
            "pairs_left_out": bool(self.left_out),
            "telemetry": None if self.telemetry is None else self.telemetry.to_json(),
            "baseline": None if self.change is None else self.change.to_json(),
            "gates": [gate.to_json() for gate in self.gates],
        }


@dataclass(frozen=True)
class CoverageResults:
    """All measured tables."""

    subject: ClassVar[Subject] = "coverage"
    tables: tuple[Measured, ...]
    gone: Mapping[str, Gate] = field(default_factory=dict)
    """For each table of the baseline that no longer exist the bar that this misses, or keeps where it is intended."""

    @property
    def gates(self) -> list[Gate]:
        return [*self.gone.values(), *(gate for measured in self.tables for gate in measured.gates)]

    @property
    def passed(self) -> bool:
        """Whether every bar is kept."""
        return all(gate.passed for gate in self.gates)

    @property
    def verdict(self) -> str:
        """Whether the bars are kept, in one sentence; "" where there are none."""
        gates = self.gates
        n_failed = sum(not gate.passed for gate in gates)
        if n_failed:
            return f"{n_failed} of {plural(len(gates), 'threshold')} missed."
        return f"{plural(len(gates), 'threshold')} met." if gates else ""

    def to_json(self) -> dict[str, object]:
        return sealed(
            {
                "format": 1,
                "passed": self.passed,
                "tables": [measured.to_json() for measured in self.tables],
                "gone": list(self.gone),
                "gates": [gate.to_json() for gate in self.gone.values()],
            }
        )

    def as_check(self) -> CheckReport:
        """Missed bars, findings and the largest gaps as findings, for formats that know nothing else."""
        gone = [Finding(gate.rule or gate.name, "error", gate.message, name) for name, gate in self.gone.items() if not gate.passed]
        return CheckReport(tuple(m.summary for m in self.tables), (*gone, *(f for m in self.tables for f in _findings(m))))


def reaches(value: float, limit: float) -> bool:
    """Whether a share reaches a bar; 100 % is reached by 100 % alone."""
    return value >= limit or (limit < 1.0 and value >= limit - ROUNDING)


def fail_under(report: CoverageReport, limit: float) -> Gate:
    """Hold the lower bound of the covered share to a bar."""
    at_least = "" if report.method == "exact" else "at least "
    return bar("fail-under", report.lower, limit, f"{at_least}{{}} of the contexts are covered", rule="coverage-below")


def max_drop(change: Change, limit: float) -> Gate:
    """Hold the fall of the covered share since the baseline to a bar."""
    passed = change.drop <= limit + ROUNDING
    if change.drop <= ROUNDING:
        return Gate("max-drop", limit, change.drop, passed, "the covered share did not fall.", rule="coverage-dropped")
    points = format_percent(change.drop).replace(" %", " points").replace("%", "points")
    allowed = format_percent(limit).replace(" %", " points")
    verb = "within" if passed else "more than"
    return Gate(
        "max-drop",
        limit,
        change.drop,
        passed,
        f"the covered share fell by {points}, {verb} the {allowed} allowed.",
        rule="coverage-dropped",
    )


def table_gone(name: str, is_intended: bool, new: Sequence[str] = ()) -> Gate:
    """Require that a table of the baseline is still there; `new` are the tables that the baseline does not have."""
    found = f"the table {in_quotes(name)} of the baseline no longer exists"
    renamed = f" New since the baseline: {some(new)}." if new else ""
    return _still_there(name, found, is_intended, renamed)


def table_emptied(name: str, n_rows: int, is_intended: bool) -> Gate:
    """Require that a table that had rows in the baseline still has some."""
    return _still_there(name, f"the table had {plural(n_rows, 'row')} in the baseline and has none now", is_intended)


def _still_there(name: str, found: str, is_intended: bool, more: str = "") -> Gate:
    how = f"--gone={name}" if re.fullmatch(r"[\w.-]+", name) else f"--gone={in_quotes(name)}"
    message = f"{found}, as --gone says." if is_intended else f"{found}.{more} Where that is intended: {how}."
    return Gate("gone", 0.0, 1.0, is_intended, message, rule="table-gone")


def fail_under_telemetry(telemetry: Observed, limit: float) -> Gate:
    """Hold the covered share of recorded moments to a bar."""
    return bar("fail-under-telemetry", telemetry.covered, limit, "{} of the recorded moments are covered", rule="telemetry-below")


def bar(name: str, value: float, limit: float, said: str, rule: str | None = None) -> Gate:
    """The gate of a share that is to reach a bar; `said` is what it is, with {} for it."""
    passed = reaches(value, limit)
    found, wanted = told_apart(value, limit) if not passed else (format_percent(value), format_percent(limit))
    message = f"{said.format(found)}, which {'reaches' if passed else 'is below'} the threshold of {wanted}."
    return Gate(name, limit, value, passed, message, rule)


def gap_size(gap: Gap) -> str:
    """The share of a gap as people read it."""
    return f"{'' if gap.is_exact else '≈ '}{format_percent(gap.share)}" if gap.share else "point"


def gap_moments(gap: Gap) -> str:
    """The share of the recorded moments in a gap as people read it; "" where none were observed."""
    return "" if gap.telemetry is None else format_percent(gap.telemetry)


def has_moments(report: CoverageReport) -> bool:
    """Whether gaps know their share of the recorded moments."""
    return any(gap.telemetry is not None for gap in report.gaps)


def _findings(measured: Measured) -> Iterator[Finding]:
    report = measured.report
    for gate in measured.gates:
        if not gate.passed:
            yield Finding(gate.rule or gate.name, "error", gate.message, report.table, measured.file)
    yield from report.findings
    if measured.change is not None:
        for gap in measured.change.opened[:MOST_GAP_FINDINGS]:
            yield _gap_finding(measured, gap, True)
    opened = {gap.id for gap in measured.change.opened[:MOST_GAP_FINDINGS]} if measured.change else set()
    for gap in report.gaps[:MOST_GAP_FINDINGS]:
        if gap.id not in opened:
            yield _gap_finding(measured, gap, False)


def _gap_finding(measured: Measured, gap: Gap, is_new: bool) -> Finding:
    size = "single points" if not gap.share else f"{gap_size(gap)} of the contexts"
    moments = "" if gap.telemetry is None else f", {gap_moments(gap)} of the recorded moments"
    message = f"no row is valid for {gap.text} ({size}{moments}; gap {gap.id})."
    if is_new:
        return Finding("new-gap", "warning", message, measured.report.table, measured.file)
    return Finding("gap", "info", message, measured.report.table, measured.file)
