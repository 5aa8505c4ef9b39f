"""The sheet of columns: many columns are changed, made, moved and taken away in one step, and contextdb.toml says so."""

import tomllib
from pathlib import Path

import pytest
from edit_strategies import write_schema
from terminal import press, with_editor

from contextdb.tables.project import load_table
from contextdb.tables.table import Table
from tui.model.column_sheet import ColumnSheet, Wrong
from tui.screens.sheet_dialog import SmallGrid

TOML = """[conditions.speed]  # as the game says
type = "number"
min = 0.0
unit = "m/s"
hysteresis = 0.2

[conditions.gait]
type = "enum"
values = ["Walk", "Run"]

[conditions.far]
type = "bool"
expr = "speed > 3"

[tables.t]
outputs = ["Slots"]
"""
RAW = "Asset,speed,gait,target,Slots\na,0..3,Walk,<2,x\nb,2..,Run,Any,y\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "t.csv").write_text(RAW)
    return tmp_path


@pytest.fixture
def table(folder: Path) -> Table:
    return load_table(folder / "t.csv")


def typed(table: Table, *cells: tuple[int, str, str]) -> ColumnSheet:
    """The sheet with cells written without a look, as a paste does; a row past the last one is a new column."""
    sheet = ColumnSheet(table)
    names = [column.name for column in sheet.table.columns]
    for row, column, text in cells:
        sheet.with_room()
        sheet.go(row, names.index(column))
        sheet.fill(text)
    return sheet


def changed(table: Table, *cells: tuple[int, str, str]) -> Table:
    return typed(table, *cells).edit().apply(table)


def test_the_sheet_tells_what_the_columns_are(table):
    rows = [(row["Column"], row["Is"], row["Type"]) for row in ColumnSheet(table).first]
    plain = [("Asset", "asset", ""), ("speed", "condition", "number"), ("gait", "condition", "enum")]
    assert rows == [*plain, ("target", "condition", "number"), ("Slots", "output", ""), ("far", "declared", "bool")]


def test_a_sheet_left_as_it_is_changes_nothing(table):
    assert not ColumnSheet(table).edit().changes


def test_the_step_tells_what_was_changed_and_what_was_added(table):
    sheet = typed(table, (1, "Most", "9"), (2, "Values", "Walk Run Crawl"))
    at = len(sheet.first)
    sheet = typed(table, (1, "Most", "9"), (2, "Values", "Walk Run Crawl"), (at, "Column", "new"), (at, "Type", "bool"))
    assert sheet.edit().name == "Change 2 columns, add the column new"


def test_types_units_bounds_and_values_of_many_columns_are_one_step(table):
    cells = [(1, "Most", "9"), (1, "Weight", "2"), (2, "Values", "Walk Run Crawl"), (3, "Unit", "m"), (3, "Least", "0")]
    sheet = typed(table, *cells)
    edit = sheet.edit()
    after = edit.apply(table).schema.conditions
    assert edit.name == "Change 3 columns"
    assert (after["speed"].domain.maximum, after["speed"].weight, after["speed"].hysteresis) == (9.0, 2.0, 0.2)
    assert after["gait"].domain.values == ("Walk", "Run", "Crawl")
    assert (after["target"].unit, after["target"].domain.minimum) == ("m", 0.0)
    assert after["far"].expr == "speed > 3"


def test_a_derived_fact_a_rule_and_a_typed_output_are_made(table, folder):
    rows = [
        (6, "Column", "closing"), (6, "Is", "declared"), (6, "Type", "number"), (6, "Expression", "speed - target"),
        (7, "Column", "rule"), (7, "Is", "rule"),
        (8, "Column", "Damage"), (8, "Is", "output"), (8, "Type", "int"), (8, "Most", "9"), (8, "Default", "3"),
        (9, "Column", "order"), (9, "Is", "priority"),
    ]  # fmt: skip
    after = changed(table, *rows)
    assert [c.name for c in after.columns] == ["Asset", "speed", "gait", "target", "Slots", "rule", "Damage", "order"]
    assert (after.settings.when, after.settings.priority, after.settings.outputs) == ("rule", "order", ("Slots", "Damage"))
    assert after.schema.conditions["closing"].expr == "speed - target"
    from edit_strategies import write_schema

    write_schema(table, after)
    said_now = tomllib.loads((folder / "contextdb.toml").read_text())
    assert said_now["tables"]["t"]["outputs"] == {"Slots": {"type": "text"}, "Damage": {"type": "int", "default": 3, "max": 9}}
    assert said_now["conditions"]["closing"] == {"type": "number", "expr": "speed - target"}
    assert "# as the game says" in (folder / "contextdb.toml").read_text()


def test_what_is_said_of_an_output_stands_in_the_sheet_as_it_was_typed(table):
    texts = {
        "Type": "numbers",
        "Unit": "m",
        "Least": "-1.5",
        "Most": "8",
        "Values": "3",
        "Default": "1 2 3",
        "Description": "where",
    }
    after = changed(table, *((4, column, text) for column, text in texts.items()))
    assert {column: ColumnSheet(after).first[4][column] for column in texts} == texts
    assert not ColumnSheet(after).edit().changes
    named = changed(table, (4, "Type", "enum"), (4, "Values", "Mid Low Mid"), (4, "Default", "Low"))
    assert [ColumnSheet(named).first[4][column] for column in ("Values", "Default")] == ["Mid Low", "Low"]


def test_rows_that_move_come_and_go_are_columns_that_do(table):
    sheet = ColumnSheet(table)
    sheet.go(3, 0)
    sheet.move_rows(-1)
    sheet.go(4, 0)
    sheet.delete_rows()
    after = sheet.edit().apply(table)
    assert [c.name for c in after.columns] == ["Asset", "speed", "target", "gait"]
    assert after.settings.outputs == ()
    assert after.text(0, "target") == "<2"


def test_a_condition_becomes_an_output_and_is_declared_no_more(table):
    after = changed(table, (2, "Is", "output"), (2, "Values", ""), (2, "Type", ""))
    assert after.settings.outputs == ("Slots", "gait")
    assert "gait" not in after.schema.conditions


def test_a_column_that_nothing_else_names_is_renamed_with_what_is_declared_of_it(table):
    after = changed(table, (2, "Column", "pace"))
    assert [c.name for c in after.columns][2] == "pace"
    assert after.schema.conditions["pace"].domain.values == ("Walk", "Run")
    assert "gait" not in after.schema.conditions


@pytest.mark.parametrize(
    ("cells", "place", "text"),
    [
        ([(1, "Column", "velocity")], (1, "Column"), "used by 1 derived fact"),
        ([(1, "Most", "x")], (1, "Most"), "not a number"),
        ([(1, "Most", "-1")], (1, "Least"), "min"),
        ([(1, "Default", "1")], (1, "Default"), "Only an output"),
        ([(1, "Column", "")], (1, "Column"), "needs a name"),
        ([(2, "Column", "speed")], (2, "Column"), "already"),
        ([(2, "Type", "tag")], (2, "Type"), "not a type"),
        ([(2, "Values", "")], (2, "Values"), "values"),
        ([(3, "Values", "A B")], (3, "Values"), "has none"),
        ([(3, "Type", "")], (3, "Type"), "Say the type"),
        ([(0, "Is", "output")], (0, "Is"), "names the assets"),
        ([(4, "Is", "asset")], (4, "Is"), "already"),
        ([(4, "Weight", "2")], (4, "Weight"), "Only a condition"),
        ([(4, "Type", "enum")], (4, "Values"), "values"),
        ([(4, "Type", "int"), (4, "Default", "x")], (4, "Default"), "annot read"),
        ([(4, "Type", "color9")], (4, "Type"), "not a type of an output"),
        ([(4, "Type", "number"), (4, "Least", "low")], (4, "Least"), "is not a number"),
        ([(4, "Type", "number"), (4, "Least", "nan")], (4, "Least"), "nothing is above or below it"),
        ([(4, "Type", "int"), (4, "Least", "5"), (4, "Most", "3")], (4, "Least"), "above max"),
        ([(4, "Type", "bool"), (4, "Values", "a")], (4, "Values"), "has no place"),
        ([(4, "Type", "numbers"), (4, "Values", "many")], (4, "Values"), "is not a number"),
        ([(4, "Column", "a\ud800")], (0, "Column"), "Field 5 of the column names has half a surrogate pair"),
        ([(5, "Expression", "speed >")], (5, "Expression"), ""),
        ([(5, "Expression", "sped > 3")], (5, "Expression"), "sped"),
        ([(6, "Type", "bool")], (6, "Column"), "needs a name"),
        ([(6, "Column", "new"), (6, "Unit", "m")], (6, "Type"), "Say the type"),
    ],
)
def test_what_cannot_be_is_said_at_its_cell(table, cells, place, text):
    with pytest.raises(Wrong) as caught:
        typed(table, *cells).edit()
    assert ((caught.value.row, caught.value.column), text in caught.value.text) == (place, True)


def test_a_declared_condition_that_others_use_stays(folder):
    (folder / "contextdb.toml").write_text(TOML.replace("speed > 3", "wet") + "\n[conditions.wet]\ntype = 'bool'\n")
    sheet = ColumnSheet(load_table(folder / "t.csv"))
    sheet.go(6, 0)
    sheet.delete_rows()
    with pytest.raises(Wrong, match="wet is used by 1 derived fact"):
        sheet.edit()


def test_two_lines_stand_over_the_rows_for_no_fact_leaves_any_here(folder):
    async def script(app, pilot):
        await press(pilot, "alt+j", "e")
        return app.screen.query_one(SmallGrid).look.header_lines

    assert with_editor(folder / "t.csv", script, (160, 48)) == ("name", "both")


def test_numbers_are_written_as_people_write_them(table, folder):
    cells = [
        (1, "Least", "0"),
        (1, "Most", "7"),
        (1, "Weight", "2"),
        (2, "Weight", "0.5"),
        (4, "Type", "number"),
        (4, "Least", "1"),
    ]
    write_schema(table, changed(table, *cells))
    toml = (folder / "contextdb.toml").read_text()
    assert {"min = 0.0", "max = 7", "weight = 2", "weight = 0.5"} <= set(toml.splitlines())  # min was so, and is not touched
    assert 'Slots = { type = "number", min = 1 }' in toml


def test_the_step_says_what_is_declared_and_what_becomes_a_column(table):
    rows = [(6, "Column", "closing"), (6, "Is", "declared"), (6, "Type", "number"), (7, "Column", "new"), (7, "Type", "int")]
    assert typed(table, *rows).edit().name == "Add the column new, declare closing"
