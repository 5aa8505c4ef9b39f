"""Motion coverage as JUnit XML: one suite a table, one case a bar; a table without a bar has one case that tells its share."""

from __future__ import annotations

from contextdb.console import printable
from contextdb.report.junit_parts import bars_of, document
from contextdb.report.motion_coverage_results import MotionCoverageResults, MotionMeasured, capture_sentence

MOST_CAPTURES = 5


def render(results: MotionCoverageResults) -> str:
    """The bars as a JUnit document."""
    gone = (bars_of(name, [gate], "", "motion coverage") for name, gate in results.gone.items())
    measured = (bars_of(each.motion.name, each.gates, _said(each), "motion coverage") for each in results.tables)
    return document("contextdb motion coverage", [*gone, *measured])


def _said(measured: MotionMeasured) -> str:
    captures = [capture_sentence(each) for each in measured.motion.coverage.to_capture[:MOST_CAPTURES]]
    return "\n".join(printable(line) for line in (measured.headline, *captures))
