"""What `contextdb check` finds of rows, assumptions and declarations."""

import random
from pathlib import Path

import pytest
from brute import random_table
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import contextdb as cdb
from contextdb.checks.run import check_rows
from contextdb.commands.check_command import check_path
from contextdb.covering import coverage
from contextdb.schema.settings import TableSettings
from contextdb.tables.variety import identical_rows

TOML = """
[conditions.speed]
type = "number"
min = 0
max = 10

[conditions.tired]
type = "bool"

[conditions.angle]
type = "angle"

[conditions.twice]
type = "number"
expr = "speed * 2"
"""


@pytest.fixture
def rules_of(tmp_path: Path):
    def found(rows: str, settings: str = "", path: str = "") -> list[tuple[str, str | None, int | None]]:
        (tmp_path / "contextdb.toml").write_text(f"{TOML}\n[tables.jog]\n{settings}\n", encoding="utf-8")
        (tmp_path / "jog.csv").write_text(rows, encoding="utf-8")
        return [(f.rule, f.column, f.line) for f in check_path(str(tmp_path / path)).findings]

    return found


def test_conditions_that_no_table_uses_are_told_with_their_line_when_the_folder_is_checked(rules_of):
    rows = "Asset,speed\nslow,0..5\nfast,5..10\n"
    assert rules_of(rows) == [
        ("unused-condition", "tired", 7),
        ("unused-condition", "angle", 10),
        ("unused-condition", "twice", 13),
    ]
    assert rules_of(rows, path="jog.csv") == []


def test_a_condition_is_used_by_assumptions_and_by_what_is_computed_from_it(rules_of):
    assert rules_of("Asset,twice\nslow,0..5\n", 'assume = ["not tired or twice < 3"]') == [("unused-condition", "angle", 10)]


def test_nothing_is_called_unused_where_a_table_cannot_be_read(rules_of):
    assert {rule for rule, _, _ in rules_of("Asset,speed\nslow,0..5,1\n")} == {"unreadable"}


def test_a_condition_that_is_always_any_is_told_and_disabled_rows_do_not_count(rules_of):
    rows = "Asset,speed,tired,On\na,0..5,Any,True\nb,5..10,,True\nc,5..10,True,False\n"
    assert rules_of(rows, 'enabled = "On"', "jog.csv") == [("always-any", "tired", None)]


def test_contradicting_assumptions_are_named(rules_of):
    assert rules_of("Asset,speed\na,0..5\n", 'assume = ["speed > 5", "speed < 4"]', "jog.csv") == [("no-context", None, None)]


def test_rows_are_not_judged_where_cells_cannot_be_read(rules_of):
    assert [rule for rule, _, _ in rules_of("Asset,speed\na,0..5\nb,1..2\nc,x\n", path="jog.csv")] == ["unreadable-cell"]


@examples(10)
@given(st.integers(0, 2**32))
def test_a_check_finds_of_small_tables_what_coverage_finds(seed):
    rng = random.Random(seed)
    table = random_table(rng, rng.choice(["collect", "first", "priority", "unique"]))
    found = [f for f in check_rows(table) if f.rule != "always-any"]
    report = coverage(table, samples=0)
    of_cells = {f.row for f in identical_rows(table)}
    told = [*report.findings, *report.needless]
    groups = [f for f in told if f.rule == "variety"]
    assert [f for f in found if f.rule != "variety"] == [f for f in report.findings if f.rule not in ("variety", "identical-rows")]
    assert all(any(f.row == g.row and set(f.by) <= set(g.by) for g in groups) for f in found if f.rule == "variety")
    needless = {f.row for f in report.needless} - of_cells
    assert needless <= {row for f in found if f.rule == "variety" for row in (f.row, *f.by)}


def test_of_a_rule_that_many_rows_break_the_first_are_named_and_how_many_more(monkeypatch):
    monkeypatch.setattr("contextdb.checks.run.MOST_ROWS", 3)
    columns = {"Asset": [f"a{i}" for i in range(9)], "speed": ["Any", *(f"{i}..{i + 3}" for i in range(8))]}
    speed = {"speed": {"type": "number", "min": 0.0, "max": 20.0}}
    table = cdb.Table.from_columns(columns, speed, TableSettings("table", policy="first"))
    found = [f for f in check_rows(table) if f.rule == "subsumed-row"]
    assert [f.row for f in found] == [1, 2, 3, 4]
    assert "(5 rows like this one are not listed.)" in found[-1].message


def test_a_row_that_one_row_alone_makes_redundant_names_it(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text(f'{TOML}\n[tables.jog]\nwhen = "When"\npolicy = "first"\n', encoding="utf-8")
    rows = "Asset,speed,tired,When\nin it,6..8,True,\nwide,Any,Any,tired or speed > 5\n"
    (tmp_path / "jog.csv").write_text(rows, encoding="utf-8")
    told = [f.message for f in check_rows(cdb.load(tmp_path / "jog.csv")) if f.rule == "redundant-row"]
    assert told == ['wherever it is valid, line 3 ("wide") is valid too.']


def test_rows_that_the_work_does_not_decide_are_counted_in_one_finding_that_fails_nothing():
    rng = random.Random(3)
    names = [f"c{i}" for i in range(8)]
    columns = {"Asset": [f"a{i}" for i in range(60)]}
    columns |= {name: [rng.choice(["True", "False", "Any"]) for _ in range(60)] for name in names}
    table = cdb.Table.from_columns(columns, {name: {"type": "bool"} for name in names})
    found = check_rows(table, work=1)
    assert [(f.rule, f.level, f.row) for f in found if f.rule == "undecided-rows"] == [("undecided-rows", "info", None)]
    told = next(f.message for f in found if f.rule == "undecided-rows")
    assert "of 60 rows" in told
    assert "--work" in told
    assert "undecided-rows" not in {f.rule for f in check_rows(table)}
