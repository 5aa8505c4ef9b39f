"""The side pane Why: beside the table where there is room, after the cursor, and a dialog elsewhere."""

from pathlib import Path

import pytest
from terminal import press, screen_text, with_editor

from tui.screens.nearest import NearestDialog


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text('[conditions.gait]\ntype = "enum"\nvalues = ["Walk", "Run"]\n')
    file = tmp_path / "t.csv"
    file.write_text("Asset,gait,hit\na,Walk,True\nb,Run,Any\n")
    return file


def test_it_follows_the_cursor_and_the_facts(path):
    async def script(app, pilot):
        seen = []
        await press(pilot, "f12")
        seen.append(screen_text(app))
        app.main.session.sheet.set_fact("gait", "Run")
        app.main.show()
        await press(pilot)
        seen.append(screen_text(app))
        await press(pilot, "down")
        seen.append(screen_text(app))
        await press(pilot, "f12")
        return [*seen, screen_text(app)]

    empty, first, second, closed = with_editor(path, script, (150, 30))
    assert "The test row is empty" in empty
    assert "Row 1, a: not valid because of 1 cell" in first
    assert "is Run; the cell says Walk" in first
    assert "Row 2, b: valid" in second
    assert "Row 2, b" not in closed


def test_a_long_line_goes_on_as_far_in_and_what_holds_is_dimmer_than_what_does_not(path):
    path.write_text("Asset,gait,hit,speed\na,Walk,True,1..2 | 4..5 | 7..8 | 10..11 | 13..14 | 16..17\n")

    async def script(app, pilot):
        for name, fact in (("gait", "Walk"), ("speed", "3")):
            app.main.session.sheet.set_fact(name, fact)
        await press(pilot, "f12")
        strips = app.screen._compositor.render_strips()
        colours = {s.text.strip(): s.style.color.get_truecolor() for strip in strips for s in strip if s.style and s.style.color}
        holds, wrong = (next(sum(rgb) for text, rgb in colours.items() if text.startswith(w)) for w in ("✓ gait", "is 3;"))
        return screen_text(app), holds < wrong

    screen, is_dimmer = with_editor(path, script, (150, 30))
    lines = [line[104:] for line in screen.splitlines()]
    at = next(at for at, line in enumerate(lines) if "is 3; the cell says" in line)
    assert lines[at + 1].index("1") == lines[at].index("is 3")
    assert is_dimmer


def test_in_a_narrow_window_it_is_a_dialog(path):
    async def script(app, pilot):
        app.main.session.sheet.set_fact("gait", "Run")
        await press(pilot, "f12")
        return isinstance(app.screen, NearestDialog)

    assert with_editor(path, script, (100, 30))


def test_the_nearest_rows_have_a_key_of_their_own(path):
    async def script(app, pilot):
        app.main.session.sheet.set_fact("gait", "Run")
        await press(pilot, "shift+f12")
        return isinstance(app.screen, NearestDialog)

    assert with_editor(path, script, (150, 30))
