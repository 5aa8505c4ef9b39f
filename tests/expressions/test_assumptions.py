"""Assumptions: what they rule out, as boxes of cells and context by context."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from expression_oracle import CONDITIONS, contexts, truths
from hypothesis import given, reject
from hypothesis import strategies as st
from strategies import examples

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import BOOL, NUMBER, Domain
from contextdb.cells.grammar import format_cell
from contextdb.covering.assumed import assumptions_of
from contextdb.covering.engine import coverage
from contextdb.expressions import Box, ExpressionError, read_assumptions, read_expression
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table

STANDING_IN = {
    "p": False,
    "Role.q": True,
    "h": 90.0,
    "other heading": -180.0,
    "gait": "Run",
    "word": "Walk",
    "tags": frozenset(("InAir",)),
}


def known(facts: dict[str, Any]) -> dict[str, Any]:
    """The context with a value for every missing fact."""
    return {n: STANDING_IN.get(n, 0.0) if f is None else f for n, f in facts.items()}


def is_in(box: Box, context: dict[str, Any]) -> bool:
    return all(cell.holds(context[name]) for name, cell in box.items())


@examples(5)
@given(truths(2), st.booleans(), st.lists(contexts().map(known), min_size=1, max_size=8))
def test_a_context_is_in_a_box_exactly_where_the_expression_has_that_truth(told, truth, facts):
    try:
        expression = read_expression(told.text, CONDITIONS)
    except ExpressionError:
        reject()
    boxes = expression.as_boxes(truth)
    for context in facts if boxes is not None else ():
        assert any(is_in(box, context) for box in boxes or ()) is (expression.evaluate(context) is truth), (told.text, boxes)


@pytest.mark.parametrize(
    ("text", "boxes"),
    [
        ("not (p and Role.q)", [{"p": "True", "Role.q": "True"}]),
        ("p or a > 3", [{"p": "False", "a": "..3"}]),
        ("0 < a <= 5", [{"a": "..0 | (5.."}]),
        ("a not in [1, 2]", [{"a": "1 | 2"}]),
        ("not (a == 1 or n == 2)", [{"a": "1"}, {"n": "2"}]),
        ('gait in ["Walk", "Run"]', [{"gait": "Idle"}]),
        ("n >= 3", [{"n": "..2"}]),
        ('h in "170..-170"', [{"h": "(-170..170)"}]),
        ("p == Role.q", [{"p": "False", "Role.q": "True"}, {"p": "True", "Role.q": "False"}]),
        ("False", [{}]),
        ("True", []),
        ("p if Role.q else a > 0", [{"p": "False", "Role.q": "True"}, {"a": "..0", "Role.q": "False"}]),
        ("h == other heading", None),
        ("a + 1 > 3", None),
        ("a > n", None),
    ],
)
def test_what_an_assumption_rules_out_as_boxes(text, boxes):
    text = text.replace("other heading", "`other heading`")
    found = read_expression(text, CONDITIONS).as_boxes(False)
    as_text = found and [{n: format_cell(cell, CONDITIONS[n].domain) for n, cell in box.items()} for box in found]
    assert as_text == boxes


def test_an_assumption_of_too_many_boxes_is_asked_context_by_context():
    conditions = {f"c{i}": Condition(f"c{i}", NUMBER) for i in range(40)}
    text = "not (" + " and ".join(f"(c{i} > 0 or c{i + 1} > 0)" for i in range(0, 40, 2)) + ")"
    assumed = read_assumptions([text], list(conditions.values()))
    assert assumed.boxes == []
    assert [e.text for e in assumed.unboxed] == [text]
    assert assumed.holds({f"c{i}": [1.0, i % 2] for i in range(40)}, 2).tolist() == [False, False]
    assert assumed.holds({f"c{i}": [0.0, i > 1] for i in range(40)}, 2).tolist() == [True, True]


def of(*assume: str) -> Any:
    return read_assumptions(assume, list(CONDITIONS.values()))


def test_a_context_with_missing_facts_can_happen_unless_the_others_rule_it_out():
    assert of("not (p and Role.q)").holds({"p": [True, True, False, None], "Role.q": [True, None, None, None]}, 4).tolist() == [
        False,
        True,
        True,
        True,
    ]


def test_boxes_over_conditions_that_the_table_does_not_have_are_left_out():
    own = [CONDITIONS["p"], CONDITIONS["a"]]
    assumed = read_assumptions(["not (p and Role.q)", "a > 0"], own, CONDITIONS)
    assert [sorted(box) for box in assumed.boxes] == [["a"]]


def test_coverage_takes_the_boxes():
    schema = {"p": {"type": "bool"}, "q": {"type": "bool"}}
    table = Table.from_columns({"Asset Name": ["x", "y"], "p": ["True", "False"], "q": ["False", "Any"]}, schema)
    assert coverage(table).covered == 0.75
    assumed = read_assumptions(["not (p and q)"], [c.condition for c in table.conditions])
    assert coverage(table, impossible=assumed.boxes).covered == 1.0


def test_a_table_with_a_derived_bool_has_no_contexts_that_contradict_it():
    schema = {"speed": {"type": "number", "min": 0, "max": 10}, "runs": {"type": "bool", "expr": "speed > 4"}}
    rows = {"Asset Name": ["walk", "run"], "speed": ["0..4", "(4..10]"], "runs": ["False", "True"]}
    table = Table.from_columns(rows, schema, TableSettings("t", assume=("speed < 20",)))
    assert coverage(table, assume=False).covered == pytest.approx(0.5)
    assumed = assumptions_of(table)
    assert coverage(table, impossible=assumed.boxes).covered == 1.0
    assert assumed.unboxed == ()


def test_an_assumption_may_name_a_column_that_nobody_declared():
    table = Table.from_columns({"Asset Name": ["x"], "p": ["True"]}, None, TableSettings("t", assume=("not p",)))
    assert len(assumptions_of(table).boxes) == 1
    with pytest.raises(ExpressionError, match='there is no condition "q"'):
        assumptions_of(Table.from_columns({"Asset Name": ["x"], "p": ["True"]}, None, TableSettings("t", assume=("not q",))))


SMALL = {
    c.name: c
    for c in (
        Condition("x", BOOL),
        Condition("y", BOOL),
        Condition("k", Domain("int", None, 0.0, 3.0)),
        Condition("e", Domain("enum", ("A", "B"))),
    )
}
PARTS = st.sampled_from(["x", "y", "not x", "k > 1", "k == 0", "k >= 3", "k > 5", 'e == "A"', 'e != "A"', "x == y", "k < 2 or y"])


@given(st.lists(st.lists(PARTS, min_size=1, max_size=3).map(" and ".join), min_size=1, max_size=4))
def test_assumptions_contradict_each_other_exactly_where_no_context_satisfies_them(assume):
    assumed = read_assumptions(assume, list(SMALL.values()))
    every = list(product((False, True), (False, True), (0.0, 1.0, 2.0, 3.0), ("A", "B")))
    columns = dict(zip(SMALL, map(list, zip(*every, strict=True)), strict=True))
    assert bool(assumed.contradictions) is not bool(assumed.holds(columns, len(every)).any())


def test_a_contradiction_is_told_with_the_assumption_that_brings_it():
    assert [str(f) for f in of("p", "a > 3", "not p or a < 0", "not p").contradictions] == [
        '"not p or a < 0" contradicts the assumptions before it: no context satisfies them all. '
        "Accepted: assumptions that hold together in some context."
    ]
    assert [str(f) for f in of("`Role.b` > 5").contradictions] == [
        '"`Role.b` > 5" holds in no context of the declared values and bounds. Accepted: an assumption that holds in some context.'
    ]


def test_faults_of_all_assumptions_are_told_together():
    with pytest.raises(ExpressionError) as caught:
        of("a + 1", "p and", "zzz > 3")
    assert [str(f) for f in caught.value.faults] == [
        '"a + 1", character 1: this place is of type bool, and this is a number. '
        "Accepted: True or False: a comparison such as speed > 0.",
        '"p and", character 6: a value is missing at the end. Accepted: a fact, a number, a text in quotes, True or False.',
        '"zzz > 3", character 1: there is no condition "zzz". Accepted: "a", "Role.b", "n", "h", "other heading", "p" and 4 more.',
    ]


def test_classes_of_a_frame_are_judged_at_once():
    assumed = of("a + n < 3")
    assert assumed.boxes == []
    assert assumed.holds({"a": np.array([1.0, 2.0, np.nan]), "n": [1, 1, 1]}, 3).tolist() == [True, False, True]
