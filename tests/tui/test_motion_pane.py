"""The tab Motion: the sessions of a project and the games that run, the debugger inside the editor, and the way to a row."""

import asyncio
import os
import shutil
from pathlib import Path
from typing import Any

import pytest
from terminal import alone, drive, press, screen_text
from test_debug_parts import recording_of
from test_motion_measure_command import here, made
from textual.pilot import Pilot
from watched_disk import touched

from tui.app import EditorApp
from tui.debug.app import DebugApp
from tui.debug.opening import opened
from tui.debug.screen import DebugScreen
from tui.model.sessions import sessions_of
from tui.model.workspace import Workspace
from tui.panes.motion import MotionPane
from tui.screens.main import MainScreen

__all__ = ["here", "made"]
"""Fixtures of another file."""


@pytest.fixture(autouse=True)
def in_git(here: Path) -> None:
    """The sessions are beside the project, in one work tree of git."""
    (here / ".git").mkdir()


async def settled(pilot: Pilot[Any]) -> None:
    """Wait until nothing is at work beside the screen."""
    await pilot.app.workers.wait_for_complete()
    await pilot.pause()
    await pilot.app.workers.wait_for_complete()
    await pilot.pause()


def test_sessions_are_found_by_what_they_say_the_newest_first(here: Path):
    shutil.copy("session.parquet", "game/later.parquet")
    (here / "game" / "other.parquet").write_bytes(b"PAR1 is no session PAR1")
    os.utime("session.parquet", (1e9, 1e9))
    assert [path.name for path in sessions_of(here / "game")] == ["session.parquet"]  # the copy says a project beside it
    shutil.copytree("game", "game2")
    assert sessions_of(here / "game2") == []
    shutil.copy("session.parquet", "newer.parquet")
    assert [path.name for path in sessions_of(here / "game")] == ["newer.parquet", "session.parquet"]


def test_no_file_is_looked_at_around_the_work_tree_of_a_project(here: Path):
    shutil.copy("session.parquet", "game/own.parquet")
    (here / ".git").rename("game/.git")
    with touched() as found:
        sessions_of(here / "game")
    assert found.outside(here / "game", here) == []


def test_a_session_whose_databases_are_gone_is_opened_and_says_so(here: Path):
    for clip in (here / "game" / "clips").glob("*.bvh"):
        clip.unlink()
    recording = opened(here / "session.parquet", here / "game")
    assert len(recording) == 151
    assert recording.missing


def test_the_tab_opens_the_debugger_its_row_is_shown_in_the_sheet_and_esc_comes_back(here: Path):
    app = EditorApp(Workspace("game"))

    async def script(pilot: Pilot[Any]) -> None:
        main = app.screen
        assert isinstance(main, MainScreen)
        assert "Motion" in screen_text(app)
        await main.action_tab("motion")
        await settled(pilot)
        found = screen_text(app)
        assert "1 session" in found
        assert "session.parquet" in found
        assert "5.0 s" in found
        await press(pilot, "enter")
        await settled(pilot)
        screen = app.screen
        assert isinstance(screen, DebugScreen)
        tick = screen.index
        await press(pilot, "slash", *"idle", "enter", "o")
        await settled(pilot)
        assert app.screen is main
        assert main.tab == "assets"
        sheet = main.session.sheet
        row, column = sheet.cursor
        assert sheet.table.assets[row] == "idle"
        assert sheet.table.columns[column].name == "gait"
        await main.action_tab("motion")
        await settled(pilot)
        await press(pilot, "enter")
        await settled(pilot)
        assert isinstance(app.screen, DebugScreen)
        assert app.screen.index == tick
        await press(pilot, "escape", "escape")
        assert app.screen is main
        assert main.query_one(MotionPane).entries

    with alone(Path.cwd()):
        drive(app, script, (120, 40))


def test_a_session_that_is_recorded_while_the_tab_is_seen_is_listed_by_itself(here: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("tui.panes.motion.LOOK_EVERY_S", 0.01)
    app = EditorApp(Workspace("game"))

    async def script(pilot: Pilot[Any]) -> None:
        await app.main.action_tab("motion")
        await settled(pilot)
        assert "1 session" in screen_text(app)
        shutil.copy("session.parquet", "another.parquet")
        async with asyncio.timeout(30.0):
            while "2 sessions" not in screen_text(app) or "another.parquet" not in screen_text(app):
                await pilot.pause()

    with alone(Path.cwd()):
        drive(app, script, (120, 40))


def test_the_debugger_by_itself_is_left_for_the_row_and_begins_where_it_was(here: Path):
    recording = recording_of(here)
    app = DebugApp(recording, measures=False)

    async def script(pilot: Pilot[Any]) -> None:
        await press(pilot, "right", "right", "o")

    with alone(Path.cwd()):
        drive(app, script, (120, 40))
    assert app.wanted is not None
    assert Path(app.wanted.table).name == "moves.csv"
    again = DebugApp(recording, measures=False, start=app.wanted.start)

    async def look(pilot: Pilot[Any]) -> int:
        assert isinstance(again.screen, DebugScreen)
        return again.screen.index

    with alone(Path.cwd()):
        assert drive(again, look, (120, 40)) == 32


def test_the_editor_begins_at_the_cell_that_is_asked_for(here: Path):
    from tui.messages import GoToCell

    app = EditorApp(Workspace("game/moves.csv"), at=GoToCell(1, "speed"))

    async def script(pilot: Pilot[Any]) -> tuple[int, str]:
        await pilot.pause()
        sheet = app.main.session.sheet
        return sheet.cursor[0], sheet.table.columns[sheet.cursor[1]].name

    with alone(Path.cwd()):
        assert drive(app, script, (120, 40)) == (1, "speed")


def test_a_project_without_a_session_has_no_tab_until_it_is_gone_to(here: Path):
    shutil.copytree("game", "alone")

    async def script(pilot: Pilot[Any]) -> str:
        before = screen_text(pilot.app).splitlines()[0]
        assert isinstance(pilot.app.screen, MainScreen)
        await pilot.app.screen.action_tab("motion")
        await settled(pilot)
        assert "No session is recorded here" in screen_text(pilot.app)
        assert "Motion" in screen_text(pilot.app).splitlines()[0]
        return before

    with alone(Path.cwd()):
        assert "Motion" not in drive(EditorApp(Workspace("alone")), script, (120, 40))


def test_the_tab_comes_with_the_first_session_when_one_looks_again(here: Path):
    (here / "session.parquet").rename(here / "away")
    app = EditorApp(Workspace("game"))

    async def script(pilot: Pilot[Any]) -> list[bool]:
        seen = ["Motion" in screen_text(app).splitlines()[0]]
        (here / "away").rename(here / "session.parquet")
        await app.main.run_command("refresh")
        await settled(pilot)
        return [*seen, "Motion" in screen_text(app).splitlines()[0]]

    with alone(Path.cwd()):
        assert drive(app, script, (120, 40)) == [False, True]
