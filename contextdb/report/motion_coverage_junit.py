"""Motion coverage as JUnit XML: one suite a table, one case a bar; a table without a bar has one case that tells its share."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree as ET

from contextdb.console import printable
from contextdb.report.measure_results import Gate
from contextdb.report.motion_coverage_results import MotionCoverageResults, MotionMeasured, capture_sentence

MOST_CAPTURES = 5


def render(results: MotionCoverageResults) -> str:
    """The bars as a JUnit document."""
    root = ET.Element("testsuites", name="contextdb motion coverage")
    root.extend(_suite(name, [gate], "") for name, gate in results.gone.items())
    root.extend(_suite(measured.motion.name, measured.gates, _said(measured)) for measured in results.tables)
    for name in ("tests", "failures", "errors", "skipped"):
        root.set(name, str(sum(int(suite.get(name, "0")) for suite in root)))
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _suite(name: str, gates: Sequence[Gate], said: str) -> ET.Element:
    label = printable(name)
    suite = ET.Element("testsuite", name=label)
    for gate in gates:
        case = ET.SubElement(suite, "testcase", classname=label, name=gate.name, time="0")
        if gate.passed:
            ET.SubElement(case, "system-out").text = printable(gate.message)
        else:
            ET.SubElement(case, "failure", type=gate.name, message=printable(gate.message)).text = said
    if not gates:
        ET.SubElement(ET.SubElement(suite, "testcase", classname=label, name="motion coverage", time="0"), "system-out").text = said
    counts = {"tests": len(suite), "failures": len(suite.findall("testcase/failure")), "errors": 0, "skipped": 0}
    for key, count in counts.items():
        suite.set(key, str(count))
    return suite


def _said(measured: MotionMeasured) -> str:
    captures = [capture_sentence(each) for each in measured.motion.coverage.to_capture[:MOST_CAPTURES]]
    return "\n".join(printable(line) for line in (measured.headline, *captures))
