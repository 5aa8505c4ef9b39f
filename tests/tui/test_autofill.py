"""Autofill: the open table filled from its clips, as `contextdb motion describe --into` fills it."""

import shutil
from collections.abc import Awaitable, Callable
from contextlib import AbstractContextManager
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from made_once import make_clip
from running import run
from terminal import press, said, screen_text, with_editor
from textual.pilot import Pilot

from contextdb.authoring.clip_folder import Tell
from contextdb.motion import write_bvh
from tui.app import EditorApp
from tui.screens import autofill
from tui.screens.autofill import AutofillDialog

NAMES = ("idle", "walk", "walk_turn_left_90", "jog")


@pytest.fixture(scope="module")
def described(tmp_path_factory) -> Path:
    """A project whose table came of its clips, without a row, a column and a cell, and with a cell that says otherwise."""
    folder = tmp_path_factory.mktemp("described")
    (folder / "clips").mkdir()
    for name in NAMES:
        write_bvh(make_clip(name).clip, folder / "clips" / f"{name}.bvh", digits=3)
    table = folder / "moves.csv"
    assert run("motion", "describe", str(folder / "clips"), "--out", str(table)).code == 0
    lines = [line.split(",") for line in table.read_text().splitlines() if not line.startswith("jog")]
    style = lines[0].index("style")
    walk = next(line for line in lines if line[0] == "walk")
    walk[1] = ""
    walk[lines[0].index("duration_s")] = "99.0"
    table.write_text("".join(",".join(line[:style] + line[style + 1 :]) + "\n" for line in lines) + "swim,,,,,1.0,,\n")
    return folder


@pytest.fixture
def game(described: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(described, tmp_path / "game"))


def in_dialog(game: Path, then: Callable[[EditorApp, Pilot[Any]], Awaitable[Any]]) -> Any:
    """Open Autofill, wait for its preview, and go on."""

    async def script(app: EditorApp, pilot: Pilot[Any]) -> Any:
        await press(pilot, "shift+f4")
        await app.workers.wait_for_complete()
        await press(pilot)
        return await then(app, pilot)

    return with_editor(game / "moves.csv", script, (140, 40))


@pytest.mark.parametrize(("key", "option"), [("enter", ()), ("a", ("--update",))])
def test_autofill_writes_the_same_bytes_as_the_command_line(game: Path, key: str, option: tuple[str, ...]):
    other = Path(shutil.copytree(game, game.parent / "other"))
    run("motion", "describe", str(other), "--into", str(other / "moves.csv"), *option)

    async def then(app: EditorApp, pilot: Pilot[Any]) -> int:
        await press(pilot, key, "ctrl+s")
        return app.main.session.sheet.history.position

    assert in_dialog(game, then) == 1
    for name in ("moves.csv", "contextdb.toml"):
        assert (game / name).read_bytes() == (other / name).read_bytes()


def test_the_preview_shows_what_would_be_filled_or_changed_by_asset_and_column(game: Path):
    async def then(app: EditorApp, pilot: Pilot[Any]) -> tuple[list[tuple[str, ...]], str, str]:
        dialog = app.screen
        assert isinstance(dialog, AutofillDialog)
        screen = screen_text(app)
        await press(pilot, "end")
        return [(line.what, line.asset, line.column) for line in dialog.lines], screen, screen_text(app)

    lines, screen, at_end = in_dialog(game, then)
    assert "duration_s: so long is the clip." in screen
    assert "gait: it goes at 2.5 m/s" in at_end
    assert "turn: it turns by 0°/s; no other clip of its gait and style differs in turn" in at_end
    assert lines[0] == ("differs", "walk", "duration_s")
    assert ("fill", "walk", "gait") in lines
    assert [line for line in lines if line[2] == "style"] == [
        ("fill", name, "style") for name in ("idle", "walk", "walk_turn_left_90")
    ]
    assert lines[-1] == ("new row", "jog", "")
    assert "gait: 1 empty · style (new): 3 empty · duration_s: 1 differ · 1 new row" in screen
    assert 'No clip for 1 row: "swim"' in screen


OTHERWISE = """
[conditions]
speed = { type = "number", unit = "cm/s" }
direction = { type = "number" }
turn = { type = "int", unit = "deg/s" }
gait = { type = "tags", values = ["Walk"] }
"""


def test_a_column_whose_condition_has_another_unit_or_type_is_not_filled_and_told(game: Path):
    (game / "contextdb.toml").write_text(OTHERWISE, encoding="utf-8")
    (game / "moves.csv").write_text("Asset Name,speed,direction,turn,gait\nwalk,120,,,\n", encoding="utf-8")
    notes = [
        '"gait" is not filled: clips show enum, contextdb.toml declares tags.',
        '"speed" is not filled: clips show number in m/s, contextdb.toml declares number in cm/s.',
        '"direction" is not filled: clips show angle in degrees, contextdb.toml declares number.',
    ]

    async def then(app: EditorApp, pilot: Pilot[Any]) -> tuple[list[tuple[str, ...]], str]:
        dialog = app.screen
        assert isinstance(dialog, AutofillDialog)
        lines, screen = [(line.what, line.column) for line in dialog.lines], screen_text(app)
        await press(pilot, "enter")
        assert app.main.session.sheet.clips.cells["walk"].keys() == {"turn", "style", "duration_s", "start", "end"}
        return lines, screen

    lines, screen = in_dialog(game, then)
    assert {column for _, column in lines if column} == {"turn", "style", "duration_s", "start", "end"}
    assert notes[0] in screen
    described = run("motion", "describe", str(game), "--into", str(game / "moves.csv"))
    assert described.code == 0
    assert [line.removeprefix("contextdb: ") for line in described.err.splitlines()][: len(notes)] == notes
    header, *rows = (game / "moves.csv").read_text(encoding="utf-8").splitlines()
    assert header.startswith("Asset Name,speed,direction,turn,gait,style")
    assert rows[0].startswith("walk,120,,-55..55,,")
    assert all(row.split(",")[1:3] == ["", ""] for row in rows[1:])


JOBS = """
[tables.moves]
priority = "turn"
[tables.moves.outputs]
speed = { type = "number", default = 0 }
start = { type = "enum", values = ["Idle", "Walk.Left"], default = "Idle" }
duration_s = { type = "int", default = 0 }
[conditions]
end = { type = "enum", values = ["Idle"] }
"""


def test_a_column_with_another_job_is_not_filled_and_told(game: Path):
    (game / "contextdb.toml").write_text(JOBS, encoding="utf-8")
    (game / "moves.csv").write_text("Asset Name,speed,turn,start,end,duration_s\nwalk,1,2,,,\n", encoding="utf-8")
    for name in ("jog", "walk_turn_left_90"):
        (game / "clips" / f"{name}.bvh").unlink()
    described = run("motion", "describe", str(game), "--into", str(game / "moves.csv"))
    assert described.code == 0
    assert [line.removeprefix("contextdb: ") for line in described.err.splitlines()] == [
        '"speed" is not filled: clips show number in m/s, contextdb.toml declares an output.',
        '"turn" is not filled: clips show number in degrees a second, contextdb.toml declares a column for priority.',
        '"duration_s" is not filled: clips show number, contextdb.toml declares an output of type int.',
        '"end" is not filled: clips show text, contextdb.toml declares enum.',
    ]
    assert (game / "moves.csv").read_text(encoding="utf-8").splitlines() == [
        "Asset Name,speed,turn,start,end,duration_s,gait,direction,style",
        "walk,1,2,Walk.Left,,,Walk,Any,Any",
        "idle,,,Idle,,,Idle,Any,Any",
    ]
    assert run("check", str(game), "--fail-on", "warning").code == 0


def test_escape_changes_nothing(game: Path):
    async def then(app: EditorApp, pilot: Pilot[Any]) -> bool:
        await press(pilot, "escape")
        return app.main.session.sheet.is_modified or bool(app.main.session.sheet.clips.cells)

    assert not in_dialog(game, then)


def test_escape_stops_the_work(game: Path, monkeypatch: pytest.MonkeyPatch):
    is_left, told = Event(), []

    def two_clips(_folder: Path, _table: Path, progress: Callable[[str], AbstractContextManager[Tell]]) -> None:
        with progress("describing") as tell:
            tell(0, 2, "walk")
            assert is_left.wait(60)
            tell(1, 2, "jog")
            told.append("jog")

    monkeypatch.setattr(autofill, "rows_for", two_clips)

    async def script(app: EditorApp, pilot: Pilot[Any]) -> str:
        await press(pilot, "shift+f4")
        while "Describing: " not in (screen := screen_text(app)):
            await pilot.pause()
        await press(pilot, "escape")
        is_left.set()
        await app.workers.wait_for_complete()
        return screen

    assert "Describing: 0 of 2, walk" in with_editor(game / "moves.csv", script)
    assert told == []


def test_cells_of_clips_are_marked_and_one_that_says_otherwise_says_what_its_clip_shows(game: Path):
    async def then(app: EditorApp, pilot: Pilot[Any]) -> tuple[str, str, str]:
        await press(pilot, "enter")
        sheet, told = app.main.session.sheet, said(app)
        names = [column.name for column in sheet.table.columns]
        walk = sheet.table.assets.index("walk")
        marks = [sheet.clips.mark("walk", name, sheet.table.columns[names.index(name)][walk]) for name in ("gait", "duration_s")]
        sheet.go(walk, names.index("duration_s"))
        app.main.show()
        await press(pilot, "left", "right")
        screen = screen_text(app)
        sheet.type_text("98.0")
        return told, "".join(marks) + sheet.marked(walk, names.index("duration_s")), screen

    told, marks, screen = in_dialog(game, then)
    assert "1 cell says otherwise than its clip." in told
    assert marks == "◦≠"
    assert "≠99.0" in screen
    assert "its clip shows" in screen
    assert "◦Walk" in screen


def test_a_folder_without_clips_is_told(game: Path):
    shutil.rmtree(game / "clips")
    (game / "contextdb.toml").unlink()

    async def then(app: EditorApp, pilot: Pilot[Any]) -> str:
        await press(pilot, "enter")
        return " ".join(screen_text(app).split())

    assert "there is no file of" in in_dialog(game, then)
