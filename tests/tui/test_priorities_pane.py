"""The tab Priorities: databases in order, what wins for the test row, and edits of the order."""

import shutil
from pathlib import Path

import pytest
from terminal import drive
from textual.app import App, ComposeResult
from textual.widgets import Input, OptionList

from contextdb.tables.project import load
from tui.messages import Edited, Notice
from tui.model.sheet import Sheet
from tui.panes.priorities import PrioritiesPane

TABLES = Path(__file__).parents[2] / "tables"
MORE = """
[databases.loco_hurt]
clips = "hurt/*.bvh"
features = "loco"
"""


class PrioritiesApp(App[None]):
    """The pane alone, with what it tells."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.sheet = Sheet(load(path))
        self.told: list[str] = []

    def compose(self) -> ComposeResult:
        yield PrioritiesPane(self.sheet)

    def on_mount(self) -> None:
        self.query_one(OptionList).focus()

    def on_edited(self, message: Edited) -> None:
        self.told.append(message.done.name)

    def on_notice(self, message: Notice) -> None:
        self.told.append(message.text)

    def order(self) -> list[tuple[object, object]]:
        steps = self.sheet.table.schema.selectors["locomotion"]["order"]
        return [(step["database"], step.get("threshold")) for step in steps]


@pytest.fixture
def game(tmp_path: Path) -> Path:
    """The sample tables, with one database more that no selector has."""
    shutil.copytree(TABLES, tmp_path / "game")
    toml = tmp_path / "game" / "contextdb.toml"
    toml.write_text(toml.read_text(encoding="utf-8") + MORE, encoding="utf-8")
    return tmp_path / "game"


def test_every_tool_works_by_mouse(game: Path):
    app = PrioritiesApp(game / "locomotion.csv")

    async def script(pilot):
        await pilot.click("#priorities-do-down")
        await pilot.pause()
        assert app.order() == [("loco", 0.1), ("loco_tired", None)]
        await pilot.click("#priorities-do-up")
        await pilot.click("#priorities-do-threshold")
        await pilot.pause()
        assert app.query_one("#priorities-threshold", Input).has_focus
        await pilot.press("escape")
        await pilot.click("#priorities-do-remove")
        await pilot.pause()

    drive(app, script)
    assert app.order() == [("loco", None)]
