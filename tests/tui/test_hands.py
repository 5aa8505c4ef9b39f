"""What the hands know from Excel: runs of Tabs, prefixes, new values from the cell, series, the menu of the right button."""

from pathlib import Path

import pytest
from terminal import press, said, screen_text, with_editor

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


def test_ctrl_t_fills_a_series_down_as_one_step(path):
    async def script(app, pilot):
        await press(pilot, "shift+down", "shift+down", "ctrl+t")
        filled = list(app.main.session.sheet.table.assets)
        await press(pilot, "ctrl+z")
        return filled, list(app.main.session.sheet.table.assets)

    assert with_editor(path, script) == (["Dodge_v1", "Dodge_v2", "Dodge_v3"], ["Dodge_v1", "b", "c"])


def test_one_cell_alone_goes_on_from_the_cell_above(path):
    async def script(app, pilot):
        await press(pilot, "down", "ctrl+t")
        return list(app.main.session.sheet.table.assets)

    assert with_editor(path, script) == ["Dodge_v1", "Dodge_v2", "c"]


def test_ctrl_d_on_one_cell_copies_the_cell_above(path):
    async def script(app, pilot):
        await press(pilot, "down", "right", "ctrl+d")
        return app.main.session.sheet.table.text_column("gait").to_list()

    assert with_editor(path, script) == ["Walk", "Walk", "Any"]


def test_enter_after_tabs_goes_back_to_where_the_run_began(path):
    async def script(app, pilot):
        await press(pilot, "right", *"Run", "tab", "7", "enter")
        return app.main.session.sheet.cursor

    assert with_editor(path, script) == (1, 1)


def test_rows_are_typed_below_the_last_one_by_tabs_and_enter(path):
    async def script(app, pilot):
        await press(pilot, "ctrl+end", "home", "down", *"d", "tab", *"Walk", "tab", "4", "enter", *"e", "tab", *"Run", "enter")
        table = app.main.session.sheet.table
        return list(table.assets), table.text_column("gait").to_list()[3:], table.text_column("speed").to_list()[3:]

    assert with_editor(path, script) == (["Dodge_v1", "b", "c", "d", "e"], ["Walk", "Run"], ["4", ""])


def test_a_run_that_an_arrow_left_is_over(path):
    async def script(app, pilot):
        await press(pilot, "right", *"Run", "tab", "left", *"Walk", "enter")
        return app.main.session.sheet.cursor

    assert with_editor(path, script) == (1, 1)


def test_enter_takes_the_one_value_that_begins_so(path):
    async def script(app, pilot):
        await press(pilot, "right", "c", "enter")
        return app.main.session.sheet.table.text_column("gait").to_list()[0], app.main.assets.editor is None

    assert with_editor(path, script) == ("Crouching", True)


def test_a_word_that_no_value_begins_with_is_still_refused(path):
    async def script(app, pilot):
        await press(pilot, "right", *"unch", "enter")
        return app.main.session.sheet.table.text_column("gait").to_list()[0], app.main.assets.editor is not None

    assert with_editor(path, script) == ("Walk", True)


def test_a_new_value_is_declared_from_the_cell_as_one_step(path):
    async def script(app, pilot):
        await press(pilot, "right", *"Prone", "enter")
        offered = screen_text(app)
        await press(pilot, "ctrl+n")
        sheet = app.main.session.sheet
        after = sheet.text(0, 1), sheet.table.condition("gait").condition.domain.values, said(app)
        await press(pilot, "ctrl+z")
        return offered, after, sheet.text(0, 1), sheet.table.condition("gait").condition.domain.values

    offered, (text, values, told), before, declared = with_editor(path, script)
    assert "Ctrl+N add the value" in offered
    assert (text, values) == ("Prone", ("Walk", "Run", "Crouching", "Prone"))
    assert told == "Add Prone to the values of gait."
    assert (before, declared) == ("Walk", ("Walk", "Run", "Crouching"))


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


def texts(app, name):
    return app.main.session.sheet.table.text_column(name).to_list()


@pytest.mark.parametrize(
    ("first", "then", "speeds"),
    [
        (("5", "enter"), (), ["5", "5", "3"]),
        (("5", "enter"), ("shift+down",), ["5", "5", "5"]),
        (("delete",), ("down", "down"), ["", "2", ""]),
        (("down", "ctrl+d"), ("down",), ["1", "1", "1"]),
        (("ctrl+b",), (), ["1", "1", "1", "2", "3"]),
        (("5", "enter", "ctrl+z"), ("down",), ["1", "2", "5"]),
        (("5", "enter"), ("down", "down"), ["5", "2", "3", "5"]),
    ],
)
def test_ctrl_u_makes_the_last_edit_again_with_what_is_selected_now(path, first, then, speeds):
    async def script(app, pilot):
        await press(pilot, "end", *first, *then, "ctrl+u")
        return texts(app, "speed")

    assert with_editor(path, script) == speeds


def test_a_text_that_the_other_column_cannot_read_is_not_repeated_there(path):
    async def script(app, pilot):
        await press(pilot, "right", *"Run", "enter", "end", "ctrl+u")
        return texts(app, "speed"), said(app)

    speeds, told = with_editor(path, script)
    assert speeds == ["1", "2", "3"]
    assert 'cannot read "Run"' in told


def test_a_fact_is_repeated_in_the_test_row_and_a_paste_anywhere(path):
    async def script(app, pilot):
        await press(pilot, "end", "f6", "2", "enter", "ctrl+z", "ctrl+u")
        fact = app.main.session.sheet.query.text("speed")
        app.main.assets.clipboard.copy("7\n8\n")
        await press(pilot, "f6", "ctrl+v", "down", "ctrl+u")
        return fact, texts(app, "speed")

    assert with_editor(path, script) == ("2", ["7", "7", "8"])


def test_before_any_edit_there_is_nothing_to_repeat(path):
    async def script(app, pilot):
        await press(pilot, "ctrl+u")
        return said(app), app.main.session.sheet.is_modified

    assert with_editor(path, script) == ("There is no edit to repeat yet.", False)


def test_keys_make_the_selected_columns_wider_and_narrower(path):
    async def script(app, pilot):
        grid, seen = app.main.assets.grid, []
        await press(pilot, "right", "shift+right")
        for key in ("alt+full_stop", "alt+comma", *["alt+comma"] * 40):
            before = grid.grid_layout.widths
            await pilot.press(key)
            seen.append([now - was for now, was in zip(grid.grid_layout.widths, before, strict=True)])
        return seen[:2], grid.grid_layout.widths[1:]

    changes, least = with_editor(path, script)
    assert changes == [[0, 2, 2], [0, -2, -2]]
    assert least == (6, 6)
