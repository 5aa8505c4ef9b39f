"""A ruler leads to the mask that a bisection finds."""

import math
from bisect import bisect_right

import pytest
from hypothesis import given
from hypothesis import strategies as st

import contextdb as cdb
from contextdb.compiled.ruler import FEWEST_BOUNDS, ruler_of

ROUND = st.integers(-3000, 3000).flatmap(lambda n: st.sampled_from([n / 2, n / 10, n * 5.0, n / 3]))
BOUNDS = st.lists(ROUND | st.floats(-1e9, 1e9) | st.floats(-1e-300, 1e-300), min_size=FEWEST_BOUNDS, unique=True)


def neighbours(bound: float) -> tuple[float, ...]:
    """A bound, and the doubles beside it."""
    return math.nextafter(bound, -math.inf), bound, math.nextafter(bound, math.inf)


@given(BOUNDS)
def test_a_number_on_a_ruler_has_the_mask_that_a_bisection_finds_or_is_left_to_it(inner):
    bounds = [-(2.0**53), *sorted(b + 0.0 for b in inner), 2.0**53]
    masks = list(range(len(bounds) + 1))
    ruler = ruler_of(bounds, masks)
    for x in (x for bound in bounds for x in neighbours(bound)) if ruler is not None else ():
        y = x * ruler.per_unit - ruler.start
        if 0.0 <= y < len(ruler.lasts) and x >= ruler.lasts[int(y)]:
            assert ruler.masks[int(y)] == bisect_right(bounds, x)


@pytest.mark.parametrize("step", [0.5, 0.1, 0.01, 5.0, 1000.0])
def test_few_numbers_between_round_bounds_are_left_to_a_bisection(step):
    bounds = [-(2.0**53), *(near for k in range(100) for near in (k * step, math.nextafter(k * step, math.inf))), 2.0**53]
    ruler = ruler_of(bounds, list(range(len(bounds) + 1)))
    assert ruler is not None
    inside = [(k + part) * step for k in range(99) for part in (0.2, 0.4, 0.6, 0.8)]
    on = [x for x in inside if x >= ruler.lasts[int(x * ruler.per_unit - ruler.start)]]
    assert len(on) > 0.85 * len(inside)


def test_few_bounds_and_bounds_too_near_each_other_have_no_ruler():
    near = [k * 5e-324 for k in range(FEWEST_BOUNDS)]
    for inner in ([1.0, 2.0, 3.0], near):
        bounds = [-(2.0**53), *inner, 2.0**53]
        assert ruler_of(bounds, list(range(len(bounds) + 1))) is None


def test_rows_of_a_column_with_many_bounds_are_those_whose_cell_holds_the_number():
    cells = [f"{k / 10}..{(k + 7) / 10}" for k in range(100)]
    columns = {"Asset Name": [f"asset_{k}" for k in range(100)], "number": cells}
    compiled = cdb.Table.from_columns(columns, schema={"number": {"type": "number"}}).compile()
    facts = [x for k in range(-3, 110) for x in neighbours(k / 10)] + [-1e300, 1e300, math.inf, -math.inf, 5, True]
    for fact in facts:
        expected = [k for k in range(100) if k / 10 <= fact <= (k + 7) / 10]
        assert compiled.query({"number": fact}).indices.tolist() == expected
