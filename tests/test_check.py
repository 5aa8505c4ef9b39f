"""Checks: what a table alone shows to be wrong, each with its rule, level, row, asset, line, column and the rows that cause it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import strategies
from hypothesis import given

from contextdb.checks import run as check_module
from contextdb.checks.run import check
from contextdb.errors import ContextDBError, Place
from contextdb.findings import Finding, worst
from contextdb.schema.settings import TableSettings
from contextdb.tables.project import Project, load_table
from contextdb.tables.table import Table

ROOT = Path(__file__).parent.parent
TYPES = """
[conditions.speed]
type = "number"
min = 0
max = 12
[conditions.n]
type = "int"
max = 16777217
[conditions.heading]
type = "angle"
[conditions.ok]
type = "bool"
[conditions.state]
type = "enum"
values = ["Ground", "Air"]
[conditions.tags]
type = "tags"
"""


def findings(folder: Path, csv: str | bytes, toml: str = TYPES) -> list[Finding]:
    """What a check finds in a file of a folder."""
    (folder / "contextdb.toml").write_text(toml, encoding="utf-8")
    (folder / "t.csv").write_bytes(csv.encode() if isinstance(csv, str) else csv)
    return check(load_table(folder / "t.csv", strict=False))


def at(folder: Path, rule: str, level: str, message: str, **more: object) -> Finding:
    return Finding(rule, level, message, "t", str(folder / "t.csv"), **more)  # type: ignore[arg-type]


# ---- tables without a fault


def test_nothing_is_found_in_a_table_that_is_as_declared(tmp_path: Path):
    assert findings(tmp_path, 'Asset,speed,heading,ok\nrun,3..6,"170, 20",True\njump,..4,Any,\n') == []


@pytest.mark.parametrize("name", ["hit_mid_air", "contested_catch", "locomotion"])
def test_the_sample_tables_have_no_errors(name: str):
    found = check(Project.load(ROOT / "tables")[name])
    assert worst(found) in (None, "info")
    assert {f.rule for f in found} <= {"variety"}


@given(strategies.tables())
def test_a_finding_about_a_row_says_which_and_compiled_tables_have_no_unreadable_cells(table: Table):
    for finding in check(table):
        assert finding.row is None or finding.asset == table.assets[finding.row]
        assert finding.rule != "unreadable-cell"
        assert all(0 <= row < table.n_rows for row in finding.by)


# ---- the whole table


def test_a_table_without_rows_is_a_warning(tmp_path: Path):
    message = "the table has no rows, so no context has an asset."
    assert findings(tmp_path, "Asset,speed\n") == [at(tmp_path, "no-rows", "warning", message)]


@pytest.mark.parametrize(
    ("csv", "ends"),
    [
        (b"Asset,speed\nrun,1\r\njump,2\n", "2 in LF, 1 in CRLF"),
        (b"Asset,speed\r\nrun,1\r\njump,2\n", "2 in CRLF, 1 in LF"),
        (b"Asset,speed\nrun,1\rjump,2\r\n", "1 in LF, 1 in CRLF, 1 in CR"),
    ],
)
def test_mixed_line_ends_are_information_with_the_most_common_first(tmp_path: Path, csv: bytes, ends: str):
    message = f"the lines end in different ways: {ends}; they are kept as they are."
    assert findings(tmp_path, csv) == [at(tmp_path, "mixed-line-ends", "info", message)]


def test_a_condition_that_is_not_declared_is_a_warning_with_the_nearest_that_is(tmp_path: Path):
    message = 'the condition is not declared in contextdb.toml; type inferred from its cells: number. Did you mean "speed"?'
    assert findings(tmp_path, "Asset,Speed\nrun,1..2\n") == [
        at(tmp_path, "undeclared-condition", "warning", message, column="Speed")
    ]


def test_where_nothing_is_declared_undeclared_conditions_are_information(tmp_path: Path):
    (finding,) = findings(tmp_path, "Asset,ok\nrun,True\n", "")
    assert (finding.level, finding.message) == (
        "info",
        "the condition is not declared in contextdb.toml; type inferred from its cells: bool.",
    )


# ---- cells


def test_a_cell_that_cannot_be_read_is_an_error_at_its_place(tmp_path: Path):
    (finding,) = findings(tmp_path, 'Asset,speed\n"a\nb",1\nrun,fast\n')
    assert finding.message.startswith('cannot read "fast" as a number. Accepted: ')
    assert replace(finding, message="") == at(tmp_path, "unreadable-cell", "error", "", row=1, asset="run", line=4, column="speed")


def test_a_value_that_is_not_declared_is_an_error_with_the_nearest_that_is(tmp_path: Path):
    (finding,) = findings(tmp_path, "Asset,state\nrun,Gruond\n")
    assert (finding.rule, finding.level, finding.row, finding.line) == ("unknown-value", "error", 0, 2)
    assert finding.message == '"Gruond" is not a declared value. Accepted: "Ground", "Air". Did you mean "Ground"?'


def test_every_unreadable_cell_of_a_file_is_found(tmp_path: Path):
    found = findings(tmp_path, "Asset,speed,ok\na,x,True\nb,1,maybe\nc,x,y\n")
    assert [(f.row, f.column) for f in found] == [(0, "speed"), (1, "ok"), (2, "speed"), (2, "ok")]
    assert {f.rule for f in found} == {"unreadable-cell"}


def test_columns_with_a_job_are_read_too(tmp_path: Path):
    toml = TYPES + '[tables.t]\nenabled = "On"\npriority = "P"\nweight = "W"\n'
    found = findings(tmp_path, "Asset,On,P,W,speed\na,maybe,1.5,-1,1\nb,True,2,0.5,2\n", toml)
    assert [(f.rule, f.row, f.line, f.column, f.message) for f in found] == [
        ("unreadable-cell", 0, 2, "On", 'cannot read "maybe". Accepted: "True" or "False".'),
        ("unreadable-cell", 0, 2, "P", 'cannot read "1.5". Accepted: a whole number.'),
        ("unreadable-cell", 0, 2, "W", 'cannot read "-1". Accepted: a number from 0 up.'),
    ]


@pytest.mark.parametrize(
    ("column", "cell"),
    [("speed", "5..3"), ("n", "(1..2)"), ("heading", "(5..5)"), ("ok", "not Any"), ("state", "not Ground Air"), ("tags", "+A -A")],
)
def test_a_cell_that_accepts_nothing_is_an_error(tmp_path: Path, column: str, cell: str):
    message = f'"{cell}" accepts no value at all, so the row never matches.'
    assert findings(tmp_path, f"Asset,{column}\nrun,{cell}\n") == [
        at(tmp_path, "empty-cell", "error", message, row=0, asset="run", line=2, column=column)
    ]


def test_a_soft_cell_that_accepts_nothing_always_costs(tmp_path: Path):
    (finding,) = findings(tmp_path, "Asset,speed\nrun,5..3 ~2\n")
    assert (finding.rule, finding.level) == ("empty-cell", "error")
    assert finding.message == '"5..3 ~2" accepts no value at all, so its penalty always counts.'


@pytest.mark.parametrize("cell", ["13..20", "-5..-1", ">12", "<0", "12.5"])
def test_a_cell_wholly_outside_the_domain_is_a_warning(tmp_path: Path, cell: str):
    message = f'"{cell}" is wholly outside the declared 0 to 12, so the row matches no expected value.'
    assert findings(tmp_path, f"Asset,speed\nrun,{cell}\n") == [
        at(tmp_path, "outside-domain", "warning", message, row=0, asset="run", line=2, column="speed")
    ]


@pytest.mark.parametrize("cell", ["5..13", "-1..3", "0..5 | 20..30", "<20", ">-1"])
def test_a_cell_that_reaches_beyond_the_domain_is_information(tmp_path: Path, cell: str):
    message = f'"{cell}" reaches beyond the declared 0 to 12.'
    assert findings(tmp_path, f"Asset,speed\nrun,{cell}\n") == [
        at(tmp_path, "beyond-domain", "info", message, row=0, asset="run", line=2, column="speed")
    ]


@pytest.mark.parametrize("cell", ["0..12", "5..", "..3", ">=0", "<5", "not 1..2", "not 12", "Any", "5 | 7..", "12"])
def test_a_cell_inside_the_domain_or_with_an_end_left_open_is_as_it_should_be(tmp_path: Path, cell: str):
    assert findings(tmp_path, f"Asset,speed\nrun,{cell}\n") == []


def test_a_bound_that_stands_alone_is_named_in_full(tmp_path: Path):
    (finding,) = findings(tmp_path, "Asset,n\nrun,16777218\n")
    assert finding.message == '"16777218" is wholly outside the declared max 16777217, so the row matches no expected value.'
    (finding,) = findings(tmp_path, "Asset,n\nrun,-1..3\n", TYPES.replace("max = 16777217", "min = 0"))
    assert finding.message == '"-1..3" reaches beyond the declared min 0.'


# ---- assets


@pytest.mark.parametrize("asset", ["", "  "])
def test_a_row_without_an_asset_is_an_error(tmp_path: Path, asset: str):
    assert findings(tmp_path, f"Asset,speed\nrun,1\n{asset},2\n") == [
        at(tmp_path, "no-asset", "error", "the row names no asset.", row=1, asset=asset, line=3, column="Asset")
    ]


def test_an_asset_that_stands_twice_is_a_warning_caused_by_the_first(tmp_path: Path):
    message = 'the asset "run" is also in line 2.'
    where = {"asset": "run", "column": "Asset", "by": (0,)}
    assert findings(tmp_path, "Asset,speed\nrun,1\njump,2\nrun,3\nrun,4\n") == [
        at(tmp_path, "duplicate-asset", "warning", message, row=2, line=4, **where),
        at(tmp_path, "duplicate-asset", "warning", message, row=3, line=5, **where),
    ]


# ---- rows


SAME = 'Asset,speed,ok\na,3..5,Any\nb,"4, 1",\nc,3..5,True\nd,3..3 | 3..5,-\n'


@pytest.mark.parametrize("policy", ["first", "unique"])
def test_rows_whose_cells_mean_the_same_are_warnings_caused_by_the_first_where_one_may_play(tmp_path: Path, policy: str):
    message = 'every condition is the same as in line 2 ("a").'
    assert findings(tmp_path, SAME, f'{TYPES}[tables.t]\npolicy = "{policy}"\n') == [
        at(tmp_path, "identical-rows", "warning", message, row=1, asset="b", line=3, by=(0,)),
        at(tmp_path, "identical-rows", "warning", message, row=3, asset="d", line=5, by=(0,)),
    ]


@pytest.mark.parametrize("policy", ["collect", "priority"])
def test_different_assets_of_the_same_contexts_are_one_line_of_information_where_several_may_play(tmp_path: Path, policy: str):
    message = '2 other rows (line 3 ("b") and line 5 ("d")) are valid in the same contexts.'
    assert findings(tmp_path, SAME, f'{TYPES}[tables.t]\npolicy = "{policy}"\n') == [
        at(tmp_path, "variety", "info", message, row=0, asset="a", line=2, by=(1, 3)),
    ]


def test_one_asset_twice_with_the_same_conditions_is_no_variety(tmp_path: Path):
    found = findings(tmp_path, "Asset,speed\na,1\nb,1\nb,1\na,1\nc,1\n")
    assert [(f.rule, f.level, f.row, f.by) for f in found if f.rule != "duplicate-asset"] == [
        ("variety", "info", 0, (1, 4)),
        ("identical-rows", "warning", 2, (1,)),
        ("identical-rows", "warning", 3, (0,)),
    ]


def test_of_a_large_group_the_first_rows_are_named_and_all_are_listed_by_number(tmp_path: Path):
    (found,) = findings(tmp_path, "Asset,speed\n" + "".join(f"a{i},1\n" for i in range(300)))
    assert found.message.startswith('299 other rows (line 3 ("a1"), line 4 ("a2"), line 5 ("a3") and 296 more) are valid')
    assert found.by == tuple(range(1, 300))


def test_a_soft_cell_differs_from_a_hard_one_and_from_one_of_another_penalty(tmp_path: Path):
    assert findings(tmp_path, "Asset,speed\na,1\nb,1 ~1\nc,1 ~2\n") == []


def test_outputs_tell_no_rows_apart(tmp_path: Path):
    toml = TYPES + '[tables.t]\noutputs = ["Slot"]\n'
    assert [f.rule for f in findings(tmp_path, "Asset,Slot,speed\na,L,1\nb,R,1\n", toml)] == ["variety"]


def test_a_disabled_row_is_never_valid_together_with_another(tmp_path: Path):
    toml = TYPES + '[tables.t]\nenabled = "On"\n'
    assert findings(tmp_path, "Asset,On,speed\na,False,1\nb,True,1\nc,False,1\n", toml) == []


def test_cells_that_cannot_be_read_are_the_same_only_as_themselves(tmp_path: Path):
    found = findings(tmp_path, "Asset,speed\na,x\nb,y\nc,Any\nd,x\n")
    assert [(f.row, f.by) for f in found if f.rule == "variety"] == [(0, (3,))]


# ---- many findings


def test_findings_come_in_the_order_of_rows_after_those_of_the_whole_table(tmp_path: Path):
    found = findings(tmp_path, b"Asset,speed,new\nrun,1,1\r\nrun,5..3,2\n,x,3\n")
    assert [f.row for f in found] == [None, None, 1, 1, 2, 2]
    assert [f.rule for f in found] == [
        *("mixed-line-ends", "undeclared-condition", "empty-cell", "duplicate-asset", "unreadable-cell", "no-asset"),
    ]


@pytest.mark.parametrize(
    ("row", "rule"),
    [("a{i},5..3", "empty-cell"), ("a,{i}..99999", "duplicate-asset"), (",{i}..99999", "no-asset"), ("a{i},1", "identical-rows")],
)
def test_of_very_many_findings_of_a_kind_the_first_are_listed_and_the_others_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, row: str, rule: str
):
    monkeypatch.setattr(check_module, "MOST_ROWS", 3)
    toml = '[conditions.speed]\ntype = "number"\n[tables.t]\npolicy = "first"\n'
    csv = "Asset,speed\n" + "".join(row.format(i=i) + "\n" for i in range(9))
    found = [f for f in findings(tmp_path, csv, toml) if f.rule == rule]
    n_all = 9 if rule in ("empty-cell", "no-asset") else 8
    assert len(found) == 4
    assert found[-1].message.endswith(f"({n_all - 3} rows like this one are not listed.)")


def test_a_table_of_python_has_rows_and_no_lines():
    table = Table.from_columns({"Asset": ["a", "a"], "x": ["1", "1"]}, {"x": {"type": "number"}})
    assert [(f.rule, f.message, f.file, f.line, f.row) for f in check(table)] == [
        ("duplicate-asset", 'the asset "a" is also in row 1.', None, None, 1),
        ("identical-rows", 'every condition is the same as in row 1 ("a").', None, None, 1),
    ]


def test_ten_thousand_identical_rows_are_told_from_the_first():
    n_rows = check_module.MOST_ROWS + 500
    columns = {"Asset": [f"a{i}" for i in range(n_rows)], "x": ["1..2"] * n_rows}
    table = Table.from_columns(columns, {"x": {"type": "number"}}, TableSettings("table", policy="unique"))
    found = check(table)
    assert len(found) == check_module.MOST_ROWS + 1
    assert {f.by for f in found} == {(0,)}
    assert np.array_equal([f.row for f in found[:-1]], np.arange(1, check_module.MOST_ROWS + 1))


# ---- findings


def test_a_finding_of_a_fault_keeps_its_place():
    from contextdb.errors import Fault

    fault = Fault("found.", "accepted", '"mend"', Place("f.csv", 7, "c", 5), "some-rule")
    assert Finding.of(fault, "warning", "t", "run") == Finding(
        "some-rule", "warning", 'found. Accepted: accepted. Did you mean "mend"?', "t", "f.csv", 5, "run", 7, "c"
    )


def test_a_finding_as_plain_data_has_every_field():
    data = Finding("r", "info", "m", by=(3, 4)).to_json()
    assert data == {
        **{"rule": "r", "level": "info", "message": "m", "by": [3, 4]},
        **dict.fromkeys(("table", "file", "row", "asset", "line", "column")),
    }


def test_the_worst_level_is_the_highest():
    made = {level: Finding("r", level, "m") for level in ("error", "warning", "info")}
    assert worst([]) is None
    assert worst([made["info"]]) == "info"
    assert worst([made["info"], made["warning"]]) == "warning"
    assert worst([made["warning"], made["error"], made["info"]]) == "error"


MIRRORED = """
[conditions.direction]
type = "angle"
[conditions.slope]
type = "angle"
mirror = "none"
[conditions.foot]
type = "enum"
values = ["Left", "Right", "Both"]
[conditions.lean]
type = "number"
min = -1.0
max = 2.0
mirror = "negate"
[databases.loco]
table = "outer"
clips = "*.bvh"
features = "loco"
mirror = {mirror}
"""


def mirror_findings(folder: Path, mirror: str) -> list[tuple[str, str | None, str | None]]:
    (folder / "contextdb.toml").write_text(MIRRORED.replace("{mirror}", mirror), encoding="utf-8")
    (folder / "outer.csv").write_text("Asset,direction,slope,side\n@inner,Any,Any,left\nb,10,5,right\n", encoding="utf-8")
    (folder / "inner.csv").write_text("Asset,foot,lean\nc,Left,0\nd,Right,1\n", encoding="utf-8")
    (folder / "other.csv").write_text("Asset,foot,direction\nc,Left,0\nd,Right,1\n", encoding="utf-8")
    tables = Project.load(folder).tables
    return [(f.rule, f.table, f.column) for name in tables for f in check(tables[name]) if "mirror" in f.rule]


def test_what_a_mirror_does_to_facts_is_told_of_the_tables_whose_clips_are_played_mirrored(tmp_path: Path):
    assert sorted(mirror_findings(tmp_path, "true"), key=str) == [
        ("inferred-mirror", "outer", None),
        ("undeclared-mirror", "inner", "foot"),
        ("undeclared-mirror", "outer", "side"),
        ("uneven-mirror", "inner", "lean"),
    ]
    assert mirror_findings(tmp_path, "false") == [("uneven-mirror", "inner", "lean")]


def test_facts_that_rules_and_derived_facts_need_are_told_too(tmp_path: Path):
    toml = (
        MIRRORED.replace("{mirror}", "true")
        + """
[conditions.turn]
type = "angle"
expr = "direction * 2"
[tables.outer]
when = "When"
"""
    )
    (tmp_path / "contextdb.toml").write_text(toml, encoding="utf-8")
    (tmp_path / "outer.csv").write_text("Asset,turn,When\na,10,foot == 'Left'\n", encoding="utf-8")
    found = {f.rule: f for f in check(Project.load(tmp_path).tables["outer"]) if "mirror" in f.rule}
    assert found["inferred-mirror"].message.startswith('"direction" is negated for mirrored clips of the database "loco"')
    assert found["undeclared-mirror"].column == "foot"


@pytest.mark.parametrize(
    ("conditions", "columns", "says"),
    [
        ("mirror = { Left = 'Right' }", "LeftFoot.Down", "RightFoot.Down is not a column, so this fact stays as it is"),
        ("", "LeftFoot.Down,RightFoot.Down", 'Try mirror = { Left = "Right" }, or "none".'),
        ("mirror = { Left = 'Right' }", "LeftFoot.Down,RightFoot.Down", ""),
    ],
)
def test_facts_of_one_foot_that_see_themselves_in_a_mirror_are_told(tmp_path: Path, conditions: str, columns: str, says: str):
    feet = "".join(f"[conditions.'{foot}.Down']\ntype = 'bool'\n{conditions}\n" for foot in ("LeftFoot", "RightFoot"))
    database = "[databases.loco]\ntable = 'moves'\nclips = '*.bvh'\nfeatures = 'loco'\nmirror = true\n"
    (tmp_path / "contextdb.toml").write_text(feet + database, encoding="utf-8")
    cells = ",".join(["True"] * len(columns.split(",")))
    (tmp_path / "moves.csv").write_text(f"Asset,{columns}\na,{cells}\n", encoding="utf-8")
    told = [f.message for f in check(Project.load(tmp_path).tables["moves"]) if f.rule == "undeclared-mirror"]
    assert len(told) == (len(columns.split(",")) if says else 0)
    assert all(says in message for message in told)


@pytest.mark.parametrize(
    ("column", "cell", "line"), [("When", "speed < 3", "when"), ("Rest", "30", "cooldown_s"), ("weight", "2", "weight")]
)
def test_a_column_with_the_name_of_a_job_is_said_to_be_meant_for_it(tmp_path: Path, column: str, cell: str, line: str):
    (tmp_path / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\n', "utf-8")
    (tmp_path / "moves.csv").write_text(f"Asset,speed,{column}\nwalk,1..3,{cell}\n", "utf-8")
    mend = f'Did you mean {line} = "{column}" in [tables.moves]?'
    found = [f.message for f in check(load_table(tmp_path / "moves.csv", strict=False)) if f.column == column]
    assert all(mend in message for message in found)
    assert len(found) == (2 if column == "When" else 1)
    if column == "When":
        with pytest.raises(ContextDBError, match='Did you mean when = "When" in'):
            load_table(tmp_path / "moves.csv")
