"""A row's own rule: how it is written and refused, asked, explained, checked, measured and kept. See also test_rules_asked."""

import pickle
from itertools import product
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from running import run
from strategies import examples

import contextdb as cdb
from contextdb.checks.cases import Case, judge
from contextdb.checks.effects import effects
from contextdb.checks.run import check, check_rows, unused_conditions
from contextdb.compiled.casting.roles import role_of
from contextdb.compiled.stubs import stubs_of
from contextdb.compiled.table import data_of
from contextdb.edits.diffing import diff
from contextdb.edits.edits import check_cell
from contextdb.errors import ContextError, SchemaError, TableError
from contextdb.expressions.rules import WhenRules
from contextdb.expressions.rules.column import MOST_MENDS
from contextdb.schema.settings import TableSettings, read_schema

SCHEMA = {
    "speed": {"type": "int", "min": 0, "max": 4},
    "target": {"type": "int", "min": 0, "max": 4},
    "gait": {"type": "enum", "values": ["Walk", "Run"]},
    "is_hurt": {"type": "bool"},
    "closing": {"type": "int", "expr": "speed - target"},
}


def table_of(*rules: str, **columns: list[str]) -> cdb.Table:
    texts = {"Asset": [f"a{i}" for i in range(len(rules))], **columns, "When": list(rules)}
    return cdb.Table.from_columns(texts, SCHEMA, TableSettings("table", when="When"))


def refusal(rule: str) -> str:
    with pytest.raises(TableError) as error:
        table_of(rule)
    return str(error.value)


# ---- written


def test_what_a_rule_cannot_mean_is_told_with_its_place_its_character_and_a_mend():
    assert refusal("sped > 2") == (
        'row 1, column "When": "sped > 2", character 1: there is no condition "sped". '
        'Accepted: "speed", "target", "gait", "is_hurt", "closing". Did you mean "speed > 2"?'
    )
    assert "character 1: this place is of type bool, and this is a number" in refusal("speed + 1")
    assert """Did you mean 'gait == "Run"'?""" in refusal('gait == "Rum"')
    assert "character 8: a value is missing at the end" in refusal("speed > ")


def test_every_rule_that_cannot_be_read_is_reported_with_the_cells_that_cannot():
    with pytest.raises(TableError) as error:
        table_of("speed >", "speed > 1", "nobody", gait=["Any", "Jog", "Any"])
    assert [(f.place.row, f.place.column, f.rule) for f in error.value.faults] == [
        (0, "When", "unreadable-cell"),
        (1, "gait", "unknown-value"),
        (2, "When", "unreadable-cell"),
    ]


def test_thousands_of_rules_without_their_condition_are_told_fast_and_the_first_with_a_mend():
    with pytest.raises(TableError) as error:
        table_of(*(f"sped > {i}" for i in range(3000)))
    faults = error.value.faults
    assert [bool(f.mend) for f in faults] == [True] * MOST_MENDS + [False] * (3000 - MOST_MENDS)
    assert faults[-1].found == '"sped > 2999", character 1: there is no condition "sped".'


def test_an_edit_of_a_rule_or_of_its_row_is_read_anew():
    table = table_of("speed > 1", "speed > 2")
    assert table.with_cell(1, "When", "speed > 3").compile().query({"speed": 3}).assets == ["a0"]
    assert table.with_rows_taken([1, 0]).compile().query({"speed": 2}).indices.tolist() == [1]
    assert [f.place.row for f in table.with_cell(1, "When", "speed >").faults] == [1]
    assert check_cell(table, "When", "speed > 3") is None
    assert check_cell(table, "When", "sped > 3").mend == '"speed > 3"'


def test_the_column_of_rules_has_no_other_job_and_is_no_condition():
    text = '[conditions.W]\ntype = "bool"\n[tables.t]\nwhen = "W"\n[tables.u]\nenabled = "E"\nwhen = "E"\n'
    with pytest.raises(SchemaError) as error:
        read_schema(text, "contextdb.toml")
    told = [f.found for f in error.value.faults]
    assert told == [
        '[tables.t] when names "W", which is declared as a condition.',
        '[tables.u] when and enabled both name the column "E".',
    ]
    with pytest.raises(TableError, match=r'there is no column "W", which \[tables.t\] names as when'):
        cdb.Table.from_columns({"A": ["x"]}, settings=TableSettings("t", when="W"))


# ---- asked


def test_a_rule_may_name_facts_that_are_no_columns_and_derived_ones():
    compiled = table_of("closing > 1", "gait == 'Run'").compile()
    assert list(compiled.asked) == ["speed", "target", "gait"]
    assert compiled.query({"speed": 3, "target": 1, "gait": "Walk"}).assets == ["a0"]


def test_a_missing_fact_of_a_rule_is_an_error_or_ignored_or_never():
    compiled = table_of("speed > target", "").compile()
    with pytest.raises(ContextError, match='the fact "target" is missing'):
        compiled.query({"speed": 3})
    assert compiled.query({"speed": 3}, unknown="any").assets == ["a0", "a1"]
    assert compiled.query({"speed": 3}, unknown="never").assets == ["a1"]


def test_a_rule_that_one_side_decides_needs_no_other_fact():
    compiled = table_of("is_hurt or speed > target").compile()
    assert compiled.query({"is_hurt": True}, unknown="never").assets == ["a0"]
    assert compiled.query({"is_hurt": False, "speed": 1}, unknown="never").assets == []


def test_a_rule_without_a_finite_value_is_an_error_where_its_row_is_left():
    compiled = table_of("speed / target > 1", gait=["Run"]).compile()
    facts = {"speed": 1, "target": 0, "gait": "Run"}
    told = 'the rule "speed / target > 1" has no finite value with speed = 1, target = 0'
    for ask in (
        compiled.query,
        lambda f: compiled.live(f).matches(),
        lambda f: compiled.query_many({k: [v] for k, v in f.items()})[0],
    ):
        with pytest.raises(ContextError, match=told):
            ask(facts)
        assert not ask({**facts, "gait": "Walk"})
    assert compiled.query(facts, unknown="any").assets == ["a0"]
    assert compiled.query(facts, unknown="never").assets == []


def test_equal_rules_are_read_once_and_computed_once():
    rules = data_of(table_of("speed > 1", " speed > 1 ", "speed > 2", "Any").compile()).when
    assert [(rule.expression.text, rule.rows) for rule in rules.rules] == [("speed > 1", 0b11), ("speed > 2", 0b100)]
    assert rules.of_row.tolist() == [0, 0, 1, -1]


def test_rules_of_rows_that_the_cells_exclude_are_not_computed():
    compiled = table_of("1 / speed > 1", gait=["Run"]).compile()
    assert compiled.query({"speed": 0, "gait": "Walk"}).assets == []


@pytest.mark.parametrize("n_rules", [1, 40, 130])
def test_many_different_rules_are_found_by_the_rows_that_are_left(n_rules):
    compiled = table_of(
        *(f"speed * 1000 > {i}" for i in range(n_rules)), gait=["Run" if i % 9 else "Walk" for i in range(n_rules)]
    ).compile()
    for speed, gait in product(range(3), ("Run", "Walk")):
        expected = [i for i in range(n_rules) if speed * 1000 > i and gait == ("Run" if i % 9 else "Walk")]
        assert compiled.query({"speed": speed, "gait": gait}).indices.tolist() == expected


def test_pick_soft_cells_saved_contexts_and_stubs_know_rules():
    compiled = table_of("speed > target", "", gait=["Run~3", "Any"]).compile()
    facts = {"speed": 2, "target": 1, "gait": "Walk"}
    assert compiled.query(facts).penalties.tolist() == [3.0, 0.0]
    assert compiled.live(facts).matches().penalties.tolist() == [3.0, 0.0]
    assert {compiled.pick(facts, rng=i) for i in range(30)} == {"a0", "a1"}
    assert compiled.pick({**facts, "target": 2}, rng=1) == "a1"
    assert judge(data_of(compiled), Case("", {"speed": "2", "target": "3", "gait": "Run"}, "a1")).holds
    assert all(f"'{name}'" in stubs_of({"table": compiled}) for name in ("speed", "target", "gait"))


def test_a_set_valued_fact_is_told_exactly_where_a_rule_is_a_box():
    compiled = table_of("speed > 2 and gait == 'Run'", "speed > 2 or gait == 'Run'", "speed > target").compile()
    matches = compiled.query({"speed": "3..4", "gait": cdb.cell("Any"), "target": 1})
    assert matches.indices.tolist() == [0, 1, 2]
    matches = compiled.query({"speed": "3..4", "gait": "Run", "target": 1})
    assert int(matches.always[0]) == 0b011
    assert compiled.query({"speed": "0..1", "gait": "Walk", "target": 1}).indices.tolist() == [2]


# ---- live


def test_a_compiled_table_with_rules_goes_to_another_process():
    compiled = pickle.loads(pickle.dumps(table_of("closing > 1").compile()))
    assert compiled.query({"speed": 3, "target": 1}).assets == ["a0"]


# ---- told


def test_check_tells_rules_that_are_always_or_never_true_and_rows_with_the_same_rule():
    table = table_of("speed >= 0", "speed > 4", "speed > target", " speed > target ", "", gait=["Any"] * 3 + ["Any", "Run"])
    found = [(f.level, f.rule, f.row) for f in check(table)]
    assert found == [("info", "always-true", 0), ("warning", "never-true", 1), ("info", "variety", 2)]


def test_a_condition_that_only_a_rule_names_is_used():
    table = table_of("closing > 1")
    unused = [f.column for f in unused_conditions(table.schema, [table], {})]
    assert unused == ["gait", "is_hurt"]


def test_rules_take_part_in_what_is_found_of_rows():
    table = table_of("speed > 2 and is_hurt", "speed > 1 and is_hurt", "not is_hurt or is_hurt and speed < 0")
    assert [(f.rule, f.row) for f in check_rows(table) if f.row is not None] == [("variety", 1)]


def test_a_row_that_its_rule_and_its_cells_leave_no_context_is_dead_and_one_whose_rule_never_holds_is_told_once():
    table = table_of("speed > 3", "speed > 9", "speed < 2", speed=["<2", "Any", "Any"])
    assert [(f.rule, f.row, "its rule, its cells" in f.message) for f in check_rows(table)] == [("dead-row", 0, True)]
    assert [(f.rule, f.row) for f in check(table)] == [("never-true", 1)]
    assert cdb.coverage(table).covered == pytest.approx(0.4)


def test_a_change_of_a_rule_has_effects_and_other_writing_has_none():
    before = table_of("speed > 1 and is_hurt", "not is_hurt")
    found = effects(before, table_of("speed > 2 and is_hurt", "not is_hurt"))
    assert [(r.asset, [b.cells for b in r.lost]) for r in found.assets] == [("a0", [{"speed": "2", "is_hurt": "True"}])]
    assert [box.cells for box in found.opened] == [{"speed": "2", "is_hurt": "True"}]
    rewritten = table_of(" speed > 1 and is_hurt", "not is_hurt")
    assert diff(before, rewritten)
    assert not effects(before, rewritten)


def test_a_gap_beyond_the_columns_is_told_as_a_rule_that_would_fill_it():
    table = table_of("speed > target", gait=["Run"])
    report = cdb.coverage(table, samples=2000)
    assert {tuple(gap.cells) for gap in report.gaps} == {("gait",), ("When",)}
    [rule] = [gap.cells["When"] for gap in report.gaps if "When" in gap.cells]
    assert rule == "not (speed > target)"
    [alone] = cdb.coverage(table_of("speed > target"), samples=2000).gaps
    assert (alone.nearest.condition, alone.nearest.cell) == ("When", "Any")
    filled = table.with_rows(1, [{"Asset": "more", "When": rule}]).with_rows(1, [{"Asset": "other", "gait": "Walk"}])
    assert not cdb.coverage(filled, samples=2000).gaps


def test_a_rule_of_the_greatest_length_and_depth_is_measured_by_samples():
    long = " or ".join(["speed == 1"] * 285)
    deep = "(" * 60 + "speed > target" + ")" * 60
    table = table_of(f"speed > target and ({long})"[:3990].rpartition(" or ")[0] + ")", deep)
    report = cdb.coverage(table, samples=2000)
    assert report.method == "estimate"
    assert report.covered == pytest.approx(0.4, abs=0.05)


def test_coverage_of_a_compiled_table_with_rules_asks_for_the_table():
    with pytest.raises(ContextError, match="has rules"):
        cdb.coverage(table_of("speed > 1").compile())


BOXED = [
    "",
    "speed > 2",
    "speed > 1 and gait == 'Run'",
    "is_hurt or speed == 0",
    "speed != 2",
    "speed in [1, 3] and not is_hurt",
    "not is_hurt",
]


@examples(0.6)
@given(
    st.lists(
        st.tuples(st.sampled_from(BOXED), st.sampled_from(["Any", "Run", "Walk"]), st.sampled_from(["Any", "1..3"])),
        min_size=1,
        max_size=6,
    )
)
def test_coverage_by_rules_that_boxes_tell_is_that_of_every_context(rows):
    rules, gaits, speeds = map(list, zip(*rows, strict=True))
    table = table_of(*rules, gait=gaits, speed=speeds)
    compiled, worlds = table.compile(), list(product(range(5), ("Walk", "Run"), (False, True)))
    facts = {"speed": [w[0] for w in worlds], "gait": [w[1] for w in worlds], "is_hurt": [w[2] for w in worlds]}
    counts = compiled.query_many(facts).counts
    report = cdb.coverage(table)
    assert report.method == "exact"
    assert report.covered == pytest.approx((counts > 0).mean())
    assert report.overlap.mean == pytest.approx(counts.mean())
    for rule in {f.row for f in report.findings if f.rule == "redundant-row"}:
        others = compiled.query_many(facts).mask
        assert all(not int(m[0]) >> rule & 1 or int(m[0]) & ~(1 << rule) for m in others)


def test_the_command_line_explains_a_rule_and_checks_it(tmp_path: Path):
    schema = '[conditions.speed]\ntype = "number"\n[conditions.gait]\ntype = "enum"\nvalues = ["Walk", "Run"]\n'
    (tmp_path / "contextdb.toml").write_text(schema + '[tables.t]\nwhen = "When"\n')
    (tmp_path / "t.csv").write_text("Asset,gait,When\na,Run,speed > 2\nb,Any,\n")
    found = run("query", tmp_path / "t.csv", "speed=1", "gait=Run", "--explain")
    assert found.code == 0
    assert "When       false with speed = 1  speed > 2  Any" in found.out
    (tmp_path / "t.csv").write_text("Asset,gait,When\na,Run,sped > 2\nb,Any,\n")
    found = run("check", tmp_path)
    assert found.code == 1
    assert "t.csv:2" in found.out
    assert 'there is no condition "sped"' in found.out


def test_a_role_is_what_stands_before_the_first_dot():
    assert [role_of(n) for n in ("Defender.x", "Defender.x.y", ".x", "x", "x.")] == ["Defender", "Defender", "", "", ""]
    assert WhenRules.of(None) is None
