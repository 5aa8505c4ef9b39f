"""The mouse in the grid: what a click, a drag and a double click do, wherever they go."""

from pathlib import Path

import pytest
from terminal import press, screen_text, settled, with_editor
from textual.events import MouseScrollDown, MouseScrollUp

from tui.app import EditorApp
from tui.model.selection import Block
from tui.widgets.bar import Bar
from tui.widgets.editing.choice_list import ChoiceList


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_text("Asset,speed,hit\n" + "".join(f"clip_{i:02},{i}..{i + 1},True\n" for i in range(40)))
    return file


def at(app: EditorApp, row: int, column: int) -> tuple[int, int]:
    """Where a cell of the window stands on the screen: row -3 and -2 are the headers, -1 is the test row."""
    grid = app.main.assets.grid
    look = grid.look
    place = look.layout.place(column, look.left) + 1
    return grid.content_region.x + place, grid.content_region.y + row + look.n_headers


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
