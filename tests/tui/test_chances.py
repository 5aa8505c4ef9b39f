"""The chance of each row that may be picked, and what outranks the others, beside the name of the asset; outputs of the pick."""

from pathlib import Path

import pytest
from terminal import press, screen_text, with_editor

TOML = """[conditions.gait]
type = "enum"
values = ["Walk", "Run"]
[tables.t]
file = "t.csv"
policy = "priority"
priority = "priority"
weight = "weight"
[tables.t.outputs]
blend = { type = "number" }
"""
CELLS = "Asset,gait,priority,weight,blend\na,Walk,1,2,0.1\nb,Walk,1,3,0.2\nlow,Walk,0,1,0.3\nother,Run,0,1,0.4\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "t.csv").write_text(CELLS)
    return tmp_path / "t.csv"


def test_chances_and_what_outranks_stand_beside_the_asset_and_the_outputs_in_the_pane(path):
    async def script(app, pilot):
        await press(pilot, "alt+w")
        app.main.assets.set_context({"gait": "Walk"}, "")
        app.main.assets.grid.set_width(0, 30)
        await press(pilot, "f12")
        return screen_text(app)

    screen = with_editor(path, script, (160, 24))
    lines = screen.splitlines()
    assert any("◉" in line and "a" in line and "40 %" in line for line in lines)
    assert any("◉" in line and "60 %" in line for line in lines)
    assert any("●" in line and "low" in line and "outranked by" in line for line in lines)
    assert "gives blend = 0.1" in screen


def test_a_name_is_never_cut_for_a_chance(path):
    async def script(app, pilot):
        app.main.assets.set_context({"gait": "Walk"}, "")
        app.main.assets.grid.set_width(0, 6)
        await press(pilot)
        return screen_text(app)

    screen = with_editor(path, script)
    assert "low" in screen
    assert "outranked by" not in screen.split("#")[1].replace("\n", " ")
