"""GitHub annotations, read back as the runner of GitHub Actions reads them."""

import re

from hypothesis import given
from report_strategies import EXAMPLE, reports

from contextdb.console import printable
from contextdb.findings import LEVELS, Finding
from contextdb.report import render_github
from contextdb.report.results import CheckReport, as_path, message_of

KINDS = {"error": "error", "warning": "warning", "info": "notice"}


def unescaped(text: str, escapes: str) -> str:
    """What the runner makes of a value: one escape after the other, "%" last."""
    for character in escapes:
        text = text.replace(f"%{ord(character):02X}", character)
    return text


def read_back(line: str) -> tuple[str, dict[str, str], str]:
    """A command, its properties and its message. The runner looks for the second "::", splits at "," and at the first "="."""
    assert line.startswith("::")
    head, _, data = line[2:].partition("::")
    command, _, properties = head.partition(" ")
    pairs = [part.partition("=") for part in properties.strip().split(",") if part]
    return command, {key: unescaped(value, "\r\n:,%") for key, _, value in pairs}, unescaped(data, "\r\n%")


@given(reports())
def test_the_runner_reads_back_what_was_found(report: CheckReport):
    lines = re.split(r"\r\n|\r|\n", render_github.render(report))
    ordered = sorted(report.findings, key=lambda f: LEVELS.index(f.level))
    assert lines.pop() == ""
    assert len(lines) == len(ordered)
    for line, finding in zip(lines, ordered, strict=True):
        expected = {"title": f"contextdb {printable(finding.rule)}"}
        if finding.file:
            expected |= {"file": as_path(finding.file)} | ({"line": str(finding.line)} if finding.line else {})
        assert read_back(line) == (KINDS[finding.level], expected, message_of(finding))


def test_annotations_look_as_github_documents_them():
    assert render_github.render(EXAMPLE).splitlines() == [
        '::error file=tables/jog.csv,line=5,title=contextdb empty-cell::"Jog_Fast", column "speed": "5..3" accepts no value.',
        '::error file=tables/jog.csv,line=10,title=contextdb empty-cell::"Jog_Slow", column "speed": "9..1" accepts no value.',
        "::error file=tables/jump.csv,title=contextdb unreadable::the file is empty.",
        '::warning file=tables/run.parquet,title=contextdb identical-rows::row 3, "Run_2": the same as row 0: 50%25, a|b.',
        '::notice file=tables/jog.csv,title=contextdb undeclared-condition::column "IsLeft": its cells read as bool.',
    ]


def test_a_value_cannot_end_its_property():
    finding = Finding("no-rows", "warning", "100%\n::error::x", None, "a,b:c=d%2C.csv", line=1)
    (line, _) = render_github.render(CheckReport((), (finding,))).split("\n")
    place = "file=a%2Cb%3Ac=d%252C.csv,line=1,title=contextdb no-rows"
    assert line == rf"::warning {place}::100%25\n::error::x"


def test_nothing_found_is_no_annotation():
    assert render_github.render(CheckReport((), ())) == ""
