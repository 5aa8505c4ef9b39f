"""The mouse in the grid: what a click, a drag and a double click do, wherever they go."""

from pathlib import Path

import pytest
from terminal import press, screen_text, settled, with_editor
from textual.events import MouseScrollDown, MouseScrollUp
from textual.widgets import Input

from tui.app import EditorApp
from tui.model.layout import NARROWEST
from tui.model.selection import Block
from tui.widgets.bar import Bar
from tui.widgets.editing.choice_list import ChoiceList
from tui.widgets.grid import Grid


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_text("Asset,speed,hit\n" + "".join(f"clip_{i:02},{i}..{i + 1},True\n" for i in range(40)))
    return file


def at(app: EditorApp, row: int, column: int) -> tuple[int, int]:
    """Where a cell of the window stands on the screen: row -2 and -1 are the headers, -4 is the test row."""
    grid = app.main.assets.grid
    look = grid.look
    y = look.height - 1 if row == -4 else row + look.n_headers
    return grid.content_region.x + look.layout.place(column, look.left) + 1, grid.content_region.y + y


async def drag(pilot, start: tuple[int, int], *places: tuple[int, int]) -> None:
    await pilot.mouse_down(offset=start)
    for place in places:
        await pilot.hover(offset=place)
    await pilot.mouse_up(offset=places[-1])
    await settled(pilot)


async def click(pilot, place: tuple[int, int], **more: object) -> None:
    await pilot.click(offset=place, **more)
    await settled(pilot)


def block(app: EditorApp) -> Block:
    return app.main.session.sheet.block


def width_of(grid: Grid, column: int) -> int:
    return grid.grid_layout.widths[column]


def test_a_click_puts_the_cursor_on_the_cell_under_it(path):
    async def script(app, pilot):
        await click(pilot, at(app, 4, 2))
        return app.main.session.sheet.cursor

    assert with_editor(path, script) == (4, 2)


def test_a_click_with_shift_selects_up_to_there(path):
    async def script(app, pilot):
        await click(pilot, at(app, 1, 1))
        await click(pilot, at(app, 4, 2), shift=True)
        return block(app), app.main.session.sheet.cursor

    assert with_editor(path, script) == (Block(1, 1, 5, 3), (1, 1))


def test_a_drag_selects_backwards_too(path):
    async def script(app, pilot):
        await drag(pilot, at(app, 6, 2), at(app, 4, 1), at(app, 2, 1))
        return block(app)

    assert with_editor(path, script) == Block(2, 1, 7, 3)


def test_a_drag_past_the_foot_makes_the_rows_come_after_the_mouse(path):
    async def script(app, pilot):
        x, y = at(app, 12, 1)
        foot = app.main.assets.grid.content_region.bottom
        await drag(pilot, (x, y), *[(x + i % 2, foot) for i in range(10)])
        return block(app).bottom, app.main.assets.grid.scroll_y

    bottom, top = with_editor(path, script)
    assert bottom > 20
    assert top > 5


def test_a_drag_over_the_headers_makes_the_rows_before_come(path):
    async def script(app, pilot):
        await press(pilot, "ctrl+end")
        x, y = at(app, 2, 1)
        top = app.main.assets.grid.content_region.y
        before = app.main.assets.grid.scroll_y
        await drag(pilot, (x, y), *[(x + i % 2, top) for i in range(5)])
        return before - app.main.assets.grid.scroll_y

    assert with_editor(path, script) >= 4


def test_a_drag_that_rests_at_an_edge_goes_on_selecting_until_the_button_is_let_go(path):
    async def script(app, pilot):
        grid = app.main.assets.grid
        x, y = at(app, 12, 1)
        await pilot.mouse_down(offset=(x, y))
        await pilot.hover(offset=(x, grid.content_region.bottom))
        before = block(app).bottom
        for _ in range(4):
            grid._pointer.pull_again()
        rested = block(app).bottom
        await pilot.mouse_up(offset=(x, grid.content_region.bottom))
        let_go = block(app).bottom
        grid._pointer.pull_again()
        return rested - before >= 4, block(app).bottom == let_go, grid._pointer._timer

    assert with_editor(path, script) == (True, True, None)


def test_a_drag_past_the_right_edge_takes_in_the_columns_that_are_not_seen(tmp_path):
    names = [f"condition_number_{i}" for i in range(12)]
    file = tmp_path / "wide.csv"
    file.write_text(",".join(["Asset", *names]) + "\n" + ",".join(["clip", *["True"] * 12]) + "\n")

    async def script(app, pilot):
        grid = app.main.assets.grid
        start = at(app, 0, 1)
        await pilot.mouse_down(offset=start)
        await pilot.hover(offset=(grid.content_region.right - 1, start[1]))
        for _ in range(20):
            grid._pointer.pull_again()
        reached, scrolled = block(app).right, grid.scroll_x > 0
        await pilot.hover(offset=(0, start[1]))
        for _ in range(20):
            grid._pointer.pull_again()
        return reached, scrolled, grid.scroll_x

    assert with_editor(file, script) == (13, True, 0)


def test_moving_the_mouse_without_a_button_selects_nothing(path):
    async def script(app, pilot):
        await drag(pilot, at(app, 1, 1), at(app, 2, 2))
        await pilot.hover(offset=at(app, 8, 1))
        await settled(pilot)
        return block(app)

    assert with_editor(path, script) == Block(1, 1, 3, 3)


def test_a_click_on_a_header_selects_the_column_and_shift_more_of_them(path):
    async def script(app, pilot):
        await click(pilot, at(app, -2, 1))
        one = block(app)
        await click(pilot, at(app, -2, 2), shift=True)
        return one, block(app)

    assert with_editor(path, script) == (Block(0, 1, 40, 2), Block(0, 1, 40, 3))


def test_a_drag_over_headers_selects_whole_columns(path):
    async def script(app, pilot):
        await drag(pilot, at(app, -2, 1), at(app, -2, 2))
        return block(app)

    assert with_editor(path, script) == Block(0, 1, 40, 3)


def test_a_click_on_a_row_number_selects_the_row_and_a_drag_more_of_them(path):
    async def script(app, pilot):
        x = app.main.assets.grid.content_region.x
        await click(pilot, (x, at(app, 3, 0)[1]))
        one = block(app)
        await drag(pilot, (x, at(app, 4, 0)[1]), (x, at(app, 6, 0)[1]))
        return one, block(app)

    assert with_editor(path, script) == (Block(3, 0, 4, 3), Block(4, 0, 7, 3))


def test_the_sign_of_a_header_sorts_up_then_down_then_as_in_the_file(path):
    async def script(app, pilot):
        grid = app.main.assets.grid
        sorts = []
        for _ in range(3):
            place = at(app, -2, 1)
            await click(pilot, (place[0] + width_of(grid, 1) - 2, place[1]))
            sort = app.main.session.sheet.sort
            sorts.append(sort and (sort.column, sort.is_descending))
        return sorts, app.main.session.sheet.is_modified

    assert with_editor(path, script) == ([("speed", False), ("speed", True), None], False)


def test_dragging_the_line_behind_a_header_changes_the_width_of_its_column(path):
    async def script(app, pilot):
        grid = app.main.assets.grid
        before = width_of(grid, 1)
        x, y = at(app, -2, 1)
        line = x - 1 + before
        await drag(pilot, (line, y), (line + 5, y), (line + 9, y))
        wider = width_of(grid, 1) - before
        await drag(pilot, (line + 9, y), (x - 1, y), (0, y))
        return wider, width_of(grid, 1), app.main.session.sheet.sort, app.main.session.sheet.is_modified

    assert with_editor(path, script) == (9, NARROWEST, None, False)


def test_the_width_of_a_narrowed_frozen_column_follows_the_mouse(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text("Asset,hit\n" + "x" * 70 + ",True\n")

    async def script(app, pilot):
        grid = app.main.assets.grid
        x, y = at(app, -2, 0)
        line = x - 1 + width_of(grid, 0)
        await drag(pilot, (line, y), (line - 4, y))
        return line - 4 - (x - 1), width_of(grid, 0)

    wanted, found = with_editor(file, script)
    assert found == wanted


def test_a_double_click_on_the_line_fits_the_column_to_its_texts(path):
    async def script(app, pilot):
        grid = app.main.assets.grid
        before = width_of(grid, 1)
        x, y = at(app, -2, 1)
        await drag(pilot, (x - 1 + before, y), (x + 30, y))
        await pilot.click(offset=(x - 1 + width_of(grid, 1), y), times=2)
        await settled(pilot)
        return before, width_of(grid, 1)

    before, after = with_editor(path, script)
    assert before == after


def test_a_double_click_edits_the_cell(path):
    async def script(app, pilot):
        await pilot.click(offset=at(app, 2, 1), times=2)
        await settled(pilot)
        return app.main.assets.editor is not None, app.main.session.sheet.cursor

    assert with_editor(path, script) == (True, (2, 1))


def test_a_double_click_below_the_last_row_edits_nothing(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text("Asset,hit\nwalk,True\n")

    async def script(app, pilot):
        await pilot.click(offset=at(app, 8, 1), times=2)
        await settled(pilot)
        return app.main.assets.editor

    assert with_editor(file, script) is None


def test_a_click_in_the_test_row_goes_there_and_one_in_the_rows_comes_back(path):
    async def script(app, pilot):
        await click(pilot, at(app, -4, 1))
        there = app.main.assets.grid.is_in_test_row
        await click(pilot, at(app, 0, 2))
        return there, app.main.assets.grid.is_in_test_row

    assert with_editor(path, script) == (True, False)


def test_the_wheel_scrolls_the_rows_and_leaves_the_cursor(path):
    from textual.events import MouseScrollDown

    async def script(app, pilot):
        grid = app.main.assets.grid
        x, y = at(app, 2, 1)
        app.post_message(MouseScrollDown(None, x, y, 0, 1, 0, False, False, False, screen_x=x, screen_y=y, style=None))
        await settled(pilot)
        await pilot.wait_for_animation()
        await settled(pilot)
        return grid.scroll_y, app.main.session.sheet.cursor

    top, cursor = with_editor(path, script)
    assert top > 0
    assert cursor == (0, 0)


def test_a_click_elsewhere_while_a_cell_is_edited_takes_its_text(path):
    async def script(app, pilot):
        await click(pilot, at(app, 2, 1))
        await press(pilot, "7")
        await click(pilot, at(app, 9, 2))
        sheet = app.main.session.sheet
        return sheet.text(2, 1), sheet.cursor

    assert with_editor(path, script) == ("7", (9, 2))


def test_clicks_on_an_empty_table_change_nothing(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text("Asset,hit\n")

    async def script(app, pilot):
        for place in [at(app, -2, 0), at(app, 0, 1), at(app, 5, 1), at(app, -4, 1), (0, at(app, 0, 0)[1])]:
            await click(pilot, place)
            await drag(pilot, place, (place[0] + 3, place[1] + 2))
        return screen_text(app), app.main.session.sheet.is_modified

    shown, is_modified = with_editor(file, script)
    assert "+    new row" in shown or "+   new" in shown
    assert not is_modified


def test_a_click_on_a_tab_and_on_a_tool_does_what_its_key_does(path):
    async def script(app, pilot):
        lines = screen_text(app).splitlines()
        await click(pilot, (lines[0].index("Options") + 1, 0))
        tab = app.main.tab
        await click(pilot, (lines[1].index("Undo history") + 1, 1))
        return tab, screen_text(app)

    tab, shown = with_editor(path, script, (80, 30))
    assert tab == "options"
    assert "the table as it was opened" in shown


def test_a_click_on_the_key_line_presses_the_key_and_a_tool_is_lit_under_the_mouse(path):
    async def script(app, pilot):
        lines = screen_text(app).splitlines()
        await click(pilot, (lines[-1].index("F6") + 1, len(lines) - 1))
        tools = app.main.query_one("#tools", Bar)
        await pilot.hover(offset=(lines[1].index("Undo history") + 1, 1))
        lit = tools._hovered
        await pilot.hover(offset=at(app, 4, 2))
        return app.main.assets.grid.is_in_test_row, lit, tools._hovered

    assert with_editor(path, script, (80, 30)) == (True, "history", None)


def test_the_buttons_of_find_replace_here_and_everywhere(path):
    async def script(app, pilot):
        await press(pilot, "ctrl+f", *"clip")
        app.main.query_one("#find-replacement", Input).value = "take"
        seen = []
        for name in ("replace", "all"):
            await pilot.click(f"#find-{name}")
            await settled(pilot)
            seen.append(sum(asset.startswith("take") for asset in app.main.session.sheet.table.assets))
        return seen

    assert with_editor(path, script, (120, 30)) == [1, 40]


def test_the_wheel_goes_through_a_list_of_values_and_a_click_takes_one(tmp_path):
    values = [f"v{i:02}" for i in range(40)]
    (tmp_path / "contextdb.toml").write_text(f'[conditions.way]\ntype = "enum"\nvalues = {values}\n')
    (tmp_path / "t.csv").write_text("Asset,way\na,v00\n")

    async def script(app, pilot):
        await press(pilot, "right", "f4")
        choices = app.main.query_one(ChoiceList)
        await pilot._post_mouse_events([MouseScrollDown], choices, offset=(2, 1))
        await pilot._post_mouse_events([MouseScrollDown], choices, offset=(2, 1))
        await settled(pilot)
        down = screen_text(app)
        await pilot._post_mouse_events([MouseScrollUp], choices, offset=(2, 1))
        await settled(pilot)
        return down, screen_text(app)

    down, up = with_editor(tmp_path / "t.csv", script, (80, 24))
    assert "v01" not in down
    assert "v06" in down
    assert "v03" in up
