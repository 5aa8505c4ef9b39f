"""JUnit XML: the document, its suites and cases, and bars as cases."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from xml.etree import ElementTree as ET

from contextdb.console import printable
from contextdb.report.results import Gate, as_path


def document(name: str, suites: Iterable[ET.Element]) -> str:
    """A document of some suites, which are counted here."""
    root = ET.Element("testsuites", name=name)
    root.extend(suites)
    for suite in root:
        counts = {"tests": len(suite), "failures": len(suite.findall("testcase/failure")), "errors": 0, "skipped": 0}
        for key, count in counts.items():
            suite.set(key, str(count))
    for key in ("tests", "failures", "errors", "skipped"):
        root.set(key, str(sum(int(suite.get(key, "0")) for suite in root)))
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def case_in(suite: ET.Element, name: str, file: str | None = None) -> ET.Element:
    case = ET.SubElement(suite, "testcase", classname=suite.get("name", ""), name=name, time="0")
    if file:
        case.set("file", as_path(file))
    return case


def bars_of(
    what: str, bars: Sequence[Gate], reached: str, otherwise: str, file: str | None = None, *, in_passed: bool = False
) -> ET.Element:
    """The thresholds of one table or session as a suite: `reached` is the text of a missed one, and with
    `in_passed` of a met one too.

    Without a threshold `reached` is in a case that is called `otherwise`.
    """
    suite = ET.Element("testsuite", name=printable(what))
    for bar in bars:
        case, message = case_in(suite, bar.name, file), printable(bar.message)
        if bar.passed:
            ET.SubElement(case, "system-out").text = f"{message}\n{reached}" if in_passed and reached else message
        else:
            ET.SubElement(case, "failure", type=bar.name, message=message).text = reached
    if not bars:
        ET.SubElement(case_in(suite, otherwise, file), "system-out").text = reached
    return suite
