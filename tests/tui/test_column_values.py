"""A column as a whole: its values with their counts, mends and replacements, tests of the filter, several keys to sort by."""

import pytest

from contextdb.columns import TextColumn
from contextdb.errors import TableError
from contextdb.schema.settings import Schema, TableSettings, conditions_from_dict
from contextdb.tables.table import Table
from tui.model.column_values import described, selection_summary, values_of
from tui.model.sheet import Sheet
from tui.model.views import CellTest, Filter, Sort

SCHEMA = {"speed": {"type": "number", "unit": "m/s"}, "gait": {"type": "enum", "values": ["Walk", "Run"]}}
COLUMNS = {
    "Asset": ["a", "b", "c", "d", "e"],
    "speed": ["0..6", "5; 9", "0-6", "Any", "5; 9"],
    "gait": ["Walk", "Run", "Walk Run", "not Walk", "Walk"],
    "n": ["1", "2", "3", "10", ""],
}


def sheet_of() -> Sheet:
    texts = [TextColumn.of(name, values) for name, values in COLUMNS.items()]
    return Sheet(Table.build("t", texts, Schema(conditions=conditions_from_dict(SCHEMA)), TableSettings("t", outputs=("n",))))


def column(sheet: Sheet, name: str) -> list[str]:
    return sheet.table.text_column(name).to_list()


def shown(sheet: Sheet) -> list[str]:
    return [sheet.text(row, 0) for row in range(len(sheet.view))]


def test_the_values_of_a_column_are_counted_and_unreadable_ones_come_first():
    sheet = sheet_of()
    sheet.set_fact("speed", "3")
    found = values_of(sheet, 1)
    assert [(v.text, v.n_rows, v.n_valid, v.fault is None) for v in found] == [
        ("5; 9", 2, 0, False),
        ("0-6", 1, 0, False),
        ("0..6", 1, 1, True),
        ("Any", 1, 1, True),
    ]
    assert described(sheet, 1, found) == "number in m/s · 4 texts in 5 rows · 1 Any · 3 cells cannot be read"


def test_all_cells_that_cannot_be_read_are_mended_in_one_step():
    sheet = sheet_of()
    sheet.go(0, 1)
    done = sheet.mend_all()
    assert done.name == "Mend in 3 cells"
    assert column(sheet, "speed") == ["0..6", "5, 9", "0..6", "Any", "5, 9"]
    sheet.undo()
    assert column(sheet, "speed") == COLUMNS["speed"]


def test_only_some_of_them_are_mended_where_that_is_said():
    sheet = sheet_of()
    sheet.go(0, 1)
    sheet.mend_all(["0-6"])
    assert column(sheet, "speed") == ["0..6", "5; 9", "0..6", "Any", "5; 9"]


def test_where_nothing_can_be_mended_that_is_said():
    sheet = sheet_of()
    sheet.go(0, 2)
    assert "cannot be read" in sheet.mend_all().notes[0]
    assert not sheet.is_modified


def test_a_value_is_renamed_in_every_cell_and_where_it_is_declared():
    sheet = sheet_of()
    sheet.go(0, 2)
    sheet.rename_value("Walk", "Stroll")
    assert column(sheet, "gait") == ["Stroll", "Run", "Stroll Run", "not Stroll", "Stroll"]
    assert sheet.table.condition("gait").condition.domain.values == ("Stroll", "Run")
    assert [sheet.fault(row, 2) for row in range(5)] == [None] * 5
    sheet.undo()
    assert column(sheet, "gait") == COLUMNS["gait"]
    assert sheet.table.condition("gait").condition.domain.values == ("Walk", "Run")


def test_a_value_is_not_renamed_to_one_that_there_is():
    sheet = sheet_of()
    sheet.go(0, 2)
    with pytest.raises(TableError, match='"Run" is a value of gait already'):
        sheet.rename_value("Walk", "Run")


def test_values_are_replaced_in_every_cell():
    sheet = sheet_of()
    sheet.go(0, 3)
    sheet.replace_value(["1", "10"], "7")
    assert column(sheet, "n") == ["7", "2", "3", "7", ""]
    sheet.go(0, 2)
    with pytest.raises(TableError):
        sheet.replace_value(["Walk"], "Crawl")


@pytest.mark.parametrize(
    ("name", "text", "rows"),
    [
        ("n", "<3", ["a", "b"]),
        ("n", ">=3", ["c", "d"]),
        ("n", "= 10", ["d"]),
        ("n", "not 10", ["a", "b", "c", "e"]),
        ("speed", "<1", ["a"]),
        ("speed", ">6", []),
        ("speed", ">x", []),
        ("gait", "!=walk", ["b", "c", "d"]),
    ],
)
def test_a_test_shows_the_rows_that_pass_it(name, text, rows):
    sheet, test = sheet_of(), CellTest.read(name, text)
    assert test is not None
    sheet.set_filter(Filter(tests=(test,)))
    assert shown(sheet) == rows


@pytest.mark.parametrize("text", ["Walk", "", "<", "not"])
def test_other_texts_are_no_test(text):
    assert CellTest.read("gait", text) is None


def test_each_part_of_a_filter_is_named_and_can_be_taken_off():
    wanted = Filter("x", (("gait", "wa"),), (("n", frozenset(["1"])),), (CellTest("n", "!=", "2"),), True, True)
    parts = wanted.parts
    assert [said for said, _ in parts] == ['"x"', 'gait has "wa"', "n: 1", "n not 2", "valid", "with problems"]
    for name, rest in parts:
        assert [other for other, _ in rest.parts] == [one for one, _ in parts if one != name]


def test_a_filter_forgets_a_column_that_is_gone():
    sheet = sheet_of()
    sheet.set_filter(Filter(tests=(CellTest("n", "<", "3"),)))
    sheet.go(0, 3)
    sheet.delete_columns()
    sheet.refresh()
    assert shown(sheet) == COLUMNS["Asset"]


def test_rows_are_sorted_by_several_columns():
    sheet = sheet_of()
    sheet.set_sort(Sort("gait", False, Sort("n", True)))
    assert shown(sheet) == ["a", "e", "c", "d", "b"]


def test_a_selection_of_numbers_is_summed_up_and_other_texts_are_counted():
    sheet = sheet_of()
    sheet.go(0, 3)
    sheet.go(4, 3, extend=True)
    assert selection_summary(sheet) == ": sum 16, mean 4, 1 to 10"
    sheet.go(0, 2)
    sheet.go(4, 2, extend=True)
    assert selection_summary(sheet) == ": 4 different texts"
