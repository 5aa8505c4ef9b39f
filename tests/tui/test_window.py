"""The part of a sheet on the screen: what it says of rows and cells is what the sheet says."""

import pytest

from contextdb.columns import TextColumn
from contextdb.schema.settings import Schema, TableSettings, conditions_from_dict
from contextdb.tables.table import Table
from tui.model.sheet import Sheet
from tui.model.views import Filter, Sort
from tui.model.window import Window


@pytest.fixture
def sheet() -> Sheet:
    columns = {
        "Asset": ["walk", "run", "jump", "idle"],
        "speed": ["0..2", "5; 9", "", "not 3"],
        "hit": ["True", "Any", "False", "True"],
        "on": ["True", "", "False", "True"],
    }
    schema = Schema(conditions=conditions_from_dict({"speed": {"type": "number"}, "hit": {"type": "bool"}}))
    texts = [TextColumn.of(name, values) for name, values in columns.items()]
    return Sheet(Table.build("t", texts, schema, TableSettings("t", enabled="on")))


def test_a_row_says_its_number_in_the_file_and_whether_it_is_enabled_and_valid(sheet):
    sheet.set_fact("hit", "True")
    rows = Window(sheet, 0, 4).rows
    assert [row.number for row in rows] == [1, 2, 3, 4]
    assert [row.is_enabled for row in rows] == [True, True, False, True]
    assert [row.is_valid for row in rows] == sheet.query.valid.tolist()


def test_no_row_is_valid_while_nothing_is_asked(sheet):
    assert not any(row.is_valid for row in Window(sheet, 0, 4).rows)


def test_a_cell_is_meant_as_text_any_fault_or_failing(sheet):
    window = Window(sheet, 0, 4)
    assert [window.cell(row, 1) for row in range(4)] == [("0..2", "text"), ("5; 9", "fault"), ("", "any"), ("not 3", "text")]
    sheet.set_fact("speed", "3")
    window = Window(sheet, 0, 4)
    assert [window.cell(row, 1)[1] for row in range(4)] == ["failing", "fault", "any", "failing"]


def test_a_column_that_is_no_condition_is_only_text(sheet):
    assert Window(sheet, 0, 4).cell(1, 0) == ("run", "text")


def test_a_window_of_a_sorted_and_filtered_view_holds_the_rows_shown(sheet):
    sheet.set_sort(Sort("Asset"))
    sheet.set_filter(Filter(text="True"))
    window = Window(sheet, 0, 10)
    assert [window.cell(row, 0)[0] for row in range(window.n_rows)] == ["idle", "walk"]
    assert [row.number for row in window.rows] == [4, 1]


@pytest.mark.parametrize(("top", "n_rows", "holds"), [(0, 2, [0, 1]), (3, 5, [3]), (9, 3, []), (0, 0, [])])
def test_a_window_holds_the_rows_that_there_are(sheet, top, n_rows, holds):
    window = Window(sheet, top, n_rows)
    assert [row for row in range(-1, 12) if window.holds(row)] == holds
