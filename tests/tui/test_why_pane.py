"""The side pane Why: beside the table where there is room, after the cursor, and a dialog elsewhere."""

from pathlib import Path

import pytest
from terminal import press, screen_text, with_editor


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text('[conditions.gait]\ntype = "enum"\nvalues = ["Walk", "Run"]\n')
    file = tmp_path / "t.csv"
    file.write_text("Asset,gait,hit\na,Walk,True\nb,Run,Any\n")
    return file


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
