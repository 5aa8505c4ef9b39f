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


def test_an_edit_is_marked_beside_the_name_until_it_is_saved_or_undone(path):
    async def script(app, pilot):
        lines = []
        for keys in (["x", "enter"], ["ctrl+z"], ["ctrl+y"], ["ctrl+s"]):
            await press(pilot, *keys)
            lines.append(screen_text(app).splitlines()[0][:4].split())
        return lines

    assert with_editor(path, script) == [["t", "*"], ["t"], ["t", "*"], ["t"]]


def test_saving_writes_only_the_line_that_was_edited(path):
    async def script(app, pilot):
        await press(pilot, "down", "x", "enter", "ctrl+s")
        return said(app)

    assert with_editor(path, script) == "Saved t.csv."
    assert path.read_text() == "Asset,hit\nwalk,True\nx,Any\n"


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


def test_a_cell_that_cannot_be_read_is_finished_before_a_save(path):
    async def script(app, pilot):
        await press(pilot, "right", *"maybe", "enter", "ctrl+s")
        return said(app), app.main.assets.editor is not None

    text, is_open = with_editor(path, script)
    assert "Correct the cell first" in text
    assert is_open
    assert path.read_text() == "Asset,hit\nwalk,True\nrun,Any\n"


@pytest.mark.parametrize(
    ("key", "tab"), [("alt+2", "options"), ("alt+3", "priorities"), ("alt+4", "coverage"), ("alt+5", "problems")]
)
def test_each_tab_opens_and_the_way_back_is_to_the_same_cell(path, key, tab):
    async def script(app, pilot):
        await press(pilot, "down", "right", key)
        there = app.main.tab
        await press(pilot, "alt+1")
        return there, app.main.tab, app.main.session.sheet.cursor, app.main.assets.grid.has_focus

    assert with_editor(path, script) == (tab, "assets", (1, 1), True)


def test_the_tabs_go_round(path):
    async def script(app, pilot):
        tabs = []
        for key in ["ctrl+pagedown"] * 6 + ["ctrl+pageup"]:
            await press(pilot, key)
            tabs.append(app.main.tab)
        return tabs

    assert with_editor(path, script) == ["options", "priorities", "coverage", "problems", "contracts", "assets", "contracts"]


def test_the_tabs_go_round_also_where_the_table_is_wider_than_the_screen(path):
    names = [f"condition_{at}" for at in range(30)]
    path.write_text(f"Asset,{','.join(names)}\nwalk{',Any' * 30}\n")

    async def script(app, pilot):
        tabs = []
        for key in ["ctrl+pagedown", "ctrl+pageup", "ctrl+pageup"]:
            await press(pilot, key)
            tabs.append(app.main.tab)
        return tabs

    assert with_editor(path, script) == ["options", "assets", "contracts"]


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


def test_a_row_inserted_from_the_test_row_is_where_one_types_next(path):
    async def script(app, pilot):
        await press(pilot, "f6", "ctrl+n", "home", *"new", "enter")
        return list(app.main.session.sheet.table.assets), dict(app.main.session.sheet.query.texts)

    assets, facts = with_editor(path, script)
    assert (assets[1], facts) == ("new", {})


def test_leaving_without_edits_asks_nothing(path):
    async def script(app, pilot):
        await press(pilot, "ctrl+q")
        return app.return_code

    assert with_editor(path, script) == 0


@pytest.mark.parametrize(("answer", "is_left", "is_saved"), [("s", True, True), ("d", True, False), ("escape", False, False)])
def test_leaving_with_edits_asks(path, answer, is_left, is_saved):
    async def script(app, pilot):
        await press(pilot, "x", "enter", "ctrl+q", answer)
        return app._exit

    assert with_editor(path, script) is is_left
    assert ("\nx,True\n" in "\n" + path.read_text().split("\n", 1)[1]) is is_saved


def test_another_table_of_the_folder_opens_and_the_first_keeps_its_edits(path):
    async def script(app, pilot):
        await press(pilot, "x", "enter", "ctrl+o", *"other", "enter")
        there = app.main.table_name, screen_text(app)
        await press(pilot, "ctrl+o", "t", "asterisk", "enter")
        await press(pilot, "escape")
        return there, app.workspace.unsaved

    (name, shown), unsaved = with_editor(path, script)
    assert name == "other"
    assert "leap" in shown
    assert unsaved == ["t"]


def test_a_table_that_cannot_be_read_is_refused_and_the_one_that_is_seen_stays(path):
    (path.parent / "broken.csv").write_text("a,a\nx,y\n")

    async def script(app, pilot):
        app.open_table("broken")
        await press(pilot)
        return app.main.table_name, said(app)

    name, text = with_editor(path, script)
    assert name == "t"
    assert "appears twice" in text


def test_going_to_a_row_takes_its_number_or_the_beginning_of_its_name(path):
    async def script(app, pilot):
        places = []
        for keys in (["2"], ["w", "a"], ["9"]):
            await press(pilot, "ctrl+g", *keys, "enter")
            places.append(app.main.session.sheet.cursor[0])
        return places, screen_text(app)

    places, shown = with_editor(path, script)
    assert places == [1, 0, 0]
    assert "The table has 2 rows." in shown


def test_the_undo_history_goes_to_any_step(path):
    async def script(app, pilot):
        await press(pilot, "x", "enter", "y", "enter", "alt+z", "up", "up", "enter")
        return app.main.session.sheet.history.position, app.main.session.sheet.table.assets[0]

    assert with_editor(path, script) == (0, "walk")


def test_why_needs_a_test_row_that_asks(path):
    async def script(app, pilot):
        await press(pilot, "f12")
        return said(app)

    assert with_editor(path, script).startswith("The test row is empty")


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


def test_what_was_said_in_one_tab_is_gone_in_the_next(path):
    async def script(app, pilot):
        await press(pilot, "ctrl+c")
        before = said(app)
        await press(pilot, "alt+5")
        return before, said(app)

    assert with_editor(path, script) == ("Copied 1 × 1.", "")
