"""The list of contexts: stepping, what is expected, saving, and long recordings."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from contextdb.checks.cases import exactly
from contextdb.errors import ContextDBError, ContextError, FileError, TableError
from contextdb.tables.project import load
from contextdb.tables.table import Table
from tui.model import context_list
from tui.model.context_list import ContextList, expectation_fault, readable_rows, summary
from tui.model.query_row import QueryRow

TOML = """
[conditions.speed]
type = "number"
[conditions.gait]
type = "enum"
values = ["Walk", "Run", "Half Way"]
[conditions.tags]
type = "tags"
"""
TABLE = "Asset,speed,gait,tags\nwalk,0..2,Walk,Any\nrun,2..6,Run,Any\nslide,Any,Any,+InAir\n"
CASES = "Case,Expected,speed,gait,height\nslow,walk slide,1,Walk,3\nfast,walk,5,Run,\nlook,,1,,\nodd,walk,quick,,\n"


@pytest.fixture
def table(tmp_path: Path) -> Table:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "t.csv").write_text(TABLE)
    (tmp_path / "t.cases.csv").write_text(CASES)
    return load(tmp_path / "t.csv")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    rows = 1000
    path = tmp_path / "moments.parquet"
    gait = pl.Series(["Walk", "Half Way", None, "Run"] * (rows // 4))
    pl.DataFrame({"frame": range(rows), "gait": gait, "speed": np.arange(rows) / 4}).write_parquet(path)
    return path


def test_the_cases_of_a_table_lie_beside_it(table: Table):
    contexts = ContextList.beside(table)
    assert (len(contexts), contexts.at, contexts.title, contexts.texts) == (4, None, "", {})
    assert contexts.rows.name(0) == "slow"


def test_a_table_without_cases_has_an_empty_list(table: Table, tmp_path: Path):
    (tmp_path / "t.cases.csv").unlink()
    contexts = ContextList.beside(table)
    assert (len(contexts), contexts.next(), contexts.previous(), contexts.n_failing) == (0, False, False, 0)


def test_steps_go_from_the_first_to_the_last_and_stop_there(table: Table):
    contexts = ContextList.beside(table)
    assert [contexts.next() for _ in range(5)] == [True] * 4 + [False]
    assert contexts.title == "odd (4 of 4)"
    assert [contexts.previous() for _ in range(4)] == [True] * 3 + [False]
    assert contexts.title == "slow (1 of 4)"
    assert contexts.texts == {"speed": "1", "gait": "Walk"}
    fresh = ContextList.beside(table)
    assert fresh.previous()
    assert fresh.title == "odd (4 of 4)"


def test_each_case_says_whether_it_holds(table: Table):
    contexts = ContextList.beside(table)
    found = [contexts.verdict(i) for i in range(4)]
    assert [v.holds for v in found if v] == [True, False, None, False]
    assert (found[1].missing, found[1].extra) == (("walk",), ("run", "slide"))
    assert "quick" in found[3].faults[0].message
    assert contexts.n_failing == 2


def test_what_is_expected_is_judged_anew_after_an_edit(table: Table):
    contexts = ContextList.beside(table)
    assert contexts.n_failing == 2
    contexts.show(table.with_cell(0, "speed", "3..4"))
    assert contexts.verdict(0).missing == ("walk",)
    contexts.show(table)
    assert contexts.verdict(0).holds


def test_rows_that_cannot_be_read_are_not_valid_as_in_the_test_row(table: Table, tmp_path: Path):
    (tmp_path / "t.csv").write_text(TABLE.replace("0..2", "0..two"))
    broken = load(tmp_path / "t.csv", strict=False)
    contexts, query = ContextList.beside(broken), QueryRow(broken)
    query.load(contexts.facts(0))
    assert contexts.verdict(0).missing == ("walk",)
    assert exactly(contexts.valid_assets(contexts.facts(0))) == "slide"
    assert query.n_valid == 1
    assert readable_rows(broken) == 0b110


# ---- saving


def test_a_context_is_kept_with_the_assets_that_are_valid_now(table: Table, tmp_path: Path):
    contexts = ContextList.beside(table)
    facts = {"speed": "5", "gait": "Run", "tags": "", "nothing": "1"}
    contexts.keep("new", facts, exactly(contexts.valid_assets(facts)), "why")
    assert contexts.title == "new (5 of 5)"
    assert contexts.verdict(4).holds
    assert (tmp_path / "t.cases.csv").read_text().splitlines() == [
        "Case,Expected,speed,gait,height,Note",
        "slow,walk slide,1,Walk,3,",
        "fast,walk,5,Run,,",
        "look,,1,,,",
        "odd,walk,quick,,,",
        "new,run slide,5,Run,,why",
    ]


def test_a_case_that_is_kept_again_stays_in_its_place_with_the_facts_of_other_tables(table: Table, tmp_path: Path):
    contexts = ContextList.beside(table)
    contexts.keep("slow", {"speed": "0.5"}, "+walk")
    assert contexts.title == "slow (1 of 4)"
    assert (tmp_path / "t.cases.csv").read_text() == CASES.replace("slow,walk slide,1,Walk,3", "slow,+walk,0.5,,3")


@pytest.mark.parametrize(("name", "expected"), [(" ", ""), ("x", '"walk'), ("x", "not walk")])
def test_what_cannot_be_kept_is_refused_and_nothing_is_written(table: Table, tmp_path: Path, name: str, expected: str):
    with pytest.raises(ContextDBError):
        ContextList.beside(table).keep(name, {"speed": "1"}, expected)
    assert (tmp_path / "t.cases.csv").read_text() == CASES


def test_what_is_valid_now_cannot_be_told_of_facts_that_cannot_be_read(table: Table):
    with pytest.raises(ContextError, match="quick"):
        ContextList.beside(table).valid_assets({"speed": "quick"})


def test_cases_are_renamed_and_deleted_and_the_current_one_stays(table: Table, tmp_path: Path):
    contexts = ContextList.beside(table)
    contexts.go(2)
    contexts.rename(0, "slower")
    contexts.delete(1)
    assert contexts.title == "look (2 of 3)"
    contexts.delete(1)
    assert contexts.title == ""
    assert [case.name for case in contexts.cases] == ["slower", "odd"]
    with pytest.raises(TableError, match="no name"):
        contexts.rename(0, "")


@pytest.mark.parametrize(("text", "found"), [("", [0, 1, 2, 3]), ("SLOW", [0]), ("speed=1", [0, 2]), ("walk run", [1]), ("zz", [])])
def test_cases_are_searched_by_name_fact_and_what_is_expected(table: Table, text: str, found: list[int]):
    assert np.concatenate(list(ContextList.beside(table).rows.search(text))).tolist() == found


# ---- recordings


def test_a_recording_gives_the_facts_of_a_row_as_texts(table: Table, recording: Path):
    contexts = ContextList.open(recording, table)
    assert len(contexts) == 1000
    assert contexts.go(1)
    assert contexts.title == "row 2 (2 of 1,000)"
    assert contexts.texts == {"speed": "0.25", "gait": "Half Way"}
    assert contexts.facts(2) == {"speed": "0.5"}
    assert (contexts.verdict(1), contexts.n_failing, contexts.cases) == (None, 0, [])
    query = QueryRow(table)
    query.load(contexts.texts)
    assert not query.faults


def test_only_a_few_blocks_of_a_recording_are_kept(table: Table, recording: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(context_list, "BLOCK", 7)
    monkeypatch.setattr(context_list, "KEPT_BLOCKS", 3)
    contexts = ContextList.open(recording, table)
    for i in (0, 999, 500, 6, 7, 13, 994, 0, 999):
        assert contexts.facts(i)["speed"] == f"{i / 4:g}"
        assert len(contexts.rows._blocks) <= 3


def test_keeping_a_moment_of_a_recording_leaves_the_recording_where_it_is(table: Table, recording: Path):
    contexts = ContextList.open(recording, table)
    contexts.go(3)
    contexts.keep("moment", contexts.texts, "run")
    assert contexts.title == "row 4 (4 of 1,000)"
    assert [case.name for case in ContextList.beside(table).cases][-1] == "moment"


def test_a_file_of_cases_can_be_opened_by_its_name(table: Table, tmp_path: Path):
    (tmp_path / "other.cases.csv").write_text("Case,speed\none,1\n")
    contexts = ContextList.open(tmp_path / "other.cases.csv", table)
    contexts.keep("two", {"speed": "2"}, "")
    assert (tmp_path / "other.cases.csv").read_text() == "Case,speed,Expected\none,1,\ntwo,2,\n"


def test_a_file_without_a_fact_of_the_table_is_refused(table: Table, tmp_path: Path):
    (tmp_path / "m.csv").write_text("a,b\n1,2\n")
    with pytest.raises(TableError, match="no column is a fact"):
        ContextList.open(tmp_path / "m.csv", table)
    with pytest.raises(FileError):
        ContextList.open(tmp_path / "none.csv", table)


def test_what_is_expected_may_be_written_in_these_ways():
    assert [expectation_fault(text) for text in ("", "walk run", "+walk -run", "(none)")] == [None] * 4
    assert expectation_fault("not walk")


def test_facts_stand_on_one_line():
    assert summary({"speed": "1, 2", "gait": "Walk"}) == "speed=1, 2  gait=Walk"
