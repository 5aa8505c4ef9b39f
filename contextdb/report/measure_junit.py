"""Measures as JUnit XML: one suite a session, one case a bar; a session without a bar has one case that tells its measures."""

from __future__ import annotations

from contextdb.console import printable
from contextdb.report.junit_parts import bars_of, document
from contextdb.report.measure_results import MeasureResults, SessionMeasures


def render(results: MeasureResults) -> str:
    """The bars as a JUnit document."""
    suites = (bars_of(each.file, each.gates, _said(each), "measures", each.file) for each in results.sessions)
    return document("contextdb motion measure", suites)


def _said(session: SessionMeasures) -> str:
    return printable("; ".join(f"{name} {value}" + (f" (raw {raw})" if raw else "") for name, value, raw, _ in session.rows()))
