"""What is kept from one painting to the next: the screen looks after each step as if all of it were painted anew."""

import pytest
from editor_desk import CHART, HIT, SPEED, STATE, WAY, Desk, checker
from terminal import drive, press, with_editor
from textual.geometry import Region
from textual.widget import Widget

from tui.model.views import Sort

WIDE = "Asset," + ",".join(f"condition_{at}" for at in range(12)) + "\n" + "".join(f"clip_{at}{',True' * 12}\n" for at in range(60))


def painted(screen):
    """Every line with its styles, from what is kept."""
    return [list(strip.simplify()) for strip in screen._compositor.render_strips()]


def painted_anew(screen):
    parts = [screen, *screen.query(Widget)]
    bars = [bar for part in parts for bar in (part._vertical_scrollbar, part._horizontal_scrollbar) if bar is not None]
    for part in [*parts, *bars]:
        part._set_dirty()
        part.notify_style_update()
    return painted(screen)


async def type_a_cell(app, pilot):
    await press(pilot, "right", "f", "enter")


async def type_into_the_test_row(app, pilot):
    await press(pilot, "f6", "t", "enter")


async def filter_rows(app, pilot):
    app.main.assets.action_filter_same()


async def open_reasons(app, pilot):
    app.main.assets.why_pane.turn(app.main.assets.sheet)


async def ask(app, pilot):
    app.main.assets.set_context({"condition_0": "True", "condition_3": "False"}, "a test")


async def follow_a_game(app, pilot):
    for at in range(3):
        facts = {"condition_0": "True", "condition_3": str(at == 1)}
        app.main.assets.follow(facts, {}, at, "a game")
        app.main.assets.why_pane.follow(app.main.assets.sheet)
        await pilot.pause()


async def go_down(app, pilot):
    await press(pilot, "down", "shift+down", "pagedown", "pageup", "up")


async def note(app, pilot):
    sheet = app.main.assets.sheet
    sheet.marks = sheet.marks.with_note("clip_1", "condition_1", "why?").with_colour(["clip_2"], "red")
    app.main.assets.show()


async def undo(app, pilot):
    await press(pilot, "ctrl+z")


async def sort(app, pilot):
    app.main.assets.sheet.set_sort(Sort.by([Sort("condition_0")]))
    app.main.assets.show()


async def widen(app, pilot):
    app.main.assets.grid.set_width(1, 20)


async def grow(app, pilot):
    await pilot.resize_terminal(150, 70)


async def shrink(app, pilot):
    await pilot.resize_terminal(60, 20)


async def scroll(app, pilot):
    await press(pilot, "pagedown", "end")


async def hide_columns(app, pilot):
    await press(pilot, "shift+left", "shift+left")
    app.main.assets.action_hide_columns()


async def turn_light(app, pilot):
    app.theme = "textual-light"


def test_after_each_step_the_grid_and_its_scroll_bars_look_as_if_painted_anew(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text(WIDE)
    steps = [
        type_a_cell,
        type_into_the_test_row,
        scroll,
        open_reasons,
        ask,
        go_down,
        type_a_cell,
        undo,
        follow_a_game,
        go_down,
        note,
        sort,
        widen,
        filter_rows,
        grow,
        hide_columns,
        shrink,
        turn_light,
        type_a_cell,
    ]

    async def script(app, pilot):
        others = []
        for step in steps:
            await step(app, pilot)
            await pilot.pause()
            if painted(app.screen) != painted_anew(app.screen):
                others.append(step.__name__)
        return others

    assert with_editor(file, script, (140, 40)) == []


OPENED = {
    "a bool": (HIT, "True", {}),
    "an enum, typed": (CHART, "L", {"is_typing": True}),
    "an enum with its list": (CHART, "CB, FS", {"open_list": True}),
    "tags, as a fact": (STATE, "InAir", {"is_fact": True, "open_list": True}),
    "a number": (SPEED, "0.3..1.1", {}),
    "a number that cannot be read": (SPEED, "1;2", {}),
    "an angle": (WAY, "10..30", {}),
    "control characters": (None, "a\tb", {}),
    "a name longer than the cell": (None, "a" * 40, {}),
}


@pytest.mark.parametrize("second", OPENED)
def test_an_editor_that_was_open_for_other_cells_looks_like_a_new_one(second):
    def of(name):
        condition, text, more = OPENED[name]
        kind = condition.domain.kind if condition is not None else "asset"
        return (condition, kind, text), {"check": checker(condition, "is_fact" in more), "known": ["a_walk", "b_run"], **more}

    def shown(before):
        (condition, kind, text), more = of(second if not before else before[0])
        desk = Desk(condition, text, kind=kind, **more)

        async def script(pilot):
            for name in (*before[1:], *([second] if before else [])):
                await pilot.press("ctrl+t", "shift+enter")
                desk.editor.close()
                await pilot.pause()
                desk.editor.place(Region(20, 10, 16, 1), desk.size)
                of_cell, more = of(name)
                desk.editor.open(*of_cell, on_done=desk.said.append, **more)
            await pilot.pause()
            return painted(desk.screen), desk.editor.text, desk.focused is desk.editor.entry

        return drive(desk, script)

    assert shown([name for name in OPENED if name != second]) == shown([])


def test_a_cell_that_is_typed_right_after_another_is_one_of_its_own(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text("Asset,hit\na,False\nb,False\nc,True\n")

    async def script(app, pilot):
        await pilot.press("right", "t", "enter", "f", "enter", "t", "escape", "up", "a", "enter")
        await pilot.pause()
        table, assets = app.main.session.sheet.table, app.main.assets
        return table.text_column("hit").to_list(), assets.editor, app.focused is assets.grid, len(assets.query("CellEditor"))

    assert with_editor(file, script) == (["True", "Any", "True"], None, True, 1)
