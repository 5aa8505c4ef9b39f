"""`contextdb merge`: three files made one, conflicts between git's marks, and a real repository with the driver installed."""

from __future__ import annotations

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
from contextdb.tables.merging.merging import Merge, merge
from contextdb.tables.merging.reading import table_of
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


# ---- notes

NOTED = "Asset,Column,Note,Colour\nwalk,speed,slow?,\n"


@pytest.mark.parametrize(
    ("ours", "theirs", "merged"),
    [
        ("new,gait,a,\n", "new,speed,b,\n", "new,gait,a,\nnew,speed,b,\nwalk,speed,slow?,\n"),
        ("new,,,red\n", "new,,n,\n", "new,,n,red\nwalk,speed,slow?,\n"),
    ],
    ids=["two cells of a new asset", "a note and a colour of its row"],
)
def test_notes_that_two_people_add_to_one_new_asset_are_both_kept(ours, theirs, merged):
    files = put(base=NOTED, ours=NOTED + ours, theirs=NOTED + theirs)
    assert run("merge", *files, "--path", "t.notes.csv").code == 0
    assert read("ours.csv") == NOTED.splitlines(keepends=True)[0] + merged


def test_one_note_that_both_changed_stands_between_marks_or_is_taken_from_a_side():
    files = put(base=NOTED, ours=NOTED.replace("slow?", "fast?"), theirs=NOTED.replace("slow?", ""))
    result = run("merge", *files, "--path", "t.notes.csv", "-o", "out.csv")
    assert result.code == 1
    assert 'the note of "walk speed" changed on both sides' in result.err
    assert "<<<<<<< ours\nwalk,speed,fast?,\n" in read("out.csv")
    assert run("merge", *files, "--path", "t.notes.csv", "--take", "theirs").code == 0
    assert read("ours.csv") == "Asset,Column,Note,Colour\n"


# ---- clean


def test_changes_of_different_rows_go_together_into_ours(here):
    result = run("merge", *put(base=BASE, ours=OURS, theirs=THEIRS))
    assert (result.code, result.out, result.err) == (0, "", "")
    assert read("ours.csv") == THEIRS.replace("walk,0..5", "walk,1..5")
    assert (read("base.csv"), read("theirs.csv")) == (BASE, THEIRS)


def test_the_result_can_go_elsewhere(here):
    assert run("merge", *put(base=BASE, ours=OURS, theirs=THEIRS), "-o", "out.csv").code == 0
    assert read("ours.csv") == OURS
    assert read("out.csv") == THEIRS.replace("walk,0..5", "walk,1..5")


def test_a_file_merged_with_itself_stays_byte_for_byte(here):
    odd = 'Asset,"speed",hit\r\n"walk",0..5,True\n\nrun,5..9,'
    assert run("merge", *put(base=odd, ours=odd, theirs=odd)).code == 0
    assert read("ours.csv") == odd


def test_a_column_renamed_by_theirs_keeps_the_bytes_of_its_cells(here):
    base = 'Asset,speed,hit\nwalk,"0..5",True\n'
    files = put(base=base, ours=base.replace("True", "False"), theirs=base.replace("speed", "pace"))
    assert run("merge", *files).code == 0
    assert read("ours.csv") == 'Asset,pace,hit\nwalk,"0..5",False\n'


def test_types_are_those_of_the_contextdb_toml_beside_the_named_path(here):
    (here / "tables").mkdir()
    toml = '[conditions.speed]\ntype = "angle"\n[tables.t]\nenabled = "On"\n'
    (here / "tables" / "contextdb.toml").write_text(toml, encoding="utf-8")
    base, ours, theirs = (f"A,speed\na,{text}\n" for text in ("1", "170..190", "170..-170"))
    files = put(base=base, ours=ours, theirs=theirs)
    assert run("merge", *files, "--path", "tables/t.csv").code == 0
    assert run("merge", *files).code == 1


# ---- conflicts


CONFLICT = [
    "Asset,speed,hit",
    "walk,1..5,True",
    "<<<<<<< ours",
    "run,1..2,Any",
    "||||||| base",
    "run,5..9,Any",
    "=======",
    "run,3..4,Any",
    ">>>>>>> theirs",
    "jump,Any,True",
    "land,,",
]


def test_only_the_rows_in_question_stand_between_marks_and_all_else_is_merged(here):
    files = put(base=BASE, ours=OURS.replace("5..9", "1..2"), theirs=THEIRS.replace("5..9", "3..4"))
    result = run("merge", *files)
    assert (result.code, result.out) == (1, "")
    assert read("ours.csv") == "".join(f"{line}\r\n" for line in CONFLICT)
    assert 'ours.csv: run, speed: ours "1..2", theirs "3..4", before "5..9"' in result.err
    assert "1 place changed on both sides" in result.err
    assert run("check", "ours.csv").code == 1


def test_a_row_deleted_here_and_changed_there_stands_on_one_side_of_the_marks(here):
    run("merge", *put(base=BASE, ours=BASE.replace("run,5..9,Any\r\n", ""), theirs=BASE.replace("5..9", "3..4")))
    block = ["<<<<<<< ours", "||||||| base", "run,5..9,Any", "=======", "run,3..4,Any", ">>>>>>> theirs"]
    assert read("ours.csv").splitlines()[2:8] == block


def test_all_can_be_decided_for_one_side(here):
    for side, text in (("ours", "1..2"), ("theirs", "3..4")):
        files = put(base=BASE, ours=OURS.replace("5..9", "1..2"), theirs=THEIRS.replace("5..9", "3..4"))
        assert run("merge", *files, "--take", side).code == 0
        assert read("ours.csv") == THEIRS.replace("walk,0..5", "walk,1..5").replace("5..9", text)


def test_a_column_in_question_puts_the_whole_file_between_marks(here):
    ours, theirs = BASE.replace("speed", "pace"), BASE.replace("speed", "velocity")
    assert run("merge", *put(base=BASE, ours=ours, theirs=theirs)).code == 1
    base, mine, yours = versions_of(read("ours.csv").encode())
    assert (base.decode(), mine.decode(), yours.decode()) == (BASE, ours, theirs)


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


# ---- the meaning of a clean merge

PAIR = '[conditions.speed]\ntype = "number"\nmin = 0\nmax = 10\n[tables.ours]\npolicy = "POLICY"\n'


def test_a_gap_that_neither_side_had_is_told_and_is_refused_only_when_strict(here):
    (here / "contextdb.toml").write_text(PAIR.replace("POLICY", "collect"), encoding="utf-8")
    base = "A,speed\nslow,0..6\nfast,4..10\n"
    sides = {"ours": base.replace("0..6", "0..4"), "theirs": base.replace("4..10", "6..10")}
    result = run("merge", *put(base=base, **sides))
    assert (result.code, result.out) == (0, "")
    assert "a gap that neither side had: speed: (4..6) (20.00 % of the contexts)" in result.err
    assert run("merge", *put(base=base, **sides), "--strict").code == 1


def test_a_meaning_that_cannot_be_looked_at_is_told_of_the_named_file_not_of_gits_own(here):
    base = "Asset,speed\nwalk,0..5\nrun,5..9\n"
    theirs = base.replace("run", "@elsewhere")
    Path("moves.csv").write_text(base)
    result = run("merge", *put(base=base, ours=base.replace("0..5", "1..5"), theirs=theirs), "--path", "moves.csv")
    assert result.code == 0
    assert "was not looked at: moves.csv, line 3, column" in result.err
    assert "ours.csv" not in result.err


def test_notes_are_no_table_so_that_nothing_is_told_of_their_meaning(here):
    base = 'Asset,Column,Note,Colour\nrun,gait,second,\nwalk,speed,"first, note",\n'
    sides = {"ours": base.replace("first", "ours"), "theirs": base.replace("second", "theirs")}
    result = run("merge", *put(base=base, **sides), "--path", "moves.notes.csv")
    assert (result.code, result.err) == (0, "")
    assert read("ours.csv") == base.replace("first", "ours").replace("second", "theirs")


def test_an_overlap_that_neither_side_had_is_told_where_the_policy_is_unique(here):
    (here / "contextdb.toml").write_text(PAIR.replace("POLICY", "unique"), encoding="utf-8")
    base = "A,speed\nslow,0..4\nfast,6..10\n"
    result = run("merge", *put(base=base, ours=base.replace("0..4", "0..5.5"), theirs=base.replace("6..10", "4.5..10")))
    assert result.code == 0
    assert "as on neither side" in result.err


def test_a_gap_that_one_side_opened_is_not_told_again(here):
    (here / "contextdb.toml").write_text(PAIR.replace("POLICY", "collect"), encoding="utf-8")
    base = "A,speed\nslow,0..6\nfast,6..10\n"
    result = run("merge", *put(base=base, ours=base.replace("0..6", "0..4"), theirs=base + "run,8..9\n"), "--strict")
    assert (result.code, result.err) == (0, "")


# ---- bad use


def test_lines_are_merged_where_a_side_is_no_table(here):
    files = put(base=BASE, ours=OURS, theirs="A,b\n1\n")
    result = run("merge", *files)
    assert result.code == 1
    assert "theirs.csv, line 2" in result.err
    marked = read("ours.csv")
    assert all(part in marked for part in ("<<<<<<< ours", "walk,1..5,True", "=======\nA,b\n1\n>>>>>>> theirs"))


def test_a_side_that_is_no_table_is_not_decided_for_anybody(here):
    result = run("merge", *put(base=BASE, ours=OURS, theirs="A,b\n1\n"), "--take", "theirs")
    assert (result.code, read("ours.csv")) == (2, OURS)


@pytest.mark.parametrize("error", [RecursionError("too deep"), ValueError("a slip"), MemoryError()])
def test_whatever_goes_wrong_inside_leaves_both_sides_in_the_file(here, monkeypatch, error):
    def fails(*_: object) -> None:
        raise error

    monkeypatch.setattr("contextdb.commands.merge_command.merge", fails)
    result = run("merge", *put(base=BASE, ours=OURS, theirs=THEIRS))
    assert result.code == 1
    assert type(error).__name__ in result.err
    assert "walk,1..5" in read("ours.csv")
    assert "land,," in read("ours.csv")


def test_files_that_are_missing_exit_with_2_and_change_nothing(here):
    put(base=BASE, ours=OURS)
    assert run("merge", "base.csv", "ours.csv", "missing.csv").code == 2
    assert run("merge", "base.csv", "ours.csv").code == 2
    assert read("ours.csv") == OURS


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
