"""Keys of contexts: the same with and without compiled kernels, and counted well when there are many."""

from __future__ import annotations

import numpy as np
import pytest

from contextdb import bitmask
from contextdb.telemetry import keys


@pytest.fixture
def codes():
    return np.random.default_rng(0).integers(-1, 9, (3000, 5)).astype(np.int32)


def test_without_numba_hashes_are_the_same(codes, monkeypatch):
    compiled = keys.row_hashes(codes)
    monkeypatch.setattr(keys, "_kernels", lambda: None)
    assert np.array_equal(keys.row_hashes(codes), compiled)


def test_without_numba_hits_are_the_same(monkeypatch):
    rng = np.random.default_rng(1)
    flags = rng.random((50, 130)) < 0.1
    moments = rng.integers(0, 1 << 40, 50)
    with_numba, without = np.zeros(192, np.int64), np.zeros(192, np.int64)
    keys.add_hits(bitmask.pack(flags), moments, with_numba)
    monkeypatch.setattr(keys, "_kernels", lambda: None)
    keys.add_hits(bitmask.pack(flags), moments, without)
    assert with_numba.tolist() == without.tolist() == [*(moments @ flags).tolist(), *[0] * 62]


def test_grouping_sums_the_moments_of_equal_contexts(codes):
    moments = np.arange(len(codes))
    _, first, sums = keys.grouped(codes, moments)
    expected: dict[tuple[int, ...], int] = {}
    for code, n in zip(codes.tolist(), moments.tolist(), strict=True):
        expected[tuple(code)] = expected.get(tuple(code), 0) + n
    assert {tuple(codes[i].tolist()): int(n) for i, n in zip(first, sums, strict=True)} == expected


def test_contexts_of_one_hash_are_still_told_apart(codes, monkeypatch):
    monkeypatch.setattr(keys, "row_hashes", lambda rows: np.zeros(len(rows), np.uint64))
    _, first, sums = keys.grouped(codes, np.ones(len(codes), np.int64))
    assert len(first) == len(np.unique(codes, axis=0))
    assert sums.sum() == len(codes)


def test_more_contexts_than_are_kept_are_estimated_within_two_percent():
    hashes = keys.row_hashes(np.arange(500_000, dtype=np.int32)[:, None])
    kept = keys.smallest(hashes)
    assert len(kept) == keys.MOST_HASHES
    assert keys.estimated(kept, True) == pytest.approx(500_000, rel=0.02)
    assert keys.estimated(kept[:10], False) == 10
