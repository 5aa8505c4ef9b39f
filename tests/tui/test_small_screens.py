"""Screens of every size: nothing fails, and what matters most is still seen."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from strategies import IS_FULL
from terminal import press, screen_text, settled, with_editor

TABLES = Path(__file__).parent.parent.parent / "tables"
SIZES = ((20, 8), (200, 60), (33, 11), (80, 24), (3, 2), (1, 1), (60, 14), (80, 24))
FEW_SIZES = ((33, 11), (1, 1), (100, 30), (80, 24))
SCENES = {
    "grid": (),
    "cell editor": ("right", "right", "right", "f2"),
    "list": ("right", "f4"),
    "refused": ("right", "right", "right", "x", "enter"),
    "test row": ("f6",),
    "find": ("ctrl+f",),
    "filter": ("ctrl+l",),
    "contexts": ("f9",),
    "why": ("f8", "down", "f12"),
    "options": ("alt+2",),
    "priorities": ("alt+3",),
    "coverage": ("alt+4",),
    "pairs": ("alt+4", "2"),
    "problems": ("alt+5",),
    "add column": ("alt+c",),
    "help": ("f1",),
    "steps": ("x", "enter", "alt+z"),
    "go to": ("ctrl+g",),
    "tables": ("ctrl+o",),
    "leaving": ("x", "enter", "ctrl+q"),
    "palette": ("ctrl+p",),
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return Path(shutil.copytree(TABLES, tmp_path / "tables", ignore=shutil.ignore_patterns("clips", ".*"))) / "hit_mid_air.csv"


@pytest.mark.parametrize("scene", SCENES)
def test_a_screen_that_is_made_smaller_and_larger_stays_what_it_is(path, scene):
    async def script(app, pilot):
        await press(pilot, *SCENES[scene])
        app.main.coverage.join()
        await settled(pilot)
        before = screen_text(app).splitlines()
        is_of = type(app.screen), type(app.focused)
        for size in SIZES if IS_FULL else FEW_SIZES:
            await pilot.resize_terminal(*size)
            await settled(pilot)
        return before, screen_text(app).splitlines(), is_of, (type(app.screen), type(app.focused))

    before, after, was, now = with_editor(path, script)
    assert (after[0], after[-1], len(after)) == (before[0], before[-1], len(before))
    assert now == was


def test_in_a_terminal_of_80_columns_and_24_lines_five_columns_are_whole_and_fourteen_rows_are_seen(path):
    async def script(app, pilot):
        return screen_text(app).splitlines()

    lines = with_editor(path, script)
    rows = [line for line in lines if line[:2].strip().isdigit()]
    assert len(rows) >= 14
    assert all(line.count("│") >= 5 for line in rows)
    assert [line.count("Commands") for line in (lines[0], lines[-1])] == [1, 0]


def test_in_a_terminal_of_160_columns_all_nine_columns_are_whole(path):
    async def script(app, pilot):
        return screen_text(app).splitlines()

    assert next(line for line in with_editor(path, script, (160, 48)) if line.startswith(" 1 ")).count("│") == 9


def test_in_a_terminal_of_20_columns_and_8_lines_there_are_names_rows_the_test_row_and_keys(path):
    async def script(app, pilot):
        return screen_text(app).splitlines()

    lines = with_editor(path, script, (20, 8))
    assert "row 1" in lines[1]
    assert "↕" in lines[2]
    assert [line.split()[0] for line in lines[3:6]] == ["1", "2", "?"]
    assert "F2 Edit" in lines[-1]


def test_the_rows_can_be_gone_through_in_a_terminal_of_20_columns_and_8_lines(path):
    async def script(app, pilot):
        await press(pilot, *["down"] * 6, "right")
        return screen_text(app).splitlines()

    lines = with_editor(path, script, (20, 8))
    assert "row 7" in lines[1]
    assert any(line.split()[:1] == ["7"] for line in lines[3:6])


def test_a_cell_is_edited_in_a_terminal_of_20_columns_and_8_lines(path):
    async def script(app, pilot):
        await press(pilot, "right", "t", "enter")
        return app.main.session.sheet.text(0, 1)

    assert with_editor(path, script, (20, 8)) == "True"
