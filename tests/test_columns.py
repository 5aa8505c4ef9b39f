"""A column of texts: whatever is done to it, it reads like a list of texts, and the column before it stays as it was."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from contextdb.columns import TextColumn

TEXTS = st.lists(st.sampled_from(["Any", "", "0..5", "CB", "ü"]) | st.text(max_size=3), max_size=12)


def assert_reads_as(column: TextColumn, texts: list[str]) -> None:
    assert column.to_list() == texts
    assert [column[row] for row in range(column.n_rows)] == texts
    assert len(set(column.texts)) == len(column.texts)
    assert column.codes.dtype == np.int32


@given(TEXTS)
def test_a_column_reads_as_the_texts_it_was_made_of(texts):
    column = TextColumn.of("speed", texts)
    assert (column.name, column.n_rows) == ("speed", len(texts))
    assert_reads_as(column, texts)


@given(TEXTS.filter(len), st.text(max_size=3), st.data())
def test_a_changed_text_changes_one_row_of_a_new_column(texts, text, data):
    row = data.draw(st.integers(0, len(texts) - 1))
    column = TextColumn.of("speed", texts)
    assert_reads_as(column.with_text(row, text), [*texts[:row], text, *texts[row + 1 :]])
    assert_reads_as(column, texts)


@given(TEXTS, TEXTS, st.data())
def test_new_rows_stand_before_the_row_they_are_put_at(texts, more, data):
    row = data.draw(st.integers(0, len(texts)))
    column = TextColumn.of("speed", texts)
    assert_reads_as(column.with_inserted(row, more), texts[:row] + more + texts[row:])
    assert_reads_as(column, texts)


@given(TEXTS.filter(len), st.data())
def test_taken_rows_come_in_the_order_given(texts, data):
    rows = data.draw(st.lists(st.integers(0, len(texts) - 1), max_size=8))
    taken = TextColumn.of("speed", texts).with_rows_taken(np.array(rows, np.int64))
    assert_reads_as(taken, [texts[row] for row in rows])


def test_a_text_that_stands_often_is_kept_once():
    column = TextColumn.of("speed", ["Any", "0..5"] * 1000)
    assert column.texts == ("Any", "0..5")
    assert column.with_text(7, "Any").texts is column.texts


def test_a_renamed_column_shares_its_texts():
    column = TextColumn.of("speed", ["Any"])
    assert column.renamed("pace").name == "pace"
    assert column.renamed("pace").texts is column.texts
    assert column.name == "speed"
