"""The sheet under any sequence of its verbs."""

import pytest
from edit_strategies import edits_of, insert_column
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

from contextdb.checks.run import check
from contextdb.edits.edits import set_cells
from contextdb.errors import TableError
from contextdb.tables.table import Table
from tui.model.find import Search
from tui.model.selection import Block, Selection
from tui.model.sheet import Sheet
from tui.model.views import Filter, Sort

SCHEMA = {"speed": {"type": "number", "unit": "m/s"}, "hit": {"type": "bool"}}


def sheet_of(*rows: tuple[str, str, str]) -> Sheet:
    rows = rows or (("walk", "0..2", "True"), ("run", "2..6", "Any"), ("jump", "Any", "False"), ("idle", "0", "Any"))
    columns = dict(zip(("Asset", "speed", "hit"), map(list, zip(*rows, strict=True)), strict=True))
    return Sheet(Table.from_columns(columns, SCHEMA))


def select(sheet: Sheet, top: int, left: int, bottom: int, right: int) -> None:
    sheet.go(top, left)
    sheet.go(bottom, right, extend=True)


def assets(sheet: Sheet) -> list[str]:
    return [sheet.text(row, 0) for row in range(sheet.shape[0])]


def column(sheet: Sheet, at: int) -> list[str]:
    return [sheet.text(row, at) for row in range(sheet.shape[0])]


VERBS = {
    "clear": lambda s: s.clear(),
    "fill": lambda s: s.fill("Any"),
    "fill_down": lambda s: s.fill_down(),
    "fill_right": lambda s: s.fill_right(),
    "paste": lambda s: s.paste("a\tb\nc\td"),
    "paste one": lambda s: s.paste("True"),
    "cut": lambda s: s.cut(),
    "insert": lambda s: s.insert_rows(2),
    "insert below": lambda s: s.insert_rows(below=True),
    "delete": lambda s: s.delete_rows() if s.shape[0] else None,
    "duplicate": lambda s: s.duplicate_rows() if s.shape[0] else None,
    "up": lambda s: s.move_rows(-1) if s.shape[0] and not s.view.is_sorted else None,
    "down": lambda s: s.move_rows(1) if s.shape[0] and not s.view.is_sorted else None,
    "toggle": lambda s: s.enable_rows() if s.shape[0] else None,
    "sort file": lambda s: s.sort_file(Sort("Asset")),
    "sort": lambda s: s.set_sort(Sort("Asset", True)),
    "unsort": lambda s: s.set_sort(None),
    "filter": lambda s: s.set_filter(Filter(text="a")),
    "unfilter": lambda s: s.set_filter(Filter()),
    "undo": lambda s: s.undo(),
    "redo": lambda s: s.redo(),
    "replace": lambda s: s.replace_all(Search("a"), "b"),
    "find": lambda s: s.find(Search("a")),
    "all": lambda s: s.select(lambda selection, shape: selection.everything()),
    "end": lambda s: s.select(Selection.last),
    "rows": lambda s: s.select(Selection.rows),
}


@given(st.data())
@examples(3)
def test_whatever_keys_are_pressed_the_sheet_stays_whole_and_can_be_undone(data):
    sheet = sheet_of()
    first = {c.name: c.to_list() for c in sheet.table.columns}
    for _ in range(data.draw(st.integers(1, 15))):
        if sheet.shape[0] and data.draw(st.booleans()):
            sheet.go(data.draw(st.integers(0, 6)), data.draw(st.integers(0, 4)), data.draw(st.booleans()))
        VERBS[data.draw(st.sampled_from(list(VERBS)))](sheet)
        rows = sheet.view.rows.tolist()
        assert len(set(rows)) == len(rows)
        assert sheet.view.n_rows == sheet.table.n_rows
        assert set(rows) <= set(range(sheet.table.n_rows))
        if sheet.filter.is_off:
            assert len(rows) == sheet.table.n_rows
        assert sheet.selection == sheet.selection.within(sheet.shape)
        assert sheet.failing(0, 3).shape == (min(3, len(rows)), sheet.shape[1])
    while sheet.history.can_undo:
        sheet.undo()
    assert {c.name: c.to_list() for c in sheet.table.columns} == first
    assert not sheet.is_modified


@given(st.data())
def test_other_peoples_edits_leave_the_sheet_whole(data):
    sheet = sheet_of()
    for _ in range(4):
        sheet.apply(data.draw(edits_of(sheet.table)))
        assert sorted(sheet.view.rows.tolist()) == list(range(sheet.table.n_rows))
        assert sheet.selection == sheet.selection.within(sheet.shape)


def test_a_typed_text_that_cannot_be_read_changes_nothing_and_says_why():
    sheet = sheet_of()
    sheet.go(0, 1)
    fault = sheet.type_text("2; 1")
    assert '"2, 1"' in fault.mend
    assert not sheet.is_modified
    assert sheet.type_text("2, 1") is None
    assert sheet.history.undo_name == "Type speed of walk"


def test_a_paste_of_a_block_goes_from_the_top_left_and_is_one_step():
    sheet = sheet_of()
    sheet.go(1, 1)
    done = sheet.paste("1..2\tTrue\r3..4\tFalse")
    assert done.name == "Paste 2 × 2"
    assert column(sheet, 1) == ["0..2", "1..2", "3..4", "0"]
    assert sheet.block == Block(1, 1, 3, 3)
    sheet.undo()
    assert column(sheet, 1) == ["0..2", "2..6", "Any", "0"]


def test_a_paste_past_the_end_adds_rows_and_leaves_out_columns_and_says_so():
    sheet = sheet_of()
    sheet.go(3, 2)
    done = sheet.paste("True\tx\nmaybe\ty\nFalse\tz")
    assert assets(sheet) == ["walk", "run", "jump", "idle", "", ""]
    assert done.notes == ("2 rows added.",)
    assert done.warnings[0].startswith("1 column left out")
    assert done.warnings[1] == "1 cell cannot be read."
    assert sheet.fault(4, 2)
    sheet.undo()
    assert sheet.table.n_rows == 4


def test_a_paste_into_an_empty_sheet_makes_its_rows():
    sheet = Sheet(Table.from_columns({"Asset": [], "hit": []}, {"hit": SCHEMA["hit"]}))
    sheet.paste("a\tTrue\nb\tAny\n")
    assert assets(sheet) == ["a", "b"]


def test_what_is_copied_can_be_pasted_elsewhere():
    sheet = sheet_of()
    select(sheet, 0, 1, 1, 2)
    text = sheet.copy()
    assert text == "0..2\tTrue\n2..6\tAny\n"
    sheet.go(2, 1)
    sheet.paste(text)
    assert column(sheet, 2) == ["True", "Any", "True", "Any"]


def test_one_value_fills_what_is_selected():
    sheet = sheet_of()
    select(sheet, 0, 2, 2, 2)
    sheet.paste("False")
    assert column(sheet, 2) == ["False", "False", "False", "Any"]
    assert sheet.paste("False").notes == ("What is pasted is there already.",)


def test_fill_down_copies_the_first_row_or_the_one_above_a_single_one():
    sheet = sheet_of()
    select(sheet, 0, 1, 2, 2)
    assert sheet.fill_down().name == "Fill down 3 × 2"
    assert column(sheet, 1) == ["0..2", "0..2", "0..2", "0"]
    sheet.go(3, 1)
    sheet.fill_down()
    assert column(sheet, 1)[3] == "0..2"
    sheet.go(0, 1)
    assert sheet.fill_down().notes


def test_fill_right_copies_the_first_column():
    sheet = sheet_of(("a", "1", "1"), ("b", "0", "0"))
    select(sheet, 0, 1, 1, 2)
    sheet.fill("0")
    sheet.go(1, 1)
    sheet.type_text("1")
    select(sheet, 0, 1, 1, 2)
    sheet.fill_right()
    assert column(sheet, 2) == ["0", "1"]


def test_a_sorted_view_never_reorders_the_file_and_shows_its_row_numbers():
    sheet = sheet_of()
    sheet.set_sort(Sort("Asset"))
    assert assets(sheet) == ["idle", "jump", "run", "walk"]
    assert [sheet.row_number(r) for r in range(4)] == [4, 3, 2, 1]
    assert sheet.table.assets == ["walk", "run", "jump", "idle"]
    assert not sheet.is_modified
    with pytest.raises(TableError, match="shown sorted"):
        sheet.move_rows(1)
    sheet.sort_file(Sort("Asset"))
    assert sheet.table.assets == ["idle", "jump", "run", "walk"]
    assert sheet.is_modified


def test_the_selection_stays_on_its_row_through_sort_filter_and_edits():
    sheet = sheet_of()
    sheet.go(2, 1)
    sheet.set_sort(Sort("Asset"))
    assert assets(sheet)[sheet.selection.row] == "jump"
    sheet.set_filter(Filter(text="u"))
    assert assets(sheet)[sheet.selection.row] == "jump"
    sheet.set_filter(Filter())
    sheet.set_sort(None)
    sheet.apply(set_cells(sheet.table, [(0, "Asset", "zzz")]))
    sheet.go(3, 1)
    sheet.move_rows(-1)
    assert assets(sheet) == ["zzz", "run", "idle", "jump"]
    assert sheet.cursor == (2, 1)


def test_an_edit_in_a_sorted_view_leaves_the_rows_where_they_are_until_asked():
    sheet = sheet_of()
    sheet.set_sort(Sort("Asset"))
    sheet.go(0, 0)
    sheet.type_text("zebra")
    assert assets(sheet) == ["zebra", "jump", "run", "walk"]
    sheet.refresh()
    assert assets(sheet) == ["jump", "run", "walk", "zebra"]


def test_the_filter_on_valid_rows_and_the_cells_that_fail():
    sheet = sheet_of()
    assert sheet.set_fact("speed", "3") is None
    assert sheet.header(1).leaves == 2
    assert sheet.header(1).unit == "m/s"
    assert sheet.failing(0, 4)[:, 1].tolist() == [True, False, False, True]
    sheet.set_filter(Filter(is_valid=True))
    assert assets(sheet) == ["run", "jump"]
    assert sheet.set_fact("speed", "quick")
    assert sheet.header(1).fault


def test_the_filter_on_findings_follows_rows_that_move():
    sheet = sheet_of(("a", "1", "Any"), ("a", "2", "Any"), ("b", "3", "Any"))
    sheet.set_findings(check(sheet.table))
    sheet.go(2, 0)
    sheet.move_rows(-1)
    sheet.set_filter(Filter(has_findings=True))
    assert [sheet.row_number(r) for r in range(sheet.shape[0])] == [3]


def test_going_to_a_hidden_row_takes_the_filter_off():
    sheet = sheet_of()
    sheet.set_filter(Filter(text="walk"))
    sheet.go_to(3, "hit")
    assert sheet.cursor == (3, 2)
    assert sheet.filter.is_off


def test_columns_come_go_move_and_change_names_and_the_cursor_stays_on_its_own():
    sheet = sheet_of()
    sheet.apply(insert_column(sheet.table, 1, "near", declared={"type": "bool"}))
    sheet.go(1, 1)
    assert [sheet.header(c).kind for c in range(4)] == ["asset", "bool", "number", "bool"]
    sheet.move_column(1)
    assert [c.name for c in sheet.table.columns] == ["Asset", "speed", "near", "hit"]
    assert sheet.cursor == (1, 2)
    sheet.rename_column("close")
    sheet.delete_columns()
    assert [c.name for c in sheet.table.columns] == ["Asset", "speed", "hit"]
    assert sheet.history.names[-1] == "Delete the column close"


def test_rows_can_be_disabled_and_the_test_row_knows():
    sheet = sheet_of()
    sheet.go(1, 0)
    sheet.enable_rows()
    assert sheet.query.n_valid == 3
    sheet.enable_rows()
    assert sheet.query.n_valid == 4
    assert sheet.header(3).kind == "enabled"


def test_find_goes_on_in_the_order_shown_and_replaces_one_or_all():
    sheet = sheet_of()
    sheet.set_sort(Sort("Asset"))
    assert sheet.find(Search("any")) == 3
    assert sheet.cursor == (0, 2)
    sheet.replace_here(Search("any"), "True")
    assert sheet.cursor == (1, 1)
    assert sheet.replace_all(Search("any"), "False").name == "Replace any in 2 cells"
    assert sheet.replace_all(Search("any"), "False").notes
    assert sheet.table.text_column("hit").to_list() == ["True", "False", "False", "True"]
