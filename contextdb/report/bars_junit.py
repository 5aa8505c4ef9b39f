"""Coverage and measures as JUnit XML: one suite a table or session, one case a bar; without a bar one case that says what was
measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

from contextdb.console import printable
from contextdb.covering import Gap
from contextdb.report.coverage_results import CoverageResults, Measured, gap_moments
from contextdb.report.coverage_words import gaps_sentence
from contextdb.report.junit_parts import bars_of, document

if TYPE_CHECKING:
    from contextdb.report.measure_results import MeasureResults, SessionMeasures
    from contextdb.report.motion_coverage_results import MotionCoverageResults, MotionMeasured

MOST_GAPS, MOST_CAPTURES = 20, 5


def coverage(results: CoverageResults) -> str:
    """The bars of tables."""
    gone = (bars_of(name, [gate], "", "coverage", with_kept=True) for name, gate in results.gone.items())
    measured = (
        bars_of(each.report.table, each.gates, "\n".join(_lines(each)), "coverage", each.file, with_kept=True)
        for each in results.tables
    )
    return document("contextdb coverage", [*gone, *measured])


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


def measures(results: MeasureResults) -> str:
    """The bars of sessions."""
    suites = (bars_of(each.file, each.gates, _measured(each), "measures", each.file) for each in results.sessions)
    return document("contextdb motion measure", suites)


def _measured(session: SessionMeasures) -> str:
    return printable("; ".join(f"{name} {value}" + (f" (raw {raw})" if raw else "") for name, value, raw, _ in session.rows()))


def motion_coverage(results: MotionCoverageResults) -> str:
    """The bars of the clips of tables."""
    gone = (bars_of(name, [gate], "", "motion coverage") for name, gate in results.gone.items())
    measured = (bars_of(each.motion.name, each.gates, _captures(each), "motion coverage") for each in results.tables)
    return document("contextdb motion coverage", [*gone, *measured])


def _captures(measured: MotionMeasured) -> str:
    from contextdb.report.motion_coverage_results import capture_sentence  # with the motion search

    captures = [capture_sentence(each) for each in measured.motion.coverage.to_capture[:MOST_CAPTURES]]
    return "\n".join(printable(line) for line in (measured.headline, *captures))
