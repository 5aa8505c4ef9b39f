"""Keys of contexts: the same with and without compiled kernels, exact, and counted well when there are many."""

from __future__ import annotations

import math

import numpy as np
import polars as pl
import pytest

from contextdb import bitmask
from contextdb.table import Table
from contextdb.telemetry import keys, observe, observe_file
from contextdb.telemetry.number_classes import NumberClasses
from contextdb.telemetry.parts import MOST_HASHES
from contextdb.telemetry.smallest import SmallestHashes, SmallestKeys

EDGES = [-math.inf, -1.7e308, -1e300, -3.0, -1.0, 0.0, 5e-324, 1e-300, 1.0, 2.0, 3.5, 72.0, 1e16, 1e300, 1.7e308, math.inf]


@pytest.fixture
def words():
    """3,000 keys of two words, of which most are there several times."""
    return np.random.default_rng(0).integers(0, 30, (2, 3000)).astype(np.uint64)


@pytest.fixture
def without_numba(monkeypatch):
    monkeypatch.setattr(keys, "load_kernels", lambda: None)
    monkeypatch.setattr(observe_file, "load_kernels", lambda: None)


def added(facts, bounds):
    word = np.zeros(len(facts), np.uint64)
    keys.add_numbers(facts, NumberClasses.of(bounds), 3, word)
    assert not (word & np.uint64(7)).any()
    return (word >> np.uint64(3)).tolist()


@pytest.mark.parametrize("seed", range(50))
def test_the_class_of_a_number_is_what_bisection_finds(seed):
    rng = np.random.default_rng(seed)
    chosen = np.array(EDGES)[rng.random(len(EDGES)) < rng.random()]
    bounds = np.unique(np.concatenate([chosen, rng.integers(-40, 40, rng.integers(0, 20)) * rng.choice([1e-3, 1.0, 1e9])]))
    near = np.concatenate([np.nextafter(bounds, -math.inf), bounds, np.nextafter(bounds, math.inf)])
    facts = np.concatenate([near, EDGES, rng.normal(0, 30, 300)])
    assert added(np.append(facts, math.nan), bounds) == [*np.searchsorted(bounds, facts, "right").tolist(), len(bounds) + 1]


def test_bounds_well_apart_need_no_bisection_and_very_near_ones_do():
    assert len(NumberClasses.of(np.arange(72.0)).before)
    assert not len(NumberClasses.of(np.array([0.0, 1e-9, 1e9])).before)


def test_without_numba_keys_and_their_groups_are_the_same(words, without_numba, monkeypatch):
    moments = np.arange(3000) % 4
    plain, facts = keys.grouped(words, moments), np.array([math.nan, 0.5, 3.0])
    hashes, classes = keys.hashes_of(words), added(facts, np.array([0.5, 2.0]))
    monkeypatch.undo()
    assert np.array_equal(keys.hashes_of(words), hashes)
    assert added(facts, np.array([0.5, 2.0])) == classes == [3, 1, 2]
    assert summed(words, keys.grouped(words, moments)) == summed(words, plain)


def summed(words, grouped):
    _, first, sums = grouped
    return {tuple(words[:, i].tolist()): int(n) for i, n in zip(first, sums, strict=True)}


def test_grouping_sums_the_moments_of_equal_contexts_and_leaves_out_those_of_none(words):
    moments = np.random.default_rng(1).integers(0, 2, 3000)
    expected: dict[tuple[int, ...], int] = {}
    for key, n in zip(words.T.tolist(), moments.tolist(), strict=True):
        if n:
            expected[tuple(key)] = expected.get(tuple(key), 0) + n
    assert summed(words, keys.grouped(words, moments)) == expected


@pytest.mark.parametrize("engine", ["numba", "numpy"])
def test_contexts_of_one_hash_are_still_told_apart(engine, words, monkeypatch):
    if engine == "numpy":
        monkeypatch.setattr(keys, "load_kernels", lambda: None)
    monkeypatch.setattr(keys, "hashes_of", lambda words: np.full(words.shape[1], 7, np.uint64))
    _, first, sums = keys.grouped(words[:, :300], np.ones(300, np.int64))
    assert len(first) == len(np.unique(words[:, :300], axis=1).T)
    assert sums.sum() == 300


@pytest.mark.parametrize("engine", ["numba", "numpy"])
def test_of_no_contexts_there_are_no_groups(engine, words, monkeypatch):
    if engine == "numpy":
        monkeypatch.setattr(keys, "load_kernels", lambda: None)
    assert [len(part) for part in keys.grouped(words, np.zeros(3000, np.int64))] == [0, 0, 0]


def test_without_numba_everything_observed_is_the_same(tmp_path, without_numba, monkeypatch):
    table = Table.from_columns(
        {"Asset": ["a", "b", "c"], "speed": ["0..2", "4..5", "Any"], "tags": ["+A", "Any", "not +B"], "mode": ["x", "Any", "y"]},
        {"speed": {"type": "number"}, "tags": {"type": "tags", "values": ["A", "B"]}, "mode": {"type": "text"}},
    )
    rng = np.random.default_rng(2)
    speed, tags = rng.integers(0, 12, 500) / 2.0, [[t for t in "AB" if rng.random() < 0.5] for _ in range(500)]
    frame = pl.DataFrame({"speed": speed, "tags": tags, "mode": rng.choice(["x", "y", "z"], 500)})
    frame.with_columns(pl.when(pl.col("speed") < 5.5).then("speed")).write_parquet(tmp_path / "a.parquet")
    plain = observe(table, tmp_path / "a.parquet")
    monkeypatch.undo()
    assert observe(table, tmp_path / "a.parquet") == plain


@pytest.mark.parametrize("n_rows", [1, 64, 130])
def test_rows_are_listed_mask_after_mask_with_and_without_numba(n_rows, monkeypatch):
    flags = np.random.default_rng(n_rows).random((3000, n_rows)) < 0.2
    expected = np.nonzero(flags)[1].tolist()
    assert keys.rows_of(bitmask.pack(flags)).tolist() == expected
    monkeypatch.setattr(keys, "load_kernels", lambda: None)
    assert keys.rows_of(bitmask.pack(flags)).tolist() == expected


def test_the_smallest_hashes_are_kept_however_they_come():
    hashes = np.random.default_rng(3).integers(0, 5000, 20_000).astype(np.uint64)
    expected = np.unique(hashes)
    for most in (100, 10_000):
        kept = SmallestHashes(most)
        for start in range(0, 20_000, 700):
            kept.add(np.unique(hashes[start : start + 700]))
        found, is_full = kept.found()
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
    found, words, sums, has_all = kept.found()
    assert not has_all
    assert list(zip(found.tolist(), sums.tolist(), strict=True)) == expected
    assert words[0].tolist() == found.tolist()


def test_more_contexts_than_are_kept_are_estimated_within_two_percent():
    hashes = keys.hashes_of(np.arange(500_000, dtype=np.uint64)[None])
    kept = np.sort(hashes)[:MOST_HASHES]
    assert keys.estimated(kept, True) == pytest.approx(500_000, rel=0.02)
    assert keys.estimated(kept[:10], False) == 10
