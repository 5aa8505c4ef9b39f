"""Notes on cells and colours of rows, texts found in all tables, copied cells inserted, and what the mouse drags elsewhere."""

from pathlib import Path

import pytest
from terminal import press, said, screen_text, settled, with_editor

from contextdb.edits.notes import Notes
from contextdb.edits.renaming_assets import asset_renaming
from contextdb.tables.other_files import notes_path
from contextdb.tables.project import load_table, table_files
from tui.model.sheet import Sheet

TOML = '[conditions.gait]\ntype = "enum"\nvalues = ["Walk", "Run"]\n[tables.t]\noutputs = ["take"]\n'
RAW = "Asset,speed,gait,take\nDodge_v1,1,Walk,a\nb,2,Run,b\nc,3,Any,c\nd,4,Any,d\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_text(RAW)
    (tmp_path / "contextdb.toml").write_text(
        '[conditions.gait]\ntype = "enum"\nvalues = ["Walk", "Run"]\n[tables.t]\noutputs = ["take"]\n'
    )
    (tmp_path / "other.csv").write_text("Asset,gait\nDodge_v2,Walk\nx,Run\n")
    return file


@pytest.fixture
def sheet(path: Path) -> Sheet:
    return Sheet(load_table(path))


def test_notes_and_colours_are_lines_that_merge_and_no_table(path):
    marks = Notes().with_note("b", "speed", "ask Ana").with_colour(["Dodge_v1", "b"], "amber").with_note("b", "gait", "x")
    marks.with_note("b", "gait", " ").write(path)
    assert notes_path(path).read_text() == "Asset,Column,Note,Colour\nDodge_v1,,,amber\nb,,,amber\nb,speed,ask Ana,\n"
    assert Notes.beside(path) == marks.with_note("b", "gait", "")
    assert sorted(name for name, _ in table_files(path.parent, load_table(path).schema)) == ["other", "t"]


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", 'Asset,Column,Note,Colour\n"x\n'])
def test_a_file_of_notes_that_is_none_says_nothing(path, text):
    notes_path(path).write_text(text)
    assert Notes.beside(path) == Notes()


def test_a_colour_that_there_is_not_colours_nothing_and_stays_in_the_file(path):
    notes_path(path).write_text("Asset,Column,Note,Colour\nb,,,mauve\nb,speed,ask Ana,red\n")
    assert not Notes.beside(path).colours
    Notes.read(path).with_note("c", "speed", "x").with_colour(["c"], "red").write(path)
    told = "Asset,Column,Note,Colour\nb,,,mauve\nb,speed,ask Ana,red\nc,,,red\nc,speed,x,\n"
    assert notes_path(path).read_text() == told


@pytest.mark.parametrize(
    "text",
    [
        "Asset,Column,Note,Colour\n<<<<<<< ours\nb,speed,ask Ana,\n=======\nb,speed,ask Bo,\n>>>>>>> theirs\n",
        "Asset,Column,Note,Colour,By\nb,speed,ask Ana,,Bo\n",
    ],
)
def test_a_note_is_not_written_over_what_cannot_be_kept(path, text):
    async def script(app, pilot):
        await press(pilot, "down", "right", "shift+f2", *"hello", "enter")
        return said(app)

    notes_path(path).write_text(text)
    told = with_editor(path, script, (100, 24))
    assert notes_path(path).read_text() == text
    assert notes_path(path).name in told


def test_notes_go_along_with_a_renamed_asset(path):
    Notes().with_note("b", "speed", "ask Ana").write(path)
    asset_renaming(load_table(path), "b", "bee").write()
    assert Notes.beside(path).texts == {("bee", "speed"): "ask Ana"}


def test_the_editor_writes_a_note_shows_it_and_takes_it_away(path):
    async def script(app, pilot):
        await press(pilot, "down", "right", "shift+f2", *"hello", "enter")
        seen, told = screen_text(app), said(app)
        app.main.assets.action_colour_rows()
        await press(pilot)
        await press(pilot, *"amb", "enter")
        coloured = screen_text(app), Notes.beside(path)
        await press(pilot, "shift+f2", "ctrl+u", "enter")
        return seen, told, coloured, Notes.beside(path), app.main.session.sheet.is_modified

    seen, told, (screen, marks), after, is_modified = with_editor(path, script, (100, 24))
    assert "note: hello" in seen
    assert "▪2" in seen
    assert told == "Note saved."
    assert "marked amber" in screen
    assert marks == Notes({("b", "speed"): "hello"}, {("b", ""): "amber"})
    assert after == Notes({}, {("b", ""): "amber"})
    assert not is_modified


def test_a_text_is_found_in_all_tables_and_gone_to(path):
    async def script(app, pilot):
        await press(pilot, "shift+f5", *"dodge")
        listed = screen_text(app)
        await press(pilot, "down", "enter")
        return listed, app.main.table_name, app.main.session.sheet.cursor

    listed, name, cursor = with_editor(path, script, (100, 24))
    assert "2 cells in 2 tables" in listed
    assert (name, cursor) == ("other", (0, 0))


def test_copied_cells_are_inserted_as_rows(sheet):
    sheet.go(1, 1)
    done = sheet.insert_copied("7\tRun\n8\tWalk\n")
    assert done.name == "Insert 2 rows"
    assert sheet.table.text_column("speed").to_list() == ["1", "7", "8", "2", "3", "4"]
    assert sheet.table.text_column("gait").to_list()[1:3] == ["Run", "Walk"]


@pytest.mark.parametrize(
    ("selected", "to", "column", "after"),
    [
        ((0, 0, 0), (2, 0), "Asset", ["Dodge_v1", "Dodge_v2", "Dodge_v3", "d"]),
        ((0, 1, 0), (2, 1), "speed", ["1", "1", "1", "4"]),
        ((0, 1, 1), (3, 1), "speed", ["1", "2", "3", "4"]),
        ((1, 2, 1), (3, 2), "gait", ["Walk", "Run", "Any", "Run"]),
        ((0, 3, 0), (1, 3), "take", ["a", "a", "c", "d"]),
        ((1, 1, 0), (1, 2), "gait", ["Walk", "2", "Any", "Any"]),
    ],
)
def test_the_handle_counts_on_where_it_makes_sense_and_copies_else(sheet, selected, to, column, after):
    row, at, more = selected
    sheet.go(row, at)
    if more:
        sheet.go(row + more, at, extend=True)
    sheet.fill_to(*to)
    assert sheet.table.text_column(column).to_list() == after


def place(app, row: int, column: int) -> tuple[int, int]:
    grid = app.main.assets.grid
    x = grid.look.layout.place(column, 0) + 1 if column >= 0 else 1
    return grid.content_region.x + x, grid.content_region.y + grid.look.n_headers + row


async def drag(pilot, start: tuple[int, int], stop: tuple[int, int]) -> None:
    await pilot.mouse_down(offset=start)
    await pilot.hover(offset=stop)
    await pilot.mouse_up(offset=stop)
    await press(pilot)


def test_selected_rows_are_dragged_to_another_place(path):
    async def script(app, pilot):
        await pilot.click(offset=place(app, 0, -1))
        await drag(pilot, place(app, 0, -1), place(app, 2, -1))
        return list(app.main.session.sheet.table.assets), said(app)

    assert with_editor(path, script) == (["b", "c", "Dodge_v1", "d"], "Move Dodge_v1.")


def test_a_selected_column_is_dragged_to_another_place(path):
    async def script(app, pilot):
        x, y = place(app, 0, 1)
        to, _ = place(app, 0, 3)
        top = y - app.main.assets.grid.look.n_headers
        await pilot.click(offset=(x, top))
        await drag(pilot, (x, top), (to, top))
        return [c.name for c in app.main.session.sheet.table.columns]

    assert with_editor(path, script) == ["Asset", "gait", "take", "speed"]


def test_the_handle_at_the_corner_is_dragged_down(path):
    async def script(app, pilot):
        await press(pilot, "right", "shift+down")
        shows_handle = "■" in screen_text(app)
        layout = app.main.assets.grid.look.layout
        x, y = place(app, 1, 1)
        corner = x - 1 + layout.widths[1], y
        await pilot.mouse_down(offset=corner)
        await pilot.hover(offset=(corner[0], y + 2))
        preview = app.main.session.sheet.block.shape, app.main.session.sheet.is_modified
        await pilot.mouse_up(offset=(corner[0], y + 2))
        await settled(pilot)
        assert preview == ((4, 1), False)  # what would be filled is selected
        return shows_handle, app.main.session.sheet.table.text_column("speed").to_list(), app.main.session.sheet.block.shape

    assert with_editor(path, script) == (True, ["1", "2", "3", "4"], (4, 1))


def test_a_sorted_view_moves_no_rows(path):
    async def script(app, pilot):
        await press(pilot, "right", "alt+s", "alt+s")
        await pilot.click(offset=place(app, 0, -1))
        await drag(pilot, place(app, 0, -1), place(app, 2, -1))
        return list(app.main.session.sheet.table.assets), said(app)

    assets, told = with_editor(path, script)
    assert assets == ["Dodge_v1", "b", "c", "d"]
    assert "sorted" in told


def test_a_warning_goes_when_one_goes_on(path):
    async def script(app, pilot):
        await press(pilot, "right", "alt+s", "alt+m")
        warned = said(app)
        await press(pilot, "down", "down")
        return warned, said(app)

    warned, after = with_editor(path, script)
    assert "sorted" in warned
    assert after == ""
