"""Expected contexts: the share of them that has a valid row, and what to do for the rest."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb import Table, load
from contextdb.cells.grammar import parse_cell
from contextdb.covering.expected import expectation
from contextdb.errors import ContextDBError, Place
from contextdb.tables.expected_file import Situation, read_situations
from tests.running import ROOT, run

SCHEMA = {
    "level": {"type": "int", "min": 0, "max": 4},
    "gait": {"type": "enum", "values": ["Idle", "Walk", "Run"]},
    "tired": {"type": "bool"},
}
DOMAINS = {"level": range(5), "gait": ("Idle", "Walk", "Run"), "tired": (False, True)}
CELLS = {
    "level": st.sampled_from(["Any", "0..1", "2", ">=3", "1..3", "0 | 4"]),
    "gait": st.sampled_from(["Any", "Idle", "Walk Run", "not Run"]),
    "tired": st.sampled_from(["Any", "True", "False"]),
}
a_row = st.fixed_dictionaries(CELLS)
weights = st.sampled_from([0.5, 1.0, 2.0, 7.0])


def table_of(rows, assume=()):
    columns = {"Asset": [f"a{i}" for i in range(len(rows))]} | {name: [row[name] for row in rows] for name in CELLS}
    return Table.from_columns(columns, SCHEMA, {"assume": list(assume)})


def situations_of(table, rows):
    domains = {c.condition.name: c.condition.domain for c in table.conditions}
    return [
        Situation("", weight, row, {name: parse_cell(text, domains[name]) for name, text in row.items()}, Place())
        for row, weight in rows
    ]


def contexts():
    return [{"level": n, "gait": g, "tired": t} for n in DOMAINS["level"] for g in DOMAINS["gait"] for t in DOMAINS["tired"]]


def holds(table, row, context):
    domains = {c.condition.name: c.condition.domain for c in table.conditions}
    return all(parse_cell(text, domains[name]).holds(context[name]) for name, text in row.items())


@given(st.lists(a_row, max_size=5), st.lists(st.tuples(a_row, weights), min_size=1, max_size=4), st.booleans())
def test_the_share_is_that_of_trying_every_context_of_every_situation(rows, expected, is_assuming):
    table = table_of(rows, ["not (gait == 'Idle' and tired)"] if is_assuming else ())
    possible = [c for c in contexts() if not (is_assuming and c["gait"] == "Idle" and c["tired"])]
    shares = []
    for row, _ in expected:
        inside = [context for context in possible if holds(table, row, context)]
        if not inside:
            with pytest.raises(ContextDBError, match="cannot happen"):
                expectation(table, "f", situations_of(table, expected))
            return
        shares.append(sum(any(holds(table, own, context) for own in rows) for context in inside) / len(inside))
    result = expectation(table, "f", situations_of(table, expected))
    assert [each.covered.value for each in result.situations] == pytest.approx(shares)
    total = sum(weight for _, weight in expected)
    assert result.covered.value == pytest.approx(sum(w * s for (_, w), s in zip(expected, shares, strict=True)) / total)
    assert sum(item.share for item in result.todo) == pytest.approx(1.0 - result.covered.value)
    assert [item.share for item in result.todo] == sorted((item.share for item in result.todo), reverse=True)


@given(st.lists(a_row, min_size=1, max_size=5), a_row)
def test_the_change_that_is_proposed_makes_something_play(rows, expected):
    table = table_of(rows)
    result = expectation(table, "f", situations_of(table, [(expected, 1.0)]))
    for item in result.todo:
        near = item.gap.nearest
        after = table.with_cells([(near.row, name, cell) for name, cell in near.cells.items()])
        inside = [c for c in contexts() if holds(table, {n: item.gap.cells.get(n, "Any") for n in CELLS}, c)]
        assert inside
        assert all(near.row in after.compile().query(context).indices for context in inside)


def test_the_nearest_row_is_the_one_that_changes_least():
    table = Table.from_columns(
        {"Asset": ["creep", "walk_left", "walk_right"], "level": ["0", "2..3", "2..3"], "gait": ["Walk", "Walk", "Walk"]},
        SCHEMA,
    )
    result = expectation(table, "f", situations_of(table, [({"level": "3..4", "gait": "Walk"}, 1.0)]))
    near = result.todo[0].gap.nearest
    assert (near.asset, near.cells) == ("walk_left", {"level": "2..3 | 4"})


@pytest.mark.parametrize("name", ["hit_mid_air", "contested_catch", "locomotion"])
def test_the_samples_reach_over_90_percent_of_what_they_declare(name):
    document = run("coverage", ROOT / "tables" / f"{name}.csv", "--format", "json").json["tables"][0]
    assert document["asked"]["by"] == "expected"
    assert 0.9 < document["asked"]["lower"] < 1.0
    assert document["covered"]["value"] < 0.2


def test_coverage_begins_with_what_is_asked(tmp_path):
    (tmp_path / "contextdb.toml").write_text(
        '[conditions.gait]\ntype = "enum"\nvalues = ["Idle", "Walk", "Run"]\n[tables.moves]\nexpected = "asked.csv"\n'
    )
    (tmp_path / "moves.csv").write_text("Asset,gait\nidle,Idle\nwalk,Walk\n")
    (tmp_path / "asked.csv").write_text("Situation,gait,Weight\nstrolling,Walk,3\nrunning,Run,1\n")
    out = run("coverage", tmp_path).lines
    assert out[2] == "75.00 % of what 2 expected situations ask for has a valid row."
    assert [run("coverage", tmp_path, "--fail-under-expected", percent).code for percent in ("75", "76")] == [0, 1]
    assert "Of all contexts alike: 66.67 % of the contexts have a valid row (exact)." in out
    assert any("running: nothing plays; idle (line 2) would, with gait Idle Run" in line for line in out)
    (tmp_path / "seen.csv").write_text("gait\nWalk\nWalk\nIdle\n")
    seen = run("coverage", tmp_path, "--telemetry", tmp_path / "seen.csv", "--format", "json").json["tables"][0]
    assert seen["asked"] == {"by": "telemetry", "value": 1.0, "lower": 1.0, "upper": 1.0}
    assert list(load(tmp_path / "moves.csv").around) == ["moves", "seen"]  # and not what is expected
    assert run("check", tmp_path).code == 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Situation,gat\na,Walk\n", ('has no condition "gat"', 'Did you mean "gait"?', 'line 1, column "gat"')),
        ("Situation,gait\na,Wlk\n", ('line 2, column "gait"',)),
        ("Situation,gait\na,Walk ~2\n", ("is soft",)),
        ("Situation,gait,weight\na,Walk,-1\nb,Walk,x\n", ('cannot read "-1" as a weight', "line 3")),
    ],
)
def test_what_cannot_be_read_is_an_error_with_its_place(tmp_path, text, words):
    (tmp_path / "contextdb.toml").write_text(
        '[conditions.gait]\ntype = "enum"\nvalues = ["Idle", "Walk"]\n[tables.moves]\nexpected = "asked.csv"\n'
    )
    (tmp_path / "moves.csv").write_text("Asset,gait\nidle,Idle\n")
    (tmp_path / "asked.csv").write_text(text)
    table = load(tmp_path / "moves.csv")
    with pytest.raises(ContextDBError) as error:
        read_situations(tmp_path / "asked.csv", [c.condition for c in table.conditions])
    assert all(word in str(error.value) for word in words), str(error.value)
    assert run("check", tmp_path).code == 1
    assert run("coverage", tmp_path).code == 2
    assert json.loads(run("check", tmp_path, "--format", "json").out)["findings"]


def test_a_gate_of_what_is_expected_does_not_pass_where_nothing_is(tmp_path):
    (tmp_path / "moves.csv").write_text("Asset,gait\nidle,Idle\n")
    result = run("coverage", tmp_path / "moves.csv", "--fail-under-expected", "50")
    assert (result.code, "no table says what is expected of it" in result.err) == (2, True)
    (tmp_path / "contextdb.toml").write_text('[tables.other]\nexpected = "asked.csv"\n')
    (tmp_path / "other.csv").write_text("Asset,gait\nwalk,Walk\n")
    (tmp_path / "asked.csv").write_text("Situation,gait\na,Walk\n")
    for form in ("text", "markdown", "html", "json", "github", "junit", "sarif"):
        result = run("coverage", tmp_path, "--fail-under-expected", "50", "--format", form)
        assert (result.code, "nothing is expected of this table" in " ".join(result.out.split())) == (0, True), form


@pytest.mark.parametrize("how", ["the setting", "a row"])
def test_to_expect_less_than_the_baseline_is_told_and_must_be_accepted(tmp_path, how):
    toml, asked = tmp_path / "contextdb.toml", tmp_path / "asked.csv"
    toml.write_text('[conditions.gait]\ntype = "enum"\nvalues = ["Idle", "Walk"]\n[tables.moves]\nexpected = "asked.csv"\n')
    (tmp_path / "moves.csv").write_text("Asset,gait\nidle,Idle\n")
    asked.write_text("Situation,gait\na,Idle\nb,Walk\n")
    run("coverage", tmp_path, "--format", "json", "-o", tmp_path / "before.json")
    assert run("coverage", tmp_path, "--baseline", tmp_path / "before.json").code == 0
    if how == "a row":
        asked.write_text("Situation,gait\na,Idle\n")
    else:
        toml.write_text(toml.read_text().replace('expected = "asked.csv"\n', ""))
        asked.unlink()  # which would be a table of its own
    result = run("coverage", tmp_path, "--baseline", tmp_path / "before.json")
    said = " ".join(result.out.split())
    assert (result.code, "expected, before 2. Where that is intended: --redefined=moves." in said) == (1, True)
    assert run("coverage", tmp_path, "--baseline", tmp_path / "before.json", "--redefined", "moves").code == 0


def test_a_missing_file_of_expected_contexts_is_an_error(tmp_path):
    (tmp_path / "contextdb.toml").write_text('[tables.moves]\nexpected = "asked.csv"\n')
    (tmp_path / "moves.csv").write_text("Asset,gait\nidle,Idle\n")
    assert run("coverage", tmp_path).code == 2
    assert run("check", tmp_path).code == 1
