"""The empty row below the last one: it takes what is typed and pasted, and no other row is changed from there."""

from pathlib import Path

import pytest
from terminal import press, with_editor

RAW = "Asset,hit\nwalk,True\nrun,Any\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_text(RAW)
    return file


def rows_after(path: Path, *keys: str) -> list[list[str]]:
    async def script(app, pilot):
        await press(pilot, *keys)
        table = app.main.session.sheet.table
        return [list(row) for row in zip(*(c.to_list() for c in table.columns), strict=True)]

    return with_editor(path, script)


BEFORE = [["walk", "True"], ["run", "Any"]]


def test_what_is_typed_there_makes_a_row_and_enter_goes_on_to_the_next(path):
    keys = ["down", "down", *"jog", "enter", *"dash", "enter"]
    assert rows_after(path, *keys) == [*BEFORE, ["jog", ""], ["dash", ""]]


def test_tab_goes_on_in_the_new_row(path):
    assert rows_after(path, "down", "down", *"jog", "tab", "t", "enter") == [*BEFORE, ["jog", "True"]]


def test_enter_goes_back_over_cells_that_tab_left_as_they_are(path):
    assert rows_after(path, "tab", "f", "enter", *"jog", "enter") == [["walk", "False"], ["jog", "Any"]]


def test_a_text_that_cannot_be_read_makes_no_row(path):
    assert rows_after(path, "right", "down", "down", *"maybe", "enter", "escape") == BEFORE


@pytest.mark.parametrize("key", ["delete", "ctrl+k", "ctrl+d", "ctrl+x", "ctrl+b", "ctrl+e", "alt+m"])
def test_no_key_there_changes_the_last_row(path, key):
    assert rows_after(path, "down", "down", key) == BEFORE


def test_one_step_takes_the_row_back(path):
    assert rows_after(path, "down", "down", *"jog", "enter", "ctrl+z") == BEFORE
