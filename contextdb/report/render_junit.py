"""Findings as JUnit XML: one suite a table, one case a rule, so that a case keeps its name from run to run.

A case fails when its rule has a finding of a level that makes the check fail; its text then lists every place. What does not fail
is in the case's `system-out`. The first line is complete in itself: some CI systems show no more. No times and no dates, so
the same findings give the same bytes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from xml.etree import ElementTree as ET

from contextdb.checks.rules import TABLE_RULES
from contextdb.console import printable
from contextdb.covering import Gap
from contextdb.covering.contracts import Proof
from contextdb.errors import plural
from contextdb.findings import Finding, Level
from contextdb.report.coverage_results import CoverageResults, Measured, gap_moments
from contextdb.report.coverage_words import gaps_sentence
from contextdb.report.results import CheckReport, Gate, Group, as_path, message_of, place_of

MOST_LISTED = 200
"""The most findings that a case lists before it says how many more there are: CI systems refuse reports that grow without end."""


def render(report: CheckReport, failing: Collection[Level], shows_all: bool = False) -> str:
    """The findings as a JUnit document; levels in `failing` make a case fail."""
    suites = [_suite(group, failing, shows_all) for group in report.groups()]
    suites += [_contracts(report.contracts, failing)] if report.contracts else []
    return document(
        "contextdb check", suites or [_suite_of_nothing()]
    )  # some CI systems take a report without a case for a broken one


def _suite(group: Group, failing: Collection[Level], shows_all: bool) -> ET.Element:
    suite = ET.Element("testsuite", name=group.label)
    for rule, findings in _by_rule(group).items():
        case = case_in(suite, printable(rule), group.file)
        failed = [f for f in findings if f.level in failing]
        passed = [f for f in findings if f.level not in failing]
        if failed:
            failure = ET.SubElement(case, "failure", type=failed[0].level, message=_headline(failed))
            failure.text = "\n".join(_lines(failed, shows_all))
        if passed:
            ET.SubElement(case, "system-out").text = "\n".join(_lines(passed, shows_all))
    return suite


def _contracts(proofs: Sequence[Proof], failing: Collection[Level]) -> ET.Element:
    """A case for each contract, which fails where some context breaks it."""
    suite = ET.Element("testsuite", name="contracts")
    for proof in proofs:
        case = case_in(suite, printable(proof.contract.name))
        if proof.holds is False and "error" in failing:
            ET.SubElement(case, "failure", type="broken-contract", message=printable(proof.sentence))
        else:
            ET.SubElement(case, "system-out").text = printable(proof.sentence)
    return suite


def _suite_of_nothing() -> ET.Element:
    suite = ET.Element("testsuite", name="contextdb check")
    case_in(suite, "nothing found")
    return suite


def _by_rule(group: Group) -> dict[str, list[Finding]]:
    """The findings of each rule; of a table that was read also the rules without a finding."""
    findings: dict[str, list[Finding]] = {rule: [] for rule in TABLE_RULES} if group.table else {}
    for finding in group.findings:
        findings.setdefault(finding.rule, []).append(finding)
    return findings


def _headline(findings: list[Finding]) -> str:
    first = _placed(findings[0])
    return first if len(findings) == 1 else f"{plural(len(findings), 'finding')}, the first: {first}"


def _lines(findings: list[Finding], shows_all: bool) -> Iterator[str]:
    listed = findings if shows_all else findings[:MOST_LISTED]
    for finding in listed:
        yield f"{finding.level}: {_placed(finding)}"
    if len(listed) < len(findings):
        yield f"… and {len(findings) - len(listed):,} more"


def _placed(finding: Finding) -> str:
    place = place_of(finding)
    return f"{place}: {message_of(finding)}" if place else message_of(finding)


# ---- jUnit XML: the document, its suites and cases, and bars as cases


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


# ---- coverage as JUnit XML: one suite a table, one case a bar; a table without a bar has one case that tells its share

MOST_GAPS = 20


def render_coverage(results: CoverageResults) -> str:
    others = (bars_of(name, [gate], "", "coverage", in_passed=True) for name, gate in results.others)
    measured = (
        bars_of(each.report.table, each.gates, "\n".join(_coverage_lines(each)), "coverage", each.file, in_passed=True)
        for each in results.tables
    )
    return document("contextdb coverage", [*others, *measured])


def _coverage_lines(measured: Measured) -> list[str]:
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
