"""The answer to a query: numbers, assets and bits of the same rows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb import bitmask
from contextdb.compiled.matches import Answering, Matches, SetMatches

N_ROWS = 130
TABLE = Answering([f"Anim_{r % 100}" for r in range(N_ROWS)])
ROWS = st.sets(st.integers(0, N_ROWS - 1)) | st.integers(0, N_ROWS).map(lambda n: set(range(n)))


def matches_of(rows: set[int]) -> Matches:
    return Matches(sum(1 << r for r in rows), TABLE)


@given(ROWS)
def test_an_answer_tells_the_same_rows_in_every_form(rows):
    found, expected = matches_of(rows), sorted(rows)
    assert found.indices.dtype == np.int64
    assert found.indices.tolist() == found.rows.tolist() == expected
    assert found.assets == [f"Anim_{r % 100}" for r in expected]
    assert (found.mask.dtype, found.mask.shape) == (np.uint64, (3,))
    assert bitmask.rows(found.mask).tolist() == expected
    assert found.always.tolist() == found.mask.tolist()
    assert (len(found), bool(found)) == (len(rows), bool(rows))
    assert list(found) == [found[i] for i in range(len(found))] == found[:] == found.assets
    assert [asset for asset in TABLE.assets if asset in found] == [a for a in TABLE.assets if a in found.assets]
    assert found.to_polars().rows() == list(zip(expected, found.assets, strict=True))


@pytest.mark.parametrize("count", [0, 1, 2, 47, 48, 49, 50, 130])
def test_few_rows_and_many_rows_are_read_off_alike(count):
    rows = set(range(N_ROWS - count, N_ROWS))
    assert matches_of(rows).indices.tolist() == sorted(rows)


def test_a_row_number_is_no_asset():
    found = matches_of({3, 100})
    assert 3 not in found
    assert np.int64(100) not in found


def test_answers_are_equal_when_their_rows_are():
    assert matches_of({1, 2}) == matches_of({2, 1})
    assert matches_of({1}) != matches_of({2})
    assert matches_of({1}) != Matches(2, Answering(["a", "b"]))
    assert matches_of({1}) != {1}


def test_an_answer_shows_how_many_rows_it_holds():
    assert repr(matches_of({1, 2})) == "<Matches: 2 of 130 rows>"


def test_the_answer_to_sets_tells_the_rows_that_always_match():
    found = SetMatches(0b111, TABLE, 0b10)
    assert found.indices.tolist() == [0, 1, 2]
    assert bitmask.rows(found.always).tolist() == [1]


def test_the_row_numbers_that_answers_share_cannot_be_written_to():
    found = matches_of({5})
    with pytest.raises(ValueError, match="read-only"):
        found.indices[0] = 6


def test_an_answer_of_a_table_without_rows_is_empty():
    found = Matches(0, Answering([]))
    assert (found.indices.tolist(), found.assets, found.mask.shape, bool(found)) == ([], [], (0,), False)
