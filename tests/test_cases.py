"""Saved contexts and what is expected of them: read, kept, checked."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.checks.cases import Case, check_cases, delete_case, exactly, judge, keep_case, read_cases, rename_case
from contextdb.compiled.table import data_of
from contextdb.errors import TableError
from contextdb.tables.other_files import cases_path
from contextdb.tables.table import Table

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


@pytest.mark.parametrize("expected", ["Any", "any", " "])
def test_nothing_need_be_expected(expected):
    [case] = [Case("one", {"speed": "50"}, expected)]
    assert judge(data_of(table_of().compile()), case).holds is None


@pytest.mark.parametrize(
    ("expected", "facts"),
    [('"walk', {}), ("not walk", {}), ("walk ~2", {}), ("+walk -walk", {}), ("not +walk", {}), ("walk", {"speed": "fast"})],
)
def test_a_case_that_cannot_be_read_is_a_finding(expected, facts):
    [found] = check_cases(table_of(), [Case("one", facts, expected, 2)])
    assert found.rule == "unreadable-case"


def test_a_fact_that_no_condition_is_about_is_one_finding_with_the_nearest():
    cases = [Case(name, {"sped": "1", "hit": "True"}, "+walk", line) for line, name in enumerate("abc", 2)]
    [found] = check_cases(table_of(), cases, "t.cases.csv")
    assert (found.rule, found.level, found.line, found.column) == ("unreadable-case", "error", 2, "sped")
    assert 'there is no condition "sped"' in found.message
    assert found.message.endswith('Did you mean "speed"?')


def test_a_fact_of_another_table_of_the_project_is_left_out_of_the_question():
    table = Table.from_columns(ROWS, SCHEMA | {"height": {"type": "number"}})
    assert check_cases(table, [Case("one", {"height": "2", "speed": "1", "hit": "True"}, "walk")]) == []


def test_two_cases_of_one_name_are_told():
    [found] = check_cases(table_of(), [Case("one", {}, "", 2), Case("two", {}, "", 3), Case("one", {}, "", 4)])
    assert (found.level, found.line) == ("warning", 4)
    assert found.message == 'the case "one" is also in line 2: each case needs its own name.'


def test_an_asset_that_must_not_be_valid_and_is_none_of_the_table_is_told():
    [found] = check_cases(table_of(), [Case("one", {"speed": "1", "hit": "True"}, "-wlak", 2)])
    assert found.level == "warning"
    assert found.message.endswith('the table has no asset "wlak"; did you mean "walk"?')


def test_findings_stand_in_the_order_of_the_file():
    cases = [Case("a", {"speed": "3"}, "walk", 2), Case("b", {"spd": "3"}, "", 3), Case("c", {"speed": "x"}, "", 4)]
    assert [f.line for f in check_cases(table_of(), cases)] == [2, 3, 4]


def test_rows_that_cannot_be_read_are_left_out_of_a_judgement():
    compiled = table_of().compile()
    case = Case("one", {"speed": "1", "hit": "True"}, "walk")
    assert judge(data_of(compiled), case).holds is True
    assert judge(data_of(compiled), case, readable=0b1110).missing == ("walk",)


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
    with pytest.raises(TableError, match='no column "Case"'):
        read_cases(path)


def saved(tmp_path: Path) -> Path:
    path = tmp_path / "t.cases.csv"
    path.write_bytes(b'Case,Expected,Note,speed\r\none,walk,why,"1, 2"\r\n"two ",run,,3\r\none,,,4\r\n')
    return path


def test_a_note_is_no_fact_and_is_kept(tmp_path: Path):
    path = saved(tmp_path)
    [one, _, _] = read_cases(path)
    assert (one.note, dict(one.facts)) == ("why", {"speed": "1, 2"})
    keep_case(path, Case("one", {"speed": "9"}, "", one.line, one.note))
    assert path.read_bytes().splitlines()[1] == b"one,,why,9"


def test_a_case_is_renamed_on_its_own_line_and_no_other_byte_changes(tmp_path: Path):
    path = saved(tmp_path)
    before = path.read_bytes()
    rename_case(path, read_cases(path)[2], 'last, "one"')
    assert path.read_bytes() == before.replace(b"\none,,,4", b'\n"last, ""one""",,,4')


def test_a_case_is_deleted_on_its_own_line_and_no_other_byte_changes(tmp_path: Path):
    path = saved(tmp_path)
    before = path.read_bytes()
    delete_case(path, read_cases(path)[2])
    assert path.read_bytes() == before.replace(b"one,,,4\r\n", b"")


def test_the_last_case_can_be_deleted_and_another_one_kept(tmp_path: Path):
    path = tmp_path / "t.cases.csv"
    keep_case(path, Case("one", {"speed": "1"}, "walk"))
    delete_case(path, read_cases(path)[0])
    assert read_cases(path) == []
    keep_case(path, Case("two", {"speed": "2"}))
    assert path.read_text() == "Case,Expected,speed\ntwo,,2\n"


def test_two_cases_cannot_get_one_name(tmp_path: Path):
    path = saved(tmp_path)
    with pytest.raises(TableError, match="already"):
        rename_case(path, read_cases(path)[1], "one")


@pytest.mark.parametrize("change", [delete_case, lambda path, case: rename_case(path, case, "new")])
def test_a_case_that_somebody_else_took_away_is_told(tmp_path: Path, change):
    path = saved(tmp_path)
    before = path.read_bytes()
    with pytest.raises(TableError, match='no case "three" any more'):
        change(path, Case("three", {}))
    assert path.read_bytes() == before


@pytest.mark.parametrize("name", ["Case", "Expected", "Note"])
def test_a_condition_with_a_name_that_the_file_uses_itself_is_refused(tmp_path: Path, name: str):
    path = tmp_path / "t.cases.csv"
    with pytest.raises(TableError, match=f'"{name}"'):
        keep_case(path, Case("one", {name: "1"}))
    assert not path.exists()


def test_a_case_that_somebody_else_keeps_in_the_same_moment_is_not_lost(tmp_path, monkeypatch):
    from contextdb.checks import cases

    path, real = tmp_path / "t.cases.csv", cases.new_source
    keep_case(path, Case("one", {"speed": "1"}, "walk"))

    def meanwhile(*given):
        monkeypatch.setattr(cases, "new_source", real)
        keep_case(path, Case("theirs", {"speed": "2"}, "run"))
        return real(*given)

    monkeypatch.setattr(cases, "new_source", meanwhile)
    keep_case(path, Case("mine", {"speed": "3"}, "run"))
    assert [case.name for case in read_cases(path)] == ["one", "theirs", "mine"]
