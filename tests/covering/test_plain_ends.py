"""Ends of cells that nobody wrote: as short as people write them, and on the same side of every number that people write."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import contextdb as cdb
from contextdb.cells.grammar import parse_cell
from contextdb.cells.intervals import above, below, complement
from contextdb.cells.plain_ends import cuts_of, plain
from contextdb.cells.sets import NumberSet
from contextdb.checks.effects import effects
from contextdb.compiled.table import data_of
from contextdb.covering import coverage
from contextdb.covering.gaps import find_gaps
from contextdb.covering.pairs import pairs
from contextdb.covering.space import Space
from contextdb.schema.settings import TableSettings

NUMBER = {"speed": {"type": "number", "min": 0.0, "max": 100.0}}
ANGLE = {"speed": {"type": "angle"}}
NOISE = re.compile(r"\d\.\d*(0{5,}|9{5,})\d+")

hundredths = st.integers(0, 4000).map(lambda n: n / 100)
centred = st.tuples(hundredths, hundredths).map(lambda pair: f"{pair[0]:.2f}, {pair[1]:.2f}")
plain_cells = st.tuples(hundredths, hundredths).map(lambda pair: f"[{min(pair):g}..{max(pair) + 0.01:g})")


def table_of(cells: list[str], schema: dict[str, dict[str, object]], policy: str = "collect") -> cdb.Table:
    columns = {"Asset": [f"A{r}" for r in range(len(cells))], "speed": cells}
    return cdb.Table.from_columns(columns, schema, TableSettings("table", policy=policy))  # type: ignore[arg-type]


def spans_of(text: str, schema: dict[str, dict[str, object]]) -> NumberSet:
    accepts = parse_cell(text, table_of([], schema).conditions[0].condition.domain).accepts
    assert isinstance(accepts, NumberSet)
    return accepts


def test_a_gap_beside_a_centre_and_tolerance_ends_at_the_decimal():
    report = coverage(table_of(["20, 9.99"], NUMBER))
    assert [gap.cells for gap in report.gaps] == [{"speed": "[0..10.01) | (29.99..100]"}]
    assert not spans_of("(29.99..100]", NUMBER).holds(29.99)


def test_the_nearest_cell_ends_at_the_decimal_too():
    (gap,) = coverage(table_of(["20, 9.99", "..15", "40.."], NUMBER)).gaps
    assert gap.cells == {"speed": "(29.99..40)"}
    assert gap.nearest is not None
    assert gap.nearest.cell == "[10.01..40)"


def test_a_nearest_cell_that_would_hold_every_number_is_any():
    (gap,) = coverage(table_of(["1..2"], {"speed": {"type": "number"}})).gaps
    assert gap.nearest is not None
    assert (gap.cells, gap.nearest.cell) == ({"speed": "..1) | (2.."}, "Any")


def test_where_two_valid_rows_are_an_error_a_gap_is_written_to_the_last_bit():
    (gap,) = coverage(table_of(["20, 9.99"], NUMBER, "unique")).gaps
    assert not spans_of(gap.cells["speed"], NUMBER).holds(29.990000000000002)
    assert spans_of(gap.cells["speed"], NUMBER).holds(29.990000000000006)


def test_an_end_that_somebody_wrote_with_many_digits_stays_apart_from_its_neighbour():
    (gap,) = coverage(table_of(["20, 9.99", "30..", "..10"], NUMBER)).gaps
    assert gap.cells == {"speed": "(10..10.01) | (29.99..30)"}
    (gap,) = coverage(table_of(["..29.99", "29.990000000000006.."], NUMBER)).gaps
    assert gap.cells == {"speed": "29.990000000000002"}


def test_a_row_that_is_made_of_a_gap_closes_it():
    cells = ["20, 9.99", "-20, 9.99"]
    report = coverage(table_of(cells, ANGLE))
    filled = coverage(table_of([*cells, *(gap.cells["speed"] for gap in report.gaps)], ANGLE))
    assert (filled.covered, filled.gaps) == (1.0, ())


def test_labels_of_parts_and_crowds_are_plain():
    table = table_of(["20, 9.99", "25, 9.99", "22, 0.3"], NUMBER)
    assert not NOISE.search(" ".join(text for own in pairs(table).parts for text in own))
    assert not NOISE.search(" ".join(crowd.cells["speed"] for crowd in coverage(table).crowded))


def test_what_a_change_of_cells_does_is_told_in_plain_ends():
    changed = effects(table_of(["20, 9.99"], NUMBER), table_of(["20, 5.01"], NUMBER))
    assert changed.to_json()
    assert not NOISE.search(" ".join(re.findall(r"'speed': '([^']*)'", str(changed.to_json()))))


@examples(0.5)
@given(
    st.lists(centred | plain_cells, min_size=1, max_size=5),
    st.sampled_from([NUMBER, ANGLE]),
    st.sampled_from(["collect", "unique"]),
)
def test_a_written_gap_holds_the_classes_of_the_gap_and_no_other_number_that_people_write(
    cells: list[str], schema: dict[str, dict[str, object]], policy: str
):
    table = table_of(cells, schema, policy)
    space = Space.of(data_of(table.compile()))
    for box in find_gaps(space, (), 20, 1000).boxes:
        exact = space.accepted(0, space.sides_of(box))
        assert isinstance(exact, NumberSet)
        text = space.cells(space.sides_of(box))["speed"]
        written = spans_of(text, schema)
        assert space.box({"speed": parse_cell(text, space.conditions[0].domain)}) == box
        for low, high in exact.spans:
            assert complement(written.spans, low, high) == ()
        assert policy != "unique" or written.spans == exact.spans
        for low, high in written.spans:
            for first, last in complement(exact.spans, low, high):
                while first <= last:  # a few neighbouring doubles, of which nobody writes one
                    assert len(repr(first)) > 15
                    first = above(first)


@examples(0.5)
@given(hundredths, hundredths)
def test_an_end_moves_only_as_far_as_rounding_goes(centre: float, tolerance: float):
    accepts = spans_of(f"{centre:.2f}, {tolerance:.2f}", NUMBER)
    ends = {round(centre - tolerance, 2), round(centre + tolerance, 2)}
    found = plain(accepts, cuts_of(accepts))
    assert isinstance(found, NumberSet)
    for end in (end for span in found.spans for end in span):
        assert {end, above(end), below(end)} & ends or math.isclose(end, 0.0, abs_tol=1e-12)


def test_what_is_no_set_of_numbers_stays():
    accepts = parse_cell("True", table_of(["True"], {"speed": {"type": "bool"}}).conditions[0].condition.domain).accepts
    assert accepts is not None
    assert plain(accepts, ()) is accepts


@pytest.mark.parametrize("text", ["0.1..0.3", "(5..7]", "..1e300", "5e-324..1", "16777217..", "0.3333333333333333.."])
def test_ends_that_people_wrote_stay(text: str):
    accepts = spans_of(text, {"speed": {"type": "number"}})
    assert plain(accepts, cuts_of(accepts)) == accepts
