"""The screen of a table: its tabs and lines, what is said, saving, leaving, and other tables of the folder."""

from pathlib import Path

import pytest
from strategies import some
from terminal import press, said, screen_text, with_editor

from contextdb.errors import FileError
from tui.messages import FillGap


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "other.csv").write_text("Asset,up\nleap,True\n")
    file = tmp_path / "t.csv"
    file.write_text("Asset,hit\nwalk,True\nrun,Any\n")
    return file


def test_a_save_that_fails_says_why_and_keeps_the_edits(path, monkeypatch):
    async def script(app, pilot):
        await press(pilot, "x", "enter")

        def refuse(*_, **__):
            raise FileError("the disk is full.")

        monkeypatch.setattr(app.main.session, "save", refuse)
        await press(pilot, "ctrl+s")
        return said(app), app.main.session.sheet.is_modified

    text, is_modified = with_editor(path, script)
    assert "the disk is full" in text
    assert is_modified


def test_the_row_for_a_gap_is_named_where_it_stands_also_when_one_was_in_the_test_row(path):
    async def script(app, pilot):
        await press(pilot, "right", "f6", "t", "enter", "alt+4")
        app.main.post_message(FillGap({"hit": "False"}))
        await press(pilot, *"new", "enter")
        sheet = app.main.session.sheet
        return sheet.table.assets[1], sheet.table.text(1, "hit"), dict(sheet.query.texts)

    assert with_editor(path, script) == ("new", "False", {"hit": "True"})


def test_the_other_cells_of_a_row_for_a_gap_say_any_as_their_columns_do(path):
    path.write_text("Asset,speed,hit,gait\na,0..2,Any,\nb,Any,True,Walk\n")

    async def script(app, pilot):
        app.main.post_message(FillGap({"speed": "(2..3]"}, below=0))
        await press(pilot, *"new", "enter", "ctrl+s")
        return path.read_text().splitlines()[2]

    assert with_editor(path, script) == "new,(2..3],Any,"


def test_a_table_that_cannot_be_saved_says_so_beside_its_name_after_edits_too(path):
    path.chmod(0o444)

    async def script(app, pilot):
        await press(pilot, *"new", "enter")
        return screen_text(app)

    assert with_editor(path, script).startswith(f" {path.stem} * (read-only) ")


def test_the_row_for_a_gap_comes_below_the_one_that_is_nearest_to_it(path):
    async def script(app, pilot):
        last = app.main.session.sheet.table.n_rows - 1
        app.main.post_message(FillGap({"hit": "False"}, below=last))
        await press(pilot, *"new", "enter")
        return app.main.session.sheet.table.assets[last + 1]

    assert with_editor(path, script) == "new"


@pytest.mark.parametrize("size", some([(20, 8), (40, 12), (80, 24), (160, 48)], 3))
def test_every_tab_is_shown_in_every_window(path, size):
    async def script(app, pilot):
        shown = []
        for key in ("alt+1", "alt+2", "alt+3", "alt+4", "alt+5"):
            await press(pilot, key)
            shown.append(screen_text(app))
        return shown

    assert [text.count("\n") + 1 for text in with_editor(path, script, size)] == [size[1]] * 5


def test_a_message_that_is_longer_than_the_line_is_seen_whole(path):
    async def script(app, pilot):
        app.main.say("Renamed a to b everywhere, in " + "some files, " * 8 + "and said so. Ctrl+Z takes it back.")
        await press(pilot)
        long = " ".join(screen_text(app).split())
        app.main.say("Done.")
        await press(pilot)
        return "Ctrl+Z takes it back." in long, "Ctrl+Z" in screen_text(app), "Done." in screen_text(app)

    assert with_editor(path, script) == (True, False, True)
