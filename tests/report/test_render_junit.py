"""JUnit XML, read back by an XML parser."""

from collections import Counter
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_strategies import EXAMPLE, JOG, many, reports

from contextdb import report as formats
from contextdb.checks.rules import TABLE_RULES
from contextdb.findings import LEVELS, Level
from contextdb.report import render_junit
from contextdb.report.results import CheckReport, message_of

SOME = reports().filter(CheckReport.groups)


def read(report: CheckReport, failing: tuple[Level, ...] = ("error",)) -> ET.Element:
    """The document that is rendered."""
    return ET.fromstring(render_junit.render(report, failing, shows_all=False).encode())


@given(SOME, st.lists(st.sampled_from(LEVELS), unique=True).map(tuple))
def test_the_cases_that_fail_are_those_with_a_finding_that_fails(report: CheckReport, failing: tuple[Level, ...]):
    root = read(report, failing)
    groups = report.groups()
    assert [suite.get("name") for suite in root] == [g.label for g in groups]
    for suite, group in zip(root, groups, strict=True):
        failed = {case.get("name") for case in suite if case.find("failure") is not None}
        assert failed == {f.rule for f in group.findings if f.level in failing}


@given(SOME)
def test_every_finding_is_told_in_the_case_of_its_rule(report: CheckReport):
    for suite, group in zip(read(report), report.groups(), strict=True):
        cases = {case.get("name"): "".join(case.itertext()) for case in suite}
        assert all(message_of(f) in cases[f.rule] for f in group.findings)


@given(SOME)
def test_counts_are_those_of_the_cases_and_no_case_stands_twice(report: CheckReport):
    root = read(report)
    for element in (root, *root):
        assert element.get("tests") == str(len(list(element.iter("testcase"))))
        assert element.get("failures") == str(len(list(element.iter("failure"))))
        assert element.get("errors") == element.get("skipped") == "0"
    names = Counter((case.get("classname"), case.get("name")) for case in root.iter("testcase"))
    assert set(names.values()) <= {1}


def test_a_table_without_a_finding_passes_every_rule():
    (suite,) = read(CheckReport((JOG,), ()))
    assert [case.get("name") for case in suite] == list(TABLE_RULES)
    assert suite.get("failures") == "0"
    assert {case.get("file") for case in suite} == {"tables/jog.csv"}


def test_a_failure_says_the_first_place_and_lists_them_all():
    failure = read(EXAMPLE).find("testsuite[@name='jog']/testcase[@name='empty-cell']/failure")
    assert failure is not None
    first = 'tables/jog.csv:5: "Jog_Fast", column "speed": "5..3" accepts no value.'
    assert failure.get("message") == f"2 findings, the first: {first}"
    assert failure.text == f'error: {first}\nerror: tables/jog.csv:10: "Jog_Slow", column "speed": "9..1" accepts no value.'


@pytest.mark.parametrize(("failing", "n_failures"), [((), 0), (("error",), 2), (("error", "warning"), 3)])
def test_the_levels_that_fail_are_those_of_the_command(failing: tuple[Level, ...], n_failures: int):
    assert f'failures="{n_failures}"' in formats.render("junit", EXAMPLE, failing=failing).splitlines()[1]


def test_a_long_list_says_how_many_more_there_are():
    failure = read(many(1234)).find(".//failure")
    assert failure is not None
    assert failure.text is not None
    assert failure.text.splitlines()[200:] == ["… and 1,034 more"]


def test_a_report_without_a_finding_has_a_case_that_passes():
    (suite,) = read(CheckReport((), ()))
    assert [case.get("name") for case in suite] == ["nothing found"]
    assert (suite.get("tests"), suite.get("failures")) == ("1", "0")
