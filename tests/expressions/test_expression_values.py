"""Expressions: one context and a frame of them give the values that an evaluator too simple to be wrong gives, bit by bit."""

import math
import struct
from fractions import Fraction

import numpy as np
import polars as pl
import pytest
from expression_oracle import CONDITIONS, SPECIAL, Told, contexts, expressions
from hypothesis import given, reject
from hypothesis import strategies as st
from strategies import examples, for_each

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.expressions import Expression, ExpressionError, read_expression
from contextdb.expressions.columns import as_array


def read(told: Told) -> Expression:
    """The expression, but for one that divides constants by 0 or the like, which is refused."""
    try:
        return read_expression(told.text, CONDITIONS)
    except ExpressionError as error:
        if "finite value" in str(error) or "divided by 0" in str(error):
            reject()
        raise


def frame_of(expression: Expression, columns: dict[str, object], n_contexts: int) -> np.ndarray:
    """The values in many contexts: float64, NaN where missing, for numbers; else objects, None where missing."""
    return as_array(expression.run_frame(columns, n_contexts))


def bits(value: object) -> object:
    """A value so that two are equal only when they are the same to the last bit."""
    if isinstance(value, float):
        return None if math.isnan(value) else struct.pack("d", value)
    return value.item() if isinstance(value, np.generic) else value


@examples(6)
@given(expressions(), st.lists(contexts(), min_size=1, max_size=4))
def test_one_context_gives_what_plain_arithmetic_with_missing_values_gives(told, facts):
    expression = read(told)
    for context in facts:
        assert bits(expression.evaluate(context)) == bits(told.value(context)), (told.text, context)


@examples(6)
@given(expressions(), st.lists(contexts(), min_size=1, max_size=6))
def test_a_frame_gives_what_each_context_gives_to_the_last_bit(told, facts):
    expression = read(told)
    columns = {name: [context[name] for context in facts] for name in CONDITIONS}
    found = frame_of(expression, columns, len(facts))
    assert [bits(v) for v in found.tolist()] == [bits(expression.evaluate(context)) for context in facts], told.text


NUMBER = st.one_of(st.sampled_from(SPECIAL), st.floats(allow_nan=False), st.floats(-500, 500))
FORMULAS = [
    *("hypot(a, Role.b)", "atan2(a, Role.b)", "wrap_angle(a)", "a ** 2", "a ** 3", "a ** 64", "a ** 0", "sqrt(a)", "ceil(a)"),
    *(
        "round(a)",
        "a // Role.b",
        "a % Role.b",
        "a / Role.b",
        "hypot(a * 1e300, Role.b)",
        "atan2(h, a - Role.b)",
        "abs(a) ** 7 % 10",
    ),
]


@pytest.mark.parametrize("text", FORMULAS)
@given(pairs=st.lists(st.tuples(NUMBER, NUMBER), min_size=1, max_size=50))
def test_every_function_gives_the_same_bits_for_one_and_for_many(text, pairs):
    expression = read_expression(text, CONDITIONS)
    columns = {"a": np.array([a for a, _ in pairs]), "Role.b": np.array([b for _, b in pairs]), "h": np.full(len(pairs), 30.0)}
    one_by_one = [expression.evaluate({"a": a, "Role.b": b, "h": 30.0}) for a, b in pairs]
    assert [bits(v) for v in frame_of(expression, columns, len(pairs)).tolist()] == [bits(v) for v in one_by_one]


def test_a_million_contexts_give_the_same_bits_as_one_at_a_time():
    expression = read_expression("wrap_angle(h - a * 7) if hypot(a, Role.b) > 3 else atan2(Role.b, a) / a", CONDITIONS)
    rng = np.random.default_rng(3)
    columns = {"a": rng.normal(0, 9, 1_000_000), "Role.b": rng.normal(0, 1, 1_000_000), "h": rng.uniform(-180, 180, 1_000_000)}
    found = frame_of(expression, columns, 1_000_000)
    for i in range(0, 1_000_000, 997):
        assert bits(found[i].item()) == bits(expression.evaluate({name: column[i] for name, column in columns.items()}))


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_length_and_direction_are_those_of_the_mathematics_library_within_a_few_units_in_the_last_place(x, y):
    facts = {"a": y, "Role.b": x}
    assert read_expression("hypot(a, Role.b)", CONDITIONS).evaluate(facts) == pytest.approx(math.hypot(x, y), rel=1e-15, abs=1e-300)
    direction = read_expression("atan2(a, Role.b)", CONDITIONS).evaluate(facts)
    expected = math.degrees(math.atan2(y + 0.0, x + 0.0))
    assert direction == pytest.approx(-180.0 if expected == 180.0 else expected, rel=4e-16 * 3, abs=1e-300)


@pytest.mark.parametrize(
    ("y", "x", "degrees"), [(0, 1, 0), (1, 0, 90), (1, 1, 45), (0, -1, -180), (-2, 2, -45), (-1, 0, -90), (0, 0, 0)]
)
def test_eighths_of_a_turn_are_exact_and_half_a_turn_is_minus_180(y, x, degrees):
    assert read_expression("atan2(a, n)", CONDITIONS).evaluate({"a": y, "n": x}) == degrees


@given(st.integers(-9, 9), st.integers(0, 10))
def test_powers_of_small_whole_numbers_are_exact(base, exponent):
    assert Fraction(read_expression(f"n ** {exponent}", CONDITIONS).evaluate({"n": base})) == Fraction(base) ** exponent


@for_each(
    [
        ("1 / a", None),
        ("a // a", None),
        ("5 % a", None),
        ("sqrt(a - 1)", None),
        ("1e308 * (a + 10)", None),
        ("-a", 0.0),
        ("n / 2", 1.5),
        ("n // 2", 1.0),
        ("-7 // 2", -4.0),
        ("-7 % 3", 2.0),
        ("2 ** 3 ** 2", 512.0),
        ("-2 ** 2", -4.0),
        ("1 < n < 5 < 9", True),
        ("False and 1 / a > 0", False),
        ("True or 1 / a > 0", True),
        ("True and 1 / a > 0", None),
        ("not 1 / a > 0", None),
        ("1 if 1 / a > 0 else 2", None),
        ("1 if n > 0 else 1 / a", 1.0),
        ("h == -190", True),
        ("h in [170, 530]", True),
        ('h in "160..-160"', True),
        ('n in "1..2 | 3"', True),
        ("wrap_angle(h + 20)", -170.0),
        ("clamp(n, 5, 4)", 4.0),
        ("round(n + 0.5) == 4 and round(n - 0.5) == 2", True),
        ('gait in ["Run", "Walk"] and "Move" in tags', True),
        ('tags in "+Move.Run -InAir"', True),
        ('"InAir" not in tags', True),
    ]
)
def test_an_expression_has_this_value(text, value):
    facts = {"a": 0, "n": 3, "h": 170, "gait": "Run", "tags": {"Move.Run"}}
    assert read_expression(text, CONDITIONS).evaluate(facts) == value
    frame = frame_of(read_expression(text, CONDITIONS), {name: [fact] for name, fact in facts.items()}, 1)
    assert bits(frame.tolist()[0]) == bits(value)


@pytest.mark.parametrize(
    "column",
    [
        [1, 2, None],
        [1.0, 2.0, math.nan],
        np.array([1, 2, np.nan], np.float32),
        pl.Series([1, 2, None], dtype=pl.Int8),
        ["1", 2, None],
        pl.Series([1.0, 2.0, None]),
    ],
)
def test_a_column_may_be_written_in_any_way_that_a_table_is_asked_with(column):
    assert frame_of(read_expression("a * 2", CONDITIONS), {"a": column}, 3)[:2].tolist() == [2.0, 4.0]
    assert np.isnan(frame_of(read_expression("a * 2", CONDITIONS), {"a": column}, 3)[2])


def test_no_contexts_give_no_values():
    assert frame_of(read_expression("a > 1 and gait == word", CONDITIONS), {"a": [], "gait": [], "word": []}, 0).tolist() == []


def test_what_c_cannot_hold_has_its_value_too():
    is_word = read_expression('word == "a" or word != gait', CONDITIONS)
    assert [is_word.evaluate({"word": word, "gait": "Run"}) for word in ("a\0b", "\ud800", "Run", "a")] == [True, True, False, True]
    assert read_expression("word", CONDITIONS).evaluate({"word": "a\0b"}) == "a\0b"
    many = {f"Move.{i}" for i in range(300)}
    has_last = read_expression('"Move.299" in free and "Run" not in free', [Condition("free", Domain("tags"))])
    assert has_last.evaluate({"free": many}) is True
