"""Moving and selecting with the keys of a spreadsheet."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.model.selection import Block, Selection

SHAPE = (10, 4)


def start(row: int, column: int) -> Selection:
    return Selection().at(row, column, SHAPE)


def place(selection: Selection) -> tuple[int, int]:
    return selection.row, selection.column


def test_arrows_stop_at_the_edges():
    assert place(start(0, 0).moved(-1, -1, SHAPE)) == (0, 0)
    assert place(start(9, 3).moved(1, 1, SHAPE)) == (9, 3)
    assert place(start(5, 2).moved(100, 0, SHAPE)) == (9, 2)


def test_shift_keeps_the_cell_where_typing_goes_and_moves_the_far_corner():
    selection = start(2, 1).moved(2, 0, SHAPE, extend=True).moved(0, 2, SHAPE, extend=True)
    assert place(selection) == (2, 1)
    assert selection.far == (4, 3)
    assert selection.block(SHAPE) == Block(2, 1, 5, 4)
    assert selection.moved(-4, 0, SHAPE, extend=True).block(SHAPE) == Block(0, 1, 3, 4)


def test_home_and_end_stay_in_the_row_and_with_ctrl_reach_the_corners():
    assert place(start(4, 2).home(SHAPE)) == (4, 0)
    assert place(start(4, 2).end(SHAPE)) == (4, 3)
    assert place(start(4, 2).first(SHAPE)) == (0, 0)
    assert place(start(4, 2).last(SHAPE)) == (9, 3)
    assert start(4, 2).last(SHAPE, extend=True).block(SHAPE) == Block(4, 2, 10, 4)


@pytest.mark.parametrize(
    ("filled", "row", "down", "there"),
    [("xxx..x...x", 0, 1, 2), ("xxx..x...x", 2, 1, 5), ("xxx..x...x", 5, -1, 2), ("x.........", 0, 1, 9), ("xxxxxxxxxx", 9, 1, 9),
     ("..........", 4, -1, 0), ("xxx..x...x", 9, -1, 5)],
)  # fmt: skip
def test_ctrl_and_an_arrow_go_to_the_edge_of_what_is_filled(filled, row, down, there):
    selection = start(row, 1).to_edge(down, 0, SHAPE, lambda r, c: filled[r] == "x")
    assert place(selection) == (there, 1)


def test_whole_rows_and_columns_are_every_cell_of_them():
    selection = start(2, 1).moved(1, 0, SHAPE, extend=True)
    assert selection.rows(SHAPE).block(SHAPE) == Block(2, 0, 4, 4)
    assert selection.columns(SHAPE).block(SHAPE) == Block(0, 1, 10, 2)
    assert selection.everything().block(SHAPE) == Block(0, 0, 10, 4)


def test_enter_and_tab_go_round_the_selected_cells_which_stay_selected():
    selection = start(1, 1).moved(1, 1, SHAPE, extend=True)
    by_tab, by_enter = [], []
    for way, seen in (((0, 1), by_tab), ((1, 0), by_enter)):
        now = selection
        for _ in range(4):
            now = now.next_cell(*way, SHAPE)
            seen.append(place(now))
            assert now.block(SHAPE) == selection.block(SHAPE)
    assert by_tab == [(1, 2), (2, 1), (2, 2), (1, 1)]
    assert by_enter == [(2, 1), (1, 2), (2, 2), (1, 1)]
    assert place(start(1, 1).next_cell(1, 0, SHAPE)) == (2, 1)
    assert place(selection.next_cell(0, -1, SHAPE)) == (2, 2)


@given(st.tuples(st.integers(0, 12), st.integers(0, 5)), st.tuples(st.integers(0, 12), st.integers(0, 5)), st.integers(0, 3))
def test_a_selection_never_leaves_the_view_however_small(one, other, n_rows):
    shape = (n_rows, 2)
    selection = Selection(*one, one, other)
    block = selection.block(shape)
    assert 0 <= block.top <= block.bottom <= n_rows
    assert 0 <= block.left < block.right <= 2
    assert bool(block.n_cells) is bool(n_rows)
