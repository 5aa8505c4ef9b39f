"""Answers for what plays already: each holds the rows whose cells, widened, accept the facts; every other answer is exact."""

import math
import pickle
from dataclasses import replace

import numpy as np
import oracles
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from nested_tables import Nest, is_valid, nests
from strategies import contexts, examples
from test_mirroring import mirroring_tables, plain_in_mirror

import contextdb as cdb
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, INT, NUMBER
from contextdb.cells.facts import read_fact
from contextdb.cells.mirroring import widened_fact
from contextdb.errors import SchemaError
from contextdb.schema.sections import condition_to_dict
from contextdb.schema.settings import EMPTY, read_schema
from contextdb.tables.table import Table

REACHES = (0.0, 0.25, 1.0, 30.0)


@st.composite
def wide_tables(draw):
    """A table some of whose conditions have a hysteresis, and some a mirror."""
    table = draw(mirroring_tables())
    conditions = {c.condition.name: replace(c.condition, hysteresis=_reach(draw, c.condition.domain)) for c in table.conditions}
    columns = {c.name: c.to_list() for c in table.columns}
    return Table.from_columns(columns, replace(EMPTY, conditions=conditions), table.settings)


def _reach(draw, domain):
    if domain.kind not in ("int", "number", "angle"):
        return 0.0
    return draw(st.sampled_from([reach for reach in REACHES if domain.kind != "int" or reach.is_integer()]))


def widened(table, plain):
    """The facts of the oracle with what is near them: values in every part that the cells tell apart there."""
    return {c.condition.name: _near(c.condition, c.texts.texts, plain.get(c.condition.name)) for c in table.conditions}


def _near(condition, texts, fact):
    reach, domain = condition.hysteresis, condition.domain
    if fact is None or not reach or isinstance(fact, list):
        return fact
    assume(abs(fact) < 1e9)
    text = f"{fact - reach:.20f}..{fact + reach:.20f}"
    values = oracles.representatives([*texts, text], domain)
    return [fact, *(value for value in values if oracles.accepts(text, domain, value))]


@examples(1)
@given(st.data())
def test_what_plays_stays_valid_while_its_widened_cells_accept_the_facts(data):
    table = data.draw(wide_tables())
    facts, plain = data.draw(contexts(table, has_missing=True))
    unknown = data.draw(st.sampled_from(["any", "never"]))
    in_mirror = plain_in_mirror(table, plain, facts)
    expected, expected_in_mirror = (oracles.rows(table, widened(table, each), unknown) for each in (plain, in_mirror))
    compiled = table.compile()
    answers = [compiled.query(facts, unknown=unknown), compiled.live(facts, unknown=unknown).matches()]
    answers.append(pickle.loads(pickle.dumps(answers[0])))
    for answer in answers:
        assert answer.indices.tolist() == oracles.rows(table, plain, unknown)
        assert answer.widened.indices.tolist() == expected
        assert answer.widened.widened is answer.widened
        assert answer.mirrored.widened.indices.tolist() == expected_in_mirror
        assert answer.widened.mirrored.indices.tolist() == expected_in_mirror
        assert np.allclose(answer.widened.penalties, oracles.costs(table, widened(table, plain), unknown))


@examples(0.5)
@given(st.data())
def test_many_answers_are_widened_as_each_is_and_joined_and_lessened_ones_too(data):
    table = data.draw(wide_tables())
    drawn = data.draw(st.lists(contexts(table), min_size=1, max_size=3))
    columns = {c.condition.name: [facts.get(c.condition.name) for facts, _ in drawn] for c in table.conditions}
    if not columns:
        return
    compiled = table.compile()
    many = compiled.query_many(columns)
    wide = [oracles.rows(table, widened(table, plain)) for _, plain in drawn]
    assert [each.widened.indices.tolist() for each in many] == wide
    first, last = many[0], many[len(many) - 1]
    assert (first & last).widened.indices.tolist() == sorted({*wide[0]} & {*wide[-1]})
    assert (first | last).widened.indices.tolist() == sorted({*wide[0]} | {*wide[-1]})
    assert first.only([]).widened.indices.tolist() == []


@given(nests(("int", "number", "angle")), st.sampled_from(["any", "never"]), st.data())
def test_in_tables_inside_tables_all_cells_of_a_condition_accept_one_value_near_the_fact(nest, unknown, data):
    conditions = {name: replace(c, hysteresis=_reach(data.draw, c.domain)) for name, c in nest.outer.schema.conditions.items()}
    outer, *inner = (_with_conditions(table, conditions) for table in (nest.outer, *nest.tables.values()))
    nest = Nest(outer, {table.name: table for table in inner})
    facts, plain = data.draw(contexts(nest.all_cells(), has_missing=True))
    near = widened(nest.all_cells(), plain)
    expected = [row for row, way in enumerate(nest.ways()) if is_valid(nest, way, near, unknown)]
    answer = nest.outer.compile(nest.tables).query(facts, unknown=unknown)
    assert answer.widened.indices.tolist() == expected


def _with_conditions(table, conditions):
    columns = {c.name: c.to_list() for c in table.columns}
    return Table.from_columns(columns, replace(EMPTY, conditions=conditions), table.settings, table.name)


@pytest.mark.parametrize(
    ("domain", "reach", "fact", "inside", "outside"),
    [
        (NUMBER, 0.5, 2.0, [1.5, 2.5], [1.4999999, 2.5000001]),
        (INT, 1.0, 2, [1.0, 3.0], [0.0, 4.0]),
        (ANGLE, 10.0, 175.0, [165.0, -175.0, -180.0], [164.9, -174.9, 0.0]),
        (ANGLE, 200.0, 0.0, [-180.0, 0.0, 179.0], []),
        (NUMBER, 1.0, cdb.cell("2..3 | 6"), [1.0, 4.0, 5.0, 7.0], [0.9, 4.5, 7.1]),
    ],
)
def test_a_widened_fact_is_all_that_is_within_the_hysteresis(domain, reach, fact, inside, outside):
    condition = Condition("fact", domain, hysteresis=reach)
    found = widened_fact(read_fact(fact, condition), condition)
    assert [value for value in inside if not found.holds(value)] == []
    assert [value for value in outside if found.holds(value)] == []


def test_without_a_hysteresis_an_answer_is_its_own_widened_one():
    answer = (
        cdb.Table.from_columns({"Asset": ["A"], "speed": ["0..5"]}, {"speed": {"type": "number"}}).compile().query({"speed": 1})
    )
    assert answer.widened is answer


def test_a_compiled_file_and_contextdb_toml_keep_it(tmp_path):
    told = {"speed": {"type": "number", "hysteresis": 0.5}}
    table = cdb.Table.from_columns({"Asset": ["Walk", "Run"], "speed": ["0..2", "2..9"]}, told)
    table.compile().save(tmp_path / "moves.safetensors")
    opened = cdb.CompiledTable.open(tmp_path / "moves.safetensors")
    assert opened.query({"speed": 2.25}).assets == ["Run"]
    assert opened.query({"speed": 2.25}).widened.assets == ["Walk", "Run"]
    assert condition_to_dict(table.schema.conditions["speed"]) == told["speed"]


def test_derived_facts_are_widened_and_rules_and_actors_are_not():
    told = {
        "speed": {"type": "number", "hysteresis": 1.0},
        "twice": {"type": "number", "expr": "speed * 2", "hysteresis": 0.5},
        "Ally.near": {"type": "number", "hysteresis": 5.0},
    }
    table = cdb.Table.from_columns({"Asset": ["A", "B"], "speed": ["0..2", "Any"], "twice": ["Any", "0..2"]}, told).compile()
    assert table.query({"speed": 1.2}).assets == ["A"]
    assert table.query({"speed": 1.2}).widened.assets == ["A", "B"]
    assert table.query({"speed": 1.3}).widened.assets == ["A"]
    cast = cdb.Table.from_columns({"Asset": ["A"], "speed": ["0..2"], "Ally.near": ["0..1"]}, told).compile()
    near, far = ({"Ally": [{"id": 1, "near": each}]} for each in (1.0, 3.0))
    answer = cast.query({"speed": 2.5}, actors=near)
    assert (answer.assets, answer.widened.assets) == ([], ["A"])
    assert answer.widened.casting(0)["Ally"]["id"] == 1
    assert cast.query({"speed": 2.5}, actors=far).widened.assets == []


@pytest.mark.parametrize(
    ("kind", "hysteresis", "message"),
    [
        ("number", "-1", "hysteresis = -1: this is below 0 or infinite. Accepted: a number from 0 up, such as 0.2"),
        ("number", '"a lot"', 'hysteresis = "a lot": this is text'),
        (
            "int",
            "0.5",
            "hysteresis = 0.5: an int has only whole neighbours. Accepted: a whole number. Did you mean hysteresis = 1?",
        ),
        ("bool", "0.5", "hysteresis = 0.5 has no place here: a bool is True or False. Accepted: hysteresis in a condition of type"),
    ],
)
def test_a_hysteresis_that_cannot_be_is_told(kind, hysteresis, message):
    with pytest.raises(SchemaError) as caught:
        read_schema(f"[conditions.speed]\ntype = '{kind}'\nhysteresis = {hysteresis}\n", "contextdb.toml")
    assert message in str(caught.value)


def test_infinite_facts_stay_what_they_are():
    condition = Condition("fact", NUMBER, hysteresis=1.0)
    assert widened_fact(math.inf, condition).holds(math.inf)
    assert widened_fact(None, condition) is None
