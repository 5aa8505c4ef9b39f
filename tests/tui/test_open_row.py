"""Going into the table that a row stands for, and back to the row."""

from pathlib import Path

import pytest
from terminal import press, said, settled, with_editor

from tui.model.session import Session
from tui.screens.ask import ChooseDialog


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "dive.csv").write_text("Asset,speed\nlow,0..3\nhigh,4..9\n")
    file = tmp_path / "moves.csv"
    file.write_text("Asset,speed\nrun,0..9\n@dive,0..9\n@gone,Any\nwalk,0..2\n")
    return file


def place(app) -> tuple[str, tuple[int, int]]:
    return app.main.table_name, app.main.session.sheet.cursor


def test_a_click_on_the_mark_goes_into_the_table_and_a_key_comes_back(path):
    async def script(app, pilot):
        grid = app.main.assets.grid
        look = grid.look
        x = grid.content_region.x + look.layout.place(0, look.left)
        y = grid.content_region.y + look.n_headers
        await pilot.click(offset=(x, y + 1))
        await settled(pilot)
        inside = place(app)
        await press(pilot, "alt+q")
        back = place(app)
        await pilot.click(offset=(x, y))
        await settled(pilot)
        return inside, back, place(app)

    inside, back, plain = with_editor(path, script)
    assert inside == ("dive", (0, 0))
    assert back == ("moves", (1, 0))
    assert plain == ("moves", (0, 0))


def test_the_facts_go_along_and_the_cursor_stands_on_the_first_row_that_is_valid(path):
    async def script(app, pilot):
        await press(pilot, "f6", "right", "7", "enter", "f6", "ctrl+home", "down", "alt+o")
        return place(app), app.main.session.sheet.query.texts, app.main.assets.grid.test_name

    assert with_editor(path, script) == (("dive", (1, 0)), {"speed": "7"}, "moves")


def test_without_facts_the_test_row_of_the_inner_table_stays_as_it_was(path):
    async def script(app, pilot):
        app.workspace.session("dive").sheet.query.load({"speed": "1"})
        await press(pilot, "down", "alt+o")
        return app.main.session.sheet.query.texts

    assert with_editor(path, script) == {"speed": "1"}


def test_an_edit_inside_that_is_not_saved_counts_outside(path):
    async def script(app, pilot):
        await press(pilot, "f6", "right", "7", "enter", "f6", "ctrl+home", "down")
        before = app.main.session.sheet.query.inside(1).text
        await press(pilot, "alt+o", "up", "right", *"0..8", "enter", "alt+q")
        between = app.main.session.sheet.query.inside(1).text
        await press(pilot, "alt+o", "ctrl+z", "alt+q")
        return before, between, app.main.session.sheet.query.inside(1).text

    assert with_editor(path, script) == ("1 of 2 rows", "2 of 2 rows", "1 of 2 rows")


def test_an_edit_outside_still_is_one_step_after_a_look_inside(path):
    async def script(app, pilot):
        await press(pilot, "right", *"1..2", "enter", "left", "alt+o", "down", "x", "enter", "alt+q", "ctrl+z")
        outer = app.main.session.sheet
        return outer.text(0, 1), outer.is_modified, app.workspace.unsaved

    assert with_editor(path, script) == ("0..9", False, ["dive"])


def test_a_table_brought_back_after_a_crash_still_knows_the_tables_inside(path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(path.parent))
    session = Session(path)
    session.sheet.go(0, 1)
    assert session.sheet.type_text("1..2") is None
    session.close(keep_journal=True)
    other = path.with_name("written.csv")  # as others write: a new file in the place of the old one
    other.write_text(path.read_text().replace("walk,0..2", "walk,0..3"))
    other.replace(path)

    again = Session(path)
    assert again.n_recovered == 1
    assert again.sheet.query.inside(1).text == "2 rows"
    again.close()


def test_rows_that_open_nowhere_say_so(path):
    async def script(app, pilot):
        await press(pilot, "alt+o")
        plain = said(app)
        await press(pilot, "down", "down", "alt+o")
        gone = said(app)
        await press(pilot, "alt+q")
        return plain, gone, said(app), place(app)[0]

    plain, gone, back, name = with_editor(path, script)
    assert "@" in plain
    assert '"gone"' in gone
    assert "Alt+O" in back
    assert name == "moves"


def test_an_inner_table_that_cannot_be_read_is_told_and_its_row_is_never_valid(path):
    path.with_name("dive.csv").write_text('Asset,speed\n"low,0..3\n')

    async def script(app, pilot):
        await press(pilot, "down")
        text = app.main.session.sheet.query.inside(1).text
        await press(pilot, "f6", "right", "1", "enter", "f6", "ctrl+home", "down", "alt+o")
        return text, said(app), app.main.session.sheet.query.valid.tolist(), place(app)[0]

    text, told, valid, name = with_editor(path, script)
    assert text == "cannot be used"
    assert "dive.csv" in told
    assert valid == [True, False, False, True]
    assert name == "moves"


def test_the_tables_of_the_folder_complete_an_asset_that_begins_with_at(path):
    async def script(app, pilot):
        await press(pilot, "ctrl+end", "home", *"@d", "ctrl+t", "enter")
        return app.main.session.sheet.text(3, 0)

    assert with_editor(path, script) == "@dive"


def test_another_table_chosen_inside_does_not_lose_the_way_back(path):
    async def script(app, pilot):
        await press(pilot, "down", "alt+o", "ctrl+o")
        is_choosing = isinstance(app.screen, ChooseDialog)
        await press(pilot, "escape", "alt+q")
        return is_choosing, place(app)

    assert with_editor(path, script) == (True, ("moves", (1, 0)))
