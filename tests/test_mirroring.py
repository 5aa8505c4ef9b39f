"""Answers in a mirror: each is the answer to the facts as a mirror shows them, mirrored here one by one."""

import copy
import pickle
import random
from dataclasses import replace

import numpy as np
import oracles
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import INDEX, contexts, examples, quoted, tables

import contextdb as cdb
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, NUMBER
from contextdb.cells.facts import read_fact
from contextdb.cells.mirroring import mirrored_fact, way_of
from contextdb.compiled.table import data_of
from contextdb.errors import ContextError
from contextdb.schema.settings import EMPTY
from contextdb.tables.table import Table


@st.composite
def mirroring_tables(draw):
    """A table some of whose conditions declare a mirror."""
    table = draw(tables())
    conditions = {c.condition.name: replace(c.condition, mirror=_way(draw, c.condition.domain)) for c in table.conditions}
    columns = {c.name: c.to_list() for c in table.columns}
    return Table.from_columns(columns, replace(EMPTY, conditions=conditions), table.settings)


def _way(draw, domain):
    form = draw(INDEX) % 3
    if form == 0 or domain.kind == "date":
        return draw(st.sampled_from([None, "none"]))
    if domain.kind in ("bool", "int", "number", "angle"):
        return "negate"
    if domain.kind == "tags":
        return (("InAir", "Moved"),) if domain.values is not None else (("Move", "Half Way"), ("InAir", "Moved"))
    names = sorted(domain.values or ("CB", "FS", "Half Back", "5"))
    return tuple(zip(names[::2], names[1::2], strict=False)) or None


def in_mirror(condition, fact):
    """A fact of the oracle as the mirror shows it."""
    way = "negate" if condition.mirror is None and condition.domain.kind == "angle" else condition.mirror
    if fact is None or way in (None, "none"):
        return fact
    if isinstance(fact, list):
        return [in_mirror(condition, one) for one in fact]
    if isinstance(fact, bool):
        return not fact
    if isinstance(fact, frozenset):
        return frozenset(_other_tag(tag, way) for tag in fact)
    if isinstance(fact, str):
        return next((b if fact == a else a for a, b in way if fact in (a, b)), fact)
    return oracles.wrapped(-fact) if condition.domain.kind == "angle" else -fact


def _other_tag(tag, way):
    for a, b in way:
        for one, other in ((a, b), (b, a)):
            if f"{tag}.".startswith(f"{one}."):
                return other + tag[len(one) :]
    return tag


def plain_in_mirror(table, plain, facts=None):
    """The facts of the oracle as the mirror shows them; of sets, values in every part that the cells tell apart there."""
    found = {}
    for column in table.conditions:
        name, fact = column.condition.name, plain.get(column.condition.name)
        if isinstance(fact, list):
            found[name] = set_in_mirror(column, getattr(facts[name], "text", facts[name]))
        else:
            found[name] = in_mirror(column.condition, fact)
    return found


def set_in_mirror(column, text):
    condition, domain, texts = column.condition, column.condition.domain, [*column.texts.texts, text]
    if domain.kind == "tags":
        named = {tag for tags in oracles.representatives(texts, domain) for tag in tags}
        texts += ["+" + quoted(next(iter(in_mirror(condition, frozenset([tag]))))) for tag in named]
    values = oracles.representatives(texts, domain)
    values += [in_mirror(condition, value) for value in values]
    return [in_mirror(condition, value) for value in values if oracles.accepts(text, domain, value)]


@examples(1)
@given(st.data())
def test_the_answer_in_a_mirror_holds_the_rows_whose_cells_accept_the_mirrored_facts(data):
    table = data.draw(mirroring_tables())
    facts, plain = data.draw(contexts(table, has_missing=True, has_sets=True))
    unknown = data.draw(st.sampled_from(["any", "never"]))
    expected = oracles.rows(table, plain_in_mirror(table, plain, facts), unknown)
    compiled = table.compile()
    answer = compiled.query(facts, unknown=unknown)
    live = compiled.live(facts, unknown=unknown).matches()
    again = compiled.live(facts, unknown=unknown).matches()
    for found in (answer, live, again):
        assert found.mirrored.indices.tolist() == expected
        assert found.mirrored.mirrored.indices.tolist() == found.indices.tolist() == oracles.rows(table, plain, unknown)
        assert np.allclose(found.mirrored.penalties, oracles.costs(table, plain_in_mirror(table, plain, facts), unknown))


@examples(0.5)
@given(st.data())
def test_many_answers_in_a_mirror_are_those_of_each_context(data):
    table = data.draw(mirroring_tables())
    drawn = data.draw(st.lists(contexts(table), min_size=1, max_size=4))
    compiled = table.compile()
    columns = {c.condition.name: [facts.get(c.condition.name) for facts, _ in drawn] for c in table.conditions}
    if not columns:
        return
    many = compiled.query_many(columns)
    for i, (facts, plain) in enumerate(drawn):
        expected = oracles.rows(table, plain_in_mirror(table, plain))
        assert many.mirrored.lists()[i].tolist() == expected
        assert many[i].mirrored.indices.tolist() == expected
        assert many[i].indices.tolist() == compiled.query(facts).indices.tolist()
        assert np.allclose(many[i].penalties, compiled.query(facts).penalties)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_angle_s_mirror_is_its_negative_on_the_circle_and_the_ends_meet(sign):
    angle = Condition("direction", ANGLE)
    assert way_of(angle) == "negate"
    for degrees in (0.0, 45.0, 179.99999999999997, 180.0, 540.0):
        assert mirrored_fact(read_fact(sign * degrees, angle), angle) == oracles.wrapped(-sign * degrees)
    for text in ("170..-170", "-180", "180", "0..180", "(0..180)", "-180..0", "90, 10 | -180..-170", "Any"):
        cell = read_fact(cdb.cell(text), angle)
        seen = mirrored_fact(cell, angle)
        held = (
            (lambda s, v: s == v if isinstance(s, float) else s.holds(v)) if isinstance(cell, float) else (lambda s, v: s.holds(v))
        )
        for degrees in (-180.0, -175.0, -170.0, -90.0, -1e-300, 0.0, 80.0, 100.0, 170.0, 175.0, 179.99999999999997):
            assert held(seen, oracles.wrapped(-degrees)) == held(cell, degrees)


def test_a_number_is_negated_only_where_it_says_so():
    number = Condition("speed", NUMBER)
    assert mirrored_fact(3.0, number) == 3.0
    assert mirrored_fact(3.0, replace(number, mirror="negate")) == -3.0
    assert str(mirrored_fact(0.0, replace(number, mirror="negate"))) == "0.0"


TURN = {
    "Asset": ["left", "right", "ahead"],
    "direction": ["45..135", "-135..-45", "-45..45"],
}


def test_an_answer_kept_over_a_change_of_facts_stays_that_of_its_moment():
    compiled = Table.from_columns(TURN, {"direction": {"type": "angle"}}).compile()
    facts = {"direction": 88.0}
    live = compiled.live(facts)
    kept, now = compiled.query(facts), live.matches()
    facts["direction"] = 0.0
    live["direction"] = 0.0
    assert (kept.mirrored.assets, now.mirrored.assets) == (["right"], ["right"])
    assert live.matches().mirrored.assets == ["ahead"]


def test_sets_and_lists_of_tags_that_change_later_change_no_answer():
    schema = {"tags": {"type": "tags", "mirror": {"Left": "Right"}}}
    compiled = Table.from_columns({"Asset": ["a", "b"], "tags": ["+Left.Hand", "+Right.Hand"]}, schema).compile()
    tags = {"Left.Hand"}
    answers = [compiled.query({"tags": tags}), compiled.live({"tags": tags}).matches()]
    many = compiled.query_many({"tags": [tags]})
    tags.clear()
    assert [m.mirrored.assets for m in (*answers, many[0])] == [["b"]] * 3


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda answer: pickle.loads(pickle.dumps(answer))])
def test_copied_and_pickled_answers_know_their_mirror(copied):
    compiled = Table.from_columns(TURN, {"direction": {"type": "angle"}}).compile()
    for answer in (compiled.query({"direction": 88.0}), compiled.live({"direction": 88.0}).matches()):
        again = copied(answer)
        assert (again.assets, again.mirrored.assets, again.mirrored.mirrored.assets) == (["left"], ["right"], ["left"])
        assert copied(again).mirrored.assets == ["right"]
    assert len(pickle.dumps(compiled.query({"direction": 88.0}))) < 2000


def test_while_rows_stay_the_same_a_live_answer_still_has_the_mirror_of_now():
    compiled = Table.from_columns(TURN, {"direction": {"type": "angle"}}).compile()
    live = compiled.live({"direction": 44.0})
    assert live.matches().mirrored.assets == ["ahead"]
    live["direction"] = 45.0
    assert (live.matches().assets, live.matches().mirrored.assets) == (["left", "ahead"], ["right", "ahead"])


def test_derived_facts_are_computed_from_mirrored_ones_and_not_mirrored_themselves():
    schema = {
        "direction": {"type": "angle"},
        "turn": {"type": "angle", "expr": "direction + 10"},
        "is_left": {"type": "bool", "expr": "direction > 0"},
    }
    columns = {"Asset": ["a", "b", "c"], "turn": ["40", "-20", "Any"], "is_left": ["Any", "Any", "False"]}
    compiled = Table.from_columns(columns, schema).compile()
    assert list(data_of(compiled).mirroring) == ["direction"]
    facts = {"direction": 30.0}
    answers = [compiled.query(facts), compiled.live(facts).matches(), compiled.query_many({"direction": [30.0]})[0]]
    assert [(m.assets, m.mirrored.assets) for m in answers] == [(["a"], ["b", "c"])] * 3


def test_a_derived_fact_that_the_mirror_leaves_without_value_is_said_to_be_asked_with_mirrored_facts():
    schema = {"side": {"type": "number", "mirror": "negate"}, "half": {"type": "number", "expr": "1 / (side + 2)"}}
    compiled = Table.from_columns({"Asset": ["a"], "half": ["0..1"]}, schema).compile()
    answer = compiled.query({"side": 2.0})
    assert answer.assets == ["a"]
    with pytest.raises(ContextError, match=r'with mirrored facts the fact "half" cannot be computed.*side = -2'):
        _ = answer.mirrored
    with pytest.raises(ContextError, match="with mirrored facts"):
        _ = compiled.query_many({"side": [2.0]}).mirrored
    assert not compiled.query({"side": 2.0}, unknown="never").mirrored


def test_rules_are_asked_with_mirrored_facts():
    schema = {"direction": {"type": "angle"}, "speed": {"type": "number"}}
    settings = replace(cdb.schema.TableSettings("t"), when="When")
    columns = {"Asset": ["l", "r"], "speed": ["Any", "Any"], "When": ["direction > speed", "direction < -speed"]}
    compiled = Table.from_columns(columns, schema, settings).compile()
    facts = {"direction": 30.0, "speed": 20.0}
    live = compiled.live(facts)
    answers = [compiled.query(facts), live.matches(), compiled.query_many({"direction": [30.0], "speed": [20.0]})[0]]
    assert [(m.assets, m.mirrored.assets) for m in answers] == [(["l"], ["r"])] * 3
    live["direction"] = 10.0
    assert (live.matches().assets, live.matches().mirrored.assets) == ([], [])


def test_actors_are_asked_with_mirrored_facts_and_stay_who_they_are():
    schema = {"Foe.direction": {"type": "angle"}, "Foe.side": {"type": "enum", "values": ["L", "R"], "mirror": {"L": "R"}}}
    columns = {"Asset": ["left", "right"], "Foe.direction": ["0..90 ~2", "-90..0"], "Foe.side": ["L", "R"]}
    compiled = Table.from_columns(columns, schema).compile()
    one, two = {"direction": 40.0, "side": "L"}, {"direction": -40.0, "side": "R"}
    live = compiled.live()
    live.actors({"Foe": [one]})
    many = compiled.query_many({}, actors=[{"Foe": [one]}])
    for found in (compiled.query({}, actors={"Foe": [one]}), live.matches(), many[0]):
        one["side"] = "L"
        assert (found.assets, found.mirrored.assets) == (["left"], ["right"])
        assert found.mirrored.casting(1)["Foe"] is one
        assert found.mirrored.mirrored.assets == ["left"]
    assert many.mirrored.lists()[0].tolist() == [1]
    both = compiled.query({}, actors={"Foe": [one, two]})
    assert both.mirrored.casting(0)["Foe"] is two
    kept = compiled.query({}, actors={"Foe": [one]})
    one["direction"] = 0.0
    assert kept.mirrored.assets == ["right"]


@examples(0.3)
@given(st.integers(0, 2**32))
def test_actors_in_a_mirror_match_as_actors_with_mirrored_facts_do(seed):
    rng = random.Random(seed)
    schema = {
        "A.direction": {"type": "angle"},
        "B.side": {"type": "number", "mirror": "negate"},
        "ahead": {"type": "angle"},
        "A.gap": {"type": "angle", "expr": "A.direction - ahead"},
    }
    some = ["0..90", "-90..0", "Any", "30..60", "-180..-120"]
    columns = {"Asset": [f"a{i}" for i in range(20)]} | {n: rng.choices(some, k=20) for n in schema}
    columns["When"] = rng.choices(["", "A.direction > B.side", "ahead < 0"], k=20)
    compiled = Table.from_columns(columns, schema, replace(cdb.schema.TableSettings("t"), when="When")).compile()

    def turned(facts, names=("direction", "side", "ahead")):
        return {n: -v if n in names else v for n, v in facts.items()}

    def actor(i):
        return {"id": i, "direction": rng.choice([-130.0, -45.0, 20.0, 45.0]), "side": rng.choice([-40.0, 10.0, 50.0])}

    actors = {"A": [actor(1), actor(2)], "B": [actor(3), actor(4)]}
    facts = {"ahead": rng.choice([-50.0, 10.0, 70.0])}
    found = compiled.query(facts, actors=actors).mirrored
    seen = compiled.query(turned(facts), actors={role: [turned(a) for a in each] for role, each in actors.items()})
    assert found.indices.tolist() == seen.indices.tolist()
    assert [{r: a["id"] for r, a in found.casting(i).items()} for i in found.rows] == [
        {r: a["id"] for r, a in seen.casting(i).items()} for i in seen.rows
    ]


def test_rows_of_inner_tables_are_asked_with_mirrored_facts():
    schema = {"direction": {"type": "angle"}, "side": {"type": "enum", "values": ["L", "R"], "mirror": {"L": "R"}}}
    inner = Table.from_columns({"Asset": ["in_l", "in_r"], "side": ["L", "R"]}, schema, name="inner")
    outer = Table.from_columns({"Asset": ["@inner", "out"], "direction": ["0..90", "-90..0"]}, schema, name="outer")
    answer = outer.compile(tables={"inner": inner}).query({"direction": -30.0, "side": "R"})
    assert answer.leaves == ["out"]
    assert answer.mirrored.leaves == ["in_l"]


def test_a_compiled_file_asks_in_a_mirror_too(tmp_path):
    schema = {"direction": {"type": "angle"}, "side": {"type": "enum", "values": ["L", "R"], "mirror": {"L": "R"}}}
    compiled = Table.from_columns({**TURN, "side": ["L", "R", "Any"]}, schema).compile()
    compiled.save(tmp_path / "t.safetensors")
    opened = cdb.CompiledTable.open(tmp_path / "t.safetensors")
    assert data_of(opened).mirroring == data_of(compiled).mirroring
    assert opened.query({"direction": 90.0, "side": "L"}).mirrored.assets == ["right"]


def test_answers_without_facts_say_that_there_is_nothing_to_mirror():
    compiled = Table.from_columns(TURN, {"direction": {"type": "angle"}}).compile()
    answer = data_of(compiled).matches(0)
    with pytest.raises(ContextError, match="was computed without facts"):
        _ = answer.mirrored


def test_a_table_whose_facts_no_mirror_changes_answers_the_same_there():
    compiled = Table.from_columns(TURN, {"direction": {"type": "angle", "mirror": "none"}}).compile()
    answer = compiled.query({"direction": 90.0})
    many = compiled.query_many({"direction": [90.0]})
    assert answer.mirrored is answer
    assert many.mirrored is many
    live = compiled.live({"direction": 90.0})
    assert live.matches() is live.matches()


def test_columns_written_later_change_no_answer_in_a_mirror():
    compiled = Table.from_columns(TURN, {"direction": {"type": "angle"}}).compile()
    array, listed = np.array([90.0, 0.0]), [90.0, 0.0]
    answers = [compiled.query_many({"direction": column}) for column in (array, listed, pl.Series(listed))]
    array[:], listed[:] = 0.0, [0.0, 0.0]
    for many in answers:
        assert [m.mirrored.assets for m in many] == [["right"], ["ahead"]]


# ---- conditions that change places

PAIRED = {
    "LeftFoot.Down": {"type": "bool", "mirror": {"Left": "Right"}},
    "RightFoot.Down": {"type": "bool", "mirror": {"Left": "Right"}},
    "LeftFoot.UntilDown_s": {"type": "number", "mirror": {"Right": "Left"}},
    "RightFoot.UntilDown_s": {"type": "number", "mirror": {"Right": "Left"}},
    "direction": {"type": "angle"},
}
FEET = {
    "Asset": ["a", "b", "c", "d"],
    "LeftFoot.Down": ["True", "False", "Any", "True"],
    "RightFoot.Down": ["Any", "True", "False", "Any"],
    "LeftFoot.UntilDown_s": ["Any", "<=0.3", "0.2..", "<=0.5 ~2"],
    "RightFoot.UntilDown_s": ["<0.4", "Any", "Any", "Any"],
    "direction": ["0..90", "Any", "-90..0", "Any"],
}
MOMENTS = st.fixed_dictionaries(
    {
        "LeftFoot.Down": st.booleans(),
        "RightFoot.Down": st.booleans(),
        "LeftFoot.UntilDown_s": st.sampled_from([0.0, 0.3, 0.6]),
        "RightFoot.UntilDown_s": st.sampled_from([0.0, 0.4, 0.6]),
        "direction": st.sampled_from([-45.0, 0.0, 45.0]),
    }
)


def other_side(facts):
    """Facts of the oracle in a mirror: of the other foot, and of the opposite direction."""
    names = {name: name.replace("Left", "*").replace("Right", "Left").replace("*", "Right") for name in facts}
    return {name: -facts[name] if name == "direction" else facts[other] for name, other in names.items()}


@given(st.lists(MOMENTS, min_size=1, max_size=3))
def test_conditions_that_change_places_are_asked_with_the_facts_of_each_other(moments):
    compiled = Table.from_columns(FEET, PAIRED).compile()
    columns = {name: [facts[name] for facts in moments] for name in moments[0]}
    many = compiled.query_many(columns)
    for i, facts in enumerate(moments):
        expected = compiled.query(other_side(facts))
        for answer in (compiled.query(facts), compiled.live(facts).matches(), many[i]):
            assert answer.mirrored.assets == expected.assets
            assert answer.mirrored.penalties.tolist() == expected.penalties.tolist()
            assert answer.mirrored.mirrored.assets == compiled.query(facts).assets


def test_a_stored_table_knows_which_conditions_change_places(tmp_path):
    compiled = Table.from_columns(FEET, PAIRED).compile()
    compiled.save(tmp_path / "feet.safetensors")
    facts = dict.fromkeys(FEET.keys() - {"Asset"}, 0.0) | {"LeftFoot.Down": True, "RightFoot.Down": False}
    again = cdb.CompiledTable.open(tmp_path / "feet.safetensors")
    assert again.query(facts).mirrored.assets == compiled.query(facts).mirrored.assets == compiled.query(other_side(facts)).assets


def test_a_fact_of_the_other_side_that_is_missing_is_missing_in_the_mirror():
    compiled = Table.from_columns(FEET, PAIRED).compile()
    facts = {"LeftFoot.Down": True, "direction": 0.0}
    assert (
        compiled.query(facts, unknown="any").mirrored.assets
        == compiled.query({"RightFoot.Down": True, "direction": 0.0}, unknown="any").assets
    )


def test_a_table_that_asks_for_one_side_alone_sees_its_fact_as_it_is():
    columns = {"Asset": ["a", "b"], "LeftFoot.Down": ["True", "False"]}
    compiled = Table.from_columns(columns, PAIRED).compile()
    assert compiled.query({"LeftFoot.Down": True}).mirrored.assets == ["a"]
