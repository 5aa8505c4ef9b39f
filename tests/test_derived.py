"""Derived facts: computed from the others wherever a table is asked, never given."""

import json
import math
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

import contextdb as cdb
from contextdb import bitmask
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import BOOL, NUMBER
from contextdb.cells.facts import Fact
from contextdb.cells.sets import ANY
from contextdb.checks.cases import Case, judge
from contextdb.cli import main
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ContextError, SchemaError
from contextdb.expressions import derive
from contextdb.schema.settings import Schema, derivation_of, read_schema
from contextdb.tables.table import Table

CONDITIONS = """
[conditions.speed]
type = "number"
unit = "m/s"
[conditions.target_speed]
type = "number"
unit = "m/s"
[conditions.closing_speed]
type = "number"
unit = "m/s"
expr = "speed - target_speed"
[conditions.steps]
type = "int"
expr = "round(abs(closing_speed) * 2)"
[conditions.heading]
type = "angle"
[conditions.turn]
type = "angle"
expr = "heading * 2"
[conditions.is_running]
type = "bool"
expr = "speed > 4 and not (is_hurt and closing_speed < 0)"
[conditions.is_hurt]
type = "bool"
[conditions.gait]
type = "enum"
values = ["Walk", "Run"]
expr = '"Run" if is_running else "Walk"'
[conditions.Tags]
type = "tags"
values = ["InAir", "Move.Run"]
"""
ROWS = {
    "Asset Name": ["close", "far", "turn", "run", "hurt", "any", "soft"],
    "closing_speed": ["0..2", "(2..", "Any", "Any", "..0", "Any", "Any"],
    "steps": ["0 | 2..4", "Any", "Any", "5..", "Any", "Any", "3 ~2"],
    "turn": ["Any", "Any", "170..-170", "Any", "Any", "Any", "Any"],
    "gait": ["Any", "Any", "Any", "Run", "Walk", "Any", "Any"],
    "is_hurt": ["Any", "False", "Any", "Any", "True", "Any", "Any"],
}


def schema() -> Schema:
    return read_schema(CONDITIONS, "contextdb.toml")


def compiled(rows: dict[str, list[str]] = ROWS) -> CompiledTable:
    return Table.from_columns(rows, schema()).compile()


def given_like_any_other() -> CompiledTable:
    """The same table where nothing is derived."""
    plain = Schema(conditions={n: Condition(n, c.domain, c.unit) for n, c in schema().conditions.items()})
    return Table.from_columns(ROWS, plain).compile()


def by_hand(facts: dict[str, Any]) -> dict[str, Any]:
    """The derived facts of a context as a programmer would compute them, None where they are missing."""
    speed, target, hurt, heading = (facts.get(n) for n in ("speed", "target_speed", "is_hurt", "heading"))
    closing = None if speed is None or target is None else speed - target
    backs_off = None if closing is None else closing < 0
    flees = False if hurt is False or backs_off is False else None if hurt is None or backs_off is None else True
    runs = None if speed is None else speed > 4
    running = False if runs is False or flees is True else None if runs is None or flees is None else True
    return {
        "closing_speed": closing,
        "steps": None if closing is None else round(abs(closing) * 2),
        "turn": None if heading is None else heading * 2,
        "gait": None if running is None else "Run" if running else "Walk",
        "is_hurt": hurt,
    }


SPEEDS = st.one_of(st.none(), st.integers(-9, 9), st.floats(-9, 9), st.floats(-9, 9, width=32).map(np.float32))
FACTS = st.fixed_dictionaries(
    {
        "speed": SPEEDS,
        "target_speed": SPEEDS,
        "heading": st.one_of(st.none(), st.floats(-400, 400), st.integers(-400, 400)),
        "is_hurt": st.sampled_from([None, True, False]),
    }
)
MODES = st.sampled_from(["any", "never"])


def doubles(facts: dict[str, Any]) -> dict[str, Any]:
    return {n: float(v) if isinstance(v, np.float32) else v for n, v in facts.items()}


@given(FACTS, MODES)
def test_a_query_answers_as_if_the_derived_facts_had_been_computed_by_hand_and_given(facts, unknown):
    expected = given_like_any_other().query(by_hand(doubles(facts)), unknown=unknown)
    found = compiled().query(facts, unknown=unknown)
    assert found.assets == expected.assets
    assert found.penalties.tolist() == expected.penalties.tolist()


@given(st.lists(FACTS, min_size=1, max_size=5), MODES)
def test_many_contexts_at_once_get_the_answers_of_each(contexts, unknown):
    table = compiled()
    columns = {name: [facts[name] for facts in contexts] for name in contexts[0]}
    many = table.query_many(columns, unknown=unknown)
    assert [rows.tolist() for rows in many.lists()] == [table.query(facts, unknown=unknown).indices.tolist() for facts in contexts]


@given(st.lists(st.tuples(st.sampled_from(["speed", "target_speed", "heading", "is_hurt"]), FACTS, st.booleans())), MODES)
def test_a_live_context_answers_as_a_query_with_its_facts_does(changes, unknown):
    table = compiled()
    live = table.live(unknown=unknown)
    for name, facts, asks in changes:
        live[name] = facts[name]
        if asks:
            assert live.matches().assets == table.query(live.facts, unknown=unknown).assets
    assert live.matches().assets == table.query(live.facts, unknown=unknown).assets
    assert live.matches().penalties.tolist() == table.query(live.facts, unknown=unknown).penalties.tolist()


WHOLE = {"speed": 6.0, "target_speed": 2.0, "heading": 88.0, "is_hurt": False}


def test_a_table_asks_for_what_derived_facts_are_computed_from_and_not_for_them():
    assert list(compiled().asked) == ["is_hurt", "speed", "target_speed", "heading"]
    assert list(given_like_any_other().asked) == ["closing_speed", "steps", "turn", "gait", "is_hurt"]


@pytest.mark.parametrize("ask", ["query", "explain", "pick", "penalties"])
def test_a_derived_fact_that_is_given_is_refused_with_what_it_is_computed_from(ask):
    with pytest.raises(
        ContextError, match=r'column "closing_speed": this fact is derived, and never given.*"speed", "target_speed"'
    ):
        getattr(compiled(), ask)({**WHOLE, "closing_speed": 4.0})


def test_a_derived_fact_that_is_given_is_refused_in_columns_and_live_too():
    table = compiled()
    with pytest.raises(ContextError, match="never given"):
        table.query_many({**{n: [v] for n, v in WHOLE.items()}, "gait": ["Run"]})
    live = table.live(WHOLE)
    with pytest.raises(ContextError, match="never given"):
        live["gait"] = "Run"
    with pytest.raises(ContextError, match="never given"):
        live.update({"gait": "Run"})
    assert live["gait"] == "Run"
    assert live["closing_speed"] == 4.0
    assert "gait" in live
    assert "nothing" not in live
    assert "turn" not in live.facts
    with pytest.raises(ContextError, match=r'no condition "sped"\. Accepted: .*Did you mean "speed"'):
        live["sped"] = 1.0


def test_a_missing_fact_that_a_derived_one_needs_is_named():
    table = compiled()
    facts = {"speed": 1.0, "heading": 0, "is_hurt": True}
    with pytest.raises(ContextError, match=r'the fact "target_speed" is missing'):
        table.query(facts)
    with pytest.raises(ContextError, match=r'"target_speed" is missing'):
        table.live(facts).matches()
    with pytest.raises(ContextError, match=r'the fact "target_speed" is missing'):
        table.query_many({n: [v] for n, v in facts.items()})
    with pytest.raises(ContextError, match=r'row 1, column "target_speed": the fact is missing in 1 context'):
        table.query_many({**{n: [v] for n, v in facts.items()}, "target_speed": [None]})
    with pytest.raises(ContextError, match=r'no condition "target_sped", and "target_speed" is missing'):
        table.query({**facts, "target_sped": 1.0}, unknown="any")
    with pytest.raises(ContextError, match=r'no condition "target_sped", and "target_speed" is missing'):
        table.query_many({**{n: [v] for n, v in facts.items()}, "target_sped": [1.0]}, unknown="any")


@pytest.mark.parametrize("speed", [3.0, 5.0])
@pytest.mark.parametrize("is_hurt", [{}, {"is_hurt": None}, {"is_hurt": math.nan}])
def test_a_fact_that_is_computed_needs_all_that_it_names_whether_or_not_the_others_decide_it(speed, is_hurt):
    table = compiled({"Asset Name": ["walk", "run"], "gait": ["Walk", "Run"]})
    facts = {"speed": speed, "target_speed": 9.0, **is_hurt}
    columns = {name: [value] for name, value in facts.items()}
    for ask in (table.query, table.explain, lambda f: table.query_many(columns), lambda f: table.live(f).matches()):
        with pytest.raises(ContextError, match='"is_hurt"'):
            ask(facts)
    live = table.live({**facts, "is_hurt": True})
    assert live.matches().assets == ["walk"]
    live["is_hurt"] = None
    for _ in range(2):
        with pytest.raises(ContextError, match='"is_hurt" is missing'):
            live.matches()
    assert live.copy()["gait"] == "Walk" if speed == 3.0 else "gait" not in live
    for unknown in ("any", "never"):
        known = table.query(facts, unknown=unknown).assets
        assert known == (["walk"] if speed == 3.0 else ["walk", "run"] if unknown == "any" else [])
        assert table.query_many(columns, unknown=unknown)[0].assets == table.live(facts, unknown=unknown).matches().assets == known


def ratio() -> CompiledTable:
    conditions = {c.name: c for c in (Condition("a", NUMBER), Condition("b", NUMBER), Condition("r", NUMBER, expr="a / b"))}
    return Table.from_columns({"Asset Name": ["x", "y"], "r": ["0..2", "Any"]}, Schema(conditions=conditions)).compile()


def test_a_division_by_zero_is_a_missing_fact_like_any_other():
    table = ratio()
    assert table.query({"a": 1, "b": 1}).assets == ["x", "y"]
    assert table.query({"a": 1, "b": 0}, unknown="any").assets == ["x", "y"]
    assert table.query({"a": 1, "b": 0}, unknown="never").assets == ["y"]
    with pytest.raises(ContextError, match=r'"r" cannot be computed: "a / b" has no finite value with a = 1, b = 0'):
        table.query({"a": 1, "b": 0})
    with pytest.raises(ContextError, match=r'row 2, column "r": .*1 context: its expression has no finite value'):
        table.query_many({"a": [1, 1], "b": [1, 0]})


def test_a_set_of_values_leaves_a_derived_fact_open():
    table = ratio()
    found = table.query({"a": cdb.cell("1..2"), "b": 1})
    assert found.assets == ["x", "y"]
    assert bitmask.unpack(found.always, 2).tolist() == [False, True]
    assert table.explain({"a": cdb.cell("1..2"), "b": 1}).facts["r"] == ANY


def test_a_wrong_fact_that_is_no_column_is_an_error():
    table = compiled()
    with pytest.raises(ContextError, match=r'column "target_speed": str|"fast"|cannot read "fast"'):
        table.query({**WHOLE, "target_speed": "fast"})
    with pytest.raises(ContextError):
        table.live(WHOLE)["target_speed"] = "fast"
    with pytest.raises(ContextError, match=r'row 1, column "target_speed"'):
        table.query_many({**{n: [v] for n, v in WHOLE.items()}, "target_speed": ["fast"]})


def test_an_explanation_tells_the_derived_facts():
    explanation = compiled().explain(WHOLE)
    facts: dict[str, Fact] = explanation.facts
    assert facts == {"closing_speed": 4.0, "steps": 8.0, "turn": 176.0, "gait": "Run", "is_hurt": False}
    assert "closing_speed is 4 m/s" in str(explanation.asset("close")[0])


def test_a_pick_sees_derived_facts():
    table = compiled()
    assert table.query(WHOLE).assets == ["far", "turn", "run", "any", "soft"]
    assert table.pick(WHOLE, rng=1) in table.query(WHOLE).assets


def test_what_computes_facts_can_be_sent_to_another_process():
    derivation = derivation_of(schema(), schema().conditions)
    assert derivation is not None
    expected = derivation.compute(WHOLE)
    assert pickle.loads(pickle.dumps(derivation)).compute(WHOLE) == expected


def test_an_artefact_computes_what_the_table_does(tmp_path: Path):
    table = compiled()
    table.save(tmp_path / "t.safetensors")
    opened = CompiledTable.open(tmp_path / "t.safetensors")
    assert opened.query(WHOLE).assets == table.query(WHOLE).assets
    assert list(opened.asked) == list(table.asked)


def test_a_frame_of_polars_columns_is_read_without_the_facts_that_nobody_asks_for():
    frame = pl.DataFrame({**{n: [v] * 3 for n, v in WHOLE.items()}, "note": ["a", "b", "c"], "is_running": [None] * 3}).drop(
        "is_running"
    )
    assert compiled().query_many(frame).counts.tolist() == [5, 5, 5]


def test_the_command_query_takes_the_facts_that_others_are_computed_from(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    (tmp_path / "contextdb.toml").write_text(CONDITIONS + '\n[tables.moves]\nfile = "moves.csv"\n', encoding="utf-8")
    rows = ["Asset Name,closing_speed,gait", "a,0..2,Any", "b,(2..,Run", ""]
    (tmp_path / "moves.csv").write_text("\n".join(rows), encoding="utf-8")
    table = str(tmp_path / "moves.csv")
    assert main(["query", table, "speed=6", "target_speed=2", "is_hurt=False"]) == 0
    assert "b" in capsys.readouterr().out
    assert main(["query", table, "speed=6", "closing_speed=2"]) == 2
    assert 'column "closing_speed": this fact is derived, and never given.' in capsys.readouterr().err
    assert main(["query", table, "speed=6", "target_sped=2"]) == 2
    assert 'Did you mean "target_speed"?' in capsys.readouterr().err


def test_the_command_evaluate_computes_derived_facts_of_every_context(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    (tmp_path / "contextdb.toml").write_text(CONDITIONS, encoding="utf-8")
    (tmp_path / "moves.csv").write_text("Asset Name,closing_speed,gait\na,0..2,Any\nb,(2..,Run\n", encoding="utf-8")
    given = pl.DataFrame({"speed": [6.0, 3.0], "target_speed": [2.0, 2.0], "is_hurt": [False, True], "note": ["x", "y"]})
    given.write_csv(tmp_path / "seen.csv")
    given.write_parquet(tmp_path / "seen.parquet")
    for seen in ("seen.csv", "seen.parquet"):
        assert main(["evaluate", str(tmp_path / "moves.csv"), str(tmp_path / seen), "--json"]) == 0
        assert [row["hits"] for row in json.loads(capsys.readouterr().out)["rows"]] == [1, 1]
    given.with_columns(gait=pl.lit("Run")).write_csv(tmp_path / "more.csv")
    assert main(["evaluate", str(tmp_path / "moves.csv"), str(tmp_path / "more.csv")]) == 2
    assert 'more.csv, column "gait": this fact is derived, and never given.' in capsys.readouterr().err


def test_a_saved_context_holds_the_facts_that_others_are_computed_from():
    case = Case("fast", {"speed": "6", "target_speed": "2", "is_hurt": "False"}, "b")
    table = compiled({"Asset Name": ["a", "b"], "closing_speed": ["0..2", "(2.."], "gait": ["Any", "Run"]})
    assert judge(data_of(table), case).holds
    wrong = judge(data_of(table), replace(case, facts={**case.facts, "gait": "Run"}))
    assert "never given" in str(wrong.faults[0])


def lines(text: str) -> list[str]:
    with pytest.raises(SchemaError) as caught:
        read_schema(text, "contextdb.toml")
    return str(caught.value).split("\n")


def test_every_fault_of_every_expression_is_told_with_its_line_and_character():
    text = """[conditions.speed]
type = "number"
unit = "m/s"
[conditions.distance]
type = "number"
unit = "m"
[conditions.gait]
type = "enum"
values = ["Walk", "Run"]
[conditions.near]
type = "bool"
description = "x"
expr = "distance < sped * 2"
[conditions.sum]
type = "number"
expr = "speed + distance"
[conditions.step]
type = "enum"
values = ["Walk"]
expr = "gait"
[tables.t]
assume = ["gait == \\"Runn\\"", "of_the_table_alone > 3"]
"""
    assert lines(text) == [
        'contextdb.toml, line 13: [conditions.near] expr "distance < sped * 2", character 12: there is no condition "sped". '
        'Accepted: "speed", "distance", "gait", "near", "sum", "step". Did you mean "distance < speed * 2"?',
        'contextdb.toml, line 16: [conditions.sum] expr "speed + distance", character 1: "m/s" and "m" are two units. '
        "Accepted: one unit; a factor, as in * 3.6, takes a number out of its unit.",
        'contextdb.toml, line 20: [conditions.step] expr "gait", character 1: "Run" is not a declared value of "step". '
        'Accepted: "Walk".',
        'contextdb.toml, line 22: [tables.t] assume \'gait == "Runn"\', character 9: "Runn" is not a declared value. '
        'Accepted: "Run", "Walk". Did you mean \'gait == "Run"\'?',
    ]


def test_a_circle_of_derived_facts_is_told_with_its_path_once():
    text = "".join(f'[conditions.{a}]\ntype = "number"\nexpr = "{b} + 1"\n' for a, b in ("ab", "bc", "ca", "da", "ee"))
    assert lines(text) == [
        'contextdb.toml, line 3: [conditions.a] expr "a" is computed from itself: a → b → c → a. '
        "Accepted: facts that are not computed from it.",
        'contextdb.toml, line 15: [conditions.e] expr "e" is computed from itself: e → e. '
        "Accepted: facts that are not computed from it.",
    ]


def test_a_schema_in_python_is_checked_as_a_file_is():
    with pytest.raises(SchemaError, match=r'\[conditions.x\] expr "y", character 1: there is no condition "y"'):
        Table.from_columns({"a": ["b"]}, {"x": {"type": "bool", "expr": "y"}})
    made = Schema(conditions={"x": Condition("x", BOOL, expr="y")})
    with pytest.raises(SchemaError, match='there is no condition "y"'):
        Table.from_columns({"a": ["b"], "x": ["True"]}, made).compile()


def test_an_infinite_fact_stays_infinite_where_it_is_only_handed_on():
    conditions = {
        c.name: c for c in (Condition("a", NUMBER), Condition("same", NUMBER, expr="a"), Condition("more", NUMBER, expr="a + 1"))
    }
    facts = derive(conditions).complete({"a": math.inf})
    assert facts["same"] == math.inf
    assert facts["more"] is None
