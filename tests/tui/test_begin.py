"""Beginning where there is no table: an empty folder, a name that does not exist, a workbook, a CSV of another program."""

from pathlib import Path

import openpyxl
import pytest
from terminal import press, screen_text, with_editor
from textual.widgets import Input, OptionList

from contextdb.errors import ContextDBError
from tui.model.beginning import Beginning
from tui.model.workspace import Workspace
from tui.run import _require_readable
from tui.screens.import_table import ImportDialog


def book(path: Path) -> Path:
    """A workbook with a title over its columns."""
    made = openpyxl.Workbook()
    sheet = made.active
    assert sheet is not None
    sheet.append(["Catches, second season", None, None])
    sheet.merge_cells("A1:C1")
    sheet.append(["Name", "speed (m/s)", "gait"])
    sheet.append(["walk", 1, "Walk"])
    sheet.append(["run", 4, "Run"])
    made.save(path)
    return path


def lines(app) -> list[str]:
    options = app.screen.query_one(OptionList)
    return [str(options.get_option_at_index(at).prompt) for at in range(options.option_count)]


async def imported(app, pilot) -> None:
    """Wait until a file is read, and import it."""
    await app.workers.wait_for_complete()
    await press(pilot, "f6")
    await press(pilot)


def test_an_empty_folder_asks_how_to_begin_and_writes_nothing_before(tmp_path):
    async def script(app, pilot):
        return lines(app), list(tmp_path.iterdir())

    asked, files = with_editor(tmp_path, script)
    assert asked == [
        "An empty table",
        "Read another file: Excel, CSV, Parquet, JSON",
        "Paste what was copied in Excel or elsewhere",
    ]
    assert [file.name for file in files] == []


def test_an_empty_table_gets_a_name_and_takes_what_is_typed(tmp_path):
    async def script(app, pilot):
        await press(pilot, "enter")
        proposed = app.screen.query_one(Input).value
        await press(pilot, "ctrl+u", *"moves", "enter", *"walk", "enter", *"run", "enter", "ctrl+s")
        return proposed

    assert with_editor(tmp_path, script) == "table"
    assert (tmp_path / "moves.csv").read_text() == "Asset Name\nwalk\nrun\n"


def test_a_workbook_with_a_title_over_its_columns_becomes_a_table_of_its_name(tmp_path):
    path = book(tmp_path / "catches.xlsx")

    async def script(app, pilot):
        name = app.screen.query_one(Input).value
        await press(pilot, "enter")
        assert isinstance(app.screen, ImportDialog)
        await imported(app, pilot)
        table = app.main.session.sheet.table
        await press(pilot, "escape", "ctrl+s")
        return name, app.main.table_name, [c.name for c in table.columns], table.assets

    name, table, columns, assets = with_editor(path, script, (100, 40))
    assert (name, table) == ("catches", "catches")
    assert columns[0] == "Asset Name"
    assert list(assets) == ["walk", "run"]
    assert (tmp_path / "catches.csv").read_text().splitlines()[1].startswith("walk,1")


def test_a_folder_with_a_workbook_offers_to_read_it(tmp_path):
    book(tmp_path / "catches.xlsx")

    async def script(app, pilot):
        return lines(app)[1]

    assert with_editor(tmp_path, script) == "Read catches.xlsx"


def test_an_import_that_is_cancelled_leaves_no_file(tmp_path):
    path = book(tmp_path / "catches.xlsx")

    async def script(app, pilot):
        await press(pilot, "enter")
        await app.workers.wait_for_complete()
        await press(pilot, "escape")
        return lines(app)[0]

    assert with_editor(path, script) == "An empty table"
    assert [file.name for file in tmp_path.glob("*.csv")] == []


def test_a_csv_of_another_program_is_imported_under_another_name(tmp_path):
    path = tmp_path / "german.csv"
    path.write_text("Titel;;\nName;speed;gait\nwalk;1,5;Walk\nrun;3,5;Run\n")
    workspace = Workspace(path)
    _require_readable(workspace)
    assert workspace.beginning == Beginning(tmp_path, source=path)
    assert workspace.beginning.proposed_name(path, list(workspace.files)) == "german_2"
    workspace.close()


def test_what_is_copied_becomes_a_new_table(tmp_path, monkeypatch):
    monkeypatch.setattr("tui.clipboard.Clipboard.paste", lambda self: "Name\tgait\nwalk\tWalk\nrun\tRun\n")

    async def script(app, pilot):
        await press(pilot, "down", "down", "enter", "enter")
        await imported(app, pilot)
        return list(app.main.session.sheet.table.assets), [c.name for c in app.main.session.sheet.table.columns]

    assert with_editor(tmp_path, script, (100, 40)) == (["walk", "run"], ["Asset Name", "gait"])


def test_an_empty_clipboard_is_said_and_asked_again(tmp_path):
    async def script(app, pilot):
        await press(pilot, "down", "down", "enter", "enter")
        return screen_text(app)

    assert "The clipboard is empty." in with_editor(tmp_path, script)


@pytest.mark.parametrize("name", ["no/such/table.csv", "new.xlsx"])
def test_where_no_table_can_be_made_the_error_says_so(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ContextDBError):
        Workspace(name)
