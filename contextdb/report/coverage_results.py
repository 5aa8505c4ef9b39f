"""What `contextdb coverage` hands to its renderers: measured tables, their thresholds, what changed. Data only."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Literal

from contextdb.cells.conditions import Condition
from contextdb.covering import CoverageReport, Gap, PairTable, Slice, format_percent
from contextdb.covering.baseline import CaseCounts, Change, Declared
from contextdb.covering.expected import Expectation
from contextdb.covering.pairs import left_out
from contextdb.covering.report import distinct_percents
from contextdb.errors import in_quotes, plural, row_name, some
from contextdb.files.reports import with_marks
from contextdb.findings import Finding
from contextdb.report.results import CheckReport, Gate, Subject, TableSummary
from contextdb.tables.gap_work import GapWork, Work
from contextdb.telemetry.observed import Observed, SeenGap

ROUNDING = 1e-12
"""Shares are as exact as this; a bar of 100 % takes nothing less all the same."""
MOST_GAP_FINDINGS = 10


@dataclass(frozen=True, slots=True)
class Asked:
    """The covered share of what a table is asked, and of what it is the share."""

    by: Literal["telemetry", "expected", "domain"]
    value: float
    lower: float
    upper: float
    headline: str

    def to_json(self) -> dict[str, object]:
        return {"by": self.by, "value": self.value, "lower": self.lower, "upper": self.upper}


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
    space: Declared = field(default_factory=dict)
    """What the shares are shares of."""
    expected: Expectation | None = None
    """The coverage of the contexts that a designer expects."""
    owner: str = ""
    """Who answers for the table."""
    fallback: str = ""
    """What plays where no row is valid."""
    work: Mapping[str, Work] = field(default_factory=dict)
    """Who works on a gap and how far it is, by the id of the gap."""
    closed: tuple[tuple[Mapping[str, str], Work], ...] = ()
    """The work on what is no gap any more."""

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

    def with_work(self, work: GapWork, conditions: Sequence[Condition]) -> Measured:
        """With the work on its gaps, those of the recording and of what is expected among them."""
        todo = () if self.expected is None else self.expected.todo
        gaps: list[Gap | SeenGap] = [*self.report.gaps, *self.seen_elsewhere, *(item.gap for item in todo)]
        cells = {gap.id: gap.cells for gap in gaps}
        works, closed = work.of_gaps(cells.values(), conditions)
        own = {gap: one for gap, one in zip(cells, works, strict=True) if one is not None}
        return replace(self, work=own, closed=tuple((dict(key), work.lines[key]) for key in closed))

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

    @property
    def asked(self) -> Asked:
        """The share of what the table is asked: of the recorded moments, else of what is expected, else of all that can happen."""
        if self.telemetry is not None and self.telemetry.moments:
            covered = self.telemetry.covered
            return Asked("telemetry", covered, covered, covered, self.telemetry.headline)
        if self.expected is not None:
            of = self.expected.covered
            return Asked("expected", of.value, of.lower, of.upper, self.expected.headline)
        report = self.report
        return Asked("domain", report.covered, report.lower, report.upper, report.headline)

    def to_json(self) -> dict[str, object]:
        """One entry of `tables` in the JSON document."""
        report = self.report.to_json()
        worst = [s.to_json() for s in self.worst_pairs(20)]
        return report | {
            "file": self.file,
            "space": dict(self.space),
            "hits": list(self.report.hits),
            "pairs": worst,
            "pairs_left_out": bool(self.left_out),
            "telemetry": None if self.telemetry is None else self.telemetry.to_json(),
            "expected": None if self.expected is None else self.expected.to_json(),
            "asked": self.asked.to_json(),
            "work": [{"gap": gap, "state": work.state, "owner": work.owner} for gap, work in self.work.items()],
            "baseline": None if self.change is None else self.change.to_json(),
            "gates": [gate.to_json() for gate in self.gates],
        }


@dataclass(frozen=True)
class CoverageResults:
    """All measured tables."""

    subject: ClassVar[Subject] = "coverage"
    tables: tuple[Measured, ...]
    others: tuple[tuple[str, Gate], ...] = ()
    """Names and gates of tables that are not measured by themselves: gone since the baseline, or inside another table."""
    cases: Mapping[str, CaseCounts] = field(default_factory=dict)
    """How much the saved contexts of each table expect."""

    @property
    def gates(self) -> list[Gate]:
        return [*(gate for _, gate in self.others), *(gate for measured in self.tables for gate in measured.gates)]

    @property
    def passed(self) -> bool:
        return all(gate.passed for gate in self.gates)

    @property
    def verdict(self) -> str:
        """Whether the thresholds are met, in one sentence; "" where there are none."""
        gates = self.gates
        n_failed = sum(not gate.passed for gate in gates)
        if n_failed:
            return f"{n_failed} of {plural(len(gates), 'threshold')} missed."
        n_skipped = sum(gate.word == "skipped" for gate in gates)
        more = f", {n_skipped:,} not measured" if n_skipped else ""
        return f"{plural(len(gates) - n_skipped, 'threshold')} met{more}." if gates else ""

    def to_json(self) -> dict[str, object]:
        return with_marks(
            {
                "format": 1,
                "passed": self.passed,
                "tables": [measured.to_json() for measured in self.tables],
                "gone": [name for name, gate in self.others if gate.rule == "table-gone"],
                "gates": [gate.to_json() for _, gate in self.others],
                "cases": {name: counts.to_json() for name, counts in self.cases.items()},
            }
        )

    def as_check(self) -> CheckReport:
        """Missed thresholds, findings and the largest gaps as findings, for formats that know nothing else."""
        others = (finding for name, gate in self.others for finding in gate.findings(name))
        return CheckReport(tuple(m.summary for m in self.tables), (*others, *(f for m in self.tables for f in _findings(m))))


def reaches(value: float, limit: float) -> bool:
    """Whether a share reaches a threshold; 100 % is reached by 100 % alone."""
    return value >= limit or (limit < 1.0 and value >= limit - ROUNDING)


def fail_under(report: CoverageReport, limit: float) -> Gate:
    """The gate of a least covered share; an estimate counts with its lower bound."""
    at_least = "" if report.method == "exact" else "at least "
    return bar("fail-under", report.lower, limit, f"{at_least}{{}} of the contexts are covered", rule="coverage-below")


def max_drop(change: Change, limit: float) -> Gate:
    """The gate of the largest fall of the covered share since the baseline."""
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


def table_gone(name: str, is_accepted: bool, new: Sequence[str] = ()) -> Gate:
    """Require that a table of the baseline is still there; `new` are the tables that the baseline does not have."""
    sentence = f"the table {in_quotes(name)} of the baseline no longer exists"
    renamed = f" New since the baseline: {some(new)}." if new else ""
    return _accepted_by("gone", name, sentence, is_accepted, renamed, rule="table-gone")


def table_emptied(name: str, n_rows: int, is_accepted: bool) -> Gate:
    """Require that a table that had rows in the baseline still has some."""
    sentence = f"the table had {plural(n_rows, 'row')} in the baseline and has none now"
    return _accepted_by("gone", name, sentence, is_accepted, rule="table-gone")


def table_new(name: str, is_accepted: bool, gone: Sequence[str] = ()) -> Gate:
    """Require that a table is compared with something; `gone` are the tables of the baseline that are missing."""
    sentence = f"the table {in_quotes(name)} is not in the baseline, so it is compared with nothing"
    renamed = f" Missing since the baseline: {some(gone)}." if gone else ""
    return _accepted_by("new", name, sentence, is_accepted, renamed, rule="table-new")


def space_changed(name: str, changes: Sequence[str], is_accepted: bool) -> Gate:
    """Require that the shares of a table are shares of the same contexts as before."""
    sentence = f"other contexts are possible than in the baseline, so that shares are not compared: {'; '.join(changes)}"
    return _accepted_by("redefined", name, sentence, is_accepted, rule="space-changed")


def fewer_expected(now: int, before: int, name: str, is_accepted: bool) -> Gate:
    """Require that no fewer situations are expected of a table than before."""
    sentence = (
        f"{plural(now, 'situation')} of the table {in_quotes(name)} {'is' if now == 1 else 'are'} expected, before {before:,}"
    )
    return _accepted_by("redefined", name, sentence, is_accepted, rule="space-changed")


def fewer_cases(name: str, before: CaseCounts, now: CaseCounts, is_accepted: bool) -> list[Gate]:
    """Require that the saved contexts of a table expect no less than before; no gate where there were none. Rows that were deleted
    need not be reached."""
    if not before.count:
        return []
    expected = max(0, before.rows_reached - max(0, before.rows - now.rows))
    changes = [
        *([f"{now.count:,} saved contexts, before {before.count:,}"] if now.count < before.count else []),
        *([f"{now.exact:,} that expect exactly their assets, before {before.exact:,}"] if now.exact < before.exact else []),
        *([f"{now.rows_reached:,} rows reached, before {before.rows_reached:,}"] if now.rows_reached < expected else []),
    ]
    if not changes:
        words = f"{plural(now.count, 'saved context')}, {plural(now.rows_reached, 'row')} reached; no fewer than in the baseline."
        return [Gate("fewer-cases", 0.0, 0.0, True, words, rule="cases-fewer")]
    sentence = f"the saved contexts of {in_quotes(name)} expect less than in the baseline: {'; '.join(changes)}"
    return [_accepted_by("fewer-cases", name, sentence, is_accepted, rule="cases-fewer")]


def _accepted_by(option: str, name: str, sentence: str, is_accepted: bool, more: str = "", *, rule: str) -> Gate:
    """The gate of what fails unless an option of the command names the table."""
    how = f"--{option}={name}" if re.fullmatch(r"[\w.-]+", name) else f"--{option}={in_quotes(name)}"
    message = f"{sentence}, as --{option} accepts." if is_accepted else f"{sentence}.{more} Where that is intended: {how}."
    return Gate(option, 0.0, 1.0, is_accepted, message, rule=rule, is_accepted=is_accepted)


def fail_under_expected(expected: Expectation | None, limit: float) -> Gate:
    """The gate of a least covered share of what is expected; an estimate counts with its lower bound. Where nothing is expected of
    a table, it passes, and says so."""
    if expected is None:
        message = "not measured: nothing is expected of this table. A --baseline notices when that is new."
        return Gate("fail-under-expected", limit, None, True, message, rule="expected-below", is_accepted=True)
    at_least = "" if expected.covered.method == "exact" else "at least "
    sentence = f"{at_least}{{}} of what is expected is covered"
    return bar("fail-under-expected", expected.covered.lower, limit, sentence, rule="expected-below")


def fail_under_telemetry(telemetry: Observed, limit: float) -> Gate:
    """The gate of a least covered share of the recorded moments; without a moment it fails."""
    if not telemetry.moments:
        return Gate("fail-under-telemetry", limit, None, False, "no moment was recorded.", rule="telemetry-below")
    return bar("fail-under-telemetry", telemetry.covered, limit, "{} of the recorded moments are covered", rule="telemetry-below")


def bar(name: str, value: float, limit: float, sentence: str, rule: str | None = None) -> Gate:
    """The gate of a share that must reach a threshold; `sentence` is what it is, with {} for it."""
    passed = reaches(value, limit)
    reached, wanted = distinct_percents(value, limit) if not passed else (format_percent(value), format_percent(limit))
    message = f"{sentence.format(reached)}, which {'reaches' if passed else 'is below'} the threshold of {wanted}."
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
        yield from gate.findings(report.table, measured.file)
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
