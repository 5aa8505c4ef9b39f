"""Crowded contexts: the rows named are those valid there, and no context of a small table has more."""

import random

import pytest
from brute import Brute, random_boxes, random_table
from hypothesis import example, given
from hypothesis import strategies as st
from strategies import examples

import contextdb as cdb
from contextdb.covering import coverage, engine

SEEDS = st.integers(0, 2**32)


@examples(2)
@given(SEEDS)
def test_the_fullest_contexts_of_a_small_table_are_found(seed):
    rng = random.Random(seed)
    table = random_table(rng)
    brute = Brute(table, random_boxes(rng, table))
    counts = [len(rows) for (_, measure), rows in zip(brute.contexts, brute.valid, strict=True) if measure]
    crowds = coverage(table, impossible=brute.impossible).crowded
    most = max(counts, default=0)
    assert (crowds[0].n_rows if crowds else 0) == (most if most > 1 else 0)
    assert [c.n_rows for c in crowds] == sorted((c.n_rows for c in crowds), reverse=True)


@examples(2)
@given(SEEDS)
@example(3544)  # a cell that excludes a conjunction of tags
def test_all_rows_of_a_crowd_are_valid_in_each_of_its_contexts(seed):
    rng = random.Random(seed)
    table = random_table(rng, most_rows=12)
    brute = Brute(table, random_boxes(rng, table))
    for crowd in coverage(table, impossible=brute.impossible).crowded:
        inside = brute.inside(crowd.cells)
        assert crowd.share == pytest.approx(brute.share(inside), abs=1e-9)
        assert crowd.share > 0.0
        held = [rows for rows, flag in zip(brute.valid, inside, strict=True) if flag]
        assert all(set(crowd.rows) <= rows for rows in held)
        assert min(map(len, held)) == crowd.n_rows


def test_crowds_are_found_in_a_table_too_large_to_go_through():
    names = [f"b{i}" for i in range(30)]
    columns = {name: ["True" if i == r else "Any" for r in range(20)] for i, name in enumerate(names)}
    table = cdb.Table.from_columns({"Asset": ["A"] * 20, **columns}, {name: {"type": "bool"} for name in names})
    [crowd] = coverage(table, samples=200).crowded
    assert crowd.rows == tuple(range(20))
    assert crowd.cells == {f"b{i}": "True" for i in range(20)}


def test_contexts_are_climbed_from_as_far_as_their_work_goes(monkeypatch: pytest.MonkeyPatch):
    names = [f"b{i}" for i in range(30)]
    columns = {name: ["True" if i == r else "Any" for r in range(20)] for i, name in enumerate(names)}
    table = cdb.Table.from_columns({"Asset": ["A"] * 20, **columns}, {name: {"type": "bool"} for name in names})
    climbs: list[tuple[int, ...]] = []
    real = engine._climbed
    monkeypatch.setattr(engine, "_climbed", lambda *given: climbs.append(given[-1]) or real(*given))
    monkeypatch.setattr(engine, "MOST_CLASSES", 0)
    assert coverage(table, samples=200).crowded[0].rows == tuple(range(20))
    assert len(climbs) == engine.MOST_CROWDS
