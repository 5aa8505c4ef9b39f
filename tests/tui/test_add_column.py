"""The dialogs Add Column and Blueprints: what there is to insert, new columns with their faults, and blueprints kept."""

from pathlib import Path

import pytest
from terminal import drive, screen_text
from textual.app import App
from textual.widgets import Input, Select

from contextdb.edits.edits import NewColumn
from contextdb.schema.settings import conditions_from_dict
from contextdb.tables.project import load
from contextdb.tables.table import Table
from tui.model.column_choices import Insertion, NewColumnForm, blueprint_fault, blueprints, choices, missing_conditions, places
from tui.model.condition_form import ConditionForm
from tui.model.options import CONDITION_OPTIONS
from tui.screens.add_column import AddColumn
from tui.screens.blueprints import Blueprints, Drop, Keep
from tui.screens.dialog import Dialog
from tui.widgets.field import Field

TABLES = Path(__file__).parents[2] / "tables"


@pytest.fixture
def table() -> Table:
    return load(TABLES / "hit_mid_air.csv")


class DialogApp(App[None]):
    """A dialog over nothing, and what it gave back."""

    def __init__(self, dialog: Dialog[object]) -> None:
        super().__init__()
        self.dialog = dialog
        self.answer: object = "none yet"

    def on_mount(self) -> None:
        self.push_screen(self.dialog, self._answered)

    def _answered(self, answer: object) -> None:
        self.answer = answer

    def wrong(self, key: str) -> str:
        return self.screen.query_one(f"#field-{key}", Field).wrong


def press(app: DialogApp, *keys: str, size: tuple[int, int] = (80, 24)) -> str:
    """Press keys; gives the screen after them."""

    async def script(pilot):
        for key in keys:
            await pilot.press(key)
            await pilot.pause()
        return screen_text(app)

    return drive(app, script, size)


# ---- add a column


def test_declared_conditions_that_the_table_lacks_are_listed_with_what_they_are(table: Table):
    text = press(DialogApp(AddColumn(table, 1)), size=(120, 40))
    assert "MidAir_Catch_Direction" in text
    assert "IsInCatchAnim" not in text.replace("behind IsInCatchAnim", "").replace("behind IsInMidAirAnim", "")
    assert "enum CB FS SS LB" in text


def test_typing_filters_and_enter_inserts_what_is_highlighted(table: Table):
    app = DialogApp(AddColumn(table, 1))
    press(app, *"speed", "enter")
    assert app.answer == Insertion(2, (NewColumn("speed"),))
    assert isinstance(app.answer, Insertion)
    now = app.answer.edit(table).apply(table)
    assert [c.name for c in now.columns][:3] == ["Asset Name", "IsInMidAirAnim", "speed"]
    assert now.condition("speed").condition.unit == "m/s"


def test_the_list_is_gone_through_from_the_name_and_elsewhere_the_fields(table: Table):
    app = DialogApp(AddColumn(table, 1))
    press(app, "down", "down", "up", "enter")
    listed = choices(table)
    assert isinstance(app.answer, Insertion)
    assert app.answer.columns == listed[1].columns
    form = DialogApp(AddColumn(table, 1))

    async def script(pilot):
        await pilot.press(*"brand new", "enter")
        form.screen.query_one("#column-unit").focus()
        seen = []
        for key in ("down", "up"):
            await pilot.press(key)
            await pilot.pause()
            seen.append(form.screen.focused.id)
        return seen

    below, unit = drive(form, script)
    assert unit == "column-unit"
    assert below not in (unit, "column-name")


def test_a_blueprint_brings_all_that_is_missing_of_it(table: Table):
    app = DialogApp(AddColumn(table, 99))
    press(app, *"locomotion", "enter")
    assert app.answer == Insertion(9, tuple(NewColumn(name) for name in ("gait", "speed", "direction", "style")))


def test_a_name_that_nobody_declared_opens_the_form_of_a_new_column(table: Table):
    app = DialogApp(AddColumn(table, 0))

    async def script(pilot):
        await pilot.press(*"wind", "enter")
        await pilot.pause()
        assert app.screen.query_one("#column-job").has_focus
        app.screen.query_one("#column-type", Select).value = "number"
        await pilot.pause()
        low = app.screen.query_one("#column-min", Input)
        low.focus()
        await pilot.press(*"gusty", "enter")
        await pilot.pause()
        assert app.wrong("min") == '"gusty" is not a number.'
        assert low.has_focus
        low.value = "0"
        app.screen.query_one("#column-unit", Input).value = "m/s"
        await pilot.press("enter")
        await pilot.pause()

    drive(app, script)
    assert app.answer == Insertion(1, (NewColumn("wind", "condition", {"type": "number", "min": 0, "unit": "m/s"}),))


def test_all_faults_of_a_new_column_stand_beside_their_fields(table: Table):
    app = DialogApp(AddColumn(table, 0))

    async def script(pilot):
        app.screen.query_one("#column-name", Input).value = "Asset Name"
        app.screen.query_one("#column-type", Select).value = "int"
        app.screen.query_one("#column-min", Input).value = "low"
        app.screen.query_one("#column-max", Input).value = "high"
        await pilot.pause()
        await pilot.click("#column-insert")
        await pilot.pause()
        assert app.wrong("min") == '"low" is not a number.'
        assert app.wrong("max") == '"high" is not a number.'
        return screen_text(app)

    assert 'The table has a column "Asset Name" already.' in drive(app, script, (100, 40))
    assert app.answer == "none yet"


def test_an_empty_name_and_escape_insert_nothing(table: Table):
    app = DialogApp(AddColumn(Table.from_columns({"Asset": ["a"]}), 0))
    assert "A column needs a name." in press(app, "enter")
    assert app.answer == "none yet"
    app = DialogApp(AddColumn(table, 0))
    press(app, "s", "escape")
    assert app.answer is None


def test_the_place_can_be_chosen(table: Table):
    app = DialogApp(AddColumn(table, 2))

    async def script(pilot):
        await pilot.press(*"gait")
        app.screen.query_one("#column-where", Select).value = len(table.columns)
        await pilot.click("#column-insert")
        await pilot.pause()

    drive(app, script)
    assert app.answer == Insertion(len(table.columns), (NewColumn("gait"),))


# ---- blueprints


def test_blueprints_say_what_the_table_has_already(table: Table):
    text = press(DialogApp(Blueprints(table, [], 0)))
    assert "tackle" in text
    assert "all 3 are here" in text
    assert "[x] IsInMidAirAnim" in text


def test_the_missing_columns_of_a_blueprint_are_inserted(table: Table):
    app = DialogApp(Blueprints(table, [], 3))
    press(app, "down", "enter")
    assert app.answer == Insertion(4, tuple(NewColumn(name) for name in table.schema.blueprints["contest"]))


def test_a_blueprint_that_lacks_nothing_inserts_nothing(table: Table):
    app = DialogApp(Blueprints(table, [], 3))
    press(app, "enter")
    assert app.answer == "none yet"


def test_the_selected_conditions_are_kept_as_a_blueprint(table: Table):
    app = DialogApp(Blueprints(table, ["Asset Name", "IsInMidAirAnim", "IsInCatchAnim"], 0))

    async def script(pilot):
        field = app.screen.query_one("#blueprint-name", Input)
        field.focus()
        await pilot.press("enter")
        await pilot.pause()
        assert app.wrong("keep") == "A blueprint needs a name."
        field.value = "tackle"
        await pilot.press("enter")
        await pilot.pause()
        assert "already" in app.wrong("keep")
        field.value = "air"
        await pilot.press("enter")
        await pilot.pause()

    drive(app, script)
    assert app.answer == Keep("air", ("IsInMidAirAnim", "IsInCatchAnim"))
    assert isinstance(app.answer, Keep)
    assert app.answer.edit(table).apply(table).schema.blueprints["air"] == ("IsInMidAirAnim", "IsInCatchAnim")


def test_a_blueprint_is_taken_away(table: Table):
    app = DialogApp(Blueprints(table, [], 0))
    press(app, "down", "delete")
    assert app.answer == Drop("contest")
    assert isinstance(app.answer, Drop)
    assert "contest" not in app.answer.edit(table).apply(table).schema.blueprints


def test_a_project_without_blueprints_says_what_one_is():
    text = press(DialogApp(Blueprints(Table.from_columns({"A": ["a"]}), [], 0)))
    assert "There is no blueprint yet" in text
    assert "Select columns in the sheet first" in text


# ---- the model


def test_derived_facts_are_no_columns_to_add():
    schema = {"a": {"type": "number"}, "b": {"type": "number", "expr": "a + 1"}, "c": {"type": "bool"}}
    table = Table.from_columns({"Asset": [], "a": []}, schema)
    assert [c.name for c in missing_conditions(table)] == ["c"]


def test_a_filter_finds_all_its_words_in_name_and_description_names_first(table: Table):
    assert [c.name for c in choices(table, "defender ball")] == [
        "Defender.MidAir_Contesting",
        "Defender.Catching",
        "Defender.FacingBall",
        "contest",
    ]
    assert next(c.name for c in choices(table, "s")).startswith(("s", "S"))
    assert choices(table, "no such thing") == []


def test_places_are_behind_the_cursor_or_at_the_end(table: Table):
    assert places(table, 0) == {"behind Asset Name": 1, "at the end": 9}
    assert places(table, 8) == {"at the end": 9}
    assert places(table, 99) == {"at the end": 9}


@pytest.mark.parametrize(
    ("form", "wrong"),
    [
        (NewColumnForm(""), {"name": "A column needs a name."}),
        (NewColumnForm("Slots", "output"), {}),
        (NewColumnForm("gait", "output"), {"job": '"gait" is declared as a condition.'}),
        (NewColumnForm("gait", "condition", ConditionForm("int", min="x")), {}),
        (NewColumnForm("n", "condition", ConditionForm("int", min="1.5")), {"min"}),
        (NewColumnForm("n", "condition", ConditionForm("number", min="3", max="2")), {"min"}),
        (NewColumnForm("n", "condition", ConditionForm("enum")), {"values"}),
        (NewColumnForm("n", "condition", ConditionForm("enum", values="a, b")), {}),
        (NewColumnForm("n", "condition", ConditionForm("bool", min="3", values="a")), {}),
        (NewColumnForm("a\0b"), {"name"}),
    ],
)
def test_a_new_column_is_read_with_its_faults_by_field(table: Table, form: NewColumnForm, wrong):
    column, found = form.read(table)
    assert set(found) == set(wrong)
    assert not isinstance(wrong, dict) or found == wrong
    if not wrong:
        now = Insertion(1, (column,)).edit(table).apply(table)
        assert now.columns[1].name == form.name


def test_f6_inserts_a_new_column_from_its_name_and_from_a_list(table: Table):
    for keys in (["f6"], ["enter", "f6"]):
        app = DialogApp(AddColumn(table, 0))
        seen = press(app, *"grip", *keys)
        assert isinstance(app.answer, Insertion), seen
        assert app.answer.columns[0].name == "grip"


def test_every_job_of_a_new_column_stands_apart_from_what_it_means(table: Table):
    seen = press(DialogApp(AddColumn(table, 0)), *"grip", "enter", "enter")
    assert "cooldown_s" in seen


def test_a_job_that_is_taken_is_told(table: Table):
    column, found = NewColumnForm("On", "enabled").read(table)
    assert not found
    now = Insertion(1, (column,)).edit(table).apply(table)
    assert NewColumnForm("On2", "enabled").read(now)[1] == {"job": 'The table has one already: "On".'}


def test_a_blueprint_needs_a_name_of_its_own_and_a_condition(table: Table):
    assert blueprint_fault(table, " ", ["a"])
    assert blueprint_fault(table, "contest", ["a"])
    assert blueprint_fault(table, "air", [])
    assert blueprint_fault(table, "air", ["a"]) == ""
    assert next(b.missing for b in blueprints(table)) == ()


def test_a_rule_is_a_column_to_add_too(table: Table):
    column, wrong = NewColumnForm("only if", "when").read(table)
    assert not wrong
    after = Insertion(1, (column,)).edit(table).apply(table)
    assert after.settings.when == "only if"
    assert NewColumnForm("another", "when").read(after)[1] == {"job": 'The table has one already: "only if".'}


def test_every_setting_of_a_condition_is_in_the_form_and_comes_back_as_it_was():
    settings = {
        "type": "number",
        "min": 1,
        "max": 5,
        "unit": "m",
        "description": "d",
        "mirror": "negate",
        "weight": 2,
        "owner": "we",
    }
    form = ConditionForm.of(conditions_from_dict({"x": settings})["x"])
    assert {key for key in CONDITION_OPTIONS if key not in ("type", "values") and not getattr(form, key)} == set()
    assert form.declared() == (settings, {})
