"""Rows that stand for other tables in the editor's test row, against the flat table that a game asks."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nested_tables import flat_rows

import contextdb as cdb
from contextdb.checks.cases import check_cases
from contextdb.schema.settings import TableSettings
from contextdb.tables.compiling import compile_table
from contextdb.tables.nesting.links import Neighbours
from contextdb.tables.table import Table
from tui.model.context_list import ContextList
from tui.model.coverage_run import measured
from tui.model.query_row import QueryRow
from tui.model.sheet import Sheet

SCHEMA = {"air": {"type": "bool"}, "speed": {"type": "number", "min": 0, "max": 10}}
BOOLS, NUMBERS = ("Any", "True", "False"), ("Any", "0..5", "3..8", "9")


def made(name: str, assets: list[str], cells: list[tuple[str, str, str]]) -> Table:
    columns = {
        "Asset": assets,
        "Enabled": [cell[2] for cell in cells],
        "air": [cell[0] for cell in cells],
        "speed": [cell[1] for cell in cells],
    }
    settings = TableSettings(name, asset="Asset", enabled="Enabled")
    return Table.from_columns(columns, SCHEMA, settings, name)


@st.composite
def folders(draw: st.DrawFn) -> dict[str, Table]:
    """Three tables: the first may hold the others, the second the third."""
    found: dict[str, Table] = {}
    for name, inside in (("deep", ()), ("inner", ("@deep",)), ("outer", ("@inner", "@deep"))):
        n_rows = draw(st.integers(0 if inside == () else 1, 4))
        assets = [draw(st.sampled_from([f"{name}_{row}", *inside])) for row in range(n_rows)]
        cell = st.tuples(st.sampled_from(BOOLS), st.sampled_from(NUMBERS), st.sampled_from(("True", "True", "False")))
        found[name] = made(name, assets, [draw(cell) for _ in range(n_rows)])
    tables = dict(found)
    for name in ("deep", "inner", "outer"):
        tables[name] = replace(tables[name], around=Neighbours(dict(tables)))
    return tables


@given(folders(), st.sampled_from(("", "True", "False")), st.sampled_from(("", "4", "9", "0..2", "0 ± 3")))
def test_a_row_is_valid_and_counts_as_in_the_flat_table(tables, air, speed):
    outer = tables["outer"]
    query = QueryRow(outer)
    query.load({"air": air, "speed": speed})

    flat = outer.flat()
    facts = {name: fact for name, fact in query.facts.items() if fact is not None}
    flags = compile_table(flat).query(facts, unknown="any").flags
    rows = flat_rows(outer, flat)
    assert query.valid.tolist() == [bool(flags[own].any()) for own in rows]
    for row, own in enumerate(rows):
        inside = query.inside(row)
        assert (inside is not None) == outer.assets[row].startswith("@")
        if inside is not None:
            assert inside.n_rows == len(own)
            assert inside.n_valid == (None if query.is_empty else int(flags[own].sum()))


def test_a_cell_that_cannot_be_read_takes_away_its_own_row_only():
    inner = made("inner", ["a", "b"], [("True", "Any", ""), ("Any", "0..5", "")])
    outer = made("outer", ["plain", "@inner"], [("Any", "Any", ""), ("Any", "Any", "")])
    outer = replace(outer, around=Neighbours({"inner": inner}))
    query = QueryRow(outer)
    query.load({"air": "True", "speed": "2"})
    assert query.inside(1).text == "2 of 2 rows"

    sheet = Sheet(outer)
    sheet.query.load({"air": "True", "speed": "2"})
    sheet.go(0, 3)
    sheet.fill("5; 3")
    assert sheet.query.valid.tolist() == [False, True]
    assert sheet.query.inside(1).text == "2 of 2 rows"


@pytest.mark.parametrize(("asset", "word"), [("@innner", "@inner"), ("@outer", "itself"), ("@", "missing")])
def test_a_table_that_cannot_stand_in_a_row_is_a_fault_of_its_cell(asset, word):
    inner = made("inner", ["a"], [("Any", "Any", "")])
    outer = made("outer", ["plain", asset], [("Any", "Any", ""), ("Any", "Any", "")])
    tables = {"inner": inner, "outer": outer}
    outer = replace(outer, around=Neighbours({**tables, "outer": replace(outer, around=Neighbours(tables))}))
    sheet = Sheet(outer)
    assert word in str(sheet.fault(1, 0))
    assert sheet.fault(0, 0) is None
    assert sheet.query.inside(1).text == "cannot be used"
    sheet.query.load({"air": "True"})
    assert sheet.query.valid.tolist() == [True, False]
    sheet.go(0, 0)
    assert word in str(sheet.type_text(asset))
    assert sheet.type_text("@inner") is None


def test_a_quoted_name_is_an_asset():
    outer = made("outer", ['"@inner"'], [("Any", "Any", "")])
    sheet = Sheet(replace(outer, around=Neighbours({})))
    assert sheet.fault(0, 0) is None
    assert sheet.query.inside(0) is None


def test_facts_of_conditions_that_only_the_inner_table_has_are_asked_of_it():
    inner = made("inner", ["a", "b"], [("Any", "0..5", ""), ("Any", "6..9", "")])
    outer = cdb.Table.from_columns({"Asset": ["@inner"], "air": ["Any"]}, {"air": {"type": "bool"}}, name="outer")
    query = QueryRow(replace(outer, around=Neighbours({"inner": inner})))
    assert query.inside(0).text == "2 rows"
    query.load({"speed": "7"})
    assert query.inside(0).text == "1 of 2 rows"
    query.load({"speed": "5.5"})
    assert np.array_equal(query.valid, [False])


def test_an_edit_of_the_inner_table_changes_what_is_counted():
    inner = made("inner", ["a", "b"], [("Any", "0..5", ""), ("Any", "6..9", "")])
    outer = made("outer", ["@inner"], [("Any", "Any", "")])
    outer = replace(outer, around=Neighbours({"inner": inner}))
    query = QueryRow(outer)
    query.load({"speed": "7"})
    assert query.inside(0).text == "1 of 2 rows"
    query.show(replace(outer, around=Neighbours({"inner": inner.with_cell(0, "speed", "0..7")})))
    assert query.inside(0).text == "2 of 2 rows"


def test_what_coverage_says_of_rows_behind_is_said_of_the_row_that_stands_for_them():
    inner = made("inner", ["a", "b"], [("Any", "0..5", ""), ("Any", "0..5", "")])
    outer = made("outer", ["plain", "@inner"], [("True", "0..2", ""), ("True", "Any", "")])
    outer = replace(outer, around=Neighbours({"inner": inner}))
    report = measured(outer, lambda part, share: None, lambda: False).report
    assert report.n_rows == 3
    rows = {finding.row for finding in report.findings if finding.row is not None}
    assert rows | {row for finding in report.findings for row in finding.by} == {0, 1}
    assert {gap.nearest.row for gap in report.gaps if gap.nearest} <= {0, 1}
    assert [crowd.rows for crowd in report.crowded] == [(0, 1, 1)]


def test_saved_contexts_are_judged_with_the_rows_behind_as_the_command_check_does(tmp_path):
    (tmp_path / "inner.csv").write_text("Asset,speed\nlow,0..3\nhigh,4..9\n")
    (tmp_path / "outer.csv").write_text("Asset,air\n@inner,True\nplain,False\n")
    (tmp_path / "outer.cases.csv").write_text("Case,Expected,air,speed\nfast,outer/inner/high,True,8\nslow,plain,True,1\n")
    table = cdb.load(tmp_path / "outer.csv")
    contexts = ContextList.beside(table)
    assert [contexts.verdict(i).holds for i in range(2)] == [True, False]
    failing = [f.message for f in check_cases(table, contexts.cases) if f.rule == "case-failed"]
    assert len(failing) == contexts.n_failing == 1


def test_the_assets_behind_a_row_are_answered_in_its_place():
    inner = made("inner", ["low", "high"], [("Any", "0..5", ""), ("Any", "6..9", "")])
    outer = made("outer", ["plain", "@inner", "@gone"], [("Any", "8", ""), ("True", "Any", ""), ("Any", "Any", "")])
    query = QueryRow(replace(outer, around=Neighbours({"inner": inner})))
    query.load({"speed": "7", "air": "True"})
    assert list(query.answers()) == [("plain", False), ("low", False), ("high", True), ("@gone", False)]
    query.set("air", "False")
    assert [is_valid for _, is_valid in query.answers()] == [False] * 4


def test_rows_behind_rows_behind_a_row_are_counted_in_a_table_that_is_opened_alone(tmp_path):
    (tmp_path / "outer.csv").write_text("Asset,speed\n@inner,Any\n")
    (tmp_path / "inner.csv").write_text("Asset,speed\nroll,..3\n@deep,Any\n")
    (tmp_path / "deep.csv").write_text("Asset,speed\na,1\nb,2\nc,7\n")
    query = QueryRow(cdb.load(tmp_path / "outer.csv"))
    query.load({"speed": "2"})
    assert query.inside(0).text == "2 of 4 rows"
    query.load({"speed": "7"})
    assert query.inside(0).text == "1 of 4 rows"
