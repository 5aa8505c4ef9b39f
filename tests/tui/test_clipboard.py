"""Tab-separated text as spreadsheets write it, and the shapes in which it is pasted."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.model.clipboard import format_tsv, parse_tsv, paste_doubt, place_paste
from tui.model.selection import Block

CELLS = st.text(st.sampled_from('ab \t\r\n"é'), max_size=5)


@given(st.data())
def test_what_is_copied_is_read_back(data):
    width = data.draw(st.integers(1, 4))
    rows = data.draw(st.lists(st.lists(CELLS, min_size=width, max_size=width), min_size=1, max_size=5))
    assert parse_tsv(format_tsv(rows)) == rows


@given(st.text(st.sampled_from('ab\t\r\n"'), max_size=30))
def test_any_text_is_read_as_rows_of_one_width(text):
    rows = parse_tsv(text)
    assert len({len(row) for row in rows}) <= 1
    assert bool(rows) is bool(text)


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("", []),
        ("a", [["a"]]),
        ("a\n", [["a"]]),
        ("a\tb\r\nc\td\r\n", [["a", "b"], ["c", "d"]]),
        ("a\tb\rc\td", [["a", "b"], ["c", "d"]]),
        ("a\n\nb\n", [["a"], [""], ["b"]]),
        ("\n", [[""]]),
        ("a\t", [["a", ""]]),
        ("a\tb\nc\n", [["a", "b"], ["c", ""]]),
        ('"two\nlines"\t"with ""quotes"""\n', [["two\nlines", 'with "quotes"']]),
        ('"a\tb"\tc', [["a\tb", "c"]]),
        ('20" wide\tb', [['20" wide', "b"]]),
        ('"open\tb\nc', [['"open', "b"], ["c", ""]]),
        ('"a"b\tc', [['"a"b', "c"]]),
    ],
)
def test_text_of_other_spreadsheets_is_read_as_they_mean_it(text, rows):
    assert parse_tsv(text) == rows


@pytest.mark.parametrize(
    ("texts", "selected", "block", "n_cut"),
    [
        ([["x"]], Block(0, 0, 3, 2), Block(0, 0, 3, 2), 0),
        ([["x", "y"]], Block(1, 0, 4, 2), Block(1, 0, 4, 2), 0),
        ([["x"], ["y"]], Block(0, 0, 4, 3), Block(0, 0, 4, 3), 0),
        ([["x"], ["y"]], Block(0, 0, 3, 1), Block(0, 0, 2, 1), 0),
        ([["x", "y"], ["z", "w"]], Block(8, 1, 9, 2), Block(8, 1, 10, 3), 0),
        ([["x", "y", "z"]], Block(0, 3, 1, 4), Block(0, 3, 1, 5), 1),
    ],
)
def test_a_paste_fills_a_multiple_of_itself_and_else_stands_once(texts, selected, block, n_cut):
    placed = place_paste(texts, selected, n_columns=5)
    assert placed.block == block
    assert placed.n_columns_cut == n_cut


@given(st.integers(1, 3), st.integers(1, 3), st.integers(1, 9), st.integers(1, 9))
def test_every_cell_of_a_paste_is_the_one_of_its_tile(height, width, tall, wide):
    texts = [[f"{r},{c}" for c in range(width)] for r in range(height)]
    placed = place_paste(texts, Block(2, 1, 2 + tall, 1 + wide), n_columns=12)
    cells = list(placed.cells())
    assert len(cells) == placed.block.n_cells
    assert all(text == f"{(row - 2) % height},{(column - 1) % width}" for row, column, text in cells)


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("a,1,x\nb,2,y\n", [["a", "1", "x"], ["b", "2", "y"]]),
        ('a,"1, 2",x\r\nb,Any,y', [["a", "1, 2", "x"], ["b", "Any", "y"]]),
        ("a,1,x", [["a", "1", "x"]]),
        ("a\t1,x\n", None),  # Excel's own
        ("Stand, then walk\nRun, then jump\n", None),  # a sentence
        ("a,1\nb\n", None),
        ("a,1,x,y,z\n", None),  # more columns than there are
        ('a,"1\n', None),
    ],
)
def test_text_with_commas_is_split_where_all_its_lines_have_as_many_cells(text, rows):
    doubt = paste_doubt(text, [None, None, None])
    assert (doubt and parse_tsv(doubt.ways[0][1])) == rows
