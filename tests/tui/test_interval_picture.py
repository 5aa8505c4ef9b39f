"""Pictures of sets of numbers, against an oracle that asks the cell at sample points."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import cells, domains

from contextdb.cells.domains import ANGLE, INT, NUMBER, Domain
from contextdb.cells.grammar import parse_cell
from tui.model.interval_picture import (
    DIAL_HEIGHT,
    DIAL_WIDTH,
    HALF_DOT,
    column_of,
    dial,
    dot_of,
    framed_line,
    holds_dot,
    interval_line,
    number_words,
    spans_of,
    visible_range,
)

SPEED = Domain("number", None, 0.0, 7.0)
UP = math.inf


def line(text: str, domain: Domain = SPEED, width: int = 14) -> str:
    return "".join(run for run, _ in interval_line(parse_cell(text, domain), domain, width))


def framed(text: str, domain: Domain, width: int = 30) -> str:
    return "".join(run for run, _ in framed_line(parse_cell(text, domain), domain, width))


def words(text: str, domain: Domain = NUMBER, unit: str = "") -> str:
    return number_words(parse_cell(text, domain), domain, unit)


def test_a_closed_end_is_a_full_circle_and_an_open_one_an_empty_circle():
    assert line("[1..3)") == "──●━━○────────"
    assert line("(1..3]") == "──○━━━●───────"


def test_a_span_that_goes_on_past_the_range_has_no_end_there():
    assert line(">=4.2") == "────────●━━━━━"
    assert line("Any") == "━" * 14


def test_a_single_value_is_seen_however_short_the_line():
    assert line("3", width=3) == "─●─"


def test_a_single_value_left_out_is_seen():
    assert line("not 3.5", width=6) == "●━○○━●"
    assert line("not 3", width=6) == "●━○━━●"


def test_the_parts_of_a_union_are_drawn_apart():
    assert line("0..1 | 3..4 | 6..7") == "●━●───●━●───●●"


def test_what_is_accepted_is_told_beside_the_signs():
    assert interval_line(parse_cell("0..3", SPEED), SPEED, 7) == [("●━━●", True), ("───", False)]


def test_bounds_of_the_domain_have_a_stop_and_a_range_that_is_only_shown_has_none():
    assert framed("1..2", SPEED) == "0 ├───●━━●─────────────────┤ 7"
    assert "├" not in framed("1..2", NUMBER)
    assert framed("1..2", Domain("number", None, 0.0)).startswith("0 ├")


def test_without_bounds_the_range_goes_a_step_past_the_ends_of_the_cell():
    assert visible_range(parse_cell("1..3", NUMBER), NUMBER) == (0.5, 3.5)
    assert visible_range(parse_cell("5", NUMBER), NUMBER) == (0.0, 10.0)
    assert visible_range(parse_cell("not 5", NUMBER), NUMBER) == (-5.0, 15.0)
    assert visible_range(parse_cell("Any", INT), INT) == (-1.0, 1.0)


@pytest.mark.parametrize("text", ["1e308", "-1e308..1e308", "5e-324", "inf", "-inf..inf", "0..5e-324"])
def test_the_ends_of_the_doubles_can_be_drawn(text):
    assert len(framed(text, NUMBER, 40)) >= 40


@given(st.data(), domains(("int", "number")), st.integers(1, 60))
def test_each_character_says_what_the_cell_says_of_the_values_that_stand_there(data, domain, width):
    cell = parse_cell(data.draw(cells(domain)), domain)
    low, high = visible_range(cell, domain)
    signs = "".join(run for run, _ in interval_line(cell, domain, width))
    assert len(signs) == width
    ends = [end for span in spans_of(cell) for end in span if low <= end <= high]
    whole = domain.kind == "int"
    for value in [*data.draw(st.lists(st.floats(low, high), min_size=5, max_size=20)), *ends]:
        sign = signs[column_of(value, (low, high), width)]
        if sign == "─":
            assert not cell.holds(value)
        if sign == "━" and not whole:
            assert cell.holds(value)
    marked = {column_of(end, (low, high), width) for end in ends}
    assert {at for at, sign in enumerate(signs) if sign in "●○"} == marked


@given(st.data(), domains(("int", "number")))
def test_a_range_shown_holds_every_bound_and_is_never_empty(data, domain):
    cell = parse_cell(data.draw(cells(domain)), domain)
    low, high = visible_range(cell, domain)
    assert math.isfinite(low)
    assert math.isfinite(high)
    assert low < high
    assert math.isfinite(high - low)


# ---- the dial


def test_a_dial_is_nine_by_five_and_empty_but_for_its_rim_when_nothing_is_held():
    drawn = dial(parse_cell("not Any", ANGLE))
    assert [sum(len(run) for run, _ in row) for row in drawn] == [DIAL_WIDTH] * DIAL_HEIGHT
    assert not any(is_accepted for row in drawn for _, is_accepted in row)
    assert "".join(run for run, _ in drawn[2]) == "⡇⠀⠀⠀⠀⠀⠀⠀⢸"


def test_a_full_circle_fills_the_dial():
    assert "".join(run for run, _ in dial(parse_cell("Any", ANGLE))[2]) == "⣿" * DIAL_WIDTH


def filled(text: str) -> set[str]:
    """The halves of the dial that a cell fills something of, away from the middle."""
    spans = spans_of(parse_cell(text, ANGLE))
    found = set()
    for x in range(DIAL_WIDTH * 2):
        for y in range(DIAL_HEIGHT * 4):
            distance, degrees = dot_of(x, y)
            if 3.0 < distance <= 9.0 and holds_dot(spans, distance, degrees):
                found |= {"up" if y < 7 else "down" if y > 12 else ""} | {"left" if x < 6 else "right" if x > 11 else ""}
    return found - {""}


@pytest.mark.parametrize(
    ("text", "where"), [("0", {"up"}), ("90", {"left"}), ("-90", {"right"}), ("180", {"down"}), ("170..-170", {"down"})]
)
def test_ahead_is_up_and_left_is_positive(text, where):
    assert filled(text) == where


@given(st.data())
def test_a_dot_is_filled_exactly_where_the_cell_holds_an_angle_under_it(data):
    cell = parse_cell(data.draw(cells(ANGLE)), ANGLE)
    x, y = data.draw(st.integers(0, DIAL_WIDTH * 2 - 1)), data.draw(st.integers(0, DIAL_HEIGHT * 4 - 1))
    distance, degrees = dot_of(x, y)
    half = math.degrees(math.atan2(HALF_DOT, distance))
    samples = [degrees + half * share for share in (-0.99, -0.5, 0.0, 0.5, 0.99)]
    is_held = holds_dot(spans_of(cell), distance, degrees)
    assert is_held or not any(cell.holds(sample) for sample in samples)
    ends = [end for span in spans_of(cell) for end in span]
    assume(not any(abs((end - degrees + 180.0) % 360.0 - 180.0) <= half for end in ends))
    assert is_held == cell.holds(degrees)


# ---- in words


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("20, 9.99", "10.01 to 29.99 m/s, ends included"),
        ("(10..30]", "10 to 30 m/s, 10 excluded"),
        ("[10..30)", "10 to 30 m/s, 30 excluded"),
        ("(10..30)", "10 to 30 m/s, ends excluded"),
        (">=5", "5 and more m/s"),
        ("<5", "below 5 m/s"),
        ("5", "exactly 5 m/s"),
        ("0..5 | (10..15)", "0 to 5 or above 10 to below 15 m/s"),
        ("Any", "every number"),
        ("5..3", "no number: the row never matches"),
    ],
)
def test_a_set_of_numbers_in_words(text, said):
    assert words(text, NUMBER, "m/s") == said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("20, 9.99", "10.01 to 29.99 degrees, ends included"),
        ("170..-170", "170 to -170 degrees, ends included"),
        ("170, 20", "150 to -170 degrees, ends included"),
        ("90..180", "90 to 180 degrees, ends included"),
        ("[170..180)", "170 to 180 degrees, 180 excluded"),
        ("180", "exactly 180 degrees"),
        ("not 90", "every angle but 90 degrees"),
        ("0, 180", "every angle"),
    ],
)
def test_a_set_of_angles_in_words(text, said):
    assert words(text, ANGLE) == said


def test_a_set_outside_the_bounds_says_so():
    assert words("8..9", SPEED) == "8 to 9, ends included; nothing within 0 to 7"
    assert words("-2", Domain("number", None, 0.0)) == "exactly -2; nothing from 0 up"
    assert words("2", Domain("number", None, -UP, 0.0)) == "exactly 2; nothing up to 0"
