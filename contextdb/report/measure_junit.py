"""Measures as JUnit XML: one suite a session, one case a bar; a session without a bar has one case that tells its measures."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from contextdb.console import printable
from contextdb.report.measure_results import MeasureResults, SessionMeasures
from contextdb.report.results import as_path


def render(results: MeasureResults) -> str:
    """The bars as a JUnit document."""
    root = ET.Element("testsuites", name="contextdb motion measure")
    root.extend(_suite(session) for session in results.sessions)
    for name in ("tests", "failures", "errors", "skipped"):
        root.set(name, str(sum(int(suite.get(name, "0")) for suite in root)))
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _suite(session: SessionMeasures) -> ET.Element:
    label = printable(session.file)
    suite = ET.Element("testsuite", name=label)
    said = printable("; ".join(f"{name} {value}" + (f" (raw {raw})" if raw else "") for name, value, raw, _ in session.rows()))
    for gate in session.gates:
        case = ET.SubElement(suite, "testcase", classname=label, name=gate.name, time="0", file=as_path(session.file))
        if gate.passed:
            ET.SubElement(case, "system-out").text = printable(gate.message)
        else:
            ET.SubElement(case, "failure", type=gate.name, message=printable(gate.message)).text = said
    if not session.gates:
        case = ET.SubElement(suite, "testcase", classname=label, name="measures", time="0", file=as_path(session.file))
        ET.SubElement(case, "system-out").text = said
    counts = {"tests": len(suite), "failures": len(suite.findall("testcase/failure")), "errors": 0, "skipped": 0}
    for name, count in counts.items():
        suite.set(name, str(count))
    return suite
