"""Tables inside tables in a folder: how their rows are named and picked, what is refused and where, and what a check finds."""

from collections.abc import Mapping
from pathlib import Path

import pytest
from nested_files import AIR, write
from nested_tables import flat_rows
from running import run

import contextdb as cdb
from contextdb.checks.run import check, check_rows
from contextdb.schema.settings import TableSettings
from contextdb.tables.nesting.links import inner_rows
from contextdb.tables.table import leaf_assets


def rules(findings: list[cdb.Finding]) -> dict[str, list[int | None]]:
    found: dict[str, list[int | None]] = {}
    for finding in findings:
        found.setdefault(finding.rule, []).append(finding.row)
    return found


# ---- names and places


def test_a_row_inside_is_named_by_its_path_and_a_plain_row_by_its_asset(tmp_path: Path):
    table = cdb.load(write(tmp_path) / "tackle.csv")
    matches = table.compile().query(AIR)
    assert matches.assets == ["tackle/dive/Left", "tackle/dive/Right", "Fall"]
    assert matches.leaves == ["Left", "Right", "Fall"]
    assert table.assets == ["Hit", "@dive", "Fall"]


def test_a_row_knows_the_file_and_line_of_every_row_on_its_way(tmp_path: Path):
    compiled = cdb.load(write(tmp_path) / "tackle.csv").compile()
    steps = compiled.way(2)
    assert [(s.table, s.row, s.asset) for s in steps] == [("tackle", 1, "@dive"), ("dive", 1, "Right")]
    assert [str(s) for s in steps] == [f"{tmp_path / 'tackle.csv'}, line 3", f"{tmp_path / 'dive.csv'}, line 3"]


def test_a_table_without_tables_inside_has_ways_of_one_step():
    table = cdb.Table.from_columns({"Asset": ["a", "b"], "speed": ["1", "2"]})
    assert table.flat() is table
    compiled = table.compile()
    assert [(s.table, s.row, s.asset) for s in compiled.way(1)] == [("table", 1, "b")]
    assert compiled.leaves is compiled.assets


def test_flat_rows_tell_where_the_rows_of_a_table_have_gone(tmp_path: Path):
    table = cdb.load(write(tmp_path) / "tackle.csv")
    assert [rows.tolist() for rows in flat_rows(table, table.flat())] == [[0], [1, 2, 3], [4]]
    plain = cdb.load(tmp_path / "dive.csv")
    assert [rows.tolist() for rows in flat_rows(plain, plain.flat())] == [[0], [1], [2]]
    assert inner_rows(table) == {"dive": [1]}
    assert leaf_assets(table) == ["Hit", "Left", "Right", "Slow", "Fall"]


def test_tables_nest_to_any_depth_and_a_table_may_stand_in_several_places(tmp_path: Path):
    write(tmp_path, low="Asset,speed\nRoll,..5\n", dive="Asset,Weight,speed\n@low,1,4..\nRight,1,Any\n@low,1,Any\n")
    compiled = cdb.load(tmp_path / "tackle.csv").compile()
    assert compiled.assets == ["Hit", "tackle/dive/low/Roll", "tackle/dive/Right", "tackle/dive/low/Roll", "Fall"]
    assert compiled.query({"in_air": True, "speed": 3.5}).indices.tolist() == [2, 3, 4]


def test_an_asset_whose_name_begins_with_the_mark_stands_in_quotes():
    table = cdb.Table.from_columns({"Asset": ['"@home"', '"@say ""hi"""', '"plain"'], "speed": ["1", "1", "1"]})
    assert table.compile().query({"speed": 1.0}).assets == ["@home", '@say "hi"', '"plain"']


def test_an_explanation_names_the_cell_of_the_inner_and_of_the_outer_table(tmp_path: Path):
    explained = cdb.load(write(tmp_path) / "tackle.csv").compile().explain({"in_air": True, "speed": 2.5})
    failures = explained.row(2).failures
    assert [(f.cell, f.mend, f.step and f.step.table) for f in failures] == [("3..", "2.5..", "tackle"), ("4..", "2.5..", "dive")]
    assert f"the cell says 4.. ({tmp_path / 'dive.csv'}, line 3)" in str(failures[1])


# ---- priorities, weights, disabled rows


def nested(
    outer: Mapping[str, list[str]], inner: Mapping[str, list[str]], /, **settings: Mapping[str, object]
) -> cdb.CompiledTable:
    jobs = {"enabled": "On", "priority": "P", "weight": "W"}
    tables = {}
    for name, columns in (("outer", outer), ("inner", inner)):
        here = {job: column for job, column in jobs.items() if column in columns}
        tables[name] = cdb.Table.from_columns(columns, None, TableSettings(name, **here, **settings.get(name, {})), name)
    return tables["outer"].compile(tables)


def test_a_disabled_outer_row_disables_the_rows_inside_and_a_disabled_inner_row_itself():
    inner = {"Asset": ["a", "b"], "On": ["True", "False"]}
    compiled = nested({"Asset": ["@inner", "@inner", "c"], "On": ["True", "False", "True"]}, inner)
    assert compiled.query({}).indices.tolist() == [0, 4]


def test_a_row_that_stands_for_a_table_is_one_candidate_by_its_own_weight():
    inner = {"Asset": ["a", "b", "c", "d"], "W": ["1", "1", "1", "1"]}
    compiled = nested({"Asset": ["@inner", "plain"], "W": ["1", "1"]}, inner)
    counts = [compiled.pick({}, rng=seed) for seed in range(400)].count("plain")
    assert 150 < counts < 250


def test_priorities_inside_order_the_rows_inside_alone():
    inner = {"Asset": ["a", "b"], "P": ["9", "1"]}
    compiled = nested({"Asset": ["@inner", "plain"], "P": ["1", "2"]}, inner)
    assert {compiled.pick({}, rng=seed) for seed in range(20)} == {"plain"}
    compiled = nested({"Asset": ["@inner", "plain"], "P": ["2", "1"]}, inner)
    assert {compiled.pick({}, rng=seed) for seed in range(20)} == {"outer/inner/a"}


def test_a_table_inside_that_has_no_row_to_give_is_passed_over_whatever_its_fallback():
    inner = {"Asset": ["a", "b"], "speed": ["1", "2"]}
    settings = {"outer": {"policy": "first", "fallback": "still"}, "inner": {"policy": "first", "fallback": "inner fallback"}}
    compiled = nested({"Asset": ["@inner", "last"], "speed": ["Any", "..3"]}, inner, **settings)
    assert compiled.pick({"speed": 2.0}) == "outer/inner/b"
    assert compiled.pick({"speed": 3.0}) == "last"
    assert compiled.pick({"speed": 4.0}) == "still"


def test_a_policy_of_one_row_counts_rows_of_its_own_table():
    inner = {"Asset": ["a", "b"], "speed": ["1", "1"]}
    settings = {"outer": {"policy": "unique"}}
    compiled = nested({"Asset": ["@inner", "other"], "speed": ["..5", "5.."]}, inner, **settings)
    assert compiled.pick({"speed": 1.0}, rng=0) in ("outer/inner/a", "outer/inner/b")
    compiled = nested({"Asset": ["@inner", "other"], "speed": ["..5", "1.."]}, inner, **settings)
    with pytest.raises(cdb.PolicyError, match='2 rows of "outer" are valid at once: "@inner", "other"'):
        compiled.pick({"speed": 1.0})


# ---- rules, slots, outputs


def test_the_rules_of_both_rows_must_hold():
    schema = {"speed": {"type": "number"}}
    outer = {"Asset": ["@inner"], "speed": ["Any"], "If": ["speed < 5"]}
    inner = {"Asset": ["a", "b"], "speed": ["Any", "Any"], "When": ["speed > 2", ""]}
    tables = {"inner": cdb.Table.from_columns(inner, schema, TableSettings("inner", when="When"))}
    compiled = cdb.Table.from_columns(outer, schema, TableSettings("outer", when="If")).compile(tables)
    assert [compiled.query({"speed": s}).leaves for s in (1.0, 3.0, 6.0)] == [["b"], ["a", "b"], []]


@pytest.fixture(params=["in memory", "from its file"])
def ruled(request, tmp_path: Path):
    """A table with rules of its own inside one with rules, as it was compiled and as its artefact has it."""
    schema = {"speed": {"type": "number"}, "Defender.x": {"type": "number"}, "Receiver.x": {"type": "number"}}
    outer = {"Asset": ["@inner"], "If": ["speed < 5"]}
    inner = {"Asset": ["a", "b"], "When": ["Defender.x < Receiver.x", ""]}
    tables = {"inner": cdb.Table.from_columns(inner, schema, TableSettings("inner", when="When"), name="inner")}
    compiled = cdb.Table.from_columns(outer, schema, TableSettings("outer", when="If"), name="outer").compile(tables)
    compiled.save(tmp_path / "outer.safetensors")
    return compiled if request.param == "in memory" else cdb.CompiledTable.open(tmp_path / "outer.safetensors")


def failing_rules(explanation, row):
    return [(f.condition, f.cell, f.fact, f.step.table) for f in explanation.row(row).failures]


def test_each_rule_that_does_not_hold_is_told_with_the_row_whose_rule_it_is(ruled):
    near = {"Defender.x": 1.0, "Receiver.x": 2.0}
    outside = ("If", "speed < 5", "false with speed = 9", "outer")
    inside = ("When", "Defender.x < Receiver.x", "false with Defender.x = 3, Receiver.x = 2", "inner")
    assert failing_rules(ruled.explain({"speed": 9.0} | near), 0) == [outside]
    assert failing_rules(ruled.explain({"speed": 9.0} | near), 1) == [outside]
    far = near | {"Defender.x": 3.0}
    assert failing_rules(ruled.explain({"speed": 1.0} | far), 0) == [inside]
    assert failing_rules(ruled.explain({"speed": 9.0} | far), 0) == [outside, inside]
    is_open = ("When", "Defender.x < Receiver.x", "open with Defender.x = (missing), Receiver.x = (missing)", "inner")
    assert failing_rules(ruled.explain({"speed": 9.0}, unknown="never"), 0) == [outside, is_open]
    assert failing_rules(ruled.explain({"speed": 9.0}, unknown="any"), 0) == [outside]


def test_a_rule_that_no_casting_meets_is_told_with_the_row_whose_rule_it_is(ruled):
    actors = {"Defender": [{"x": 3.0}], "Receiver": [{"x": 2.0}]}
    told = "false for every casting, such as "
    inside = ("When", "Defender.x < Receiver.x", f"{told}Defender.x = 3, Receiver.x = 2", "inner")
    assert failing_rules(ruled.explain({"speed": 1.0}, actors=actors), 0) == [inside]
    assert failing_rules(ruled.explain({"speed": 9.0}, actors=actors), 0) == [
        ("If", "speed < 5", f"{told}speed = 9", "outer"),
        inside,
    ]
    assert failing_rules(ruled.explain({"speed": 9.0}, actors=actors), 1) == [("If", "speed < 5", "false with speed = 9", "outer")]


def test_rows_are_in_order_of_their_failures_whether_or_not_a_rule_is_among_them(ruled):
    near, far = {"Defender.x": 1.0, "Receiver.x": 2.0}, {"Defender.x": 3.0, "Receiver.x": 2.0}
    assert [row.row for row in ruled.explain({"speed": 1.0} | near)] == [0, 1]
    assert [row.row for row in ruled.explain({"speed": 1.0} | far)] == [1, 0]
    assert [row.row for row in ruled.explain({"speed": 9.0} | far).nearest(2)] == [1, 0]


def test_a_rule_that_is_false_for_every_value_of_a_set_is_told_as_false(ruled):
    facts = {"speed": cdb.cell("6..9"), "Defender.x": 1.0, "Receiver.x": 2.0}
    assert failing_rules(ruled.explain(facts), 1) == [("If", "speed < 5", "false with speed = 6..9", "outer")]


def test_where_cells_of_a_way_each_take_a_part_of_a_set_the_inner_ones_are_to_be_changed():
    outer, inner = {"Asset": ["@inner"], "speed": ["2.."]}, {"Asset": ["a"], "speed": ["..1"]}
    compiled = nested(outer, inner)
    [failure] = compiled.explain({"speed": cdb.cell("1..5")}).row(0).failures
    assert (failure.cell, failure.mend, failure.step.table) == ("..1", "..5", "inner")


def test_a_role_that_the_outer_row_needs_is_not_made_optional_inside():
    slots = ("Mandatory_Slots", "Optional_Slots")
    schema = {"Defender.Tall": {"type": "bool"}, "Receiver.Fast": {"type": "bool"}}
    inner = cdb.Table.from_columns(
        {"Asset": ["a"], slots[0]: ["Receiver"], slots[1]: ["Defender"]}, schema, TableSettings("inner", outputs=slots)
    )
    outer = cdb.Table.from_columns({"Asset": ["@inner"], "Defender.Tall": ["True"]}, schema, TableSettings("outer"))
    compiled = outer.compile({"inner": inner})
    short, tall, runner = {"id": 1, "Tall": False}, {"id": 2, "Tall": True}, {"id": 3, "Fast": True}
    assert not compiled.query({}, actors={"Defender": [short], "Receiver": [runner]})
    assert not compiled.query({}, actors={"Defender": [tall], "Receiver": []})
    matches = compiled.query({}, actors={"Defender": [short, tall], "Receiver": [runner]})
    assert matches.casting(0) == {"Defender": tall, "Receiver": runner}


@pytest.mark.parametrize("rule", ["Defender.Tall", "is_marked"])
@pytest.mark.parametrize("slots", ["Defender", "Receiver,Defender", '"Defender" Embed'])
def test_a_role_that_the_rule_of_an_inner_row_needs_is_not_made_optional_by_the_outer_row(rule: str, slots: str):
    schema = {"Defender.Tall": {"type": "bool"}, "is_marked": {"type": "bool", "expr": "Defender.Tall"}}
    inner = cdb.Table.from_columns({"Asset": ["a"], "When": [rule]}, schema, TableSettings("inner", when="When"))
    settings = TableSettings("outer", outputs=("Optional_Slots",))
    outer = cdb.Table.from_columns({"Asset": ["@inner"], "Optional_Slots": [slots]}, schema, settings)
    compiled = outer.compile({"inner": inner})
    assert not compiled.query({}, actors={"Defender": []})
    assert not compiled.query({}, actors={"Defender": [{"id": 1, "Tall": False}]})
    assert compiled.query({}, actors={"Defender": [{"id": 2, "Tall": True}]})


def test_outputs_are_those_of_the_inner_row_else_of_the_outer_one():
    inner = cdb.Table.from_columns({"Asset": ["a", "b"], "Clip": ["x", ""]}, None, TableSettings("inner", outputs=("Clip",)))
    outer = cdb.Table.from_columns({"Asset": ["@inner", "c"], "Clip": ["y", "z"]}, None, TableSettings("outer", outputs=("Clip",)))
    assert outer.flat({"inner": inner}).text_column("Clip").to_list() == ["x", "y", "z"]


# ---- what is refused


def test_a_missing_table_is_named_with_its_place_and_the_nearest(tmp_path: Path):
    write(tmp_path, tackle="Asset,in_air,speed\n@dvie,True,Any\n")
    with pytest.raises(cdb.TableError) as caught:
        cdb.load(tmp_path / "tackle.csv")
    [fault] = caught.value.faults
    assert str(fault) == (
        f'{tmp_path / "tackle.csv"}, line 2, column "Asset": there is no table "dvie". Accepted: "@dive". Did you mean "@dive"?'
    )
    assert fault.rule == "no-such-table"


def test_a_table_that_stands_in_itself_is_refused_with_the_way_round(tmp_path: Path):
    write(tmp_path, dive="Asset,Weight,speed\n@low,1,Any\n", low="Asset,speed\n@tackle,Any\n")
    with pytest.raises(cdb.TableError, match="the table contains itself: tackle > dive > low > tackle"):
        cdb.load(tmp_path / "tackle.csv")
    with pytest.raises(cdb.TableError, match="low > tackle > dive > low"):
        cdb.Project.load(tmp_path)
    table = cdb.load(tmp_path / "low.csv", strict=False)
    assert [(f.rule, f.place.line) for f in table.faults] == [("cyclic-tables", 2)]


def test_a_guessed_type_of_a_column_that_says_any_alone_gives_way(tmp_path: Path):
    write(tmp_path, tackle="Asset,style\n@dive,Any\n", dive="Asset,Weight,style\nLeft,1,5\n")
    compiled = cdb.load(tmp_path / "tackle.csv").compile()
    assert compiled.query({"style": 5.0}).leaves == ["Left"]


def test_tables_without_rows_may_stand_inside():
    empty = cdb.Table.from_columns({"Asset": [], "speed": []})
    compiled = cdb.Table.from_columns({"Asset": ["@empty", "a"]}).compile({"empty": empty})
    assert compiled.query({}, unknown="any").assets == ["a"]
    only = cdb.Table.from_columns({"Asset": ["@empty"]}).compile({"empty": empty})
    assert not only.query({}, unknown="any")
    assert only.pick({}, unknown="any") is None


# ---- check


def test_a_check_tells_of_missing_cyclic_and_broken_tables_once_each(tmp_path: Path):
    write(tmp_path, tackle="Asset,in_air\n@gone,True\n@dive,True\n@tackle,True\n", dive="Asset,Weight,speed\nLeft,1,fast\n")
    found = run("check", tmp_path, "--json").json["findings"]
    told = [(f["rule"], f["table"], f["line"]) for f in found if f["level"] == "error"]
    assert told == [("no-such-table", "tackle", 2), ("cyclic-tables", "tackle", 4), ("unreadable-cell", "dive", 2)]
    write(tmp_path, dive="Asset,Weight,speed\nLeft,1,fast\n")
    found = run("check", tmp_path, "--json").json["findings"]
    told = [(f["rule"], f["table"], f["line"]) for f in found if f["level"] == "error"]
    assert told == [("unusable-table", "tackle", 3), ("unreadable-cell", "dive", 2)]


def test_a_check_of_a_variant_tells_what_its_base_has_that_cannot_be_used(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text('[conditions.s]\ntype = "number"\n[tables.v]\nbase = "b"\n')
    (tmp_path / "v.csv").write_text("Asset,s\nB,2\n")
    for row, rule in (("A,fast", "unreadable-cell"), ("@gone,1", "no-such-table"), ("@v,1", "unusable-table")):
        (tmp_path / "b.csv").write_text(f"Asset,s\n{row}\n")
        found = [f for f in run("check", tmp_path, "--json").json["findings"] if f["level"] == "error"]
        assert {(f["rule"], f["table"]) for f in found} == {("unusable-table", "v"), (rule, "b")}
        alone = [f for f in run("check", tmp_path / "v.csv", "--json").json["findings"] if f["level"] == "error"]
        assert [(f["rule"], f["table"]) for f in alone] == [("unusable-table", "v")]


def test_a_new_row_of_a_variant_that_lacks_an_output_is_told_once(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text('[tables.b]\noutputs = { n = { type = "int" } }\n[tables.v]\nbase = "b"\n')
    (tmp_path / "b.csv").write_text("Asset,n\nA,1\n")
    (tmp_path / "v.csv").write_text("Asset,n\nB,\n")
    found = [f for f in run("check", tmp_path, "--json").json["findings"] if f["level"] == "error"]
    assert [(f["rule"], f["table"], f["line"]) for f in found] == [("missing-output", "v", 2)]


def test_findings_of_an_inner_table_are_told_of_it_and_not_of_the_outer_one_too(tmp_path: Path):
    write(tmp_path, dive="Asset,Weight,speed\nLeft,1,..8\nRight,3,4..6\n")
    outer, inner = cdb.Project.load(tmp_path)["tackle"], cdb.load(tmp_path / "dive.csv")
    assert rules([*check(inner), *check_rows(inner)]) == {"variety": [0]}
    assert rules([*check(outer), *check_rows(outer)]) == {"subsumed-row": [1]}, (
        "that Left lies in Fall; of Right its own table tells"
    )
    [first] = check_rows(outer)
    assert (first.level, first.asset, first.line, first.by) == ("warning", "tackle/dive/Left", 3, (2,))
    assert f"The row is in {tmp_path / 'dive.csv'}, line 2." in first.message


def test_rows_of_an_inner_table_share_contexts_by_variety_where_every_policy_on_the_way_lets_several_play(tmp_path: Path):
    write(tmp_path, dive="Asset,Weight,speed\nLeft,1,..8\nRight,3,4..6\n")
    toml = tmp_path / "contextdb.toml"
    toml.write_text(toml.read_text().replace('policy = "first"', 'policy = "collect"'))
    [first] = check_rows(cdb.Project.load(tmp_path)["tackle"])
    assert (first.rule, first.asset, first.line, first.by) == ("variety", "Fall", 4, (1,))
    assert f'line 2 of {tmp_path / "dive.csv"} ("tackle/dive/Left") is valid only where' in first.message


def test_a_row_that_the_outer_row_shuts_out_is_told(tmp_path: Path):
    outer = cdb.load(write(tmp_path) / "tackle.csv")
    [finding] = [f for f in check(outer) if f.rule == "shut-out-row"]
    assert (finding.level, finding.row, finding.asset) == ("info", 1, "tackle/dive/Slow")
    assert 'speed must be "3.." and "..2", which share nothing' in finding.message


def test_a_row_is_never_chosen_by_the_policy_of_the_table_where_ways_part(tmp_path: Path):
    write(tmp_path, tackle="Asset,in_air,speed\nFirst,True,Any\n@dive,Any,3..\n")
    found = cdb.coverage(cdb.load(tmp_path / "tackle.csv"))
    assert "never-chosen" not in {f.rule for f in found.findings}
    write(tmp_path, tackle="Asset,in_air,speed\nFirst,Any,Any\n@dive,Any,3..\n")
    found = cdb.coverage(cdb.load(tmp_path / "tackle.csv"))
    assert {f.asset for f in found.findings if f.rule == "never-chosen"} == {"tackle/dive/Left", "tackle/dive/Right"}


def test_the_same_table_may_stand_in_two_rows_without_a_warning(tmp_path: Path):
    write(tmp_path, tackle="Asset,in_air,speed\n@dive,True,3..\n@dive,False,..2\n")
    assert "duplicate-asset" not in rules(check(cdb.load(tmp_path / "tackle.csv")))
