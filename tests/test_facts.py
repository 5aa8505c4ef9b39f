"""Facts: what a game may give, what it is taken for, and what is said of what cannot be taken."""

import enum
import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import oracles
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from strategies import for_each

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, BOOL, INT, NUMBER, TAGS, TEXT, Domain
from contextdb.cells.facts import cell, check_mode, describe, missing_error, misspelt, read_fact, read_fact_text
from contextdb.cells.grammar import parse_cell
from contextdb.cells.intervals import EVERYTHING
from contextdb.cells.sets import Cell
from contextdb.errors import ContextError

DEPTH = Domain("enum", ("CB", "FS", "Half Back", "5"))
STATE = Domain("tags", ("InAir", "Stunned", "Move.Run"))
SPEED = Domain("number", None, 0.0, 10.0)


def short(value: object) -> str:
    if isinstance(value, frozenset):
        return "+".join(sorted(value))
    return value.kind if isinstance(value, Domain) else str(value)[:40]


def read(value: object, domain: Domain) -> object:
    return read_fact(value, Condition("x", domain))


def refused(value: object, domain: Domain) -> str:
    with pytest.raises(ContextError) as caught:
        read(value, domain)
    return str(caught.value)


# ---- what is taken, and for what


@pytest.mark.parametrize("value", [True, 1, 1.0, np.True_, np.int8(1)])
def test_true_may_be_a_one(value):
    assert read(value, BOOL) is True


@pytest.mark.parametrize("value", [False, 0, 0.0, -0.0, np.False_])
def test_false_may_be_a_nothing(value):
    assert read(value, BOOL) is False


FIVES = [5, 5.0, np.int16(5), np.float32(5), np.uint64(5), Fraction(5), "5", " =5 ", "5..5", cell("5..5")]


@for_each(FIVES, [INT, NUMBER, ANGLE])
def test_a_number_may_be_of_any_number_type_or_a_text(value, domain):
    fact = read(value, domain)
    assert fact == 5.0 or (isinstance(fact, Cell) and fact == parse_cell("5", domain))
    assert isinstance(fact, (float, Cell))


@pytest.mark.parametrize("value", [True, np.True_])
def test_true_may_count_as_one(value):
    assert read(value, NUMBER) == 1.0


def test_a_number_past_what_is_declared_is_taken_as_it_is():
    assert read(12.5, SPEED) == 12.5


@pytest.mark.parametrize("value", [-0.0, np.float64(-0.0), np.float32(-0.0), "-0.0"])
def test_a_nothing_with_a_sign_is_a_nothing(value):
    assert math.copysign(1.0, read(value, NUMBER)) == 1.0


@pytest.mark.parametrize("value", [math.inf, -math.inf, np.float32("inf"), "inf"])
@pytest.mark.parametrize("domain", [INT, NUMBER], ids=lambda domain: domain.kind)
def test_a_number_may_be_infinite(value, domain):
    assert math.isinf(read(value, domain))


@pytest.mark.parametrize(
    ("value", "expected"), [(2**53 + 1, 2.0**53), (2**63, 2.0**63), (np.uint64(2**64 - 1), 2.0**64), (10**300, 1e300)]
)
def test_a_whole_number_past_2_to_the_53_is_taken_as_the_nearest_double(value, expected):
    assert read(value, INT) == expected
    assert read(value, NUMBER) == expected


@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers(-5000, 5000))
def test_an_angle_is_brought_onto_the_circle_exactly(value):
    assert read(value, ANGLE) == oracles.wrapped(float(value))


@pytest.mark.parametrize("value", ["CB", np.str_("CB")])
def test_a_value_is_a_text(value):
    assert read(value, DEPTH) == "CB"
    assert type(read(value, DEPTH)) is str


def test_a_text_may_be_any_text():
    assert read("", TEXT) == ""
    assert read("not Any ~2", TEXT) == "not Any ~2"


@pytest.mark.parametrize(
    "value",
    [{"InAir", "Stunned"}, ["InAir", "Stunned"], ("Stunned", "InAir"), "InAir Stunned", " InAir  Stunned "],
    ids=["set", "list", "tuple", "text", "blanks"],
)
def test_tags_may_be_any_collection_of_texts_or_a_text(value):
    assert read(value, STATE) == frozenset(("InAir", "Stunned"))


def test_no_tags_are_a_fact_and_not_a_missing_one():
    assert read([], STATE) == read("", STATE) == frozenset()


def test_a_tag_over_declared_ones_is_declared():
    assert read({"Move"}, STATE) == frozenset(("Move",))


def test_a_tag_with_a_space_stands_in_quotes_in_a_text():
    assert read('"Half Way" InAir', TAGS) == frozenset(("Half Way", "InAir"))


@for_each([None, math.nan, np.float32("nan"), np.float64("nan")], [BOOL, INT, NUMBER, ANGLE, TEXT, DEPTH, STATE])
def test_nothing_and_nan_are_missing_facts_of_every_type(value, domain):
    assert read(value, domain) is None


# ---- sets


@given(strategies.domains(), st.data())
def test_a_set_is_read_as_the_cell_that_it_is_written_as(domain, data):
    text = data.draw(strategies.sets(domain))
    expected = parse_cell(text, domain)
    if expected.is_empty:
        assert "a set that holds at least one value" in refused(cell(text), domain)
    elif domain.type.limits == EVERYTHING[0]:
        assert read(cell(text), domain) == expected
    else:  # what no fact can be is left out
        low, high = domain.type.limits
        found = read(cell(text), domain)
        ends = [end for span in expected.accepts.spans for end in span] if expected.accepts else []
        days = {min(max(end + step, low), high) for end in (*ends, low, high) for step in (-1, 0, 1)}
        assert isinstance(found, Cell)
        assert [found.holds(day) for day in days] == [expected.holds(day) for day in days]


@pytest.mark.parametrize("domain", [INT, NUMBER, ANGLE], ids=lambda domain: domain.kind)
def test_a_plain_text_of_a_number_is_a_set(domain):
    assert read("0 ± 90", domain) == read(cell("0 ± 90"), domain) == parse_cell("0 ± 90", domain)


def test_a_list_of_values_is_a_set_of_them():
    assert read(["CB", "FS"], DEPTH) == read({"FS", "CB"}, DEPTH) == parse_cell("CB FS", DEPTH)
    assert read(["left", "right"], TEXT) == parse_cell("left right", TEXT)


def test_a_text_with_signs_is_a_set_of_tag_sets():
    assert read("+InAir -Stunned", STATE) == read(cell("+InAir -Stunned"), STATE) == parse_cell("+InAir -Stunned", STATE)
    assert read("not +InAir", STATE) == parse_cell("not +InAir", STATE)
    assert read("Any", STATE) == Cell()


# ---- what is refused, and in which words


def taken(value: object, domain: Domain) -> bool:
    """Whether a value is taken, as one of the things that a fact can be, and not refused as a wrong fact."""
    try:
        fact = read(value, domain)
    except ContextError:
        return False
    assert fact is None or isinstance(fact, (bool, float, str, frozenset, Cell))
    return True


@pytest.mark.parametrize("value", [Decimal("0.1"), Decimal("NaN"), 10**5000], ids=["decimal", "decimal nan", "very long"])
def test_odd_numbers_are_taken_or_refused_and_never_crash(value):
    assert taken(value, NUMBER) is isinstance(value, Decimal)


ANYTHING = (
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary() | st.lists(st.text()) | st.just(object())
)


@given(strategies.domains(), ANYTHING)
def test_any_value_whatsoever_is_taken_or_refused(domain, value):
    assert taken(value, domain) in (True, False)


# ---- facts as texts, from a command line or a file


@pytest.mark.parametrize(
    ("text", "domain", "expected"),
    [
        ("true", BOOL, True),
        ("No", BOOL, False),
        (" 1 ", BOOL, True),
        ("5", NUMBER, 5.0),
        ("-0.0", NUMBER, 0.0),
        ("540", ANGLE, -180.0),
        ("5", INT, 5.0),
        ("inf", NUMBER, math.inf),
        ("CB", DEPTH, "CB"),
        ("Half Back", DEPTH, "Half Back"),
        ('"Half Back"', DEPTH, "Half Back"),
        ("5", DEPTH, "5"),
        ("left", TEXT, "left"),
        ("5", TEXT, "5"),
        ('"upper left"', TEXT, "upper left"),
        ("InAir Stunned", STATE, frozenset(("InAir", "Stunned"))),
    ],
    ids=short,
)
def test_a_fact_as_text_is_the_value_it_says(text, domain, expected):
    assert read_fact_text(text, Condition("x", domain)) == expected


@pytest.mark.parametrize("domain", [BOOL, INT, NUMBER, ANGLE, TEXT, DEPTH, STATE], ids=lambda domain: domain.kind)
def test_an_empty_text_is_a_missing_fact(domain):
    assert read_fact_text("  ", Condition("x", domain)) is None


@pytest.mark.parametrize("text", ["nan", "NaN"])
def test_nan_as_text_is_a_missing_number(text):
    assert read_fact_text(text, Condition("x", NUMBER)) is None


@pytest.mark.parametrize(
    ("text", "domain"),
    [
        ("0..5", NUMBER),
        ("0 ± 90", ANGLE),
        (">5", INT),
        ("CB FS", DEPTH),
        ("not CB", DEPTH),
        ("Any", BOOL),
        ("left right", TEXT),
        ("+InAir", STATE),
    ],
    ids=short,
)
def test_a_set_as_text_is_the_cell_it_says(text, domain):
    assert read_fact_text(text, Condition("x", domain)) == parse_cell(text, domain)


@given(strategies.domains(), st.data())
def test_a_fact_is_described_in_a_text_that_reads_as_the_same_fact(domain, data):
    fact = read_fact(data.draw(strategies.plain_facts(domain)).given, Condition("x", domain))
    if domain.kind not in ("enum", "text", "tags"):
        assert read_fact_text(describe(fact, domain), Condition("x", domain)) == fact


def test_facts_are_described_as_people_write_them():
    assert describe(None, TEXT) == "(missing)"
    assert describe(frozenset(), TAGS) == "(no tags)"
    assert describe(frozenset(("Stunned", "InAir")), TAGS) == "InAir Stunned"
    assert describe(True, BOOL) == "True"
    assert describe(0.1, NUMBER) == "0.1"
    assert describe(5.0, NUMBER) == "5"
    assert describe("CB", TEXT) == "CB"


class Position(str, enum.Enum):  # noqa: UP042 - the kind whose str() is not its value
    CORNER = "CB"
    AIRBORNE = "InAir"


def test_a_member_of_an_enum_of_texts_is_its_value():
    assert repr(read(Position.CORNER, DEPTH)) == repr(read(Position.CORNER, TEXT)) == "'CB'"
    assert repr(read({Position.AIRBORNE}, STATE)) == "frozenset({'InAir'})"


# ---- words for what is missing


def test_an_unknown_treatment_of_missing_facts_is_refused_with_the_nearest_one():
    with pytest.raises(ContextError) as caught:
        check_mode("eror")
    assert str(caught.value) == (
        'there is no treatment "eror" of missing facts. Accepted: "error", "any", "never". Did you mean "error"?'
    )


def test_a_missing_fact_is_named():
    assert str(missing_error(["speed"], [])) == (
        'the fact "speed" is missing. Accepted: a value for each condition, or unknown="any" or "never".'
    )


def test_many_missing_facts_are_counted_and_the_first_are_named():
    said = str(missing_error([f"c{i}" for i in range(9)], []))
    assert said.startswith('the fact "c0" is missing (9 facts missing: "c0", "c1", "c2", "c3", "c4", "c5" and 3 more).')


def test_a_given_fact_that_is_nearly_a_missing_one_is_taken_for_a_slip():
    assert str(misspelt(["speed"], ["colour", "sped"])) == (
        'there is no condition "sped", and "speed" is missing. '
        'Accepted: the names of the table\'s conditions. Did you mean "speed"?'
    )
    assert misspelt(["speed"], ["colour", "heading"]) is None


def test_a_name_with_an_accent_of_its_own_is_a_slip():
    assert 'Did you mean "Höhe"?' in str(misspelt(["Höhe"], ["Ho\u0308he"]))
    domain = Domain("enum", ("Höhe", "Breite"))
    assert 'Did you mean "Höhe"?' in refused("Ho\u0308he", domain)
