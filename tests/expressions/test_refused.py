"""What is refused in an expression, and how it is told. `refused.txt`: the text, the place, the message; blank lines between."""

import sys
from pathlib import Path

import pytest
from expression_oracle import CONDITIONS
from hypothesis import given
from hypothesis import strategies as st
from strategies import for_each

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, BOOL, INT, NUMBER, TEXT, Domain
from contextdb.errors import SchemaError
from contextdb.expressions import Expression, ExpressionError, ExpressionFault, read_expression
from contextdb.expressions.functions import FUNCTIONS
from contextdb.expressions.tokens import MOST_CHARACTERS, RESERVED, written_name

NAMED = [
    *(Condition("speed", NUMBER, "m/s"), Condition("dist", NUMBER, "m"), Condition("heading", ANGLE), Condition("turn", ANGLE)),
    *(Condition("level", INT), Condition("moving", BOOL), Condition("gait", Domain("enum", ("Walk", "Run")))),
    *(Condition("Defender.Tags", Domain("tags", ("InAir", "Move.Run"))), Condition("Asset Name", TEXT)),
]
REFUSED = (Path(__file__).parent / "refused.txt").read_text(encoding="utf-8").rstrip("\n").split("\n\n")


def fault_of(text: str, conditions: object = NAMED, wants: Condition | None = None) -> ExpressionFault:
    with pytest.raises(ExpressionError) as caught:
        read_expression(text, conditions, wants)
    (fault,) = caught.value.faults
    assert isinstance(fault, ExpressionFault)
    return fault


@for_each(REFUSED)
def test_a_refusal_points_at_the_place_and_says_what_is_accepted(entry):
    text, marks, message = entry.split("\n")
    fault = fault_of(text)
    assert fault.pointed == f"{text}\n{marks}"
    assert fault.message.endswith(f", character {len(marks) - len(marks.lstrip()) + 1}: {message}")
    assert isinstance(ExpressionError(fault), SchemaError)


@pytest.mark.parametrize("entry", [e for e in REFUSED if "Did you mean" in e])
def test_a_mend_that_is_a_whole_text_is_read(entry):
    mend = fault_of(entry.split("\n")[0]).mend[1:-1]
    if " " in mend:
        assert isinstance(read_expression(mend, NAMED), Expression)


@pytest.mark.parametrize(
    ("text", "wants", "message"),
    [
        ("level / 2", Condition("n", INT), '"n" is of type int, and this is not whole'),
        ("speed", Condition("p", BOOL), '"p" is of type bool, and this is a number'),
        ("1", Condition("p", BOOL), "Did you mean"),
        ("moving", Condition("x", NUMBER), '"x" is of type number, and this is True or False'),
        ("speed", Condition("x", NUMBER, "km/h"), 'this is in "m/s", and "x" in "km/h"'),
        ('"Run" if moving else "Idle"', Condition("g", Domain("enum", ("Run", "Idler"))), '"Idle" is not a declared value of "g"'),
        ("gait", Condition("g", Domain("enum", ("Run",))), '"Walk" is not a declared value of "g"'),
    ],
)
def test_a_result_that_does_not_fit_its_condition_is_refused(text, wants, message):
    assert message in str(fault_of(text, NAMED, wants))


@pytest.mark.parametrize(
    ("text", "wants"),
    [
        ("speed * 3.6", Condition("x", NUMBER, "km/h")),
        ("level // 2", Condition("n", INT)),
        ("round(speed)", Condition("n", INT)),
        ("speed * 90", Condition("h", ANGLE)),
        ("heading", Condition("x", NUMBER, "m")),
        ("Defender.Tags", Condition("t", Domain("tags", ("InAir", "Move.Run")))),
        ("gait", Condition("w", TEXT)),
    ],
)
def test_a_result_that_fits_its_condition_is_taken(text, wants):
    assert read_expression(text, NAMED, wants).text == text


@for_each(
    [
        ("(" * 5000, "5,000 characters"),
        ("(" * 500 + "1" + ")" * 500, "nested too deeply"),
        ("not " * 900 + "moving", "nested too deeply"),
        ("-" * 3000 + "1", "nested too deeply"),
        ("1" + " + 1" * 900, "nested too deeply"),
        ("1 if moving else " * 200 + "1", "nested too deeply"),
        ("2 ** " * 700 + "2", "nested too deeply"),
        ("abs(" * 300 + "1" + ")" * 300, "nested too deeply"),
        ("9" * 3999, "too large for a number"),
        ("10 ** 64 ** 64", "whole number from 0 to 64"),
        ("speed ** 1000000000", "whole number from 0 to 64"),
        ('"' + "x" * 3990, "not closed"),
        ("__builtins__", "no condition"),
        ("speed.__class__.__mro__", "no condition"),
        ("exec('1')", "no function"),
        ("().__class__", "a dot is allowed only inside"),
        ("speed[0]", "no place"),
        ("speed\x00", "not a sign"),
        ("speed > 3\nimport os", "operator is missing"),
    ]
)
def test_hostile_texts_are_refused_with_a_reason(text, why):
    limit = sys.getrecursionlimit()
    fault = fault_of(text)
    assert why in fault.message
    assert len(fault.message) < 600
    assert str(fault).isprintable()
    assert sys.getrecursionlimit() == limit


WORDS = [
    *(
        "speed",
        "gait",
        "moving",
        "heading",
        "Defender.Tags",
        "`Asset Name`",
        '"Walk"',
        '"0..5"',
        "'x'",
        "1",
        "0",
        "2.5",
        "1e308",
        ".",
    ),
    *(
        "+",
        "-",
        "*",
        "/",
        "//",
        "%",
        "**",
        "==",
        "!=",
        "<",
        ">=",
        "(",
        ")",
        "[",
        "]",
        ",",
        "=",
        ":=",
        "?",
        ":",
        "#",
        "\n",
        "é",
        "²",
        "\x00",
    ),
    *("and", "or", "not", "in", "if", "else", "True", "is", "AND", "lambda", "abs", "min(", "clamp(", "atan2(", "wrap_angle("),
]


@given(st.one_of(st.text(max_size=60), st.lists(st.sampled_from(WORDS), max_size=14).map(" ".join)))
def test_any_text_is_an_expression_or_refused_with_a_place_in_it(text):
    try:
        expression = read_expression(text, NAMED)
    except ExpressionError as error:
        (fault,) = error.faults
        assert isinstance(fault, ExpressionFault)
        assert 0 <= fault.start <= fault.stop <= max(len(text), fault.start)
        assert str(fault).isprintable()
        assert "^" in fault.pointed
    else:
        expression.evaluate({})
        expression.run_frame({}, 2)
        expression.as_boxes()


@given(st.text(min_size=1, max_size=20).map(str.strip).filter(bool))
def test_any_name_of_a_condition_can_be_written(name):
    condition = Condition(name, NUMBER)
    assert read_expression(f"{written_name(name)} + 1", [condition]).names == (name,)
    assert read_expression(f"-{written_name(name)}", [condition]).evaluate({name: 2}) == -2.0


@for_each([*sorted(RESERVED), *FUNCTIONS, "Defender.DepthChart", "a b", "`", "1st", "a.", ".a", "in.out"])
def test_words_of_the_language_can_be_names_too(name):
    assert read_expression(f"{written_name(name)} * 2", [Condition(name, NUMBER)]).evaluate({name: 4}) == 8.0


def test_the_longest_text_is_read_quickly_enough_to_be_read_at_all():
    text = " or ".join(["a > 3"] * 440)
    assert len(text) < MOST_CHARACTERS
    assert read_expression(text, CONDITIONS).evaluate({"a": 4}) is True
