"""A value is renamed in one table as a step, or in the whole project, with all that speaks of it."""

import tomllib
from pathlib import Path

import pytest
from terminal import press, said, screen_text, with_editor

from contextdb.edits.renaming_values import value_renaming, value_uses, with_value
from contextdb.errors import SchemaError
from contextdb.tables.project import load_table

TOML = """[conditions.gait]
type = "enum"
values = ["Walk", "Run", "Half Back"]  # as the game says

[conditions.mood]
type = "enum"
values = ["Calm", "Fast"]
expr = '"Fast" if gait == "Walk" else "Calm"'

[tables.a]
when = "rule"
assume = ["gait != 'Walk' or speed >= 0"]

[conditions.speed]
type = "number"
"""
TABLES = {
    "a.csv": 'Asset,gait,speed,rule\nx,Walk,1,"gait == ""Walk"""\ny,Run,2,\n',
    "b.csv": 'Asset,gait\nz,"Walk ""Half Back"""\nw,not Walk\n',
    "b.cases.csv": "Case,Expected,gait\none,z,Walk\n",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    for name, text in TABLES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.mark.parametrize(
    ("text", "now"),
    [
        ("Walk", "Stroll"),
        ("Walk Run ~2", "Stroll Run ~2"),
        ("not Walk", "not Stroll"),
        ("+Walk -Run", "+Stroll -Run"),
        ('Walk "Half Back"', 'Stroll "Half Back"'),
        ("Walker Any", "Walker Any"),
        ("", ""),
    ],
)
def test_a_value_is_renamed_in_a_cell_and_nothing_else_is(text, now):
    assert with_value(text, "Walk", "Stroll") == now


def test_a_value_with_a_space_is_found_and_written_in_quotes():
    assert with_value('Walk "Half Back"', "Half Back", "FB") == "Walk FB"
    assert with_value("Walk", "Walk", "Slow Walk") == '"Slow Walk"'


def test_what_speaks_of_a_value_is_counted(folder):
    uses = value_uses(load_table(folder / "a.csv"), "gait", "Walk")
    assert (uses.tables, uses.n_cases, uses.n_expressions) == (("b",), 1, 3)
    assert uses.text == "1 other table, 1 saved context, 3 expressions"
    assert not value_uses(load_table(folder / "a.csv"), "gait", "Run").text


def test_renamed_everywhere_the_project_says_the_same_with_another_word(folder):
    value_renaming(load_table(folder / "a.csv"), "gait", "Walk", "Stroll").write()
    texts = {name: (folder / name).read_text() for name in TABLES}
    assert texts == {name: text.replace("Walk", "Stroll") for name, text in TABLES.items()}
    toml = (folder / "contextdb.toml").read_text()
    assert tomllib.loads(toml) == tomllib.loads(TOML.replace("Walk", "Stroll"))
    assert "# as the game says" in toml


def test_an_expression_that_could_mean_another_condition_is_refused(folder):
    toml = TOML.replace('values = ["Calm", "Fast"]', 'values = ["Calm", "Fast", "Walk"]').replace("speed >= 0", "mood == 'Calm'")
    (folder / "contextdb.toml").write_text(toml)
    with pytest.raises(SchemaError, match="both have the value"):
        value_renaming(load_table(folder / "a.csv"), "gait", "Walk", "Stroll")


def renamed(folder: Path, *answer: str) -> tuple[str, str, str]:
    async def script(app, pilot):
        await press(pilot, "right", "alt+d", "e", "ctrl+u", *"Stroll", "enter")
        asked = screen_text(app)
        await press(pilot, *answer)
        return asked, said(app), app.main.session.sheet.text(0, 1)

    return with_editor(folder / "a.csv", script, (110, 30))


def test_the_editor_names_what_uses_the_value_and_renames_it_everywhere(folder):
    asked, told, text = renamed(folder, "enter")
    assert "1 other table, 1 saved context, 3 expressions" in asked
    assert "Tables: b." in asked
    assert told.startswith("Renamed Walk to Stroll everywhere")
    assert text == "Stroll"
    assert (folder / "b.csv").read_text() == TABLES["b.csv"].replace("Walk", "Stroll")


def test_only_here_it_is_a_step_and_the_old_name_stays_declared(folder):
    _, told, text = renamed(folder, "down", "enter")
    assert told.startswith("Rename Walk to Stroll")
    assert text == "Stroll"
    assert {name: (folder / name).read_text() for name in TABLES} == TABLES


def test_cancelled_nothing_is_renamed(folder):
    assert renamed(folder, "escape")[2] == "Walk"
