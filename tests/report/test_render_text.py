"""Text for a terminal: what it says, how wide it gets and where it stops."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_strategies import EXAMPLE, JOG, TEXTS, many, reports

from contextdb.console import printable, width_of
from contextdb.findings import Finding
from contextdb.report import render_text
from contextdb.report.render_text import wrapped
from contextdb.report.results import CheckReport, TableSummary, message_of, place_of


def squeezed(text: str) -> str:
    """The text without any space, as wrapping may put some in."""
    return re.sub(r"\s", "", text)


@given(reports())
def test_every_message_is_there_in_full_beside_its_place(report: CheckReport):
    text = squeezed(render_text.render(report, shows_all=True))
    for finding in report.findings:
        assert squeezed(place_of(finding) + message_of(finding, names_asset=False)) in text


@given(reports(), st.integers(60, 160))
def test_no_line_is_wider_than_the_terminal_but_for_a_place(report: CheckReport, width: int):
    places = {place_of(f) for f in report.findings}
    for line in render_text.render(report, width=width).splitlines():
        assert width_of(line) <= width or line.strip() in {p.strip() for p in places}


@given(reports())
def test_colour_changes_nothing_but_the_colour(report: CheckReport):
    coloured = render_text.render(report, colour=True)
    assert re.sub(r"\x1b\[\d+m", "", coloured) == render_text.render(report)


@given(TEXTS, st.integers(2, 40))
def test_wrapping_loses_nothing_and_keeps_to_the_width(text: str, width: int):
    lines = wrapped(printable(text), width)
    assert squeezed("".join(lines)) == squeezed(printable(text))
    assert all(width_of(line) <= width for line in lines)


def test_wrapping_breaks_at_spaces_and_inside_words_only_where_it_must():
    assert wrapped("to be or not to be", 9) == ["to be or", "not to be"]
    assert wrapped("a Going_Up_And_Down b", 8) == ["a", "Going_Up", "_And_Dow", "n b"]
    assert wrapped("漢字漢字", 4) == ["漢字", "漢字"]
    assert wrapped("", 4) == [""]


def test_a_report_reads_as_written():
    assert render_text.render(EXAMPLE) == (
        "jog: 17 rows, 8 conditions\n"
        "  error  empty-cell\n"
        '    tables/jog.csv:5   column "speed": "5..3" accepts no value.\n'
        '    tables/jog.csv:10  column "speed": "9..1" accepts no value.\n'
        "  info  undeclared-condition\n"
        '    tables/jog.csv     column "IsLeft": its cells read as bool.\n'
        "\n"
        "jump\n"
        "  error  unreadable\n"
        "    tables/jump.csv  the file is empty.\n"
        "\n"
        "run: 3 rows, 1 condition\n"
        "  warning  identical-rows\n"
        "    tables/run.parquet  row 3: the same as row 0: 50%, a|b.\n"
        "\n"
        "walk: 1 row, 2 conditions, nothing found\n"
        "\n"
        "3 tables checked: 3 errors, 1 warning, 1 info.\n"
    )


def test_a_table_without_a_finding_says_so():
    expected = "jog: 17 rows, 8 conditions, nothing found\n\n1 table checked: nothing found.\n"
    assert render_text.render(CheckReport((JOG,), ())) == expected
    assert render_text.render(CheckReport((), ())) == "0 tables checked: nothing found.\n"


def test_a_message_stands_under_a_place_that_leaves_it_no_room():
    file = "tables/of/a/very/deep/folder/that/goes/on/and/on/until/there/is/no/room/left.csv"
    text = render_text.render(CheckReport((), (Finding("unreadable", "error", "the file is empty.", None, file, line=3),)))
    assert f"    {file}:3\n      the file is empty.\n" in text


def test_many_findings_of_a_rule_are_shortened_unless_all_are_asked_for():
    report = many(50)
    text = render_text.render(report)
    assert "    … and 30 more\n" in text
    assert text.endswith("1 table checked: 50 errors. 30 of them not shown; --all shows every one.\n")
    whole = render_text.render(report, shows_all=True)
    assert whole.count("accepts no value") == 50
    assert whole.endswith("1 table checked: 50 errors.\n")


@pytest.mark.parametrize(
    "report",
    [many(5000), many(100, 1, ("a", "b", "c", "d", "e", "f")), many(7, 5), many(3, 200), many(0, 300)],
    ids=["many findings", "many rules", "some tables", "many tables", "many clean tables"],
)
def test_about_forty_lines_are_enough_however_much_is_found(report: CheckReport):
    text = render_text.render(report)
    assert len(text.splitlines()) <= 41
    shown = text.count("accepts no value")
    hidden = re.search(r"([\d,]+) of them not shown", text)
    assert shown + (int(hidden[1].replace(",", "")) if hidden else 0) == len(report.findings)


def test_clean_tables_are_counted_when_there_are_many():
    clean = CheckReport(tuple(TableSummary(f"t{i}", None, 1, 1) for i in range(30)), ())
    assert "t7: 1 row, 1 condition, nothing found\n… and 22 more tables with nothing found\n" in render_text.render(clean)
    assert render_text.render(clean, shows_all=True).count("nothing found\n") == 30
