"""`contextdb play`: which tables it plays with, what it refuses, and how it starts the game and the editor."""

import subprocess
import sys
from pathlib import Path

import pytest

from contextdb.cli import main
from contextdb.commands import play_command
from contextdb.errors import FileError

Words = list[list[str]]


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> Words:
    """The commands that are started instead of the game."""
    started: Words = []

    def run(words: list[str], **options: object) -> subprocess.CompletedProcess[bytes]:
        started.append(words)
        return subprocess.CompletedProcess(words, 0)

    monkeypatch.setattr(play_command.subprocess, "run", run)
    monkeypatch.setattr(play_command, "find_spec", lambda name: name)
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.delenv("TMUX", raising=False)
    return started


def test_a_new_folder_gets_a_copy_of_the_tables_and_the_second_time_it_is_used(tmp_path: Path):
    folder = play_command.tables_in(tmp_path / "mine")
    assert {path.name for path in folder.iterdir()} >= {"contextdb.toml", "moves.csv", "vaults.csv", "catches.csv"}
    (folder / "moves.csv").write_text("changed")
    assert (play_command.tables_in(folder) / "moves.csv").read_text() == "changed"


def test_a_folder_of_other_things_is_refused(tmp_path: Path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(FileError, match=r"this has no contextdb\.toml.*a name that is free"):
        play_command.tables_in(tmp_path)


def test_without_a_terminal_the_game_plays_and_the_editors_command_is_printed(
    tmp_path: Path, started: Words, capsys: pytest.CaptureFixture[str]
):
    assert main(["play", str(tmp_path / "mine")]) == 0
    assert started == [[sys.executable, "-m", "examples.playground", "--link", "playground", "--tables", str(tmp_path / "mine")]]
    assert f"contextdb edit {tmp_path / 'mine'} --follow playground" in capsys.readouterr().err


def test_in_tmux_the_editor_opens_in_a_pane_beside(tmp_path: Path, started: Words, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TMUX", "here")
    monkeypatch.setattr(play_command, "_has_terminal", lambda: True)
    monkeypatch.setattr(play_command.shutil, "which", lambda name: name)
    assert main(["play", str(tmp_path / "mine")]) == 0
    pane, game = started
    assert pane[:3] == ["tmux", "split-window", "-h"]
    assert pane[3].endswith(f"-m contextdb edit {(tmp_path / 'mine').resolve()} --follow playground")
    assert game[2] == "examples.playground"


def test_without_panda_or_a_screen_it_says_what_is_missing(
    started: Words, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    if sys.platform == "linux":
        monkeypatch.delenv("DISPLAY")
        monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
        assert main(["play"]) == 2
        assert "the game needs a screen" in capsys.readouterr().err
    monkeypatch.setattr(play_command, "find_spec", lambda name: None)
    assert main(["play"]) == 2
    assert "Did you mean pip install 'contextdb[playground]'?" in capsys.readouterr().err
    assert started == []


def test_a_game_that_ends_before_it_opens_prints_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    words = [sys.executable, "-c", "import sys; print('no window can be opened', file=sys.stderr); sys.exit(2)"]
    with open(tmp_path / "log", "w+") as log:
        assert play_command._beside(words, tmp_path, log) == 2
    assert "no window can be opened" in capfd.readouterr().err
