"""The empty row below the last one: it takes what is typed and pasted, and no other row is changed from there."""

from pathlib import Path

import pytest
from terminal import press, said, screen_text, with_editor

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


def test_a_paste_there_is_appended(path):
    async def script(app, pilot):
        await press(pilot, "down", "down")
        app.main.assets.grid.paste("jog\tTrue\ndash\tFalse\n")
        await press(pilot)
        return app.main.session.sheet.table.assets, app.main.session.sheet.cursor

    assets, cursor = with_editor(path, script)
    assert list(assets) == ["walk", "run", "jog", "dash"]
    assert cursor == (2, 0)


def test_rows_that_are_pasted_there_are_seen(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text("Asset,hit\n" + "".join(f"a{at},Any\n" for at in range(40)))

    async def script(app, pilot):
        await press(pilot, "ctrl+end", "down")
        app.main.assets.grid.paste("jog\tTrue\ndash\tFalse\nhop\tAny\n")
        await press(pilot)
        await press(pilot)
        return screen_text(app), app.main.session.sheet.cursor[0]

    shown, row = with_editor(file, script)
    assert all(name in shown for name in ("jog", "dash", "hop"))
    assert row == 40


def test_down_goes_to_it_and_up_comes_back(path):
    async def script(app, pilot):
        grid, seen = app.main.assets.grid, []
        for key in ("down", "down", "down", "up", "up", "up"):
            await press(pilot, key)
            seen.append("test" if grid.is_in_test_row else "new" if grid.is_in_new_row else grid.sheet.cursor[0])
        return seen

    assert with_editor(path, script) == [1, "new", "new", 1, 0, "test"]


def test_it_is_seen_and_named(path):
    async def script(app, pilot):
        await press(pilot, "down", "down")
        return screen_text(app)

    screen = with_editor(path, script)
    assert "new row · Asset" in screen
    assert "+    new row" in screen
    assert "type or paste here to add rows" in screen


def test_a_click_goes_there(path):
    async def script(app, pilot):
        grid = app.main.assets.grid
        await pilot.click(grid, offset=(6, grid.look.n_headers + 2))
        await press(pilot, *"jog", "enter")
        return list(app.main.session.sheet.table.assets)

    assert with_editor(path, script) == ["walk", "run", "jog"]


def test_one_step_takes_the_row_back(path):
    assert rows_after(path, "down", "down", *"jog", "enter", "ctrl+z") == BEFORE


def test_a_row_that_is_typed_while_rows_are_filtered_is_shown(path):
    async def script(app, pilot):
        await press(pilot, "alt+e", "down", *"jog", "enter")
        sheet = app.main.session.sheet
        return [sheet.text(row, 0) for row in range(len(sheet.view))], said(app)

    assert with_editor(path, script)[0] == ["walk", "jog"]


@pytest.mark.parametrize(
    ("size", "name"), [((80, 24), "Land_Grass_…rward_03_v2"), ((120, 36), "Land_Grass_Soft_Roll_Forward_03_v2")]
)
def test_the_only_row_of_a_wide_table_is_told_by_its_name_and_a_header_takes_no_room_from_it(tmp_path, size, name):
    columns = [
        "weight",
        "cooldown_s",
        *(f"{what}_{of}" for what in ("gait", "speed", "ground") for of in ("own", "target", "next")),
    ]
    path = tmp_path / "wide.csv"
    path.write_text(f"Asset,{','.join(columns)}\nLand_Grass_Soft_Roll_Forward_03_v2,1,2.5{',Any' * 9}\n")

    async def script(app, pilot):
        return screen_text(app).splitlines()

    lines = with_editor(path, script, size)
    row = next(line for line in lines if line.startswith("1 "))
    assert name in row
    assert len(row.split("│")[2]) <= len(" cooldown_s")
