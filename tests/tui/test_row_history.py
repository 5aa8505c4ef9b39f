"""The history of a cell and a row is that of the commits; without git, or outside a repository, one sentence says so."""

from __future__ import annotations

import random
import shutil
import subprocess
from pathlib import Path

import pytest
from terminal import press, screen_text, settled, with_editor

from contextdb.disk.git import versions_of
from contextdb.errors import FileError
from contextdb.tables.project import load_table
from tui.model.row_history import row_history

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")
AUTHORS = ("Ana Møller", "Bo \x1b[31m")


def commit(folder: Path, text: str | None, author: str, message: str) -> None:
    if text is None:
        (folder / "t.csv").unlink()
    else:
        (folder / "t.csv").write_text(text)
    about = ["-c", f"user.name={author}", "-c", "user.email=x@y"]
    subprocess.run(["git", *about, "add", "-A"], cwd=folder, check=True)
    subprocess.run(["git", *about, "commit", "-q", "--allow-empty", "-m", message], cwd=folder, check=True)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\n')
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    return tmp_path


def test_the_history_is_that_of_the_commits_that_changed_the_row(folder: Path):
    rng = random.Random(5)
    rows = {"walk": "0..4", "run": "2..9"}
    expected: list[tuple[str, str | None]] = []
    for number in range(12):
        asset = rng.choice(["walk", "run"])
        before = rows.get("walk") if number else None
        if rng.random() < 0.3 and asset in rows:
            del rows[asset]
        else:
            rows[asset] = f"0..{number + 1}"
        lines = "".join(f"{name},{cell}\n" for name, cell in rng.sample(sorted(rows.items()), len(rows)))
        commit(folder, f"Asset,speed\n{lines}", AUTHORS[number % 2], f"change {number}")
        if rows.get("walk") != before:
            expected.append((f"change {number}", rows.get("walk")))
    rows["walk"] = "1..1"
    (folder / "t.csv").write_text("Asset,speed\n" + "".join(f"{name},{cell}\n" for name, cell in rows.items()))
    table = load_table(folder / "t.csv")
    history = row_history(table, table.assets.index("walk"))
    assert history.versions[0].message == "not committed yet"
    listed = [(v.message, None if v.cells is None else v.cells["speed"]) for v in history.versions[1:]]
    assert listed == expected[::-1]
    assert {v.who for v in history.versions[1:]} <= {"Ana Møller", "Bo \\x1b[31m"}
    assert [v.message for v in history.of_cell("speed").versions] == [v.message for v in history.versions]
    few = versions_of(folder / "t.csv", most=3)
    assert (len(few.versions), few.n_left_out) == (3, 1)
    assert versions_of(folder / "t.csv", most_bytes=60).n_left_out > 8


def test_without_git_outside_a_repository_and_where_git_hangs_a_sentence_says_so(folder: Path, tmp_path_factory, monkeypatch):
    (folder / "t.csv").write_text("Asset,speed\nwalk,1\n")
    with pytest.raises(FileError, match="no commit has the file yet"):
        versions_of(folder / "t.csv")
    outside = tmp_path_factory.mktemp("outside")
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(outside.parent))
    with pytest.raises(FileError, match="in no git repository"):
        versions_of(outside / "t.csv")
    tools = tmp_path_factory.mktemp("tools")
    monkeypatch.setenv("PATH", str(tools))
    with pytest.raises(FileError, match="git cannot be run"):
        versions_of(folder / "t.csv")
    (tools / "git").write_text("#!/bin/sh\nexec /bin/sleep 5\n")
    (tools / "git").chmod(0o755)
    with pytest.raises(FileError, match=r"git takes longer than 0\.2 s"):
        versions_of(folder / "t.csv", most_s=0.2)


def test_the_dialog_shows_who_changed_the_cell_and_two_versions_beside_each_other(folder: Path):
    commit(folder, "Asset,speed\nwalk,0..4\n", "Ana", "the first ones")
    commit(folder, "Asset,speed\nwalk,0..5\n", "Bo", "playtest of Tuesday")

    async def script(app, pilot):
        await press(pilot, "right", *"0..6", "enter", "shift+f1")
        await app.workers.wait_for_complete()
        await settled(pilot)
        cell = screen_text(app)
        await press(pilot, "down", "tab")
        return cell, screen_text(app)

    cell, row = with_editor(folder / "t.csv", script, (120, 30))
    for text in ("not committed yet", "playtest of Tuesday", "the first ones", "Ana", "Bo"):
        assert text in cell
    assert "speed: 0..4 → 0..5" in row
    assert "the row is new" in row
