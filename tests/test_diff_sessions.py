"""Searches of a recorded session repeated with both versions of a table."""

import pytest
from motion_project import session_folder, work_in_copy
from running import run

from contextdb.motion.trace.session import Trace


@pytest.fixture
def game(tmp_path, monkeypatch):
    folder = work_in_copy(session_folder(), tmp_path, monkeypatch)
    (folder / "new").mkdir()
    (folder / "new" / "contextdb.toml").write_text((folder / "game" / "contextdb.toml").read_text())
    (folder / "new" / "moves.csv").write_text((folder / "game" / "moves.csv").read_text())
    return folder


def test_two_equal_versions_choose_the_same_in_every_search(game):
    [session] = run("diff", "game/moves.csv", "new/moves.csv", "--session", "session.parquet", "--json").json["sessions"]
    searched = sum(decision.choice is not None for decision in Trace.load("session.parquet"))
    assert (session["searches"], session["changed"], session["examples"]) == (searched, 0, [])


def test_without_a_row_no_search_chooses_its_asset(game):
    table = game / "new" / "moves.csv"
    table.write_text("".join(line for line in table.read_text().splitlines(keepends=True) if not line.startswith("walk,")))
    there = run("diff", "game/moves.csv", "new/moves.csv", "--session", "session.parquet", "--json").json["sessions"][0]
    back = run("diff", "new/moves.csv", "game/moves.csv", "--session", "session.parquet", "--json").json["sessions"][0]
    assert 0 < there["other_assets"] <= there["changed"] == back["changed"]
    assert all(example["before"] == "walk" != example["after"] for example in there["examples"])
    assert [(e["after"], e["before"]) for e in back["examples"]] == [(e["before"], e["after"]) for e in there["examples"]]
    text = run("diff", "game/moves.csv", "new/moves.csv", "--session", "session.parquet").out
    assert f"session.parquet: {there['changed']} of {there['searches']} searches would choose otherwise" in text


def test_a_table_that_no_database_uses_is_refused_with_the_nearest(game):
    (game / "new" / "mooves.csv").write_text((game / "new" / "moves.csv").read_text())
    result = run("diff", "new/mooves.csv", "new/moves.csv", "--session", "session.parquet")
    assert result.code == 2
    assert 'Did you mean "moves"?' in result.err


def test_a_file_that_is_no_session_is_refused(game):
    result = run("diff", "game/moves.csv", "new/moves.csv", "--session", "game/moves.csv")
    assert result.code == 2
    assert "game/moves.csv" in result.err
