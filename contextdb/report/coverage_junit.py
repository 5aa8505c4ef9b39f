"""Coverage as JUnit XML: one suite a table, one case a bar; a table without a bar has one case that tells its share."""

from __future__ import annotations

from contextdb.console import printable
from contextdb.covering import Gap
from contextdb.report.coverage_results import CoverageResults, Measured, gap_moments
from contextdb.report.coverage_words import gaps_sentence
from contextdb.report.junit_parts import bars_of, document

MOST_GAPS = 20


def render(results: CoverageResults) -> str:
    others = (bars_of(name, [gate], "", "coverage", in_passed=True) for name, gate in results.others)
    measured = (
        bars_of(each.report.table, each.gates, "\n".join(_lines(each)), "coverage", each.file, in_passed=True)
        for each in results.tables
    )
    return document("contextdb coverage", [*others, *measured])


def _lines(measured: Measured) -> list[str]:
    report = measured.report
    lines = [report.headline, gaps_sentence(report)]
    if measured.change is not None:
        lines += [f"new gap: {gap.text}" for gap in measured.change.opened[:MOST_GAPS]]
    lines += [f"gap: {gap.text}{_moments(gap)}" for gap in report.gaps[:MOST_GAPS]]
    if len(report.gaps) > MOST_GAPS:
        lines.append(f"… and {len(report.gaps) - MOST_GAPS:,} more")
    return [printable(line) for line in lines]


def _moments(gap: Gap) -> str:
    return "" if gap.telemetry is None else f" ({gap_moments(gap)} of the recorded moments)"
