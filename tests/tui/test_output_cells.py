"""Cells of outputs in the editor: what they may say is offered, and what the game could not read is refused."""

from pathlib import Path

import pytest
from terminal import with_editor

import contextdb as cdb
from contextdb.errors import TableError
from tui.model.window import Window


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
