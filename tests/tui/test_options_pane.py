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
    for word in ("Policy", "collect", "Asset Name", "[x] Mandatory_Slots", "Enabled column", "Weight column", "Assumptions"):
        assert word in text
    assert "A row that says False here never matches." in text
    assert "Condition MidAir_Catch_Direction" in text
    assert "Going_Up Top Going_Down" in text
    assert app.told == []
    assert not app.sheet.is_modified


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


def test_a_picked_setting_is_an_edit_that_undo_takes_back():
    app = PaneApp(small())

    async def script(pilot):
        app.query_one("#option-policy", Select).focus()
        await pilot.press("enter", "down", "enter")
        await pilot.pause()
        assert app.sheet.table.settings.policy == "first"
        app.query_one("#option-enabled", Select).value = "on"
        await pilot.pause()
        assert app.sheet.table.enabled.tolist() == [True, False]
        app.sheet.undo()
        app.query_one(OptionsPane).show()
        await pilot.pause()
        assert app.query_one("#option-enabled", Select).is_blank()

    drive(app, script)
    assert app.told == ["Set policy of the table", "Set enabled of the table"]
    assert app.sheet.table.settings.policy == "first"


def test_outputs_are_ticked_and_unticked():
    app = PaneApp(small())

    async def script(pilot):
        app.query_one("#option-outputs", TickList).focus()
        await pilot.press("down", "down", "space")
        await pilot.pause()
        assert app.sheet.table.settings.outputs == ("slot",)
        assert "[x] slot" in screen_text(app)
        await pilot.press("space")
        await pilot.pause()

    drive(app, script, (80, 40))
    assert app.sheet.table.settings.outputs == ()
    assert app.told == ["Set outputs of the table"] * 2


def test_a_fallback_is_completed_from_the_assets_and_told_when_no_row_has_it():
    app = PaneApp(small())

    async def script(pilot):
        app.query_one("#option-fallback", Input).focus()
        await pilot.press("w", "a")
        await pilot.pause()
        await pilot.press("right", "enter")
        await pilot.pause()
        assert app.sheet.table.settings.fallback == "walk"
        await submit(pilot, "#option-fallback", "stand")
        assert "No row of this table has it." in app.query_one("#field-fallback", Field).meaning
        await submit(pilot, "#option-fallback", "")

    drive(app, script)
    assert app.sheet.table.settings.fallback is None


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


def test_a_bad_bound_stays_in_its_field_with_the_reason_and_escape_puts_it_back():
    app = PaneApp(small())

    async def script(pilot):
        await submit(pilot, "#condition-min", "fast")
        assert wrong(app, "min") == '"fast" is not a number.'
        assert app.query_one("#condition-min", Input).value == "fast"
        await submit(pilot, "#condition-min", "9")
        assert "is above" in wrong(app, "min")
        assert "✗" in screen_text(app)
        await pilot.press("escape")
        assert app.query_one("#condition-min", Input).value == ""
        assert wrong(app, "min") == ""
        await submit(pilot, "#condition-min", "-1")

    drive(app, script, (160, 42))
    assert app.sheet.table.condition("speed").condition.domain.minimum == -1.0
    assert app.told == ["Set min of speed"]


def test_a_guessed_condition_is_declared_when_its_form_is_changed():
    app = PaneApp(small(), column=2)

    async def script(pilot):
        assert "not declared" in screen_text(app)
        app.query_one("#condition-type", Select).value = "enum"
        await pilot.pause()
        assert "names" in wrong(app, "values") or "values" in wrong(app, "values").lower()
        await submit(pilot, "#condition-values", 'True False "May be"')
        return screen_text(app)

    assert "not declared" not in drive(app, script, (160, 42))
    assert app.sheet.table.schema.conditions["on"].domain.values == ("True", "False", "May be")


def test_texts_of_the_table_are_shown_as_they_are():
    app = PaneApp(Table.from_columns({"[red]A[/]": ["[/]"], "[bold]": ["x"]}))

    async def script(pilot):
        return screen_text(app)

    text = drive(app, script, (160, 42))
    assert "Condition [bold]" in text
    assert "[red]A[/]" in text


def test_a_table_without_conditions_has_no_form_for_one():
    app = PaneApp(Table.from_columns({"Asset": ["a"]}), column=0)

    async def script(pilot):
        return screen_text(app)

    assert "Condition" not in drive(app, script, (160, 42))


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


def sided() -> Table:
    columns = {"Asset": ["walk", "run"], "side": ["Left", "Right"], "lean": ["1..2", "Any"]}
    schema = {"side": {"type": "enum", "values": ["Left", "Right", "Far Left", "Far Right"]}, "lean": {"type": "number"}}
    return Table.from_columns(columns, schema)


def test_how_a_condition_mirrors_is_typed_as_pairs_or_a_word_and_a_wrong_one_stays_with_the_reason():
    app = PaneApp(sided())

    async def script(pilot):
        await submit(pilot, "#condition-mirror", 'Left = Right, "Far Left" = "Far Right"')
        side = app.sheet.table.condition("side").condition
        assert side.mirror == (("Left", "Right"), ("Far Left", "Far Right"))
        assert app.query_one("#condition-mirror", Input).value == 'Left = Right, "Far Left" = "Far Right"'
        await submit(pilot, "#condition-mirror", "Left = Rigth")
        assert 'there is no value "Rigth"' in wrong(app, "mirror")
        await submit(pilot, "#condition-mirror", "negate")
        assert "has no sign" in wrong(app, "mirror")
        assert app.sheet.table.condition("side").condition.mirror == side.mirror
        await submit(pilot, "#condition-mirror", "")
        assert app.sheet.table.condition("side").condition.mirror is None

    drive(app, script)


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


def test_the_weight_of_a_condition_is_typed_and_taken_away():
    app = PaneApp(sided())

    async def script(pilot):
        await submit(pilot, "#condition-weight", "2.5")
        assert app.sheet.table.condition("side").condition.weight == 2.5
        await submit(pilot, "#condition-weight", "-1")
        assert "below 0" in app.query_one("#options-condition #field-weight", Field).wrong
        assert app.query_one("#options-table #field-weight", Field).wrong == ""
        await submit(pilot, "#condition-weight", "much")
        assert app.query_one("#options-condition #field-weight", Field).wrong == '"much" is not a number.'
        assert app.sheet.table.condition("side").condition.weight == 2.5
        await submit(pilot, "#condition-weight", "")
        assert app.sheet.table.condition("side").condition.weight == 1.0

    drive(app, script)
