"""Casting wherever a table is asked: live, many contexts, explained, with derived facts, soft cells, and from the command line."""

import json

import pytest

import contextdb as cdb
from contextdb.cli import main
from contextdb.errors import ContextError
from contextdb.schema.settings import TableSettings

SCHEMA = {
    "down": {"type": "int"},
    "Defender.speed": {"type": "number"},
    "Receiver.speed": {"type": "number"},
}
COLUMNS = {"Asset Name": ["one", "two"], "down": ["1", "Any"], "Defender.speed": ["3..", "..5"], "Receiver.speed": ["Any", "2.."]}
SLOW, FAST = {"id": "slow", "speed": 1.0}, {"id": "fast", "speed": 9.0}


def compiled_table(columns=COLUMNS, schema=SCHEMA):
    return cdb.Table.from_columns(columns, schema, TableSettings(name="table")).compile()


def test_a_live_context_answers_with_its_actors_until_they_are_taken_back():
    compiled = compiled_table()
    live = compiled.live({"down": 1})
    live.actors({"Defender": [SLOW, FAST], "Receiver": [FAST]})
    assert live.matches().indices.tolist() == [0, 1]
    assert live.matches().casting(1) == {"Defender": SLOW, "Receiver": FAST}
    live["down"] = 2
    assert live.matches().indices.tolist() == [1]
    live.actors(None)
    with pytest.raises(ContextError, match="missing"):
        live.matches()


def test_many_contexts_take_one_cast_for_all_or_one_for_each():
    compiled = compiled_table()
    both = {"Defender": [SLOW, FAST], "Receiver": [FAST]}
    many = compiled.query_many({"down": [1, 2]}, actors=both)
    assert many.counts.tolist() == [2, 1]
    assert many.hits.tolist() == [1, 2]
    assert [rows.tolist() for rows in many.lists()] == [[0, 1], [1]]
    assert many.mask.tolist() == [[3], [2]]
    each = compiled.query_many({"down": [1, 2]}, actors=[both, {}])
    assert each.counts.tolist() == [2, 0]
    with pytest.raises(ContextError, match="actors for 1 context"):
        compiled.query_many({"down": [1, 2]}, actors=[both])
    with pytest.raises(ContextError, match="row 2"):
        compiled.query_many({"down": [1, "x"]}, actors=both)


def test_an_explanation_names_the_role_and_whose_fact_is_in_the_way():
    compiled = compiled_table()
    told = compiled.explain({"down": 1}, actors={"Defender": [SLOW], "Receiver": [SLOW]})
    assert "Defender.speed is 1 of slow, the cell says 3.." in str(told.row(0))
    assert "Receiver.speed is 1 of slow, the cell says 2.." in str(told.row(1))
    steady = {"id": "steady", "speed": 4.0}
    told = compiled.explain({"down": 1}, actors={"Defender": [steady], "Receiver": [steady]})
    assert "Receiver is not filled: steady plays Defender" in str(told.row(1))
    told = compiled.explain({"down": 1}, actors={"Receiver": [steady]})
    assert "Defender is not filled: nobody is offered" in str(told.row(0))


def test_a_derived_fact_of_a_role_is_computed_for_each_actor():
    schema = SCHEMA | {"wind": {"type": "number"}, "Defender.ground": {"type": "number", "expr": "Defender.speed - wind"}}
    compiled = compiled_table({"Asset Name": ["one"], "Defender.ground": ["5.."]}, schema)
    matches = compiled.query({"wind": 2.0}, actors={"Defender": [{"id": 0, "speed": 6.0}, {"id": 1, "speed": 7.5}]})
    assert [c["Defender"]["id"] for c in matches.castings(0)] == [1]
    with pytest.raises(ContextError, match="derived"):
        compiled.query({"wind": 2.0}, actors={"Defender": [{"ground": 6.0}]})


def test_a_soft_cell_of_a_role_costs_for_the_actor_who_is_cast():
    columns = {"Asset Name": ["one"], "down": ["1 ~2"], "Defender.speed": ["5.. ~3"], "Receiver.speed": ["2.."]}
    compiled = compiled_table(columns)
    matches = compiled.query({"down": 2}, actors={"Receiver": [FAST]})
    assert matches.penalties.tolist() == [2.0]
    columns["Asset Name"] = ["one"]
    table = cdb.Table.from_columns(
        columns | {"Mandatory_Slots": ["Defender"]}, SCHEMA, TableSettings(name="table", outputs=("Mandatory_Slots",))
    )
    matches = table.compile().query({"down": 2}, actors={"Receiver": [FAST], "Defender": [SLOW]})
    assert matches.penalties.tolist() == [5.0]


def test_a_set_of_values_of_an_actor_may_match_or_always_match():
    matches = compiled_table().query(
        {"down": 1}, actors={"Defender": [{"speed": cdb.cell("2..4")}], "Receiver": [{"speed": cdb.cell("2..4")}]}
    )
    assert matches.indices.tolist() == [0, 1]
    assert matches.always.tolist() == [2]


def test_a_fact_of_another_role_is_not_taken_for_a_slip():
    schema = {"Receiver.stance": {"type": "bool"}, "Defender.stances": {"type": "number"}}
    columns = {"Asset Name": ["one"], "Receiver.stance": ["True"], "Defender.stances": ["Any"]}
    actor = {"id": 1, "stance": True}
    compiled = compiled_table(columns, schema)
    matches = compiled.query({}, unknown="any", actors={"Receiver": [actor], "Defender": [actor]})
    assert matches.casting(0) == {"Receiver": actor}
    with pytest.raises(cdb.ContextError, match=r'Did you mean "Defender\.stances"'):
        compiled.query({}, unknown="any", actors={"Defender": [{"id": 2, "stancess": 1.0}]})


def test_the_command_line_casts_numbered_actors(tmp_path, monkeypatch, capsys):
    (tmp_path / "plays.csv").write_text("Asset Name,down,Defender.speed\none,1,3..\ntwo,Any,..5\n", encoding="utf-8")
    (tmp_path / "contextdb.toml").write_text('[conditions."Defender.speed"]\ntype = "number"\n', encoding="utf-8")
    asked = ["query", str(tmp_path / "plays.csv"), "down=1", "Defender[0].speed=1", "Defender[1].speed=4"]
    assert main([*asked, "Defender[1].id=Marsh", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["matches"]
    assert [(r["row"], r["casting"]) for r in rows] == [(0, {"Defender": "[1] Marsh"}), (1, {"Defender": "[0]"})]
    assert main([*asked, "--prefer=-speed"]) == 0
    assert "Defender: [1]" in capsys.readouterr().out
    assert main([*asked, "Defender[1].speed=4"]) == 2
    assert "given twice" in capsys.readouterr().err
    assert main([*asked[:3], "Defnder[0].speed=1"]) == 2
    assert "Defender" in capsys.readouterr().err
    assert main([*asked[:3], "--unknown", "any", "--prefer", "speed"]) == 2
    assert "no actors" in capsys.readouterr().err


def test_a_derived_role_whose_inputs_stand_in_the_context_is_not_cast():
    schema = SCHEMA | {"Defender.ground": {"type": "number", "expr": "Defender.speed - 2"}}
    compiled = compiled_table({"Asset Name": ["one"], "Defender.ground": ["5.."], "Receiver.speed": ["2.."]}, schema)
    matches = compiled.query({"Defender.speed": 8.0}, actors={"Receiver": [FAST]})
    assert matches.casting(0) == {"Receiver": FAST}


@pytest.mark.parametrize("rule", ["is_open", "Receiver.speed > space", "Receiver.lead > 1"])
def test_a_rule_over_facts_that_are_computed_from_computed_ones_is_asked_with_actors(rule: str):
    schema = SCHEMA | {
        "width": {"type": "number"},
        "space": {"type": "number", "expr": "width - 2"},
        "is_open": {"type": "bool", "expr": "space > 1 or is_wet"},
        "is_wet": {"type": "bool"},
        "Receiver.lead": {"type": "number", "expr": "Receiver.speed - space"},
    }
    columns = {"Asset Name": ["one"], "Receiver.speed": ["2.."], "When": [rule]}
    compiled = cdb.Table.from_columns(columns, schema, TableSettings(name="table", when="When")).compile()
    actors = {"Receiver": [FAST]}
    wide, narrow = {"width": 2.0 if "lead" in rule else 4.0, "is_wet": False}, {"width": 99.0, "is_wet": False}
    assert compiled.query(wide, actors=actors)
    assert bool(compiled.query(narrow, actors=actors)) == (rule == "is_open")
    with pytest.raises(cdb.ContextError, match='"width"'):
        compiled.query({"is_wet": True}, actors=actors)
    if rule == "is_open":  # it is decided without the width, which is needed all the same
        with pytest.raises(cdb.ContextError, match='"width"'):
            compiled.query({"is_wet": True, "Receiver.speed": 5.0})
