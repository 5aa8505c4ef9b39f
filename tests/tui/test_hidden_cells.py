"""No edit of a selection changes a cell that is hidden, and each says how much of the selection is hidden."""

from collections.abc import Callable

import pytest

from contextdb.tables.table import Table
from tui.model.find import Search
from tui.model.selection import Selection
from tui.model.sheet import Done, Sheet
from tui.model.views import Filter
from tui.model.visible_columns import VisibleColumns

COLUMNS = {
    "Asset": ["walk", "run", "jump", "idle"],
    "speed": ["1", "2", "3", "4"],
    "hidden": ["5", "6", "7", "8"],
    "gait": ["a", "b", "c", "d"],
    "filtered": ["x", "no", "x", "x"],
}
HIDDEN_ROW = 1
SELECTED = "1 hidden row and 1 hidden column"


@pytest.fixture
def sheet() -> Sheet:
    """The cells of speed, hidden and gait are selected in three rows that are seen."""
    sheet = Sheet(Table.from_columns(COLUMNS, {"speed": {"type": "number"}}))
    sheet.show_columns(VisibleColumns(frozenset(["hidden"])))
    sheet.set_filter(Filter(columns=(("filtered", "x"),)))
    sheet.go(0, 1)
    sheet.go(2, 3, extend=True)
    return sheet


def texts(sheet: Sheet) -> dict[str, list[str]]:
    return {column.name: column.to_list() for column in sheet.table.columns}


def hidden_texts(sheet: Sheet) -> tuple[object, object]:
    now = texts(sheet)
    return now["hidden"][: len(COLUMNS["Asset"])], [column[HIDDEN_ROW] for column in now.values()]


@pytest.mark.parametrize(
    ("verb", "speed", "gait"),
    [
        (lambda s: s.clear(), ["", "2", "", ""], ["", "b", "", ""]),
        (lambda s: s.cut()[1], ["", "2", "", ""], ["", "b", "", ""]),
        (lambda s: s.fill("9"), ["9", "2", "9", "9"], ["9", "b", "9", "9"]),
        (lambda s: s.fill_down(), ["1", "2", "1", "1"], ["a", "b", "a", "a"]),
        (lambda s: s.fill_right(), ["1", "2", "3", "4"], ["1", "b", "3", "4"]),
        (lambda s: s.fill_series(), ["1", "2", "3", "5"], ["a", "b", "a", "a"]),
        (lambda s: s.paste("7\tp\n8\tq\n9\tr\n"), ["7", "2", "8", "9"], ["p", "b", "q", "r"]),
        (lambda s: s.paste("7"), ["7", "2", "7", "7"], ["7", "b", "7", "7"]),
        (lambda s: s.replace_all(Search("[1-8a-d]", is_pattern=True), "0", True), ["0", "2", "0", "0"], ["0", "b", "0", "0"]),
    ],
    ids=["clear", "cut", "fill", "fill down", "fill right", "fill a series", "paste", "paste one", "replace"],
)
def test_edits_of_a_selection_pass_over_what_is_hidden_and_say_so(
    sheet: Sheet, verb: Callable[[Sheet], Done], speed: list[str], gait: list[str]
):
    before = hidden_texts(sheet)
    done = verb(sheet)
    assert hidden_texts(sheet) == before
    assert (texts(sheet)["speed"], texts(sheet)["gait"]) == (speed, gait)
    assert f"Unchanged: {SELECTED}." in done.notes


def test_the_handle_fills_over_hidden_columns_and_rows(sheet):
    before = hidden_texts(sheet)
    sheet.go(0, 1)
    assert sheet.fill_to(0, 3).notes == ("Unchanged: 1 hidden column.",)
    assert texts(sheet)["gait"] == ["1", "b", "c", "d"]
    sheet.go(0, 1)
    sheet.go(0, 3, extend=True)
    assert sheet.fill_to(2, 3).notes == (f"Unchanged: {SELECTED}.",)
    assert hidden_texts(sheet) == before


def test_whole_columns_that_are_selected_count_every_row_that_a_filter_hides(sheet):
    sheet.set_filter(Filter(columns=(("filtered", "no"),)))
    sheet.go(0, 1)
    sheet.select(Selection.columns)
    assert sheet.clear().notes == ("Unchanged: 3 hidden rows.",)
    assert texts(sheet)["speed"] == ["1", "", "3", "4"]


def test_hidden_columns_are_neither_copied_nor_deleted_with_those_around_them(sheet):
    assert sheet.copy() == "1\ta\n3\tc\n4\td\n"
    sheet.delete_columns()
    assert list(texts(sheet)) == ["Asset", "hidden", "filtered"]


@pytest.mark.parametrize("verb", ["paste_below", "insert_copied"])
def test_pasted_rows_leave_hidden_columns_empty(sheet, verb):
    sheet.go(0, 1)
    getattr(sheet, verb)("9\tz\n")
    new = texts(sheet)["gait"].index("z")
    assert [column[new] for column in texts(sheet).values()] == ["", "9", "", "z", ""]


@pytest.mark.parametrize(("down", "right"), [(0, 1), (0, -1), (1, 0), (-1, 0)])
def test_enter_and_tab_go_through_the_selected_cells_that_are_seen(sheet, down, right):
    places = set()
    for _ in range(6):
        sheet.move_on(down, right)
        places.add(sheet.cursor)
    assert places == {(row, column) for row in range(3) for column in (1, 3)}


@pytest.mark.parametrize("change", [Selection.columns, lambda s, _: s.everything()], ids=["columns", "all"])
def test_the_cursor_leaves_columns_that_are_hidden_under_it(sheet, change):
    sheet.go(1, 3)
    sheet.select(change)
    sheet.show_columns(VisibleColumns(frozenset(["gait", "hidden"])))
    assert (sheet.cursor, sheet.block.n_cells) == ((1, 4), 1)
    sheet.show_columns(VisibleColumns(frozenset(["hidden"])))
    sheet.go(1, 1)
    sheet.delete_columns()
    assert not sheet.hidden[sheet.cursor[1]]
