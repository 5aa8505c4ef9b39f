"""`contextdb motion debug`: what it refuses, each with a sentence; the screen itself is tested in tests/tui."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from running import run
from test_motion_measure_command import here, made

from contextdb.motion import Trace

__all__ = ["here", "made"]
"""Fixtures of another file."""


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[Any, ...]]:
    """Runs the command as in a terminal, and gives what the screen is given."""
    given: list[tuple[Any, ...]] = []

    def runs(*arguments: str) -> tuple[Any, ...]:
        with (
            patch("contextdb.commands.motion_debug_command.require_terminal", lambda instead: None),
            patch("tui.debug.run.debug", lambda *them: given.append(them)),
        ):
            result = run("motion", "debug", *arguments)
        assert result.code == 0, result.err
        return given[-1]

    return runs


def refused(*arguments: str) -> str:
    result = run("motion", "debug", *arguments)
    assert result.code == 2
    assert result.out == ""
    assert "Traceback" not in result.err
    return result.err


def test_the_screen_has_the_session_with_the_databases_of_its_project(opened: Callable[..., tuple[Any, ...]]):
    file, trace, folder, databases, missing = opened("session.parquet")
    assert (file, len(trace), sorted(databases), missing) == ("session.parquet", 151, ["all", "tired"], "")
    assert Path(folder).name == "game"


def test_a_folder_is_the_project(opened: Callable[..., tuple[Any, ...]]):
    shutil.move("game", "moved")
    assert opened("session.parquet", "moved")[4] == ""
    *_, folder, databases, missing = opened("session.parquet")
    assert (folder, databases) == ("", {})
    assert missing.startswith('its project is no longer at "game"')


def test_a_project_that_cannot_be_read_is_said_on_the_screen_unless_it_was_asked_for(opened: Callable[..., tuple[Any, ...]]):
    Path("game/contextdb.toml").write_text("[features.loco]\nrate = 'x'\n", encoding="utf-8")
    assert "rate" in opened("session.parquet")[4]
    assert "rate" in refused("session.parquet", "game")


def test_a_changed_database_is_said_on_the_screen(opened: Callable[..., tuple[Any, ...]]):
    text = Path("game/contextdb.toml").read_text(encoding="utf-8")
    Path("game/contextdb.toml").write_text(text.replace('bone = "LeftFoot"', 'bone = "RightFoot"'), encoding="utf-8")
    assert "is another than the one that the session was recorded with" in opened("session.parquet")[4]


def test_without_a_terminal_it_says_what_to_use_instead(here: Path):
    err = refused("session.parquet")
    assert "not a terminal" in err
    assert '"contextdb motion replay"' in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize(
    ("file", "said"),
    [("none.parquet", "none.parquet"), ("stick.csv", "not a Parquet file"), ("poses.npz", "not a Parquet file")],
)
def test_what_is_no_session_is_refused(here: Path, file: str, said: str):
    err = refused(file)
    assert said in err
    assert len(err.splitlines()) == 1


def test_an_empty_session_is_refused(here: Path):
    Trace().save("empty.parquet")
    assert "the session has no decision." in refused("empty.parquet")


# ---- a running game


@pytest.fixture
def no_games(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.mark.usefixtures("no_games")
def test_a_game_that_does_not_run_is_said():
    assert "no game is running" in refused("--live")
    assert "no game is running" in refused("--live", "game")  # a folder
    assert 'no game "other" is running' in refused("other", "game", "--live")


def test_a_session_or_live_is_asked_for_and_who_is_of_a_game():
    assert "no session is named" in refused()
    assert "--live" in refused("session.parquet", "--who", "player")
