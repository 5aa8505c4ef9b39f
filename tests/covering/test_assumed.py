"""Coverage of tables with assumptions and derived facts: exact where boxes can tell, else estimated from what can happen."""

import pytest

import contextdb as cdb
from contextdb.covering import pairs
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table

SPEEDS = {name: {"type": "number", "min": 0, "max": 10} for name in ("speed", "target_speed")}


def table_of(columns: dict[str, list[str]], schema: dict[str, dict[str, object]], *assume: str, policy: str = "collect") -> Table:
    return Table.from_columns(columns, schema, TableSettings("t", assume=assume, policy=policy))


def test_the_tables_own_assumptions_are_read():
    schema = {"p": {"type": "bool"}, "q": {"type": "bool"}}
    table = table_of({"Asset": ["x", "y"], "p": ["True", "False"], "q": ["False", "Any"]}, schema, "not (p and q)")
    report = cdb.coverage(table)
    assert (report.covered, report.method, report.gaps) == (1.0, "exact", ())
    assert (report.assumptions, report.sampled) == (("not (p and q)",), ())
    assert cdb.coverage(table, assume=False).covered == 0.75
    assert cdb.coverage(table.compile()).covered == 0.75


def test_an_assumption_that_compares_facts_gives_an_estimate_that_says_so():
    # Half of the square can happen: speed below target_speed. Of that triangle, speed under 5 is three quarters.
    table = table_of({"Asset": ["slow"], "speed": ["..5"], "target_speed": ["Any"]}, SPEEDS, "speed < target_speed")
    report = cdb.coverage(table)
    assert report.method == "estimate"
    assert report.lower < 0.75 < report.upper
    assert report.upper - report.lower < 0.02
    assert report.sampled == ("speed < target_speed",)
    assert report.certain == (0.0, 1.0)
    assert report == cdb.coverage(table)
    (gap,) = report.gaps
    assert (gap.cells, gap.is_exact) == ({"speed": "(5..10]"}, False)
    assert gap.share == pytest.approx(0.25, abs=0.01)
    assert report.hits[0] == pytest.approx(0.75, abs=0.01)


def test_a_gap_that_cannot_happen_is_left_out_and_the_list_is_not_called_complete():
    columns = {"Asset": ["a", "b"], "speed": ["..5", "(5.."], "target_speed": ["Any", "(5.."]}
    report = cdb.coverage(table_of(columns, SPEEDS, "speed < target_speed"))
    assert (report.gaps, report.gaps_complete) == ((), False)
    assert report.upper == 1.0


def test_a_derived_fact_is_computed_and_not_drawn():
    schema = {**SPEEDS, "closing": {"type": "number", "min": -10, "max": 10, "expr": "speed - target_speed"}}
    table = table_of({"Asset": ["a"], "speed": ["Any"], "closing": ["0.."]}, schema)
    report = cdb.coverage(table)
    assert report.method == "estimate"
    assert report.lower < 0.5 < report.upper
    assert report.sampled == ("closing = speed - target_speed",)
    both = table_of({"Asset": ["a"], "speed": ["..2"], "closing": ["(2.."]}, schema)
    assert cdb.coverage(both, samples=2000).covered == 0.0


def test_a_derived_bool_over_conditions_of_the_table_stays_exact():
    schema = {"speed": {"type": "number", "min": 0, "max": 10}, "runs": {"type": "bool", "expr": "speed > 4"}}
    table = table_of({"Asset": ["walk", "run"], "speed": ["0..4", "(4..10]"], "runs": ["False", "True"]}, schema)
    report = cdb.coverage(table)
    assert (report.covered, report.method, report.sampled) == (1.0, "exact", ())


def test_tags_enums_and_facts_that_the_table_does_not_have_may_stand_in_assumptions():
    schema = {
        "Tags": {"type": "tags", "values": ["Move", "Move.Run", "Air"]},
        "gait": {"type": "enum", "values": ["Walk", "Run"]},
        "n": {"type": "int", "min": 1, "max": 4},
        "limit": {"type": "int", "min": 0, "max": 4},
    }
    columns = {"Asset": ["a", "b"], "Tags": ["+Move", "Any"], "gait": ["Any", "Run"], "n": ["Any", "3.."]}
    table = table_of(columns, schema, "n <= limit", "'Air' not in Tags or n + 1 > limit")
    report = cdb.coverage(table, samples=20_000)
    # n ≤ limit leaves 10 of the pairs (n, limit); with Air (half) only the 4 where they are equal: 7 in all, of weight 5 and 2.
    # Covered: Move, 3 of 4; else Run and n ≥ 3: of 10 pairs 3, of the 4 equal ones 2.
    weight, valid = 10 + 4, 10 * (0.75 + 0.25 * 0.5 * 0.3) + 4 * (0.75 + 0.25 * 0.5 * 0.5)
    assert report.lower < valid / weight < report.upper
    assert report.method == "estimate"


def test_rows_that_meet_only_where_nothing_can_happen_do_not_break_the_policy_unique():
    columns = {"Asset": ["a", "b"], "speed": ["..5", "4.."], "target_speed": ["..4", "Any"]}
    overlap = table_of(columns, SPEEDS, policy="unique")
    assert [f.rule for f in cdb.coverage(overlap).findings if f.rule == "policy-overlap"] == ["policy-overlap"]
    apart = table_of(columns, SPEEDS, "speed + 1 < target_speed", policy="unique")
    assert [f.rule for f in cdb.coverage(apart).findings if f.rule == "policy-overlap"] == []


def test_pairs_of_conditions_leave_out_what_cannot_happen():
    table = table_of({"Asset": ["slow"], "speed": ["..5"], "target_speed": ["..5"]}, SPEEDS, "speed < target_speed")
    found = pairs(table, samples=20_000)
    assert found.method == "estimate"
    worst = {tuple(s.cells.values()): s for s in found.slices(0, 1)}
    assert worst["(5..10]", "0..5"].n_samples == 0


def test_nothing_sampled_is_nothing_known():
    table = table_of({"Asset": ["slow"], "speed": ["..5"], "target_speed": ["Any"]}, SPEEDS, "speed < target_speed")
    report = cdb.coverage(table, samples=0)
    assert (report.lower, report.upper, report.method) == (0.0, 1.0, "bounds")
    impossible = table_of({"Asset": ["slow"], "speed": ["..5"], "target_speed": ["Any"]}, SPEEDS, "speed > target_speed + 20")
    assert (cdb.coverage(impossible).lower, cdb.coverage(impossible).upper) == (0.0, 1.0)


def test_everything_covered_is_certain_whatever_is_assumed():
    table = table_of({"Asset": ["all"], "speed": ["Any"], "target_speed": ["Any"]}, SPEEDS, "speed < target_speed")
    report = cdb.coverage(table, samples=100)
    assert (report.covered, report.method, report.gaps_complete) == (1.0, "exact", True)


def test_an_assumption_about_facts_that_no_row_restricts_leaves_the_share_exact():
    schema = {**SPEEDS, "p": {"type": "bool"}, "extra": {"type": "number", "min": 0, "max": 1}}
    columns = {"Asset": ["a"], "p": ["True"], "speed": ["Any"], "target_speed": ["Any"]}
    report = cdb.coverage(table_of(columns, schema, "speed < target_speed", "extra * 2 < 1"))
    assert (report.covered, report.method, report.sampled) == (0.5, "exact", ())
    tied = cdb.coverage(table_of(columns, schema, "speed < target_speed", "target_speed < 1 or (p and extra * 2 < 1)"))
    assert (tied.method, tied.sampled) == ("estimate", ("speed < target_speed", "target_speed < 1 or (p and extra * 2 < 1)"))


@pytest.mark.parametrize("cell", ["7..10", "9..10", "3", "..10", "7.."])
def test_a_whole_number_without_bounds_under_a_derived_fact_is_drawn_whole(cell):
    schema = {"m": {"type": "int"}, "d": {"type": "number", "expr": "m * 30"}}
    report = cdb.coverage(table_of({"Asset": ["a"], "m": [cell], "d": ["3.."]}, schema), samples=2000)
    assert report.method == "estimate"
    assert 0.0 < report.lower < report.upper < 1.0


@pytest.mark.parametrize("assume", ["-90 <= heading <= 90", "heading >= -90 and heading <= 90", "heading in '-90..90'"])
def test_half_a_turn_is_one_of_its_two_names_throughout_an_assumption(assume):
    schema = {"heading": {"type": "angle"}, "p": {"type": "bool"}}
    columns = {"Asset": ["a", "b"], "heading": ["-90..90", "-90..90"], "p": ["True", "False"]}
    report = cdb.coverage(table_of(columns, schema, assume))
    assert (report.covered, report.method, report.gaps, report.gaps_complete) == (1.0, "exact", (), True)
    (gap,) = cdb.coverage(table_of(columns, schema, f"not p or ({assume})")).gaps
    assert gap.cells == {"heading": "(90..-90)"}
    (gap,) = cdb.coverage(table_of(columns, schema, "heading <= 90")).gaps
    assert gap.share == pytest.approx(1 / 3)


def test_an_assumption_about_a_derived_fact_that_is_no_column_leaves_its_contexts_out():
    schema = {"p": {"type": "bool"}, "q": {"type": "bool"}, "both": {"type": "bool", "expr": "p and q"}}
    table = table_of({"Asset": ["a"], "p": ["True"], "q": ["True"]}, schema, "both")
    report = cdb.coverage(table, samples=1000)
    assert (report.lower <= 1.0 <= report.upper, report.gaps) == (True, ())


def test_assumptions_that_contradict_each_other_leave_no_context_whatever_the_rows_restrict():
    schema = {"p": {"type": "bool"}, "n": {"type": "int", "min": 0, "max": 4}}
    table = table_of({"Asset": ["a"], "p": ["True"]}, schema, "n > 7")
    report = cdb.coverage(table)
    assert ([f.rule for f in report.findings], report.gaps) == (["no-context"], ())
