"""The two ways of answering questions about boxes agree, and the count with the simplest one there is."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import contextdb as cdb
from contextdb.checks.run import check_rows
from contextdb.covering.count import uncovered_share
from contextdb.covering.factors import ValueFactor
from contextdb.covering.judge import AHEAD
from contextdb.covering.points import MANY, Questions
from contextdb.covering.progress import Cancelled, Progress
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import BoxSet, Steps

SIZES = (2, 2, 3, 4, 2, 3)
FULL: Box = tuple((1 << n) - 1 for n in SIZES)
BOXES = st.tuples(*(st.one_of(st.just(full), st.integers(1, full)) for full in FULL))
MANY_BOXES = st.lists(BOXES, min_size=1, max_size=70)


def space_of(boxes: list[Box], weights: list[list[float]]) -> Space:
    """A space of enums of these weights."""
    parts = [np.array(own) / sum(own) for own in weights]
    factors = tuple(ValueFactor(tuple(f"v{k}" for k in range(len(own))), False, own) for own in parts)
    return Space((), factors, (), tuple(range(len(boxes))), tuple(boxes), ())


def open_share(space: Space) -> float:
    """The share that no box holds, context by context."""
    left = 0.0
    for point in product(*(range(n) for n in SIZES)):
        if not any(all(side >> k & 1 for side, k in zip(box, point, strict=True)) for box in space.boxes):
            left += float(np.prod([f.weights[k] for f, k in zip(space.factors, point, strict=True)]))
    return left


WEIGHTS = st.tuples(*(st.lists(st.sampled_from([0.0, 1.0, 1.0, 2.0]), min_size=n, max_size=n).filter(any) for n in SIZES))


@examples(1.5)
@given(boxes=MANY_BOXES, weights=WEIGHTS)
def test_the_count_is_that_of_going_through_every_context(boxes, weights):
    space = space_of(boxes, list(weights))
    found, expected = uncovered_share(space, space.boxes, 40_000_000), open_share(space)
    assert found.is_exact
    assert found.lower == pytest.approx(expected, abs=1e-12)
    assert (found.lower == 0.0) == (expected == 0.0)


@examples(0.6)
@given(boxes=MANY_BOXES, weights=WEIGHTS, work=st.integers(0, 3000))
def test_a_count_that_is_cut_anywhere_gives_bounds_that_hold_the_share(boxes, weights, work):
    space = space_of(boxes, list(weights))
    found, expected = uncovered_share(space, space.boxes, work), open_share(space)
    assert found.lower - 1e-12 <= expected <= found.upper + 1e-12
    assert found == uncovered_share(space, space.boxes, work)


@examples(1.5)
@given(boxes=MANY_BOXES, box=BOXES)
def test_whether_boxes_hold_another_is_the_same_by_the_core_and_by_search(boxes, box):
    by = (1 << len(boxes)) - 1
    is_held, is_certain, _ = Questions(boxes, FULL).are_held(box, by, 1_000_000)
    point = BoxSet.of(FULL, boxes).outside(by, box, Steps(100_000))
    assert (is_held, is_certain) == (point is None, True)


@examples(1)
@given(boxes=MANY_BOXES)
def test_the_first_holder_of_each_box_is_that_of_comparing_all_pairs(boxes):
    def first(i: int) -> int:
        holders = (j for j, b in enumerate(boxes) if b != boxes[i] and all(x & ~y == 0 for x, y in zip(boxes[i], b, strict=True)))
        return next(holders, -1)

    assert Questions(boxes, FULL).holders(len(boxes)).tolist() == [first(i) for i in range(len(boxes))]


def test_boxes_are_read_until_it_is_time_to_stop():
    with pytest.raises(Cancelled):
        Questions([FULL], FULL, Progress(None, lambda: True)).are_held(FULL, 1, 1_000)


def test_a_question_without_steps_is_not_certain():
    boxes = [(1, 3, 7, 15, 3, 7), (3, 1, 7, 15, 3, 7), (2, 2, 7, 15, 3, 7)]
    assert Questions(boxes, FULL).are_held(FULL, 7, 0)[:2] == (False, False)


def test_what_is_prepared_for_many_rows_counts_as_work_that_is_told():
    n = MANY + 200
    columns = {"a": [f"{i % 37}..{i % 37 + 3}" for i in range(n)], "b": [f"{i % 41}..{i % 41 + 2}" for i in range(n)]}
    schema = {name: {"type": "number", "min": 0, "max": 50} for name in columns}
    told: list[float] = []
    check_rows(
        cdb.Table.from_columns({"Asset": [f"A{i}" for i in range(n)], **columns}, schema), progress=lambda _, s: told.append(s)
    )
    assert told == sorted(told)
    assert {AHEAD / 2, AHEAD} <= set(told)
