"""A file with git's marks is opened as choices."""

import subprocess
from pathlib import Path

import pytest
from terminal import press, said, screen_text, with_editor

from contextdb.errors import TableError
from tui.model.conflicted import conflicts_in, sides_in, write_decided
from tui.model.session import Session

RAW = b"Asset,speed\r\nwalk,0..5\r\n<<<<<<< HEAD\r\nrun,1..2\r\n=======\r\nrun,3..4\r\n>>>>>>> other\r\njump,\r\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_bytes(RAW)
    return file


@pytest.mark.parametrize(("side", "text"), [("ours", b"1..2"), ("theirs", b"3..4")])
def test_a_file_with_marks_is_decided_and_then_opens_as_a_table(path, side, text):
    with pytest.raises(TableError, match="unresolved git conflict"):
        Session(path)
    found = conflicts_in(path)
    assert [(c.asset, c.column, c.ours, c.theirs) for c in found.conflicts] == [("run", "speed", "1..2", "3..4")]
    write_decided(path, found.resolved({0: side}))
    assert path.read_bytes() == b"Asset,speed\r\nwalk,0..5\r\nrun," + text + b"\r\njump,\r\n"
    session = Session(path)
    assert session.sheet.table.assets == ["walk", "run", "jump"]
    session.close()


@pytest.mark.parametrize("raw", [b"Asset,speed\nwalk,1\n", RAW[:-20], RAW.replace(b"run,3..4", b"run"), b"\x00"])
def test_a_file_without_marks_or_without_tables_between_them_has_no_choices(path, raw):
    path.write_bytes(raw)
    assert conflicts_in(path) is None


def test_a_row_that_one_side_deleted_and_the_other_changed_is_asked_for(tmp_path):
    def git(*words: str) -> None:
        who = ["-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false", "-c", "merge.conflictStyle=merge"]
        subprocess.run(["git", *who, *words], cwd=tmp_path, capture_output=True, check=words[0] != "merge")

    def commit(raw: bytes) -> None:
        (tmp_path / "t.csv").write_bytes(raw)
        git("add", "t.csv")
        git("commit", "-m", "t")

    git("init", "-b", "design")
    commit(b"Asset,speed\nwalk,1\nrun,2\n")
    git("checkout", "-b", "art")
    commit(b"Asset,speed\nwalk,1\nrun,3\n")
    git("checkout", "design")
    commit(b"Asset,speed\nwalk,1\n")
    git("merge", "art")
    found = conflicts_in(tmp_path / "t.csv")
    assert [(c.asset, c.kind) for c in found.conflicts] == [("run", "row")]
    write_decided(tmp_path / "t.csv", found)
    assert (tmp_path / "t.csv").read_bytes() == b"Asset,speed\nwalk,1\n"


def test_a_file_that_is_not_there_has_no_choices(path):
    path.unlink()
    assert conflicts_in(path) is None


def test_the_sides_are_called_as_git_calls_them(path):
    assert sides_in(path) == ("Ours (HEAD)", "Theirs (other)")


def test_the_editor_asks_in_gits_words_and_says_what_git_wants_then(path):
    async def script(app, pilot):
        asked = screen_text(app)
        await press(pilot, "right", "enter")
        return asked, said(app)

    asked, told = with_editor(path, script, (110, 30))
    assert "The file holds a merge conflict" in asked
    assert "Theirs (other)" in asked
    assert "changed on both sides" in asked
    assert "git add t.csv" in told
