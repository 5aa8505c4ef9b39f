"""What the hands know from Excel: runs of Tabs, prefixes, new values from the cell, series, the menu of the right button."""

from pathlib import Path

import pytest
from terminal import press, screen_text, with_editor

from tui.model.condition_form import undeclared
from tui.model.series import continued

TOML = '[conditions.gait]\ntype = "enum"\nvalues = ["Walk", "Run", "Crouching"]\n'


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    file = tmp_path / "t.csv"
    file.write_text("Asset,gait,speed\nDodge_v1,Walk,1\nb,Run,2\nc,Any,3\n")
    return file


@pytest.mark.parametrize(
    ("begun", "more"),
    [
        (["Dodge_v1"], ["Dodge_v2", "Dodge_v3", "Dodge_v4"]),
        (["Dodge_09"], ["Dodge_10", "Dodge_11", "Dodge_12"]),
        (["take10b", "take20b"], ["take30b", "take40b", "take50b"]),
        (["3"], ["4", "5", "6"]),
        (["0.1", "0.2"], ["0.3", "0.4", "0.5"]),
        (["-1", "-3"], ["-5", "-7", "-9"]),
        (["Walk"], ["Walk", "Walk", "Walk"]),
        (["Walk", "Run"], ["Run", "Run", "Run"]),
        ([""], ["", "", ""]),
    ],
)
def test_a_series_goes_on(begun, more):
    assert continued(begun, 3) == more


def test_a_number_too_long_to_count_is_repeated():
    assert continued(["a" + "9" * 40], 2) == ["a" + "9" * 40] * 2


@pytest.mark.parametrize(
    ("text", "names"),
    [("Pro", ["Pro"]), ("Walk Pro ~2", ["Pro"]), ("not Pro", ["Pro"]), ('"A B" +C', ["A B", "C"]), ("Walk", []), ("Any", [])],
)
def test_the_names_that_are_no_values_are_found(text, names):
    assert undeclared(text, ["Walk", "Run"]) == names


def test_names_are_not_compared_with_every_declared_value():
    class Name(str):
        n_compared = 0
        __hash__ = str.__hash__

        def __eq__(self, other):
            Name.n_compared += 1
            return str.__eq__(self, other)

    values = [Name(f"tag_{at}") for at in range(300)]
    assert undeclared(" ".join(f"+tag_{at}" for at in range(301)), values) == ["tag_300"]
    assert Name.n_compared < 2_000


async def right_click(app, pilot, x: int, y: int) -> None:
    grid = app.main.assets.grid
    await pilot.mouse_down(grid, offset=(x, y), button=3)
    await press(pilot)


def test_the_right_button_offers_what_can_be_done_with_a_cell(path):
    async def script(app, pilot):
        grid = app.main.assets.grid
        look = grid.look
        await right_click(app, pilot, look.layout.place(1, 0) + 2, look.n_headers + 1)
        menu = screen_text(app)
        await press(pilot, *"dupli", "enter")
        return menu, list(app.main.session.sheet.table.assets)

    menu, assets = with_editor(path, script, (100, 30))
    assert "Duplicate" in menu
    assert "Ctrl+B" in menu
    assert assets == ["Dodge_v1", "b", "b", "c"]


def test_the_right_button_on_a_header_offers_what_can_be_done_with_the_column(path):
    async def script(app, pilot):
        grid = app.main.assets.grid
        await right_click(app, pilot, grid.look.layout.place(1, 0) + 2, 0)
        await press(pilot, *"hide", "enter")
        sheet = app.main.session.sheet
        return sheet.hidden, sheet.is_modified

    assert with_editor(path, script, (100, 30)) == ((False, True, False), False)


# ---- again, and widths
