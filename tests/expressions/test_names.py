"""Names in the text of an expression."""

from dataclasses import replace

import pytest
from expression_oracle import CONDITIONS, contexts, expressions
from hypothesis import given, reject
from hypothesis import strategies as st

from contextdb.expressions import ExpressionError, names_in, read_expression, with_names

NEW = st.sampled_from(["speed", "Role.speed", "a b", "not", "abs", "a", "`", "h", "Größe"])


@given(expressions(2), st.dictionaries(st.sampled_from(sorted(CONDITIONS)), NEW), contexts())
def test_an_expression_under_other_names_says_the_same_of_them(told, new_names, facts):
    called = {name: new_names.get(name, name) for name in CONDITIONS}
    if len(set(called.values())) < len(called):
        reject()
    try:
        before = read_expression(told.text, CONDITIONS)
    except ExpressionError:
        reject()
    renamed = [replace(condition, name=called[name]) for name, condition in CONDITIONS.items()]
    after = read_expression(with_names(told.text, new_names), renamed)
    assert after.names == tuple(called[name] for name in before.names)
    assert after.evaluate({called[name]: fact for name, fact in facts.items()}) == before.evaluate(facts)


@given(expressions(2))
def test_the_names_of_an_expression_are_those_that_it_needs(told):
    try:
        needed = read_expression(told.text, CONDITIONS).names
    except ExpressionError:
        reject()
    assert set(names_in(told.text)) == set(needed)


@pytest.mark.parametrize(
    ("text", "renamed"),
    [
        ("speed - target_speed", "velocity - target_speed"),
        ('"speed" in tags and speed  >  3 ', '"speed" in tags and velocity  >  3 '),
        ("`speed` + Role.speed", "velocity + Role.speed"),
        ("speed(speed)", "speed(velocity)"),
        ("speed > 'open", "speed > 'open"),
        ("", ""),
    ],
)
def test_only_the_name_is_written_anew(text, renamed):
    assert with_names(text, {"speed": "velocity"}) == renamed
