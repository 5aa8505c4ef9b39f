"""The dialogs Import and Export, and the draft behind the first: what a file becomes in the open table."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import tables
from terminal import drive, press, screen_text, with_editor
from textual.app import App
from textual.pilot import Pilot
from textual.screen import Screen
from textual.widgets import Input

import contextdb as cdb
from contextdb.columns import TextColumn
from contextdb.errors import ContextDBError
from contextdb.exchange.formats import FORMATS, ReadOptions, write
from contextdb.exchange.importing import Choices
from contextdb.exchange.mapping import as_job
from contextdb.exchange.reading import Reading
from contextdb.tables.table import Table
from tui.model.importing import Draft, Mode
from tui.model.sheet import Sheet
from tui.screens.export_table import ExportDialog
from tui.screens.import_table import ImportDialog
from tui.widgets.line_list import LineList

TOML = '[conditions.speed]\ntype = "number"\n[conditions.pos]\ntype = "enum"\nvalues = ["CB", "FS"]\n'


@pytest.fixture
def table(tmp_path: Path) -> Table:
    """A table of three rows, and beside it files to import."""
    (tmp_path / "contextdb.toml").write_text(TOML, encoding="utf-8")
    (tmp_path / "moves.csv").write_text("Asset Name,speed\njog,1..2\nrun,4..6\nidle,0\n", encoding="utf-8")
    work = tmp_path / "work"
    work.mkdir()
    (work / "more.csv").write_text("name;Speed;Depth\nrun;5;CB\nsprint;>8;FS\n", encoding="utf-8")
    (work / "broken.xlsx").write_bytes(b"PK\x03\x04nothing")
    book = openpyxl.Workbook()
    for title in ("Moves", "Other"):
        sheet = book.create_sheet(title)
        sheet.append(["Asset", "speed"])
        sheet.append([f"{title}_jog", 5])
    book.save(work / "book.xlsx")
    return cdb.load(tmp_path / "moves.csv")


def draft(table: Table, text: str, mode: Mode = "merge") -> Draft:
    found = Draft.read(table, text.encode(), "more.csv", ReadOptions("csv"))
    found.mode = mode
    return found


def texts(table: Table) -> dict[str, list[str]]:
    return {column.name: column.to_list() for column in table.columns}


# ---- the draft


MORE = "name;Speed\nrun;5\nsprint;>8\n"


@pytest.mark.parametrize(
    ("mode", "assets", "speeds"),
    [
        ("merge", ["jog", "run", "idle", "sprint"], ["1..2", "5", "0", ">8"]),
        ("append", ["jog", "run", "idle", "run", "sprint"], ["1..2", "4..6", "0", "5", ">8"]),
        ("replace", ["run", "sprint"], ["5", ">8"]),
    ],
)
def test_rows_are_merged_by_asset_added_or_put_in_place_of_others(table: Table, mode: Mode, assets: list[str], speeds: list[str]):
    sheet = Sheet(table)
    done = sheet.apply(draft(table, MORE, mode).edit())
    assert done.name == "Import more.csv"
    assert texts(sheet.table) == {"Asset Name": assets, "speed": speeds}
    sheet.undo()
    assert texts(sheet.table) == texts(table)


def test_a_merge_changes_only_the_lines_that_it_must(table: Table):
    assert table.path is not None
    Sheet(table).apply(draft(table, MORE).edit())
    after = draft(table, MORE).edit().apply(table).save()
    assert after.path is not None
    assert after.path.read_text(encoding="utf-8") == "Asset Name,speed\njog,1..2\nrun,5\nidle,0\nsprint,>8\n"


def test_equal_assets_pair_up_in_their_order(table: Table):
    twice = table.with_rows(3, [{"Asset Name": "run", "speed": "7"}])
    after = draft(twice, "name;speed\nrun;1\nrun;2\nrun;3\n").edit().apply(twice)
    assert texts(after) == {"Asset Name": ["jog", "run", "idle", "run", "run"], "speed": ["1..2", "1", "0", "2", "3"]}


def test_new_columns_are_added_with_their_declarations(table: Table):
    found = draft(table, "name;pos;Depth;note;Priority\nrun;CB;A;x, y!;5\njog;FS;B;z, w!;6\n")
    assert [found.becomes(at) for at in range(5)] == [
        "Asset Name (asset)",
        "+ enum",
        "+ new enum",
        "+ output",
        "+ priority",
    ]
    after = found.edit().apply(table)
    assert texts(after)["Depth"] == ["B", "A", ""]
    assert after.condition("Depth").condition.domain.values == ("A", "B")
    assert (after.settings.outputs, after.settings.priority) == (("note",), "Priority")


def test_a_column_can_be_left_out_or_become_another_condition(table: Table):
    found = draft(table, "name;velocity\nrun;5\n")
    assert found.becomes(1) == "+ new number"
    labels = [choice.label for choice in found.choices_for(1)]
    assert labels[:3] == ["(left out)", "Asset Name (asset)", "speed"]
    assert labels[-1] == "new column of data"
    found.choose(1, next(choice.mapped for choice in found.choices_for(1) if choice.label == "speed"))
    assert texts(found.edit().apply(table))["speed"] == ["1..2", "5", "0"]
    found.choose(1, found.choices_for(1)[0].mapped)
    assert not found.edit().changes


def test_two_columns_never_become_the_same(table: Table):
    found = draft(table, "name;velocity;speed\nrun;5;6\n")
    found.choose(1, next(choice.mapped for choice in found.choices_for(1) if choice.label == "speed"))
    assert [found.becomes(at) for at in range(3)] == ["Asset Name (asset)", "speed", "(left out)"]
    assert found.label(2) == "(left out)"


def test_cells_that_cannot_be_read_are_marked_and_said(table: Table):
    found = draft(table, "name;speed\nrun;5;5\n".replace("5;5", '"5;5"'))
    assert found.becomes(1) == "! speed"
    assert found.is_doubtful(1)
    assert '1 cell cannot be read as number, such as "5;5"' in found.why(1)


def test_without_a_column_of_assets_nothing_can_be_imported(table: Table):
    found = draft(table, MORE)
    found.columns[0] = as_job(found.columns[0], "left out")
    assert found.summary().startswith("no column of the file names the assets.")
    with pytest.raises(ContextDBError):
        found.edit()


def test_what_the_file_does_not_have_is_told(table: Table):
    assert 'Not in the file: "speed". New rows are empty there, others stay.' in draft(table, "name\nsprint\n").notes


@given(table=tables(least_conditions=1), data=st.data())
def test_importing_what_was_exported_changes_nothing(table: Table, data: st.DataObject):
    name = data.draw(st.sampled_from(["xlsx", "tsv", "parquet"]))
    found = Draft.read(table, write(table, FORMATS[name])[0], f"x.{name}", ReadOptions(name))
    found.mode = data.draw(st.sampled_from(["merge", "replace"]))
    assert not found.edit().changes


@given(table=tables(least_conditions=1), data=st.data())
def test_a_merge_gives_every_row_of_the_file_and_keeps_every_other(table: Table, data: st.DataObject):
    n_rows = data.draw(st.integers(0, 5))
    assets = data.draw(st.lists(st.sampled_from(["A0", "A1", "new", ""]), min_size=n_rows, max_size=n_rows))
    column = table.conditions[0].condition.name
    cells = data.draw(st.lists(st.sampled_from(["Any", "5", "x"]), min_size=n_rows, max_size=n_rows))
    read = Reading((TextColumn.of("Asset", assets), TextColumn.of(column, cells)), "csv")
    found = Draft(table, read, "x.csv")
    edit = found.edit()
    after = edit.apply(table)
    pairs = list(zip(after.assets, after.text_column(column).to_list(), strict=True))
    assert not [pair for pair in zip(assets, cells, strict=True) if pair not in pairs]
    assert after.assets[: table.n_rows] == table.assets
    assert np.array_equal(edit.came_from(table.n_rows)[: table.n_rows], np.arange(table.n_rows))


# ---- the screens


class Editor(App[None]):
    """A screen with one dialog over it."""

    def __init__(self, make: Callable[[], Screen[Any]]) -> None:
        super().__init__()
        self.make = make
        self.answers: list[Any] = []

    def on_mount(self) -> None:
        self.push_screen(self.make(), self.answers.append)


Script = Callable[[Pilot[Any]], Awaitable[None]]


def played(make: Callable[[], Screen[Any]], script: Script, size: tuple[int, int] = (80, 24)) -> tuple[list[Any], str]:
    """What the dialog gave back, and what the screen showed at the end."""
    app = Editor(make)

    async def run(pilot: Pilot[Any]) -> str:
        await script(pilot)
        await settled(pilot)
        return screen_text(app)

    return app.answers, drive(app, run, size)


async def settled(pilot: Pilot[Any]) -> None:
    await pilot.app.workers.wait_for_complete()
    await pilot.pause()


async def read_file(pilot: Pilot[Any], path: str) -> None:
    pilot.app.screen.query_one("#import-path", Input).value = path
    await pilot.pause()
    await pilot.press("enter")
    await settled(pilot)


def importing(table: Table) -> Callable[[], ImportDialog]:
    assert table.path is not None
    folder = table.path.parent / "work"
    return lambda: ImportDialog(table, folder)


def exporting(table: Table) -> Callable[[], ExportDialog]:
    assert table.path is not None
    folder = table.path.parent / "work"
    return lambda: ExportDialog(table, folder)


def test_a_sheet_is_chosen_where_a_workbook_has_several(table: Table):
    async def script(pilot: Pilot[Any]) -> None:
        await read_file(pilot, "book.xlsx")
        text = screen_text(pilot.app)
        assert '2 sheets hold cells: "Moves", "Other".' in text
        assert "✗" not in text
        assert "--sheet" not in text
        await pilot.press("down", "down", "down", "enter")  # the filled one, an empty one, Moves, Other
        await pilot.pause()
        await settled(pilot)
        await pilot.press("f6")

    [answer], _ = played(importing(table), script)
    assert answer.edit.apply(table).assets == ["jog", "run", "idle", "Other_jog"]


def test_rows_and_decimals_are_asked_for_once_and_the_next_file_of_that_name_is_one_key(table: Table):
    assert table.path is not None
    for week, more in ((12, []), (13, [["hop", "2,5"]])):
        book = openpyxl.Workbook()
        sheet = book.worksheets[0]
        for row in (["Moves of the week"], ["x", "y"], ["1", "2"], [], ["Asset", "speed"], ["sprint", "0,5"], *more):
            sheet.append(row)
        book.save(table.path.parent / "work" / f"W{week}.xlsx")

    async def choosing(pilot: Pilot[Any]) -> None:
        await read_file(pilot, "W12.xlsx")
        assert "the sheet holds" not in screen_text(pilot.app)  # blank rows belong to a table; so it is one, of wrong rows
        await pilot.press("f4")
        await pilot.pause()
        lines = pilot.app.screen.query_one("#rows-lines", LineList)
        assert lines.index == 1
        await pilot.press("down", "down", "down", "enter", "f6")
        await pilot.pause()
        await settled(pilot)
        assert "0,5 → 0 ± 5" in screen_text(pilot.app)
        await pilot.press("down", "enter")  # the list of decimals is open: a comma
        await pilot.pause()
        await settled(pilot)
        assert "0,5 → 0 ± 5" not in screen_text(pilot.app)
        await pilot.press("f6")

    [answer], _ = played(importing(table), choosing)
    assert answer.edit.apply(table).text(3, "speed") == "0.5"

    async def again(pilot: Pilot[Any]) -> None:
        await read_file(pilot, "W13.xlsx")
        await pilot.press("f6")

    [answer], _ = played(importing(table), again)
    after = answer.edit.apply(table)
    assert (after.assets[3:], after.text(4, "speed")) == (["sprint", "hop"], "2.5")


NAMES_SAID = 'column "where": each text is one name, such as "Mid Air"; Names, "each word is a name", reads each word as a name.'


def test_a_text_with_blanks_is_one_name_or_several_as_it_is_chosen(table: Table):
    raw = b"name;where\nrun;Mid Air\nsprint;Mid\n"
    cells = {None: ['"Mid Air"', "Mid"], "whole": ['"Mid Air"', "Mid"], "words": ["Mid Air", "Mid"]}
    for names, expected in cells.items():
        found = Draft.read(table, raw, "more.csv", ReadOptions("csv"), Choices(names=names or ""))
        after = texts(found.edit().apply(table))
        assert [after["where"][1], after["where"][3]] == expected
        assert (NAMES_SAID in found.notes) is (names is None)


def test_a_table_of_ours_keeps_its_cells_where_nothing_else_is_chosen(table: Table):
    assert table.path is not None
    ours = table.path.with_name("ours.csv")
    ours.write_text("name,where\nrun,Mid Air\n", encoding="utf-8")
    ours.with_name("contextdb.toml").write_text(f"{TOML}[tables.ours]\n", encoding="utf-8")
    for names, cell in ((None, "Mid Air"), ("whole", '"Mid Air"')):
        found = Draft.read(table, ours.read_bytes(), str(ours), ReadOptions(), Choices(names=names or ""))
        assert texts(found.edit().apply(table))["where"][1] == cell


def test_the_clipboard_is_imported_without_a_path(table: Table):
    text = "Asset\tspeed\r\nhop\t[red]3[/]\r\n"

    async def script(pilot: Pilot[Any]) -> None:
        await settled(pilot)
        assert "[red]3[/]" in screen_text(pilot.app)
        await pilot.press("f6")

    [answer], _ = played(lambda: ImportDialog(table, Path(), text), script)
    assert answer.edit.apply(table).text(3, "speed") == "[red]3[/]"


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
def test_escape_leaves_and_everything_has_room(table: Table, size: tuple[int, int]):
    async def script(pilot: Pilot[Any]) -> None:
        await read_file(pilot, "more.csv")
        text = screen_text(pilot.app)
        for part in ("Import into moves", "Speed", "Depth", "Import   Cancel", "F6 import"):
            assert part in text
        await pilot.press("escape")

    answers, _ = played(importing(table), script, size)
    assert answers == [None]


def test_a_path_that_no_system_has_is_not_exported_to(table: Table):
    async def script(pilot: Pilot[Any]) -> None:
        pilot.app.screen.query_one("#export-path", Input).value = "x\0.csv"
        await pilot.press("f6")
        await settled(pilot)

    answers, text = played(exporting(table), script)
    assert not answers
    assert "✗ This is not the path of a file." in text


def test_the_names_of_an_export_are_completed_chosen_and_gone_through(table: Table):
    (table.path.parent / "work" / "more.tsv").write_text("x", encoding="utf-8")
    seen: list[str] = []

    async def script(pilot: Pilot[Any]) -> None:
        entry = pilot.app.screen.query_one("#export-path", Input)
        entry.value = "m"
        await settled(pilot)
        for key in ("tab", "down", "enter", "tab"):
            await pilot.press(key)
            await settled(pilot)
            seen.append(entry.value)
        assert not entry.has_focus

    assert played(exporting(table), script)[0] == []
    common, _, chosen, still = seen
    assert common == "more."
    assert chosen == still
    assert chosen in ("more.csv", "more.tsv")


def test_an_import_goes_into_a_folder_and_leaves_a_path_that_is_none(table: Table):
    seen: list[str] = []

    async def script(pilot: Pilot[Any]) -> None:
        entry = pilot.app.screen.query_one("#import-path", Input)
        for text in ("..", "m\0re.csv"):
            await read_file(pilot, text)
            seen.append(entry.value)
        entry.value = ""
        await settled(pilot)
        await pilot.press("down", "up", "enter")
        await settled(pilot)
        seen.append(entry.value)
        await pilot.press("f2")
        assert entry.has_focus

    assert played(importing(table), script)[0] == []
    folder, none, chosen = seen
    assert folder == "../"
    assert none == "m\0re.csv"
    assert chosen in ("book.xlsx", "broken.xlsx", "more.csv")


@pytest.mark.parametrize("where", ["read", "answer"])
def test_a_file_at_which_we_fail_ends_neither_the_dialog_nor_the_editor(tmp_path, monkeypatch, where):
    def fail(*_: object) -> None:
        raise IndexError("list index out of range")

    (path := tmp_path / "t.csv").write_text("Asset,speed\nwalk,2\n")
    (tmp_path / "other.csv").write_text("Asset,speed\nnew,1\n")

    async def script(app, pilot):
        await press(pilot, "x", "enter")
        await app.main.run_command("import")
        await press(pilot)
        if where == "read":
            monkeypatch.setattr(Draft, "read", fail)
        await press(pilot, *"other.csv", "enter")
        await pilot.app.workers.wait_for_complete()
        monkeypatch.setattr(Draft, "answer", fail)
        await press(pilot, "f6")
        shown = screen_text(app)
        await press(pilot, "escape")
        return shown, app.main.session.sheet.is_modified

    shown, is_modified = with_editor(path, script)
    assert "contextdb fails at this file (IndexError" in shown
    assert is_modified
