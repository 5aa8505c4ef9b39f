"""Notes on cells and colours of rows, texts found in all tables, copied cells inserted, and what the mouse drags elsewhere."""

from pathlib import Path

import pytest

from contextdb.edits.notes import Notes
from contextdb.edits.renaming_assets import asset_renaming
from contextdb.tables.other_files import notes_path
from contextdb.tables.project import load_table, table_files
from tui.model.sheet import Sheet

RAW = "Asset,speed,gait,take\nDodge_v1,1,Walk,a\nb,2,Run,b\nc,3,Any,c\nd,4,Any,d\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_text(RAW)
    (tmp_path / "contextdb.toml").write_text(
        '[conditions.gait]\ntype = "enum"\nvalues = ["Walk", "Run"]\n[tables.t]\noutputs = ["take"]\n'
    )
    (tmp_path / "other.csv").write_text("Asset,gait\nDodge_v2,Walk\nx,Run\n")
    return file


@pytest.fixture
def sheet(path: Path) -> Sheet:
    return Sheet(load_table(path))


def test_notes_and_colours_are_lines_that_merge_and_no_table(path):
    marks = Notes().with_note("b", "speed", "ask Ana").with_colour(["Dodge_v1", "b"], "amber").with_note("b", "gait", "x")
    marks.with_note("b", "gait", " ").write(path)
    assert notes_path(path).read_text() == "Asset,Column,Note,Colour\nDodge_v1,,,amber\nb,,,amber\nb,speed,ask Ana,\n"
    assert Notes.beside(path) == marks.with_note("b", "gait", "")
    assert sorted(name for name, _ in table_files(path.parent, load_table(path).schema)) == ["other", "t"]


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", 'Asset,Column,Note,Colour\n"x\n'])
def test_a_file_of_notes_that_is_none_says_nothing(path, text):
    notes_path(path).write_text(text)
    assert Notes.beside(path) == Notes()


def test_a_colour_that_there_is_not_colours_nothing_and_stays_in_the_file(path):
    notes_path(path).write_text("Asset,Column,Note,Colour\nb,,,mauve\nb,speed,ask Ana,red\n")
    assert not Notes.beside(path).colours
    Notes.read(path).with_note("c", "speed", "x").with_colour(["c"], "red").write(path)
    told = "Asset,Column,Note,Colour\nb,,,mauve\nb,speed,ask Ana,red\nc,,,red\nc,speed,x,\n"
    assert notes_path(path).read_text() == told


def test_notes_go_along_with_a_renamed_asset(path):
    Notes().with_note("b", "speed", "ask Ana").write(path)
    asset_renaming(load_table(path), "b", "bee").write()
    assert Notes.beside(path).texts == {("bee", "speed"): "ask Ana"}


def test_copied_cells_are_inserted_as_rows(sheet):
    sheet.go(1, 1)
    done = sheet.insert_copied("7\tRun\n8\tWalk\n")
    assert done.name == "Insert 2 rows"
    assert sheet.table.text_column("speed").to_list() == ["1", "7", "8", "2", "3", "4"]
    assert sheet.table.text_column("gait").to_list()[1:3] == ["Run", "Walk"]


@pytest.mark.parametrize(
    ("selected", "to", "column", "after"),
    [
        ((0, 0, 0), (2, 0), "Asset", ["Dodge_v1", "Dodge_v2", "Dodge_v3", "d"]),
        ((0, 1, 0), (2, 1), "speed", ["1", "1", "1", "4"]),
        ((0, 1, 1), (3, 1), "speed", ["1", "2", "3", "4"]),
        ((1, 2, 1), (3, 2), "gait", ["Walk", "Run", "Any", "Run"]),
        ((0, 3, 0), (1, 3), "take", ["a", "a", "c", "d"]),
        ((1, 1, 0), (1, 2), "gait", ["Walk", "2", "Any", "Any"]),
    ],
)
def test_the_handle_counts_on_where_it_makes_sense_and_copies_else(sheet, selected, to, column, after):
    row, at, more = selected
    sheet.go(row, at)
    if more:
        sheet.go(row + more, at, extend=True)
    sheet.fill_to(*to)
    assert sheet.table.text_column(column).to_list() == after
