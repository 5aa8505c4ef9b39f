"""Coverage as JUnit XML: one suite a table, one case a bar; a table without a bar has one case that tells its share."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from contextdb.console import printable
from contextdb.covering import Gap
from contextdb.report.coverage_results import CoverageResults, Gate, Measured, gap_moments
from contextdb.report.coverage_words import gaps_sentence
from contextdb.report.results import as_path

MOST_GAPS = 20


def render(results: CoverageResults) -> str:
    """The bars as a JUnit document."""
    root = ET.Element("testsuites", name="contextdb coverage")
    root.extend(_gone_suite(name, gate) for name, gate in results.gone.items())
    root.extend(_suite(measured) for measured in results.tables)
    for name in ("tests", "failures", "errors", "skipped"):
        root.set(name, str(sum(int(suite.get(name, "0")) for suite in root)))
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _suite(measured: Measured) -> ET.Element:
    label = printable(measured.report.table)
    suite = ET.Element("testsuite", name=label)
    said = "\n".join(_lines(measured))
    for gate in measured.gates:
        _told(_case(suite, label, gate.name, measured.file), gate, said)
    if not measured.gates:
        ET.SubElement(_case(suite, label, "coverage", measured.file), "system-out").text = said
    return _counted(suite)


def _gone_suite(table: str, gate: Gate) -> ET.Element:
    """A table of the baseline that no longer exist: one case."""
    label = printable(table)
    suite = ET.Element("testsuite", name=label)
    _told(_case(suite, label, gate.name, None), gate, "")
    return _counted(suite)


def _told(case: ET.Element, gate: Gate, said: str) -> None:
    message = printable(gate.message)
    if gate.passed:
        ET.SubElement(case, "system-out").text = "\n".join(filter(None, [message, said]))
    else:
        ET.SubElement(case, "failure", type=gate.name, message=message).text = said


def _counted(suite: ET.Element) -> ET.Element:
    counts = {"tests": len(suite), "failures": len(suite.findall("testcase/failure")), "errors": 0, "skipped": 0}
    for name, count in counts.items():
        suite.set(name, str(count))
    return suite


def _case(suite: ET.Element, label: str, name: str, file: str | None) -> ET.Element:
    case = ET.SubElement(suite, "testcase", classname=label, name=name, time="0")
    if file:
        case.set("file", as_path(file))
    return case


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
