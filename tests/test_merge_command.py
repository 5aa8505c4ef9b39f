"""`contextdb merge`: three files made one, conflicts between git's marks, and a real repository with the driver installed."""

import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from running import run
from warm_commands import warm_program

from contextdb import cli
from contextdb.columns import TextColumn
from contextdb.edits.diffing.markers import versions_of, with_markers
from contextdb.files.csv_rewrite import rewritten
from contextdb.tables.merging.merging import Merge, merge, table_of
from contextdb.tables.project import load
from contextdb.tables.table import Table

BASE = "Asset,speed,hit\r\nwalk,0..5,True\r\nrun,5..9,Any\r\njump,Any,False\r\n"
OURS = BASE.replace("walk,0..5", "walk,1..5")
THEIRS = BASE.replace("jump,Any,False", "jump,Any,True") + "land,,\r\n"


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setitem(cli.COMMANDS, "merge", "merge two versions of a table")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def put(**texts: str) -> list[str]:
    """Write the files and give their names."""
    for name, text in texts.items():
        Path(f"{name}.csv").write_bytes(text.encode())
    return [f"{name}.csv" for name in texts]


def read(name: str) -> str:
    return Path(name).read_bytes().decode()


# ---- clean


def test_a_file_merged_with_itself_stays_byte_for_byte(here):
    odd = 'Asset,"speed",hit\r\n"walk",0..5,True\n\nrun,5..9,'
    assert run("merge", *put(base=odd, ours=odd, theirs=odd)).code == 0
    assert read("ours.csv") == odd


# ---- conflicts


def test_a_parquet_file_with_conflicts_stays_as_it_was(here):
    for name, text in zip(put(base="A,x\na,1\n", ours="A,x\na,2\n", theirs="A,x\na,3\n"), ("base", "ours", "theirs"), strict=True):
        load(name).save(f"{text}.parquet")
    raw = Path("ours.parquet").read_bytes()
    files = ["base.parquet", "ours.parquet", "theirs.parquet"]
    result = run("merge", *files)
    assert (result.code, Path("ours.parquet").read_bytes()) == (1, raw)
    assert "--take ours or --take theirs" in result.err
    assert run("merge", *files, "--take", "theirs").code == 0
    assert load("ours.parquet").text(0, "x") == "3"


def texts_of(found: Merge) -> dict[str, list[str]]:
    return {c.name: c.to_list() for c in found.table.columns}


@given(st.data())
def test_what_stands_between_marks_can_be_merged_again_to_either_side(data):
    texts = st.sampled_from(["Any", "1..2", 'a "b"', "x\r\ny", "5"])
    names = ["walk", "run", "jump"]

    def side() -> str:
        rows = [[name, data.draw(texts), data.draw(texts)] for name in names if data.draw(st.integers(0, 4))]
        rows += [["new", data.draw(texts), ""]] if data.draw(st.booleans()) else []
        columns = [TextColumn.of(name, [row[at] for row in rows]) for at, name in enumerate(["Asset", "speed", "hit"])]
        return rewritten(columns, None, np.full(len(rows), -1)).raw.decode()

    base, ours, theirs = (table_of(Table, side().encode(), "t.csv") for _ in range(3))
    found = merge(base, ours, theirs)
    if not found.conflicts:
        return
    again = merge(*(table_of(Table, raw, "t.csv") for raw in versions_of(with_markers(found))))
    for one in ("ours", "theirs"):
        decided = [m.resolved(dict.fromkeys(range(len(m.conflicts)), one)) for m in (found, again)]
        assert texts_of(decided[0]) == texts_of(decided[1])


def test_marks_that_git_itself_wrote_without_a_base_are_read_too():
    text = "A,x\na,1\n<<<<<<< HEAD\nb,2\n=======\nb,3\n>>>>>>> branch\nc,4\n"
    base, ours, theirs = (table_of(Table, raw, "t.csv") for raw in versions_of(text.encode()))
    found = merge(base, ours, theirs)
    assert [(c.asset, c.column, c.base, c.ours, c.theirs) for c in found.conflicts] == [("b", "x", None, "2", "3")]
    assert found.table.assets == ["a", "b", "c"]


@pytest.mark.parametrize(
    "text", ["A\na\n", "A\n=======\nb\n", "<<<<<<< x\nA\n", "A\n>>>>>>> x\n", "<<<<<<< a\n<<<<<<< b\n=======\n>>>>>>> c\n"]
)
def test_marks_that_do_not_go_together_are_no_versions(text):
    assert versions_of(text.encode()) is None


# ---- bad use


@pytest.mark.parametrize("error", [RecursionError("too deep"), ValueError("a slip"), MemoryError()])
def test_whatever_goes_wrong_inside_leaves_both_sides_in_the_file(here, monkeypatch, error):
    def fails(*_: object) -> None:
        raise error

    monkeypatch.setattr("contextdb.commands.merge_command.merge", fails)
    result = run("merge", *put(base=BASE, ours=OURS, theirs=THEIRS))
    assert result.code == 70
    assert f"  {type(error).__name__} in contextdb merge\n" in result.err
    assert "walk,1..5" in read("ours.csv")
    assert "land,," in read("ours.csv")


# ---- git


@pytest.fixture(scope="module")
def driver() -> Iterator[str]:
    with warm_program() as program:
        yield program


@pytest.fixture
def repository(here: Path, driver: str) -> Path:
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    (here / "driver.py").write_text(driver, encoding="utf-8")
    git("init", "-q", "-b", "main")
    git("config", "user.name", "t")
    git("config", "user.email", "t@example.org")
    git("config", "core.autocrlf", "false")
    git("config", "merge.contextdb.driver", f"'{sys.executable}' driver.py merge %O %A %B --path %P")
    (here / ".gitattributes").write_text("*.csv merge=contextdb\n", encoding="utf-8")
    (here / ".gitignore").write_text("driver.py\n", encoding="utf-8")
    put(t=BASE)
    commit("base")
    return here


def git(*arguments: str, fails: bool = False) -> str:
    done = subprocess.run(["git", *arguments], capture_output=True, text=True)
    assert (done.returncode != 0) == fails, done.stderr
    return done.stdout + done.stderr


def commit(message: str) -> None:
    git("add", "-A")
    git("commit", "-q", "-m", message)


def branched(ours: str, theirs: str) -> None:
    git("checkout", "-q", "-b", "other")
    put(t=theirs)
    commit("theirs")
    git("checkout", "-q", "main")
    put(t=ours)
    commit("ours")


def test_git_merges_and_rebases_two_branches_cell_by_cell(repository):
    side = BASE.replace("walk,0..5", "walk,1..5")
    branched(side, BASE.replace("walk,0..5,True", "walk,0..5,False"))
    git("merge", "-q", "other", "-m", "both")
    assert read("t.csv") == side.replace("walk,1..5,True", "walk,1..5,False")
    git("reset", "-q", "--hard", "HEAD~1")
    git("rebase", "-q", "other")
    assert read("t.csv") == side.replace("walk,1..5,True", "walk,1..5,False")


def test_git_leaves_a_conflict_with_marks_and_the_file_unmerged(repository):
    branched(BASE.replace("5..9", "1..2"), BASE.replace("5..9", "3..4"))
    said = git("merge", "-q", "other", "-m", "both", fails=True)
    assert "t.csv: run, speed" in said
    assert "<<<<<<< ours\r\nrun,1..2,Any" in read("t.csv")
    assert git("status", "--porcelain") == "UU t.csv\n"


def test_git_merges_edits_into_a_file_that_the_other_branch_renamed(repository):
    git("checkout", "-q", "-b", "other")
    git("mv", "t.csv", "moved.csv")
    commit("renamed")
    git("checkout", "-q", "main")
    put(t=BASE.replace("5..9", "1..2"))
    commit("ours")
    git("merge", "-q", "other", "-m", "both")
    assert read("moved.csv") == BASE.replace("5..9", "1..2")
