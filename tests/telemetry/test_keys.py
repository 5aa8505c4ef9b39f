"""Keys of contexts: exact, and counted well when there are many."""

import numpy as np
import pytest

from contextdb import bitmask
from contextdb.compiled.many import rows_of
from contextdb.core import pack_codes, unpack_codes
from contextdb.telemetry import facts_read
from contextdb.telemetry.observe_file import SmallestHashes, SmallestKeys
from contextdb.telemetry.parts import MOST_HASHES


@pytest.fixture
def words():
    """3,000 keys of two words, of which most are there several times."""
    return np.random.default_rng(0).integers(0, 30, (2, 3000)).astype(np.uint64)


def summed(words, grouped):
    _, first, sums = grouped
    return {tuple(words[:, i].tolist()): int(n) for i, n in zip(first, sums, strict=True)}


def test_grouping_sums_the_moments_of_equal_contexts_and_leaves_out_those_of_none(words):
    moments = np.random.default_rng(1).integers(0, 2, 3000)
    expected: dict[tuple[int, ...], int] = {}
    for key, n in zip(words.T.tolist(), moments.tolist(), strict=True):
        if n:
            expected[tuple(key)] = expected.get(tuple(key), 0) + n
    assert summed(words, facts_read.grouped(words, moments)) == expected


def test_contexts_of_one_hash_are_still_told_apart(words, monkeypatch):
    monkeypatch.setattr(facts_read, "hashes_of", lambda words: np.full(words.shape[1], 7, np.uint64))
    _, first, sums = facts_read.grouped(np.ascontiguousarray(words[:, :300]), np.ones(300, np.int64))
    assert len(first) == len(np.unique(words[:, :300], axis=1).T)
    assert sums.sum() == 300


def test_of_no_contexts_there_are_no_groups(words):
    assert [len(part) for part in facts_read.grouped(words, np.zeros(3000, np.int64))] == [0, 0, 0]


def test_a_key_has_a_hash_that_stays_the_same_on_every_machine():
    words = np.array([[0, 1, 2**64 - 1], [5, 5, 5]], np.uint64)
    assert facts_read.hashes_of(words).tolist() == [4517933670823692284, 12773366489153039575, 3846658174030194800]


def test_codes_come_out_of_keys_as_they_were_put_in(words):
    rng = np.random.default_rng(6)
    fields = ((0, 0, 5, 1), (0, 5, 31, 0), (0, 36, 28, 7), (1, 63, 1, -1))
    codes = np.stack([rng.integers(first, first + (1 << bits), 400) for _, _, bits, first in fields]).astype(np.int32)
    packed, rows = np.zeros((2, 400), np.uint64), rng.integers(0, 400, 90).astype(np.int32)
    for field, own in zip(fields, codes, strict=True):
        pack_codes(own, field, packed)
    unpacked = np.empty((4, 90), np.int32)
    unpack_codes(packed, rows, fields, unpacked)
    assert np.array_equal(unpacked, codes[:, rows])


@pytest.mark.parametrize("field", [(2, 0, 3, 0), (-1, 0, 3, 0), (0, 62, 3, 0), (0, 0, 0, 0), (0, -1, 3, 0), (0, 0, 32, 0)])
def test_a_field_that_no_key_has_is_refused(field):
    with pytest.raises(ValueError, match="no such field"):
        pack_codes(np.zeros(3, np.int32), field, np.zeros((2, 3), np.uint64))


def test_rows_that_are_not_there_are_refused(words):
    with pytest.raises(ValueError, match="out of range"):
        unpack_codes(words, np.array([3000], np.int32), ((0, 0, 3, 0),), np.zeros((1, 1), np.int32))


@pytest.mark.parametrize("n_rows", [1, 64, 130])
def test_rows_are_listed_mask_after_mask(n_rows):
    flags = np.random.default_rng(n_rows).random((3000, n_rows)) < 0.2
    assert rows_of(bitmask.pack(flags)).tolist() == np.nonzero(flags)[1].tolist()


def test_the_smallest_hashes_are_kept_however_they_come():
    hashes = np.random.default_rng(3).integers(0, 5000, 20_000).astype(np.uint64)
    expected = np.unique(hashes)
    for most in (100, 10_000):
        kept = SmallestHashes(most)
        for start in range(0, 20_000, 700):
            kept.add(np.unique(hashes[start : start + 700]))
        found, is_full = kept.settled()
        assert found.tolist() == expected[:most].tolist()
        assert is_full is (len(expected) > most)


def test_contexts_of_the_smallest_hashes_have_all_their_moments():
    rng = np.random.default_rng(4)
    hashes, moments = rng.integers(0, 500, 8000).astype(np.uint64), rng.integers(1, 9, 8000)
    expected = [(int(h), int(moments[hashes == h].sum())) for h in np.unique(hashes)[:40]]
    kept = SmallestKeys(40, 1)
    for start in range(0, 8000, 64):
        at = np.unique(hashes[start : start + 64], return_index=True)[1]
        here = hashes[start : start + 64]
        sums = np.array([moments[start : start + 64][here == here[i]].sum() for i in at])
        kept.add(here[at], here[None], at.astype(np.int32), sums)
    found, words, sums, has_all = kept.settled()
    assert not has_all
    assert list(zip(found.tolist(), sums.tolist(), strict=True)) == expected
    assert words[0].tolist() == found.tolist()


def test_more_contexts_than_are_kept_are_estimated_within_two_percent():
    hashes = facts_read.hashes_of(np.arange(500_000, dtype=np.uint64)[None])
    kept = np.sort(hashes)[:MOST_HASHES]
    assert facts_read.estimated(kept, True) == pytest.approx(500_000, rel=0.02)
    assert facts_read.estimated(kept[:10], False) == 10
