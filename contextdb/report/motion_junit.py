"""Measures and motion coverage as JUnit XML: a suite a session or table, a case a bar; without a bar one case that says what was
measured."""

from __future__ import annotations

from contextdb.console import printable
from contextdb.report.measure_results import MeasureResults, SessionMeasures
from contextdb.report.motion_coverage_results import MotionCoverageResults, MotionMeasured, capture_sentence
from contextdb.report.render_junit import bars_of, document

MOST_CAPTURES = 5


def measures(results: MeasureResults) -> str:
    suites = (bars_of(each.file, each.gates, _measured(each), "measures", each.file) for each in results.sessions)
    return document("contextdb motion measure", suites)


def _measured(session: SessionMeasures) -> str:
    return printable("; ".join(f"{name} {value}" + (f" (raw {raw})" if raw else "") for name, value, raw, _ in session.rows()))


def motion_coverage(results: MotionCoverageResults) -> str:
    gone = (bars_of(name, [gate], "", "motion coverage") for name, gate in results.gone.items())
    measured = (bars_of(each.motion.name, each.gates, _captures(each), "motion coverage") for each in results.tables)
    return document("contextdb motion coverage", [*gone, *measured])


def _captures(measured: MotionMeasured) -> str:
    captures = [capture_sentence(each) for each in measured.motion.coverage.to_capture[:MOST_CAPTURES]]
    return "\n".join(printable(line) for line in (measured.headline, *captures))
