"""Coverage as JUnit XML: one suite a table, one case a bar; a table without a bar has one case that tells its share."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from contextdb.console import printable
from contextdb.covering import Gap
from contextdb.report.coverage_results import CoverageResults, Measured, gap_moments
from contextdb.report.coverage_words import gaps_sentence
from contextdb.report.results import as_path

MOST_GAPS = 20


def render(results: CoverageResults) -> str:
    """The bars as a JUnit document."""
    root = ET.Element("testsuites", name="contextdb coverage")
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
        case = _case(suite, label, gate.name, measured)
        if gate.passed:
            ET.SubElement(case, "system-out").text = f"{printable(gate.message)}\n{said}"
        else:
            ET.SubElement(case, "failure", type=gate.name, message=printable(gate.message)).text = said
    if not measured.gates:
        ET.SubElement(_case(suite, label, "coverage", measured), "system-out").text = said
    n_failed = sum(not gate.passed for gate in measured.gates)
    for name, count in {"tests": len(suite), "failures": n_failed, "errors": 0, "skipped": 0}.items():
        suite.set(name, str(count))
    return suite


def _case(suite: ET.Element, label: str, name: str, measured: Measured) -> ET.Element:
    case = ET.SubElement(suite, "testcase", classname=label, name=name, time="0")
    if measured.file:
        case.set("file", as_path(measured.file))
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
