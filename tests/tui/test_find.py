"""Find and replace over the cells of a sheet."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import tables

from contextdb.tables.table import Table
from tui.model.find import PatternError, Search, find, next_hit, replace_all

NAMES = ["Asset", "x"]


def table_of(*texts: str) -> Table:
    return Table.from_columns({"Asset": [f"a{i}" for i in range(len(texts))], "x": list(texts)}, {"x": {"type": "text"}})


def found(search: Search, *texts: str) -> list[int]:
    table = table_of(*texts)
    return np.flatnonzero(find(table, search, np.arange(len(texts)), NAMES)[:, 1]).tolist()


def replaced(search: Search, by: str, *texts: str) -> list[str]:
    table = table_of(*texts)
    return replace_all(table, search, by, np.arange(len(texts)), ["x"]).apply(table).text_column("x").to_list()


@given(
    tables(), st.sampled_from(["a", "A1", "..", "not", "|", "(", "$1", "+", '"', "ö", "Größe", "\\"]), st.booleans(), st.booleans()
)
def test_plain_texts_are_found_where_python_finds_them(table, text, is_cased, is_whole):
    names = [c.name for c in table.columns]
    hits = find(table, Search(text, is_whole, is_cased), np.arange(table.n_rows), names)
    fold = (lambda t: t) if is_cased else str.lower
    for column, name in enumerate(names):
        for row in range(table.n_rows):
            cell, word = fold(table.text(row, name)), fold(text)
            assert hits[row, column] == (cell == word if is_whole else word in cell)


def test_whole_cells_and_case():
    assert found(Search("cb"), "CB", "CB FS", "x") == [0, 1]
    assert found(Search("cb", is_whole=True), "CB", "CB FS", "x") == [0]
    assert found(Search("cb", is_cased=True), "CB", "cb") == [1]


def test_patterns_and_their_groups():
    search = Search(r"([A-Z])_(\d+)", is_pattern=True, is_cased=True)
    assert replaced(search, "$2_$1", "A_1 B_22", "a_1") == ["1_A 22_B", "a_1"]
    assert replaced(Search("A|B", is_whole=True, is_pattern=True), "C", "A", "B", "AB") == ["C", "C", "AB"]


def test_a_plain_replacement_is_taken_as_it_is():
    assert replaced(Search("A"), "$1$$", "xAx") == ["x$1$$x"]


def test_a_pattern_that_cannot_be_read_says_why():
    with pytest.raises(PatternError, match="cannot read the pattern"):
        found(Search("(", is_pattern=True), "a")
    assert Search("(", is_pattern=True).check()
    assert Search("(").check() is None


def test_a_pattern_that_hangs_a_backtracking_engine_does_not_hang_this_one():
    assert found(Search("(a+)+$", is_pattern=True, is_cased=True), "a" * 2000 + "b") == []


def test_replace_all_is_one_named_step_and_nothing_found_is_none():
    table = table_of("CB FS", "CB", "SS")
    edit = replace_all(table, Search("CB"), "LB", np.arange(3), NAMES)
    assert edit.name == "Replace CB in 2 cells"
    assert replace_all(table, Search("QB"), "LB", np.arange(3), NAMES).changes == ()
    assert replace_all(table, Search(""), "LB", np.arange(3), NAMES).changes == ()


def test_the_next_hit_goes_round_both_ways():
    hits = np.array([[False, True], [False, False], [True, False]])
    assert next_hit(hits, (0, 0)) == (0, 1)
    assert next_hit(hits, (0, 1)) == (2, 0)
    assert next_hit(hits, (2, 0)) == (0, 1)
    assert next_hit(hits, (0, 1), is_backwards=True) == (2, 0)
    assert next_hit(hits, (2, 0), is_backwards=True) == (0, 1)
    assert next_hit(hits & False, (0, 0)) is None
