"""Unions of intervals: every operation against what it does to single numbers, at the bounds and the doubles beside them."""

import math
from itertools import pairwise

import oracles
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st

from contextdb.cells.intervals import (
    CIRCLE,
    EVERYTHING,
    Span,
    Spans,
    above,
    arc,
    below,
    complement,
    holds,
    union,
    whole,
    wrap_angle,
)

EDGES = [-math.inf, -1.0, -5e-324, -0.0, 0.0, 5e-324, 0.1 + 0.2, 1.0, 5.0, 2.0**53, 1e308, math.inf]
LINE = st.sampled_from(EDGES) | st.floats(-9.0, 9.0)
SPANS = st.lists(st.tuples(LINE, LINE), max_size=5)
DEGREES = st.sampled_from([0.0, -0.0, 90.0, 179.5, 180.0, 185.0, 360.0, 365.0, 540.0, 1e-20, 720.0]) | st.floats(-800.0, 800.0)
ENDS = DEGREES | DEGREES.map(lambda angle: -angle)


def arcs_from(low: float) -> st.SearchStrategy[Span]:
    """Arcs to anywhere, and all round to where they began, as near as doubles come to it."""
    return st.tuples(st.just(low), ENDS | st.sampled_from([low, low + 180.0, low + 360.0, low - 360.0]))


def near(spans: list[Span]) -> list[float]:
    """Every bound, and the doubles beside it."""
    return [math.nextafter(b, to) for span in spans for b in span for to in (-math.inf, b, math.inf)] + [-math.inf, 0.0, math.inf]


def is_held(spans: list[Span], value: float) -> bool:
    return any(low <= value <= high for low, high in spans)


def assert_canonical(spans: Spans) -> None:
    assert all(low <= high for low, high in spans)
    assert all(above(first[1]) < second[0] for first, second in pairwise(spans))
    assert not any(str(bound) == "-0.0" for span in spans for bound in span)


@given(SPANS)
def test_a_union_holds_what_any_of_its_spans_holds(spans):
    joined = union(spans)
    assert_canonical(joined)
    assert [holds(joined, v) for v in near(spans)] == [is_held(spans, v) for v in near(spans)]


@given(SPANS, st.randoms(use_true_random=False))
def test_a_union_is_the_same_in_any_order_and_of_itself(spans, random):
    shuffled = random.sample(spans, len(spans))
    assert union(shuffled) == union(spans) == union(union(spans))


@given(SPANS, st.tuples(LINE, LINE).map(sorted))
def test_a_complement_holds_what_the_set_does_not_within_its_bounds(spans, bounds):
    low, high = bounds
    rest = complement(union(spans), low, high)
    assert_canonical(rest)
    for value in near([*spans, (low, high)]):
        assert holds(rest, value) is (low <= value <= high and not is_held(spans, value))


@given(SPANS)
def test_the_complement_of_a_complement_is_the_set(spans):
    joined = union(spans)
    assert complement(complement(joined, *EVERYTHING[0]), *EVERYTHING[0]) == joined


@given(SPANS)
def test_the_whole_numbers_of_a_set_are_those_that_it_holds(spans):
    joined = union(spans)
    inner = whole(joined)
    assert all(bound == math.inf or bound == -math.inf or bound.is_integer() for span in inner for bound in span)
    assert all(first[1] + 1.0 < second[0] or above(first[1]) < second[0] for first, second in pairwise(inner))
    finite = [b for b in near(spans) if math.isfinite(b)]
    for value in {float(math.floor(b) + step) for b in finite for step in (-1, 0, 1, 2)} | {math.inf, -math.inf}:
        assert holds(inner, value) is holds(joined, value)


@given(ENDS.flatmap(arcs_from), st.booleans(), st.booleans(), ENDS)
@strategies.examples(5)
def test_an_arc_holds_the_angles_from_its_low_end_upwards_to_its_high_end(ends, is_low_open, is_high_open, angle):
    low, high = ends
    part = f"{'[('[is_low_open]}{low!r}..{high!r}{'])'[is_high_open]}"
    spans = arc(low, high, is_low_open, is_high_open)
    assert_canonical(spans)
    for value in [angle, *(math.nextafter(end, to) for end in (low, high) for to in (-math.inf, end, math.inf))]:
        assert holds(spans, wrap_angle(value)) is oracles.is_on_arc(part, value), value


@given(st.floats(-1e6, 1e6) | ENDS | st.floats(allow_nan=False, allow_infinity=False))
def test_wrapping_gives_exactly_the_same_angle_on_the_circle(degrees):
    assert wrap_angle(degrees) == oracles.wrapped(degrees)
    assert CIRCLE[0] <= wrap_angle(degrees) <= CIRCLE[1]


@given(SPANS)
def test_no_set_holds_nan(spans):
    assert not holds(union(spans), math.nan)


@pytest.mark.parametrize("value", [0.0, -0.0, 5e-324, -5e-324, 1.0, -1.0, 1.7976931348623157e308])
def test_one_up_and_one_down_is_the_same_number(value):
    assert below(above(value)) == above(below(value)) == value


def test_spans_that_touch_are_one_and_spans_a_double_apart_are_one():
    assert union([(0.0, 5.0), (5.0, 9.0)]) == ((0.0, 9.0),)
    assert union([(0.0, 5.0), (above(5.0), 9.0)]) == ((0.0, 9.0),)
    assert union([(0.0, below(5.0)), (above(5.0), 9.0)]) == ((0.0, below(5.0)), (above(5.0), 9.0))


def test_neighbouring_whole_numbers_are_one_span():
    assert whole(union([(0.5, 2.5), (2.75, 3.0), (5.0, 5.5)])) == ((1.0, 3.0), (5.0, 5.0))
