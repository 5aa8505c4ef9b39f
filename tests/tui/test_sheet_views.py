"""Sorting and filtering are views: no row is lost or doubled."""

import numpy as np
from edit_strategies import edits_of
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, tables

from contextdb.tables.table import Table
from tui.model.views import Filter, Sort, View, filtered_rows, sorted_rows


def column(texts: list[str], **declared: object) -> Table:
    return Table.from_columns({"Asset": [f"a{i}" for i in range(len(texts))], "x": texts}, {"x": declared})


def in_order(table: Table, name: str = "x", is_descending: bool = False) -> list[str]:
    return [table.text(r, name) for r in sorted_rows(table, Sort(name, is_descending)).tolist()]


@given(tables(), st.data())
@examples(2)
def test_sort_and_filter_never_lose_or_double_a_row(table, data):
    sort = Sort(data.draw(st.sampled_from([c.name for c in table.columns])), data.draw(st.booleans()))
    assert sorted(sorted_rows(table, sort).tolist()) == list(range(table.n_rows))
    shown = filtered_rows(table, Filter(text=data.draw(st.sampled_from(["", "a1", "true", "."]))))
    view = View.of(table, sort, shown)
    expected = range(table.n_rows) if shown is None else np.flatnonzero(shown).tolist()
    assert sorted(view.rows.tolist()) == list(expected)
    assert all(view.place(int(row)) == at for at, row in enumerate(view.rows))


@given(tables(), st.data())
@examples(2)
def test_a_view_after_an_edit_shows_what_it_showed_and_the_new_rows(table, data):
    sort = data.draw(st.none() | st.just(Sort("Asset", True)))
    shown = filtered_rows(table, data.draw(st.sampled_from([Filter(), Filter(text="a1")])))
    view = View.of(table, sort, shown)
    edit = data.draw(edits_of(table))
    came_from = edit.came_from(table.n_rows)
    after = view.after(came_from)
    was_shown = set(view.rows.tolist())
    expected = {i for i, row in enumerate(came_from.tolist()) if row < 0 or row in was_shown}
    assert sorted(after.rows.tolist()) == sorted(expected)
    if sort is None:
        assert after.rows.tolist() == sorted(expected)
    else:
        old = [row for row in came_from[after.rows].tolist() if row >= 0]
        places = [view.place(row) for row in old]
        assert places == sorted(places)


def test_numbers_stand_by_where_they_begin_then_end_and_any_last():
    table = column(["10..30", "Any", "2..5", "2..3", "..1", "-5, 1", ""], type="number")
    assert in_order(table) == ["..1", "-5, 1", "2..3", "2..5", "10..30", "Any", ""]
    assert in_order(table, is_descending=True) == ["10..30", "2..5", "2..3", "-5, 1", "..1", "Any", ""]


def test_enums_stand_as_they_are_declared():
    table = column(["Top", "Going_Down", "Any", "Going_Up Top", "Going_Up"], type="enum", values=["Going_Up", "Top", "Going_Down"])
    assert in_order(table) == ["Going_Up", "Going_Up Top", "Top", "Going_Down", "Any"]


def test_booleans_stand_false_first_and_unreadable_cells_behind_any():
    table = column(["True", "Any", "False"], type="bool").with_cell(0, "x", "maybe")
    assert in_order(table) == ["False", "Any", "maybe"]


def test_texts_stand_without_case_and_numbers_in_them_by_value():
    texts = ["walk_10", "Walk_2", "walk_1", "a", "walk_", ""]
    table = Table.from_columns({"Asset": texts})
    assert in_order(table, "Asset") == ["a", "walk_", "walk_1", "Walk_2", "walk_10", ""]


def test_a_sort_is_stable_both_ways():
    table = column(["1", "1.0", "0", "=1"], type="number")
    assert sorted_rows(table, Sort("x")).tolist() == [2, 0, 1, 3]
    assert sorted_rows(table, Sort("x", True)).tolist() == [0, 1, 3, 2]


def test_a_filter_shows_rows_that_pass_everything_it_says():
    table = column(["True", "Any", "False"], type="bool")
    valid = np.array([True, True, False])

    def shown(**said: object) -> list[int]:
        return np.flatnonzero(filtered_rows(table, Filter(**said), valid, ~valid)).tolist()

    assert shown(text="A1") == [1]
    assert shown(columns=(("x", "e"),)) == [0, 2]
    assert shown(cells=(("x", frozenset(["Any", "False"])),)) == [1, 2]
    assert shown(is_valid=True, columns=(("x", "TRUE"),)) == [0]
    assert shown(has_findings=True) == [2]
    assert filtered_rows(table, Filter()) is None
