"""Saved contexts and what is expected of them: read, kept, checked."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.cases import Case, cases_path, check_cases, exactly, keep_case, read_cases
from contextdb.errors import TableError
from contextdb.table import Table

SCHEMA = {"speed": {"type": "number"}, "hit": {"type": "bool"}}
ROWS = {"Asset": ["walk", "run", "Half Way", "+odd"], "speed": ["0..2", "2..6", "Any", "9"], "hit": ["True", "Any", "False", "Any"]}


def table_of() -> Table:
    return Table.from_columns(ROWS, SCHEMA)


def messages(expected: str, **facts: str) -> list[str]:
    return [f.message for f in check_cases(table_of(), [Case("one", facts, expected, 2)], "t.cases.csv")]


@pytest.mark.parametrize("expected", ['"Half Way"', '+"Half Way" -walk', "-run", "", "-"])
def test_a_case_that_holds_has_no_finding(expected):
    assert messages(expected, speed="1", hit="False") == []


def test_a_case_that_fails_says_which_assets_and_where():
    table = table_of()
    [found] = check_cases(table, [Case("fast", {"speed": "3", "hit": "True"}, "walk", 7)], "t.cases.csv")
    assert (found.rule, found.level, found.line, found.file) == ("case-failed", "error", 7, "t.cases.csv")
    assert found.message == 'the case "fast" fails: "walk" should be valid and is not; "run" should not be valid and is.'


def test_signs_say_what_must_and_must_not_be_valid_whatever_else_is():
    assert messages("+run -walk", speed="2", hit="True") == [
        'the case "one" fails: "walk" should not be valid and is.',
    ]


def test_nothing_may_be_expected_to_be_valid():
    assert messages("(none)", speed="50", hit="True") == []
    assert "should not be valid" in messages("(none)", speed="1")[0]


def test_an_asset_that_the_table_does_not_have_is_told_with_the_nearest():
    assert 'did you mean "walk"?' in messages("wolk", speed="1", hit="True")[0]


@pytest.mark.parametrize(("expected", "facts"), [('"walk', {}), ("not walk", {}), ("walk", {"speed": "fast"})])
def test_a_case_that_cannot_be_read_is_a_finding(expected, facts):
    [found] = check_cases(table_of(), [Case("one", facts, expected, 2)])
    assert found.rule == "unreadable-case"


@given(st.floats(-5, 20).map(str), st.sampled_from(["True", "False", ""]))
def test_the_assets_that_are_valid_now_are_what_a_kept_case_expects(speed, hit):
    table = table_of()
    valid = table.compile().query({"speed": float(speed), "hit": {"": None}.get(hit, hit == "True")}, unknown="any").assets
    assert check_cases(table, [Case("now", {"speed": speed, "hit": hit}, exactly(valid))]) == []


def test_cases_are_kept_in_a_file_and_read_back(tmp_path: Path):
    path = cases_path(tmp_path / "t.csv")
    assert path.name == "t.cases.csv"
    assert read_cases(path) == []
    keep_case(path, Case("one", {"speed": "1, 2"}, "walk"))
    keep_case(path, Case("two", {"hit": "True"}))
    keep_case(path, Case("one", {"speed": "3"}, "run"))
    assert path.read_text() == "Case,Expected,speed,hit\none,run,3,\ntwo,,,True\n"
    assert [(c.name, dict(c.facts), c.expected, c.line) for c in read_cases(path)] == [
        ("one", {"speed": "3"}, "run", 2),
        ("two", {"hit": "True"}, "", 3),
    ]


def test_a_file_without_names_is_refused(tmp_path: Path):
    path = tmp_path / "t.cases.csv"
    path.write_text("cases,speed\na,1\n")
    with pytest.raises(TableError, match='has a column "Case"'):
        read_cases(path)
