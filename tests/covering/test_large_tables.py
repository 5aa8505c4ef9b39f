"""Tables that are too large to compare every row: what is left out is said, and what is found holds all the same."""

import random
from functools import reduce
from operator import add, or_

import numpy as np
import pytest
from brute import nearest_row, random_boxes, random_table
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import contextdb as cdb
from contextdb import bitmask
from contextdb.cells.domains import Domain
from contextdb.cells.grammar import ValueSet
from contextdb.checks.run import check_rows
from contextdb.compiled.table import data_of
from contextdb.covering import coverage, pairs
from contextdb.covering.assumed import opened
from contextdb.covering.count import _share
from contextdb.covering.factors import ValueFactor
from contextdb.covering.gaps import NearRows, find_gaps
from contextdb.covering.sample import samples_of
from contextdb.covering.space import SMALLEST, Space, comparable_rows, weight_of
from contextdb.covering.witness import BoxSet
from contextdb.errors import TableError
from contextdb.schema import TableSettings

CELLS = ("True", "False", "Any")


def table_of(rows: list[tuple[str, ...]], policy: str = "first") -> cdb.Table:
    columns = {"Asset": [f"A{r}" for r in range(len(rows))]}
    columns |= {f"c{i}": [row[i] for row in rows] for i in range(3)}
    settings = TableSettings("table", policy=policy)  # type: ignore[arg-type]
    return cdb.Table.from_columns(columns, {f"c{i}": {"type": "bool"} for i in range(3)}, settings)


@examples(1)
@given(st.lists(st.tuples(*[st.sampled_from(CELLS)] * 3), min_size=3, max_size=9), st.sampled_from(["first", "unique"]))
def test_a_check_of_the_first_rows_finds_what_a_table_of_them_alone_has(rows: list[tuple[str, ...]], policy: str):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("contextdb.covering.space.MOST_COMPARED", 3 * len(rows[:-1]) ** 2)
        found = check_rows(table_of(rows, policy))
    alone = check_rows(table_of(rows[:-1], policy))
    left = [f for f in found if f.rule == "undecided-rows"]
    assert [(f.rule, f.row, f.by) for f in found if f.row is not None] == [
        (f.rule, f.row, f.by) for f in alone if f.row is not None
    ]
    assert len(left) == 1
    assert f"the last 1 of {len(rows)} rows" in left[0].message


def test_coverage_of_a_large_table_says_that_the_last_rows_are_not_compared(monkeypatch: pytest.MonkeyPatch):
    table = table_of([("True", "Any", "Any"), ("True", "True", "Any"), ("True", "True", "True")])
    whole = coverage(table)
    monkeypatch.setattr("contextdb.covering.space.MOST_COMPARED", 3 * 2**2)
    cut = coverage(table)
    assert (whole.covered, whole.findings_complete) == (0.5, True)
    assert (cut.covered, cut.findings_complete) == (0.5, False)
    assert {f.row for f in cut.findings} == {None, 1}


def test_rows_whose_bits_would_not_fit_are_cut_by_a_check_and_refused_where_all_are_compared(monkeypatch: pytest.MonkeyPatch):
    table = table_of([("True", "Any", "False")] * 16)
    monkeypatch.setattr("contextdb.covering.space.MOST_HELD", 24)
    assert comparable_rows(data_of(table.compile())) == 8
    assert "undecided-rows" in {f.rule for f in check_rows(table)}
    with pytest.raises(TableError, match="too large to compare its rows with each other: 16 rows x 3 different cells"):
        opened(table)


@examples(2)
@given(st.integers(0, 2**32), st.integers(1, 60), st.sampled_from([0, 100_000]))
def test_rows_whose_bits_would_not_fit_are_sampled_some_at_a_time(seed: int, most_held: int, most_contexts: int):
    table = random_table(random.Random(seed))
    exact = coverage(table)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("contextdb.covering.sample.MOST_CONTEXTS", most_contexts)
        at_once, pairs_at_once = coverage(table, samples=4000), pairs(table, samples=500)
        patch.setattr("contextdb.covering.space.MOST_HELD", most_held)
        cut = coverage(table, samples=4000)
        assert pairs(table, samples=500).to_json() == pairs_at_once.to_json()
    assert cut.certain[0] - 1e-9 <= exact.covered <= cut.certain[1] + 1e-9
    assert cut.covered == pytest.approx(exact.covered, abs=0.05)
    assert (cut.overlap, cut.hits) == (at_once.overlap, at_once.hits)
    assert not cut.crowded or cut.crowded[0].n_rows == len(cut.overlap.histogram) - 1
    if most_contexts:
        assert any(gap.share for gap in cut.gaps) == any(gap.share for gap in exact.gaps)
    else:
        assert {gap.id for gap in cut.gaps} <= {gap.id for gap in at_once.gaps}


@given(st.sets(st.integers(0, 300)))
def test_the_bits_of_rows_are_those_rows(rows: set[int]):
    assert bitmask.int_of(sorted(rows)) == reduce(or_, (1 << row for row in rows), 0)


@given(st.sets(st.sampled_from("abcdef")), st.booleans(), st.sampled_from(["enum", "text"]))
def test_the_classes_of_a_set_are_those_of_the_values_it_holds(values: set[str], is_complement: bool, kind: str):
    names = ("a", "b", "c", "d")
    accepts = ValueSet(frozenset(values), is_complement)
    domain = Domain("enum", names) if kind == "enum" else Domain("text")
    factor = ValueFactor.of([ValueSet(frozenset(names))], domain)
    held = {k for k, value in enumerate(factor.values) if accepts.holds(value)}
    held |= {len(factor.values)} if kind == "text" and is_complement else set()
    assert factor.classes(accepts) == bitmask.int_of(sorted(held))


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=40), st.data())
def test_a_weight_is_the_sum_of_its_classes_to_the_last_bit(weights: list[float], data: st.DataObject):
    factor = ValueFactor(tuple(map(str, range(len(weights)))), False, np.array(weights))
    side = data.draw(st.integers(0, (1 << len(weights)) - 1))
    one_by_one = reduce(add, (w for k, w in enumerate(weights) if side >> k & 1), 0.0)
    assert weight_of(factor, side) == _share(side, np.array(weights)) == one_by_one


@given(st.integers(0, 300), st.data())
def test_the_flags_of_bits_are_those_bits(n_rows: int, data: st.DataObject):
    bits = data.draw(st.integers(0, (1 << n_rows) - 1))
    assert bitmask.flags_of(bits, n_rows).tolist() == [bool(bits >> row & 1) for row in range(n_rows)]


@given(st.integers(0, 2**32))
def test_boxes_added_one_by_one_answer_as_those_given_at_once(seed: int):
    space = Space.of(data_of(random_table(random.Random(seed)).compile()))
    at_once, one_by_one = BoxSet.of(space.full, space.boxes), BoxSet.of(space.full, ())
    for box in space.boxes:
        one_by_one.add(box)
    assert (one_by_one.rejects, one_by_one.restricts, one_by_one.n_boxes) == (at_once.rejects, at_once.restricts, at_once.n_boxes)


@examples(2)
@given(st.integers(0, 2**32))
def test_the_nearest_row_has_fewest_cells_that_do_not_hold_the_gap_and_is_the_first_of_equals(seed: int):
    rng = random.Random(seed)
    table = random_table(rng)
    compiled = data_of(table.compile())
    space = Space.of(compiled, random_boxes(rng, table))
    near = NearRows(space, compiled)
    for box in find_gaps(space, (), 20, 1000).boxes:
        nearest = near.nearest(space.sides_of(box))
        assert (nearest is None) == (not space.boxes)
        if nearest is not None:
            i, failing = nearest_row(space, box)
            assert (nearest.row, nearest.n_changes) == (space.rows[i], len(failing))
            assert list(nearest.cells) == [space.conditions[at].name for at in failing]


def test_a_table_of_very_many_conditions_is_measured_and_says_how_many_samples_it_drew():
    n = 2000
    columns = {f"c{i}": ["True", "False" if i == 7 else "Any"] for i in range(n)}
    table = cdb.Table.from_columns({"Asset": ["A", "B"], **columns}, {f"c{i}": {"type": "bool"} for i in range(n)})
    report = coverage(table, samples=1000, max_gaps=3)
    assert (report.covered, report.n_samples) == (0.5, 1000)
    assert [(gap.share, gap.new_share, gap.is_exact) for gap in report.gaps] == [
        (0.25, 0.25, True),
        (0.25, 0.125, True),
        (0.25, 0.0625, True),
    ]
    assert all(gap.cells["c7"] == "True" and "False" in gap.cells.values() and len(gap.cells) == 2 for gap in report.gaps)
    assert {(gap.nearest.row, gap.nearest.n_changes) for gap in report.gaps if gap.nearest} == {(1, 1)}
    assert report.hits == (SMALLEST, 0.5)


def test_as_many_samples_are_drawn_as_were_asked_for_and_else_fewer_of_very_many_conditions():
    columns = {f"c{i}": ["True", "False" if i == 7 else "Any"] for i in range(2000)}
    table = cdb.Table.from_columns({"Asset": ["A", "B"], **columns}, {name: {"type": "bool"} for name in columns})
    space = opened(table).space
    assert (samples_of(1000, 200_000, space), samples_of(None, 200_000, space)) == (1000, 50_000)
