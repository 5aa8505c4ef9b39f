"""The dialogs Add Column and Blueprints: what there is to insert, new columns with their faults, and blueprints kept."""

from pathlib import Path

import pytest
from terminal import drive, screen_text
from textual.app import App

from contextdb.schema.settings import conditions_from_dict
from contextdb.tables.project import load
from contextdb.tables.table import Table
from tui.model.column_choices import Insertion, NewColumnForm, blueprint_fault, blueprints, choices, missing_conditions, places
from tui.model.condition_form import ConditionForm
from tui.model.options import CONDITION_OPTIONS
from tui.screens.add_column import AddColumn
from tui.screens.dialog import Dialog

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


def press(app: DialogApp, *keys: str, size: tuple[int, int] = (80, 24)) -> str:
    """Press keys; gives the screen after them."""

    async def script(pilot):
        for key in keys:
            await pilot.press(key)
            await pilot.pause()
        return screen_text(app)

    return drive(app, script, size)


# ---- add a column


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


# ---- blueprints


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
