"""Sets of rows as bits: the words, the integer and the list of rows say the same."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb import bitmask

FLAGS = st.binary(max_size=200).map(lambda octets: np.array([octet & 1 for octet in octets], np.bool_))


@pytest.mark.parametrize(("n_rows", "n_words"), [(0, 0), (1, 1), (63, 1), (64, 1), (65, 2), (128, 2), (129, 3)])
def test_a_mask_has_a_word_for_every_64_rows(n_rows, n_words):
    assert bitmask.n_words(n_rows) == n_words
    assert bitmask.pack(np.ones(n_rows, np.bool_)).shape == (n_words,)
    assert bitmask.full(n_rows).shape == (n_words,)


@given(FLAGS)
def test_every_form_of_a_mask_holds_the_same_rows(flags):
    words, expected, n_rows = bitmask.pack(flags), np.flatnonzero(flags), len(flags)
    assert bitmask.rows(words).tolist() == expected.tolist()
    assert bitmask.unpack(words, n_rows).tolist() == flags.tolist()
    assert bitmask.from_rows(expected, n_rows).tolist() == words.tolist()
    assert bitmask.count(words) == len(expected)
    assert bitmask.to_int(words) == sum(1 << r for r in expected.tolist())
    assert bitmask.from_int(bitmask.to_int(words), n_rows).tolist() == words.tolist()


@given(FLAGS)
def test_the_bits_past_the_last_row_are_0(flags):
    assert bitmask.to_int(bitmask.pack(flags)) < 1 << len(flags)
    assert bitmask.to_int(bitmask.full(len(flags))) == (1 << len(flags)) - 1


@given(st.lists(FLAGS.filter(len), min_size=1, max_size=4))
def test_masks_in_an_array_are_packed_and_counted_one_by_one(parts):
    n_rows = min(map(len, parts))
    flags = np.array([part[:n_rows] for part in parts])
    words = bitmask.pack(flags)
    assert words.tolist() == [bitmask.pack(part).tolist() for part in flags]
    assert bitmask.count(words).tolist() == flags.sum(axis=1).tolist()
    assert bitmask.unpack(words, n_rows).tolist() == flags.tolist()


def test_the_types_are_those_that_kernels_and_games_expect():
    words = bitmask.from_rows(np.array([3, 70]), 100)
    assert bitmask.rows(words).dtype == np.int64
    assert bitmask.count(words[None]).dtype == np.int64
    assert bitmask.from_int(8, 100).dtype == np.uint64
    assert bitmask.unpack(words, 100).dtype == np.bool_


def test_a_mask_of_a_slice_of_an_array_is_read_like_any_other():
    grid = bitmask.pack(np.eye(130, dtype=np.bool_))
    column = np.asfortranarray(grid)[64]
    assert bitmask.rows(column).tolist() == [64]
    assert bitmask.to_int(grid[::2][32]) == 1 << 64
