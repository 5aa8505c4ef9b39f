"""No key goes astray: what is typed goes to what is shown, and no cell changes that is not seen."""

from pathlib import Path

import pytest
import random_hands
from quick_apps import painted
from strategies import IS_FULL, some
from terminal import press, said, screen_text, with_editor
from textual.events import Paste

from tui.screens.ask import ChooseDialog
from tui.widgets.bar import Bar
from tui.widgets.find_bar import FilterBar, FindBar
from tui.widgets.grid import Grid

SEQUENCES = 300 if IS_FULL else 2
"""At each size; 300 cost about 70 s of the processor."""
SIZES = {(80, 24): 0, (120, 36): 10_000, (160, 48): 20_000}
"""Sizes of the terminal, with their first seeds."""
TABLE = "Asset,speed,hit\nwalk,0..2,True\nrun,2..5,Any\njump,Any,False\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_text(TABLE)
    return file


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_random_hands_change_no_cell_that_is_not_seen(tmp_path, size):
    broken = random_hands.first_broken(tmp_path, size, range(SIZES[size], SIZES[size] + SEQUENCES))
    assert broken is None, str(broken)


# ---- a cell that is edited


@pytest.mark.parametrize(
    "key", some(["alt+2", "alt+3", "alt+4", "alt+5", "alt+right", "alt+left", "ctrl+pagedown", "ctrl+pageup"], 3)
)
def test_a_key_of_a_tab_takes_the_cell_and_gives_the_keys_to_the_tab(path, key):
    async def script(app, pilot):
        await press(pilot, "down", *"Q", key)
        of_tab = app.main.tab, isinstance(app.focused, Grid), app.main.assets.editor
        await press(pilot, *"7w", "enter")
        return of_tab, list(app.main.session.sheet.table.assets)

    (tab, is_grid, editor), assets = with_editor(path, script)
    assert (tab != "assets", is_grid, editor) == (True, False, None)
    assert assets == ["walk", "Q", "jump"]


def test_a_click_on_a_tab_takes_the_cell_and_gives_the_keys_to_the_tab(path):
    async def script(app, pilot):
        await press(pilot, "down", *"Q")
        await pilot.click(app.main.query_one("#tabs", Bar), offset=(45, 0))
        await press(pilot, *"7w", "enter")
        return app.main.tab, list(app.main.session.sheet.table.assets)

    tab, assets = with_editor(path, script)
    assert tab != "assets"
    assert assets == ["walk", "Q", "jump"]


@pytest.mark.parametrize(("key", "bar"), [("ctrl+f", FindBar), ("ctrl+l", FilterBar)])
def test_the_bars_take_the_cell_and_what_is_typed_next(path, key, bar):
    async def script(app, pilot):
        await press(pilot, "down", *"Q", key, *"run")
        is_open, texts = app.main.query_one(bar).has_class("-open"), list(app.main.session.sheet.table.assets)
        await press(pilot, "escape")
        return is_open, texts, app.main.query_one(bar).has_class("-open"), isinstance(app.focused, Grid)

    assert with_editor(path, script) == (True, ["walk", "Q", "jump"], False, True)


@pytest.mark.parametrize("key", some(["alt+4", "ctrl+f", "ctrl+s", "ctrl+o", "f5", "ctrl+q", "alt+z", "shift+f5"], 3))
def test_a_cell_that_cannot_be_read_keeps_the_keys_and_its_text(path, key):
    async def script(app, pilot):
        await press(pilot, "right", *"7w", key)
        editor = app.main.assets.editor
        before = app.screen is app.main, app.main.tab, editor.text, app.focused is editor.entry, said(app)
        await press(pilot, "escape")
        return before, app.main.session.sheet.table.text_column("speed").to_list(), said(app)

    before, texts, after = with_editor(path, script)
    assert before[:4] == (True, "assets", "7w", True)
    assert "Correct the cell first" in before[4]
    assert "Correct the cell first" not in after
    assert texts == ["0..2", "2..5", "Any"]
    assert path.read_text() == TABLE


def test_a_click_beside_a_cell_that_cannot_be_read_does_nothing(path):
    async def script(app, pilot):
        await press(pilot, "right", *"7w")
        await pilot.click(app.main.assets.grid, offset=(10, 8))
        return app.main.session.sheet.cursor, app.main.assets.editor.text

    assert with_editor(path, script) == ((0, 1), "7w")


def test_help_and_the_palette_leave_the_cell_open_below_them(path):
    async def script(app, pilot):
        await press(pilot, *"Q", "f1", "escape", "ctrl+p", "escape", *"x", "enter")
        return list(app.main.session.sheet.table.assets)

    assert with_editor(path, script) == ["Qx", "run", "jump"]


def test_a_command_of_the_palette_takes_the_cell_first(path):
    async def script(app, pilot):
        await press(pilot, *"Q")
        await app.main.run_command("delete-rows")
        await press(pilot, "ctrl+z")
        return list(app.main.session.sheet.table.assets), app.main.assets.editor

    assert with_editor(path, script) == (["Q", "run", "jump"], None)


def test_saving_takes_the_cell_that_is_edited_first(path):
    async def script(app, pilot):
        await press(pilot, *"Q", "ctrl+s")
        return said(app)

    assert with_editor(path, script) == "Saved t.csv."
    assert path.read_text() == TABLE.replace("walk", "Q")


def test_leaving_takes_the_cell_that_is_edited_first_and_asks(path):
    async def script(app, pilot):
        await press(pilot, *"Q", "ctrl+q")
        await press(pilot, "s")

    with_editor(path, script)
    assert path.read_text() == TABLE.replace("walk", "Q")


def test_what_another_program_writes_waits_while_a_cell_is_edited(path):
    async def script(app, pilot):
        await press(pilot, "down", *"Q")
        path.write_text(TABLE.replace("walk,", "sit,Any,Any\nwalk,"))
        for keys in ((), ("enter",)):
            await press(pilot, *keys)
            for _ in range(2):  # a file counts once it has settled
                app.main._look()
        return list(app.main.session.sheet.table.assets)

    assert with_editor(path, script) == ["sit", "walk", "Q", "jump"]


def test_the_keys_at_the_foot_are_those_of_the_text_when_the_same_text_is_typed_over_an_open_list(path):
    async def script(app, pilot):
        await press(pilot, "w", "f4", "w")
        await painted(app)
        return screen_text(app).splitlines()[-1]

    assert "Move in the text" not in with_editor(path, script)


# ---- the empty row


@pytest.mark.parametrize("keys", [["home"], ["end", "home"], ["shift+home"], ["ctrl+left"], ["ctrl+right", "ctrl+left"]])
def test_home_and_end_stay_in_the_empty_row(path, keys):
    async def script(app, pilot):
        await press(pilot, "ctrl+end", "down", *keys)
        await press(pilot, *"new", "enter")
        return list(app.main.session.sheet.table.assets)

    assert with_editor(path, script) == ["walk", "run", "jump", "new"]


# ---- commas in what is pasted


async def paste(app, pilot, text: str) -> str:
    """Paste as a terminal does; gives the title of the dialog that asks, or nothing."""
    event = Paste(text)
    event.set_sender(app)
    app._driver.send_message(event)
    await press(pilot)
    return app.screen.title_text if isinstance(app.screen, ChooseDialog) else ""


@pytest.mark.parametrize(("keys", "expected"), [(["enter"], ["0.5", "1.5", "Any"]), (["down", "enter"], ["0,5", "1,5", "Any"])])
def test_decimal_commas_are_asked_about_before_they_are_pasted_into_numbers(path, keys, expected):
    async def script(app, pilot):
        await press(pilot, "right")
        title, before = await paste(app, pilot, "0,5\r1,5\r"), app.main.session.sheet.table.text_column("speed").to_list()
        shown = screen_text(app)
        await press(pilot, *keys)
        return title, before, shown, app.main.session.sheet.table.text_column("speed").to_list()

    title, before, shown, after = with_editor(path, script)
    assert (title, before) == ("What 0,5 means", ["0..2", "2..5", "Any"])
    assert "0.5: the comma is a decimal sign" in shown
    assert "0 ± 5: centre and tolerance" in shown
    assert after == expected


def test_a_number_with_a_comma_that_is_typed_says_that_it_is_centre_and_tolerance(path):
    async def script(app, pilot):
        await press(pilot, "right", *"0,5")
        await painted(app)
        return screen_text(app)

    assert "│ 0 ± 5: -5 to 5, ends included " in with_editor(path, script)


@pytest.mark.parametrize(("keys", "expected"), [(["enter"], "0.5"), (["down", "enter"], "0,5"), (["escape"], "")])
def test_decimal_commas_are_asked_about_before_they_are_pasted_into_a_fact(path, keys, expected):
    async def script(app, pilot):
        await press(pilot, "right", "f6")
        title = await paste(app, pilot, "0,5\r")
        await press(pilot, *keys)
        return title, app.main.session.sheet.query.text("speed")

    assert with_editor(path, script) == ("What 0,5 means", expected)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        (["enter"], ["0.5", "0..2", "2..5", "Any"]),
        (["down", "enter"], ["0,5", "0..2", "2..5", "Any"]),
        (["escape"], ["0..2", "2..5", "Any"]),
    ],
)
def test_decimal_commas_are_asked_about_before_copied_rows_are_inserted(path, keys, expected):
    async def script(app, pilot):
        await press(pilot, "right")
        app.main.assets.clipboard.copy("0,5\n")
        await app.main.run_command("insert-copied")
        await press(pilot)
        title = app.screen.title_text
        await press(pilot, *keys)
        return title, app.main.session.sheet.table.text_column("speed").to_list()

    assert with_editor(path, script) == ("What 0,5 means", expected)


def test_a_question_about_commas_that_is_not_answered_pastes_nothing(path):
    async def script(app, pilot):
        await press(pilot, "right")
        await paste(app, pilot, "0,5")
        await press(pilot, "escape")
        return app.main.session.sheet.is_modified

    assert not with_editor(path, script)


@pytest.mark.parametrize(("column", "text"), [(1, "20, 9.99\n1..2\n"), (0, "0,5"), (1, "0.5\n"), (2, "0,5")])
def test_pastes_that_are_clear_are_not_asked_about(path, column, text):
    async def script(app, pilot):
        await press(pilot, *["right"] * column)
        return await paste(app, pilot, text)

    assert with_editor(path, script) == ""


def test_what_was_copied_here_is_pasted_as_it_was(path):
    path.write_text(TABLE.replace("0..2", '"0,5"'))

    async def script(app, pilot):
        await press(pilot, "right", "ctrl+c", "down")
        title = await paste(app, pilot, "0,5\r")
        return title, app.main.session.sheet.table.text_column("speed").to_list()

    assert with_editor(path, script) == ("", ["0,5", "0,5", "Any"])


def test_lines_of_csv_are_split_when_asked(path):
    async def script(app, pilot):
        title = await paste(app, pilot, 'a,"1, 2",True\rb,3..4,Any\r')
        await press(pilot, "enter")
        return title, [column.to_list() for column in app.main.session.sheet.table.columns]

    title, columns = with_editor(path, script)
    assert title == "Commas in the text that is pasted"
    assert columns == [["a", "b", "jump"], ["1, 2", "3..4", "Any"], ["True", "Any", "False"]]
