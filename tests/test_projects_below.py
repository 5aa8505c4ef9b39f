"""All projects below a folder: which of them fail, and their rows in one file."""

import subprocess
from datetime import UTC, datetime
from pathlib import Path

import polars as pl
import pytest
from running import run

STUDIO = '[conditions.speed]\ntype = "number"\nmin = 0\nmax = 8\n[tables.base]\noutputs = ["dmg"]\n'


@pytest.fixture
def games(tmp_path: Path) -> Path:
    """A studio, and two games that extend it."""
    for name, text, rows in (
        ("studio", STUDIO, None),
        (
            "games/one",
            '[project]\nextends = "../../studio/contextdb.toml"\n[tables.moves]\nowner = "combat"\noutputs = ["dmg"]\n',
            "walk,0..2,1",
        ),
        ("games/two", '[project]\nextends = "../../studio/contextdb.toml"\n[tables.moves]\noutputs = ["dmg"]\n', "run,2..,1"),
    ):
        folder = tmp_path / name
        folder.mkdir(parents=True)
        (folder / "contextdb.toml").write_text(text)
        file = folder / ("moves.csv" if rows else "base.csv")
        file.write_text(f"Asset,speed,dmg\n{rows or 'idle,..1,1'}\n")
    return tmp_path


def test_a_change_of_what_projects_extend_says_which_it_breaks(games):
    before = run("check", "--projects", games)
    assert before.code == 0
    assert "3 projects checked, and none fails." in before.lines[-1]
    (games / "studio" / "contextdb.toml").write_text(STUDIO.replace("number", "bool").replace("min = 0\nmax = 8\n", ""))
    after = run("check", "--projects", games / "games", "--root", games, "--json")
    assert after.code == 1
    assert [(Path(p["project"]).name, p["passed"], p["errors"] > 0) for p in after.json["projects"]] == [
        ("one", False, True),
        ("two", False, True),
    ]
    text = run("check", "--projects", games)
    assert "3 of 3 projects fail: " in text.lines[-1]


def test_one_that_fails_is_named_and_the_others_are_not(games):
    (games / "games" / "two" / "moves.csv").write_text("Asset,speed,dmg\nrun,2..x,1\n")
    result = run("check", "--projects", games)
    assert result.code == 1
    assert f"1 of 3 projects fail: {games / 'games' / 'two'}." in result.lines[-1]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check"], "PATH is missing"),
        (["check", ".", "--projects", "."], "stands by itself"),
        (["check", "--projects", ".", "--propose"], "stands by itself"),
        (["check", "--projects", "games/one/moves.csv"], "a folder with projects below it"),
        (["index", "games", "--out", "rows.csv"], "does not end in .parquet"),
        (["index", "none", "--out", "rows.parquet"], "there is no such folder"),
        (["index", "games", "--out", "games/one/rows.parquet"], "would take the file for one of its tables"),
    ],
)
def test_what_cannot_be_meant_is_refused(games, monkeypatch, arguments, words):
    monkeypatch.chdir(games)
    result = run(*arguments)
    assert result.code == 2
    assert words in result.err


def test_hidden_folders_and_links_are_passed_over(games):
    (games / ".cache").mkdir()
    (games / ".cache" / "contextdb.toml").write_text("x")
    (games / "again").symlink_to(games / "games")
    assert len(run("check", "--projects", games, "--json").json["projects"]) == 3


def test_the_rows_of_all_projects_are_in_one_file(games):
    (games / "play.csv").write_text("speed\n1\n1.5\n3\n")
    out = games / "rows.parquet"
    result = run("index", games, "--out", out, "--telemetry", games / "play.csv")
    assert (result.code, result.lines) == (0, [f"{out}: 3 rows of 3 tables in 3 projects"])
    rows = pl.read_parquet(out).sort("project").rows(named=True)
    assert [(r["project"], r["table"], r["asset"], r["moments"]) for r in rows] == [
        ("games/one", "moves", "walk", 2),
        ("games/two", "moves", "run", 1),
        ("studio", "base", "idle", 1),
    ]
    one = rows[0]
    assert (one["owner"], one["file"], one["row"], one["line"]) == ("combat", "moves.csv", 0, 2)
    assert (one["cells"], one["outputs"]) == ([{"name": "speed", "text": "0..2"}], [{"name": "dmg", "text": "1"}])


def test_a_project_that_cannot_be_read_is_left_out(games):
    (games / "games" / "two" / "moves.csv").write_text("Asset,speed,dmg\nrun,2..x,1\n")
    result = run("index", games, "--out", games / "rows.parquet")
    assert result.code == 1
    assert "2..x" in result.err
    assert len(pl.read_parquet(games / "rows.parquet")) == 2


def test_the_last_change_of_a_row_is_that_of_its_line(games):
    file = games / "games" / "one" / "moves.csv"

    def commit(date: str) -> None:
        environment = {
            "GIT_AUTHOR_DATE": date,
            "GIT_COMMITTER_DATE": date,
            "HOME": str(games),
            "PATH": "/usr/bin:/bin:/usr/local/bin",
        }
        own = ["-c", "user.name=a", "-c", "user.email=a@b"]
        for arguments in (["init", "-q"], ["add", "games", "studio"], [*own, "commit", "-q", "-m", "x"]):
            subprocess.run(["git", *arguments], cwd=games, env=environment, check=True)

    commit("2026-01-02T00:00:00Z")
    file.write_text(file.read_text() + "jog,1..3,2\n")
    commit("2026-03-04T00:00:00Z")
    result = run("index", games / "games" / "one", "--out", games / "rows.parquet")
    assert result.err == ""
    assert pl.read_parquet(games / "rows.parquet")["last_change"].to_list() == [
        datetime(2026, 1, 2, tzinfo=UTC),
        datetime(2026, 3, 4, tzinfo=UTC),
    ]


def test_the_rows_of_a_variant_are_all_that_it_answers_with(games):
    folder = games / "games" / "one"
    (folder / "contextdb.toml").write_text((folder / "contextdb.toml").read_text() + '[tables.orc]\nbase = "moves"\n')
    (folder / "orc.csv").write_text("Asset,speed\nroar,3..\n")
    (games / "play.csv").write_text("speed\n1\n1.5\n3\n")
    run("index", games, "--out", games / "rows.parquet", "--telemetry", games / "play.csv")
    rows = pl.read_parquet(games / "rows.parquet").filter(pl.col("table") == "orc").rows(named=True)
    assert [(r["asset"], r["file"], r["line"], r["moments"]) for r in rows] == [
        ("walk", "moves.csv", 2, 2),
        ("roar", "orc.csv", 2, 1),
    ]
