"""Cells of outputs in the editor: what they may say is offered, and what the game could not read is refused."""

from pathlib import Path

import pytest
from terminal import press, screen_text, with_editor

import contextdb as cdb
from contextdb.errors import TableError
from tui.model.window import Window

TOML = """[tables.t.outputs]
element = { type = "enum", values = ["Fire", "Ice"] }
loud = { type = "bool", default = true }
n = { type = "int", max = 5 }
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "t.csv").write_text("Asset,element,loud,n\nwalk,,,1\n")
    return tmp_path / "t.csv"


@pytest.mark.parametrize(("column", "text"), [(1, "Ice"), (2, "False")])
def test_what_an_output_may_say_is_offered_before_any_row_says_it(path: Path, column: int, text: str):
    async def script(app, pilot):
        await press(pilot, *["right"] * column, "f4", "down", "enter", "enter")
        return app.main.session.sheet.text(0, column)

    assert with_editor(path, script) == text


def test_a_cell_that_the_game_could_not_read_is_refused_with_what_is_accepted(path: Path):
    async def script(app, pilot):
        await press(pilot, "right", "right", "right", *"9", "enter")
        return screen_text(app), app.main.session.sheet.text(0, 3)

    text, kept = with_editor(path, script)
    assert '"9" is outside the declared bounds' in text
    assert kept == "1"


@pytest.mark.parametrize(("job", "text"), [("enabled", "maybe"), ("priority", "high"), ("weight", "-1"), ("cooldown_s", "soon")])
def test_the_sheet_marks_what_check_reports_of_columns_with_a_job(tmp_path: Path, job: str, text: str):
    (tmp_path / "contextdb.toml").write_text(f'[tables.t]\n{job} = "Job"\n')
    (tmp_path / "t.csv").write_text(f"Asset,Job\na,{text}\nb,\n")
    with pytest.raises(TableError) as refused:
        cdb.load(tmp_path / "t.csv")

    async def script(app, pilot):
        sheet = app.main.session.sheet
        kinds = [kind for _, kind in Window(sheet, 0, 2)._read(1)]
        return kinds, sheet.fault(0, 1)

    kinds, fault = with_editor(tmp_path / "t.csv", script)
    assert kinds == ["fault", "text"]
    assert fault.found == refused.value.faults[0].found
