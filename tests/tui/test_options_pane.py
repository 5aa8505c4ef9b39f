"""The tab Options: settings become edits, and what cannot be meant stays in its field with the reason."""

from dataclasses import replace
from pathlib import Path

import pytest
from strategies import for_each
from terminal import drive, screen_text
from textual.app import App, ComposeResult
from textual.widgets import Input, Select

from contextdb.tables.project import load
from contextdb.tables.table import Table
from tui.messages import Edited
from tui.model.condition_form import ConditionForm, names_in
from tui.model.options import columns_for, with_expression
from tui.model.sheet import Sheet
from tui.panes.options import OptionsPane
from tui.widgets.field import Field
from tui.widgets.ticks import TickList

TABLES = Path(__file__).parents[2] / "tables"


class PaneApp(App[None]):
    """The pane alone, with what it tells."""

    def __init__(self, table: Table, column: int = 1) -> None:
        super().__init__()
        self.sheet = Sheet(table)
        self.sheet.go(0, column)
        self.told: list[str] = []

    def compose(self) -> ComposeResult:
        yield OptionsPane(self.sheet)

    def on_edited(self, message: Edited) -> None:
        self.told.append(message.done.name)


def small() -> Table:
    columns = {"Asset": ["walk", "run"], "speed": ["1..2", "Any"], "on": ["True", "False"], "slot": ["a", "b"]}
    return Table.from_columns(columns, {"speed": {"type": "number", "max": 7.0, "unit": "m/s"}})


async def submit(pilot, selector: str, text: str) -> None:
    field = pilot.app.query_one(selector, Input)
    field.focus()
    field.value = text
    await pilot.press("enter")
    await pilot.pause()


def wrong(app: App[None], key: str) -> str:
    return app.query_one(f"#field-{key}", Field).wrong


def test_every_setting_is_shown_with_its_value_and_what_it_means():
    app = PaneApp(load(TABLES / "contested_catch.csv"), column=3)

    async def script(pilot):
        return screen_text(app)

    text = drive(app, script, (160, 42))
    for word in ("Policy", "collect", "Asset Name", "[x] Mandatory_Slots", "Add a setting", "Add to the condition"):
        assert word in text
    for word in ("Enabled column", "Weight column", "Assumptions"):
        assert word not in text
    assert "Condition MidAir_Catch_Direction" in text
    assert "Going_Up Top Going_Down" in text
    assert app.told == []
    assert not app.sheet.is_modified


def test_a_setting_that_is_added_has_the_keys_and_stays_while_it_is_empty():
    app = PaneApp(small())

    async def script(pilot):
        add = app.query_one("#add-table", Select)
        add.value = "fallback"
        await pilot.pause()
        focused = app.focused
        await pilot.press("tab", "shift+tab")
        return focused is not None and focused.id, "Fallback" in screen_text(app)

    assert drive(app, script, (160, 42)) == ("option-fallback", True)


def test_unticking_an_output_keeps_the_types_of_the_others():
    typed = {"slot": {"type": "enum", "values": ["a", "b"]}, "n": {"type": "int", "default": 1}}
    settings = {"outputs": typed, "fallback": {"asset": "walk", "outputs": {"slot": "a", "n": 2}}}
    columns = {"Asset": ["walk"], "slot": ["a"], "n": [""]}
    app = PaneApp(Table.from_columns(columns, {}, settings), column=0)

    async def script(pilot):
        app.query_one("#option-outputs", TickList).focus()
        await pilot.press("down", "space")
        await pilot.pause()
        await submit(pilot, "#option-fallback", "run")

    drive(app, script, (80, 40))
    now = app.sheet.table.settings
    assert (now.outputs, now.fallback, now.fallback_outputs) == (("n",), "run", (("n", 2),))
    assert now.output("n") is not None


def test_assumptions_are_added_changed_and_taken_away():
    app = PaneApp(small())

    async def script(pilot):
        await submit(pilot, "#options-assume Input", "not on")
        assert app.sheet.table.settings.assume == ("not on",)
        inputs = list(app.query("#options-assume Input").results(Input))
        assert [one.value for one in inputs] == ["not on", ""]
        inputs[1].focus()
        await pilot.press(*"speed>3")
        inputs[0].focus()  # leaving a field takes what was typed
        await pilot.pause()
        assert app.sheet.table.settings.assume == ("not on", "speed>3")
        inputs = list(app.query("#options-assume Input").results(Input))
        inputs[1].focus()
        inputs[1].value = "not on"
        await pilot.press("enter")
        await pilot.pause()
        assert "appears twice" in wrong(app, "assume")
        inputs[1].value = "not onn"
        await pilot.press("enter")
        await pilot.pause()
        assert 'Did you mean "not on"?' in wrong(app, "assume")
        inputs[1].value = ""
        await pilot.press("enter")
        await pilot.pause()

    drive(app, script)
    assert app.sheet.table.settings.assume == ("not on",)


# ---- the model


def test_a_column_may_have_one_job_and_no_declared_condition_has_any():
    table = small()
    assert columns_for(table, "enabled") == ["on", "slot"]
    assert columns_for(table, "asset") == ["Asset", "on", "slot"]
    ruled = replace(table, settings=replace(table.settings, when="on"))
    assert columns_for(ruled, "enabled") == ["slot"]


@pytest.mark.parametrize(
    ("at", "text", "expected"), [(0, "x", ["x", "b"]), (2, " x ", ["a", "b", "x"]), (1, "", ["a"]), (2, "", ["a", "b"])]
)
def test_an_expression_is_changed_added_or_taken_away(at: int, text: str, expected: list[str]):
    assert with_expression(["a", "b"], at, text) == expected


def test_names_are_read_with_spaces_commas_and_quotes():
    assert list(names_in('a b,c; "d e" "say ""no"""')) == ["a", "b", "c", "d e", 'say "no"']


CONDITIONS = load(TABLES / "locomotion.csv").schema.conditions


@for_each(CONDITIONS)
def test_a_form_says_again_what_its_condition_says(name: str):
    form = ConditionForm.of(CONDITIONS[name])
    said, wrong = form.declared()
    assert not wrong
    assert ConditionForm.of(Table.from_columns({"A": [], name: []}, {name: said}).condition(name).condition) == form


def test_a_mirror_that_has_no_place_under_another_type_goes_with_the_old_one():
    form = ConditionForm.of(
        Table.from_columns({"A": ["a"], "x": ["1"]}, {"x": {"type": "number", "mirror": "negate"}}).conditions[0].condition
    )
    assert form.mirror == "negate"
    assert form.of_kind("angle").declared() == ({"type": "angle", "mirror": "negate"}, {})
    assert form.of_kind("text").declared() == ({"type": "text"}, {})
    pairs = ConditionForm("text", mirror="L = R")
    assert pairs.of_kind("tags").declared()[0] == {"type": "tags", "mirror": {"L": "R"}}
    assert pairs.of_kind("bool").declared()[0] == {"type": "bool"}
