"""The tab Priorities: databases in order, what wins for the test row, and edits of the order."""

import shutil
from pathlib import Path

import pytest
from terminal import drive, screen_text
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


def test_databases_stand_in_order_with_what_is_valid_and_the_rule(game: Path):
    app = PrioritiesApp(game / "locomotion.csv")

    async def script(pilot):
        before = screen_text(app)
        app.sheet.set_fact("gait", "Walk")
        app.sheet.set_fact("style", "normal")
        app.query_one(PrioritiesPane).show()
        await pilot.pause()
        return before, screen_text(app)

    before, after = drive(app, script)
    assert "every row counts as valid" in before
    assert "1  loco_tired  wins under 0.1      ● 11 of 11 assets valid" in before
    assert "2  loco        searched last       ● 28 of 28 assets valid" in before
    assert "For the test row  gait Walk, style normal" in after
    assert "1  loco_tired  wins under 0.1      ○ 0 of 11 assets valid" in after
    assert "loco_tired has no valid asset for this context: loco decides." in after


def test_the_valid_assets_of_the_highlighted_database_are_named(game: Path):
    app = PrioritiesApp(game / "locomotion.csv")
    app.sheet.set_fact("gait", "Idle")
    app.sheet.set_fact("speed", "0")

    async def script(pilot):
        first = screen_text(app)
        await pilot.press("down")
        await pilot.pause()
        return first, screen_text(app)

    first, second = drive(app, script)
    assert "loco_tired: idle_tired, stop_walk_tired" in first
    assert "loco: idle, idle_tired" in second


def test_a_threshold_is_typed_and_a_bad_one_stays_with_its_reason(game: Path):
    app = PrioritiesApp(game / "locomotion.csv")

    async def script(pilot):
        await pilot.press("t")
        field = app.query_one("#priorities-threshold", Input)
        assert field.has_focus
        assert field.value == "0.1"
        await pilot.press(*"low", "enter")
        await pilot.pause()
        assert "A cost is a number, such as 0.1." in screen_text(app)
        assert field.value == "low"
        field.value = "1e40"
        await pilot.press("enter")
        await pilot.pause()
        assert "out of range" in screen_text(app)
        field.value = "3.5"
        await pilot.press("enter")
        await pilot.pause()
        assert app.query_one(OptionList).has_focus
        return screen_text(app)

    assert "wins under 3.5" in drive(app, script)
    assert app.order() == [("loco_tired", 3.5), ("loco", None)]
    assert app.told == ["Set the threshold of loco_tired"]


def test_the_last_database_has_no_threshold_to_set(game: Path):
    app = PrioritiesApp(game / "locomotion.csv")

    async def script(pilot):
        await pilot.press("down", "enter")
        await pilot.pause()

    drive(app, script)
    assert "it has no threshold" in app.told[0]


def test_a_database_is_moved_and_the_cursor_goes_with_it(game: Path):
    app = PrioritiesApp(game / "locomotion.csv")

    async def script(pilot):
        await pilot.press("d")
        await pilot.pause()
        assert app.order() == [("loco", 0.1), ("loco_tired", None)]
        await pilot.press("d", "u")
        await pilot.pause()

    drive(app, script)
    assert app.order() == [("loco_tired", 0.1), ("loco", None)]
    assert app.told == ["Move loco_tired down", "Move loco_tired up"]


def test_a_database_is_added_with_a_threshold_asked_for_and_removed(game: Path):
    app = PrioritiesApp(game / "locomotion.csv")

    async def script(pilot):
        await pilot.press("a")
        await pilot.pause()
        await pilot.press("down", "enter")
        await pilot.pause()
        await pilot.pause()
        assert app.order() == [("loco_hurt", 0.0), ("loco_tired", 0.1), ("loco", None)]
        assert app.query_one("#priorities-threshold", Input).has_focus
        await pilot.press(*"1.5", "enter")
        await pilot.pause()
        assert app.order()[0] == ("loco_hurt", 1.5)
        await pilot.press("a")
        await pilot.pause()
        await pilot.press("delete")
        await pilot.pause()
        return screen_text(app)

    drive(app, script)
    assert app.order() == [("loco_tired", 0.1), ("loco", None)]
    assert "Every database of the same features is in the selector already" in app.told[2]


def test_the_last_one_left_stays(game: Path):
    app = PrioritiesApp(game / "locomotion.csv")

    async def script(pilot):
        await pilot.press("x", "x")
        await pilot.pause()

    drive(app, script)
    assert app.order() == [("loco", None)]
    assert app.told[-1] == "A selector has at least one database."


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


def test_a_project_without_databases_says_what_they_are(tmp_path: Path):
    (tmp_path / "t.csv").write_text("Asset,x\na,True\n", encoding="utf-8")
    app = PrioritiesApp(tmp_path / "t.csv")

    async def script(pilot):
        await pilot.press("t", "u", "a", "x")
        return screen_text(app)

    text = drive(app, script, (80, 18))
    assert "A database is a set of clips" in text
    assert 'order = [ { database = "jog_tired", threshold = 0.1 }, { database = "jog" } ]' in text


def test_databases_without_a_selector_are_put_into_the_example(tmp_path: Path):
    toml = (TABLES / "contextdb.toml").read_text(encoding="utf-8")
    start, stop = toml.index("[selectors.locomotion]"), toml.index("[controllers.player]")
    (tmp_path / "contextdb.toml").write_text(toml[:start], encoding="utf-8")
    assert stop
    (tmp_path / "locomotion.csv").write_bytes((TABLES / "locomotion.csv").read_bytes())
    app = PrioritiesApp(tmp_path / "locomotion.csv")

    async def script(pilot):
        return screen_text(app)

    assert '{ database = "loco_tired", threshold = 0.1 }, { database = "loco" }' in drive(app, script, (120, 24))


def test_faults_of_the_file_are_shown(game: Path):
    toml = game / "contextdb.toml"
    toml.write_text(toml.read_text(encoding="utf-8").replace("threshold = 0.1", 'threshold = "[low]"'), encoding="utf-8")
    app = PrioritiesApp(game / "locomotion.csv")

    async def script(pilot):
        return screen_text(app)

    text = drive(app, script, (120, 24))
    assert "contextdb.toml has 1 fault in what it says of motion" in text
    assert "[low]" in text
