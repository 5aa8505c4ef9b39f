"""A live context: after any sequence of changes it answers what a fresh query of the same facts does."""

import math
import random
from collections.abc import Callable
from unittest import mock

import numpy as np
import oracles
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st

from contextdb import bitmask
from contextdb.cells.facts import cell
from contextdb.compiled.classes import FLAT_BYTES
from contextdb.compiled.live import LiveContext
from contextdb.compiled.matches import Matches
from contextdb.errors import ContextError
from contextdb.tables.table import Table

TABLE = Table.from_columns(
    {
        "Asset": ["run", "jump", "fall"],
        "speed": ["3..6", "Any", "0..3"],
        "state": ["Ground", "Air", "Air Ground"],
        "heading": ["170, 20", "Any", "Any"],
    },
    {
        "speed": {"type": "number"},
        "state": {"type": "enum", "values": ["Ground", "Air"]},
        "heading": {"type": "angle"},
    },
)
FACTS = {"speed": 3.0, "state": "Ground", "heading": 180.0}


def told(matches: Matches) -> tuple[list[int], list[int]]:
    return matches.indices.tolist(), bitmask.rows(matches.always).tolist()


def answer_or_message(ask: Callable[[], Matches]) -> object:
    try:
        return told(ask())
    except ContextError as error:
        return str(error)


def steps(table: Table) -> st.SearchStrategy[tuple[str, strategies.Fact]]:
    """One change: a condition and the fact it gets, most often a plain one."""
    conditions = [(c.condition.name, c.condition.domain, c.texts.texts) for c in table.conditions]
    return st.sampled_from(conditions).flatmap(
        lambda c: st.tuples(
            st.just(c[0]),
            st.one_of(
                strategies.plain_facts(c[1], c[2]),
                strategies.plain_facts(c[1], c[2]),
                strategies.set_facts(c[1], c[2]),
                strategies.MISSING,
            ),
        )
    )


@pytest.mark.parametrize("flat_bytes", [FLAT_BYTES, 0], ids=["flat", "wide"])
@given(strategies.tables(least_conditions=1), st.sampled_from(["any", "never"]), st.data())
@strategies.examples(0.6)
def test_after_any_changes_a_live_context_answers_what_reading_every_cell_does(flat_bytes, table, unknown, data):
    with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
        live = table.compile().live(unknown=unknown)
        plain: dict[str, object] = {}
        for name, fact in data.draw(st.lists(steps(table), min_size=1, max_size=12)):
            if fact.given is None:
                del live[name]
            else:
                live[name] = fact.given
            plain[name] = fact.plain
            if data.draw(st.booleans()):
                assert told(live.matches()) == (oracles.rows(table, plain, unknown), oracles.rows_always(table, plain, unknown))
        assert told(live.matches()) == (oracles.rows(table, plain, unknown), oracles.rows_always(table, plain, unknown))


@given(strategies.tables(least_conditions=1), st.data())
@strategies.examples(0.6)
def test_a_live_context_insists_on_every_fact_as_a_query_does(table, data):
    compiled, live = table.compile(), table.compile().live()
    for name, fact in data.draw(st.lists(steps(table), min_size=1, max_size=12)):
        live[name] = fact.given
        assert answer_or_message(live.matches) == answer_or_message(lambda: compiled.query(live.facts))


@pytest.mark.parametrize("n_facts", [4, 5, 17, 70])
def test_facts_that_change_again_and_again_are_answered_as_in_a_query(n_facts):
    rng = random.Random(n_facts)
    names = [f"c{i}" for i in range(n_facts)]
    cells = {name: [rng.choice(["Any", "<5", ">=3", "2..4"]) for _ in range(70)] for name in names}
    columns = {"Asset": [f"a{r}" for r in range(70)], **cells}
    table = Table.from_columns(columns, {name: {"type": "number"} for name in names}).compile()
    live = table.live(dict.fromkeys(names, 4.0))
    for frame in range(150):
        for name in rng.sample(names, min(3, n_facts)):
            live[name] = rng.choice([1.0, 3.5, 4.5, 6.0])
        if frame == 30:
            live = live.copy()
        assert live.matches() == table.query(live.facts)


def test_each_of_many_facts_counts_as_soon_as_it_is_set():
    names = [f"c{i}" for i in range(24)]
    table = Table.from_columns(
        {"Asset": ["a", "b"], **{name: ["<5", ">=3"] for name in names}}, {name: {"type": "number"} for name in names}
    )
    live = table.compile().live(dict.fromkeys(names, 4.0))
    assert live.matches().assets == ["a", "b"]
    for i, name in enumerate(names):
        live[name] = 9.0
        assert live.matches().assets == ["b"], i
    for name in names:
        live[name] = 2.0
    assert live.matches().assets == ["a"]
    live[names[0]] = 4.0
    assert live.matches().assets == ["a"]
    live[names[-1]] = 7.0
    assert live.matches().assets == []


def test_facts_given_at_the_start_are_there():
    live = TABLE.compile().live(FACTS)
    assert live.matches().assets == ["run", "fall"]
    assert live.facts == FACTS
    assert live["speed"] == 3.0


def test_facts_that_the_table_does_not_ask_for_are_passed_over_by_live_and_update():
    live = TABLE.compile().live({**FACTS, "weather": "rain"})
    live.update({"speed": 6.0, "wind": 3})
    assert live.matches().assets == ["run"]
    assert set(live.facts) == set(FACTS)


@pytest.mark.parametrize("n_updates", [1, 48])
@pytest.mark.parametrize("wrong", [{"state": "Water"}, {"heading": "north"}, {"state": []}])
def test_an_update_with_a_wrong_fact_sets_none(wrong: dict[str, object], n_updates: int):
    live = TABLE.compile().live(FACTS)
    for i in range(n_updates):
        live.update({"speed": float(i)})
        live.matches()
    live.update(FACTS)
    with pytest.raises(ContextError):
        live.update({"speed": 6.0, **wrong})
    assert live.facts == FACTS
    assert live.matches().assets == ["run", "fall"]


def test_an_update_with_a_wrong_fact_leaves_missing_facts_missing():
    live = TABLE.compile().live({"state": "Air"}, unknown="any")
    rows = told(live.matches())
    with pytest.raises(ContextError, match="heading"):
        live.update([("speed", 2.0), ("heading", "north")])
    assert (dict(live), told(live.matches())) == ({"state": "Air"}, rows)


def test_a_fact_that_is_set_to_none_or_deleted_is_missing():
    live = TABLE.compile().live(FACTS)
    live["speed"] = None
    assert "speed" not in live
    with pytest.raises(ContextError, match='the fact "speed" is missing'):
        live.matches()
    live["speed"] = 6.0
    assert "speed" in live
    del live["speed"]
    with pytest.raises(ContextError, match='the fact "speed" is missing'):
        live.matches()


@pytest.mark.parametrize("value", [math.nan, np.float32("nan")], ids=["float", "numpy"])
def test_nan_is_a_missing_fact(value):
    live = TABLE.compile().live(FACTS)
    live["speed"] = value
    with pytest.raises(ContextError, match='the fact "speed" is missing'):
        live.matches()
    live["speed"] = 3.0
    assert live.matches().assets == ["run", "fall"]


def test_all_missing_facts_are_named_in_the_order_of_the_conditions():
    with pytest.raises(ContextError) as caught:
        TABLE.compile().live({"state": "Air"}).matches()
    assert str(caught.value).startswith('the fact "speed" is missing (2 facts missing: "speed", "heading").')


def test_a_fact_that_no_condition_asks_for_cannot_be_set():
    live = TABLE.compile().live(FACTS)
    with pytest.raises(ContextError) as caught:
        live["sped"] = 3.0
    assert str(caught.value) == 'there is no condition "sped". Accepted: "speed", "state", "heading". Did you mean "speed"?'
    with pytest.raises(ContextError, match='there is no condition "sped"'):
        del live["sped"]


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("state", "Grond", 'column "state": "Grond" is not a declared value. Accepted: "Ground", "Air". Did you mean "Ground"?'),
        ("state", 5, 'column "state": int "5" is not a fact of type enum.'),
        ("speed", "fast", 'column "speed": cannot read "fast" as a number.'),
        ("speed", [1.0], 'column "speed": list "[1.0]" is not a fact of type number.'),
        ("heading", math.inf, 'column "heading": float "inf" is not a fact of type angle. Accepted: a finite number of degrees.'),
        ("speed", cell("0..5 ~1"), 'Accepted: a set without a penalty ("~").'),
    ],
    ids=str,
)
def test_a_wrong_fact_is_refused_by_name_when_set_or_when_next_asked(name, value, message):
    live = TABLE.compile().live(FACTS)
    with pytest.raises(ContextError) as caught:
        set_and_ask(live, name, value)
    assert message in str(caught.value)
    live.update(FACTS)
    assert live.matches().assets == ["run", "fall"]


def set_and_ask(live: LiveContext, name: str, value: object) -> list[str]:
    live[name] = value
    return live.matches().assets


def test_a_refused_fact_that_is_mended_is_no_longer_refused():
    live = TABLE.compile().live(FACTS)
    with pytest.raises(ContextError):
        set_and_ask(live, "heading", math.inf)
    assert set_and_ask(live, "heading", 0.0) == ["fall"]


def test_an_answer_given_before_a_change_stays_as_it_was():
    live = TABLE.compile().live(FACTS)
    before = live.matches()
    live["speed"] = 6.0
    assert live.matches().assets == ["run"]
    assert before.assets == ["run", "fall"]


def test_two_live_contexts_of_one_table_know_nothing_of_each_other():
    compiled = TABLE.compile()
    one, other = compiled.live(FACTS), compiled.live(FACTS)
    one["speed"] = 6.0
    assert (one.matches().assets, other.matches().assets) == (["run"], ["run", "fall"])


def test_a_set_of_values_may_stand_among_the_facts_and_go_again():
    live = TABLE.compile().live(FACTS)
    live["speed"] = cell("2..4")
    assert told(live.matches()) == ([0, 2], [])
    live["speed"] = "3 ± 0"
    assert told(live.matches()) == ([0, 2], [0, 2])
    live["heading"] = cell("Any")
    assert told(live.matches()) == ([0, 2], [2])
    live["heading"] = 180
    assert told(live.matches()) == ([0, 2], [0, 2])
