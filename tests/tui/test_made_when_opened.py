"""What is opened now and then costs nothing before: the bars under the grid, and the lists of a form."""

from pathlib import Path

from terminal import press, screen_text, with_editor
from textual.widgets import Input, OptionList

from tui.screens.main import MainScreen
from tui.widgets.pick import Pick


def table(folder: Path) -> Path:
    file = folder / "t.csv"
    file.write_text("Asset,speed\nwalk,0..2\nrun,2..6\n")
    return file


def test_bars_are_made_when_they_are_opened_and_what_is_typed_at_once_goes_into_them(tmp_path):
    async def script(app, pilot):
        before = len(app.screen.query(Input))
        await pilot.press("ctrl+f", "r", "u", "n")
        await pilot.pause()
        return before, app.screen.query_one("#find-text", Input).value

    assert with_editor(table(tmp_path), script) == (0, "run")


def test_the_list_of_a_field_is_made_when_it_is_opened_and_shows_and_keeps_what_is_picked(tmp_path):
    async def script(app, pilot):
        await app.main.run_action("tab('options')")
        await press(pilot)
        pick = app.screen.query_one("#option-policy", Pick)
        lists = len(pick.query(OptionList))
        await press(pilot, "enter", "escape")
        closed = pick.expanded, app.focused is pick
        await press(pilot, "enter", "u", "n", "i", "enter")
        return lists, closed, pick.value, screen_text(app)

    lists, closed, value, text = with_editor(table(tmp_path), script, (120, 40))
    assert (lists, closed, value) == (0, (False, True), "unique")
    assert "unique    at most one may be valid" in text


def test_a_screen_has_the_class_of_its_height_before_its_parts_are_styled(tmp_path, monkeypatch):
    seen = []
    made = MainScreen.on_mount

    def on_mount(screen):
        seen.append([name for name in ("-low", "-high", "-tall") if screen.has_class(name)])
        made(screen)

    monkeypatch.setattr(MainScreen, "on_mount", on_mount)
    for height in (12, 24, 36):
        with_editor(table(tmp_path), lambda app, pilot: pilot.pause(), (80, height))
    assert seen == [["-low"], ["-high"], ["-tall"]]
