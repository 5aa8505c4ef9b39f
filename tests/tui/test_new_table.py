"""A new table: its name, its file, its columns, and that it opens."""

from pathlib import Path
from typing import Any

import pytest
from terminal import drive, screen_text
from textual.pilot import Pilot

from tui.app import EditorApp
from tui.model.new_table import make_table, name_fault
from tui.model.workspace import Workspace

TOML = '[conditions.speed]\ntype = "number"\n[blueprints.moving]\nconditions = ["speed"]\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "jog.csv").write_text("Asset Name,speed\nrun,0..5\n")
    (tmp_path / "contextdb.toml").write_text(TOML)
    return tmp_path


@pytest.mark.parametrize("name", ["", "  ", ".hidden", "a/b", "a\\b", "a:b", 'a"b', "a\tb", "jog", " jog "])
def test_a_name_that_no_file_may_have_or_that_is_taken_is_refused(folder: Path, name: str):
    assert name_fault(folder, name, ["jog"])


def test_a_table_has_the_columns_of_the_blueprint_and_no_row(folder: Path):
    assert name_fault(folder, "swim two", ["jog"]) == ""
    assert make_table(folder, "swim two", ["speed"]).read_bytes() == b"Asset Name,speed\n"


def test_a_new_table_is_made_from_a_blueprint_and_opens(folder: Path):
    async def script(pilot: Pilot[Any]) -> str:
        await pilot.app.main.run_command("new-table")
        await pilot.press(*"swim", "enter", "down", "enter")
        await pilot.pause()
        return screen_text(pilot.app)

    text = drive(EditorApp(Workspace(folder)), script)
    assert (folder / "swim.csv").read_bytes() == b"Asset Name,speed\n"
    assert text.startswith(" swim ")
    assert "+    new row" in text


def test_where_there_is_no_blueprint_none_is_asked_for(folder: Path):
    (folder / "contextdb.toml").write_text(TOML.partition("[blueprints")[0])

    async def script(pilot: Pilot[Any]) -> str:
        await pilot.app.main.run_command("new-table")
        await pilot.press(*"swim", "enter")
        await pilot.pause()
        return screen_text(pilot.app)

    assert drive(EditorApp(Workspace(folder)), script).startswith(" swim ")


def test_saving_as_another_table_leaves_the_old_file_and_goes_on_with_the_new_one(folder: Path):
    before = (folder / "jog.csv").read_bytes()

    async def script(pilot: Pilot[Any]) -> str:
        await pilot.press("down", "up", "right", *"7..8", "enter")
        await pilot.app.main.run_command("save-as")
        await pilot.press(*"dash", "enter")
        await pilot.pause()
        return screen_text(pilot.app)

    text = drive(EditorApp(Workspace(folder)), script)
    assert text.startswith(" dash  ")
    assert (folder / "jog.csv").read_bytes() == before
    assert (folder / "dash.csv").read_bytes() == before.replace(b"0..5", b"7..8")
