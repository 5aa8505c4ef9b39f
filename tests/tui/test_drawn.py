"""Signs of which terminals differ in the width: on the screen each takes as many cells as the layout counts for it."""

import pytest
from rich.cells import cell_len
from terminal import press, screen_text, with_editor

from tui.drawn import drawn
from tui.model.layout import cut

FAMILY, HEART, THUMB, FLAG, KEYCAP = "👩\u200d👩\u200d👧", "❤\ufe0f", "👍\U0001f3fd", "🇩🇪", "1\ufe0f\u20e3"


@pytest.mark.parametrize("text", [FAMILY, HEART, THUMB, FLAG, KEYCAP, f"a{FAMILY}b {HEART}{THUMB}", "क्\u200dष", "日本 é", "\ufe0f"])
def test_a_text_is_drawn_in_as_many_cells_and_each_sign_has_one_width(text):
    shown = drawn(text)
    assert cell_len(shown) == cell_len(text)
    assert text == shown or sum(map(cell_len, shown)) == cell_len(text)


def test_the_first_sign_stands_for_those_that_are_joined():
    assert [drawn(text) for text in (FAMILY, HEART, THUMB, FLAG, KEYCAP)] == ["👩", "❤ ", "👍", "DE", "1 "]
    assert drawn(cut(f"x{FAMILY}", 8)) == "x👩     "


def test_columns_the_foot_and_dialogs_do_not_drift_and_the_file_keeps_its_bytes(tmp_path):
    path = tmp_path / "t.csv"
    raw = f"Asset,gait\n{FAMILY}{HEART},{THUMB}\nplain,Walk\n".encode()
    path.write_bytes(raw)

    async def script(app, pilot):
        grid = screen_text(app)
        await press(pilot, "shift+f2")
        asked = screen_text(app)
        await press(pilot, "escape", "down", "right", "x", "enter", "ctrl+s")
        return grid, asked

    grid, asked = with_editor(path, script)
    lines = [line for line in grid.splitlines() if line.startswith((" 1", "1", " 2", "2"))]
    assert len({cell_len(line[: line.index("│")]) for line in lines}) == 1
    for screen in (grid, asked):
        assert "👩❤ " in screen
        assert not {"\u200d", "\ufe0f", "\U0001f3fd", "\ufffd"} & set(screen)
    assert path.read_bytes() == raw.replace(b"Walk", b"x")
