"""What saved contexts reach: as each slip made by hand says, and by as few contexts as there can be."""

import random
from itertools import combinations, product
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from running import run
from strategies import examples

from contextdb.cells.domains import ANGLE, BOOL, DATE, INT, NUMBER, TAGS, TEXT, Domain
from contextdb.cells.grammar import format_cell, parse_cell
from contextdb.checks import case_contexts
from contextdb.checks.cases import Case, check_cases, judge
from contextdb.checks.slips import Slips, mutated
from contextdb.commands.cases_command import reached_by, with_names
from contextdb.compiled.table import data_of
from contextdb.tables.table import Table

SCHEMA = {
    "p": {"type": "bool"},
    "x": {"type": "number", "min": 0, "max": 4},
    "n": {"type": "int", "min": 0, "max": 3},
    "e": {"type": "enum", "values": ["A", "B", "C"]},
    "t": {"type": "tags", "values": ["Hot", "Half Way"]},
    "a": {"type": "angle"},
}
CELLS = {
    "p": ["True", "False", "Any"],
    "x": ["0..2", "(1..3]", "2..", "Any", "..1 | 3..", "1.5", "0..2 ~3"],
    "n": ["0..1", "2", "Any"],
    "e": ["A", "A B", "not C", "Any"],
    "t": ["+Hot", '-Hot +"Half Way"', "Any"],
    "a": ["170..-170", "0, 30", "Any"],
}


def random_table(rng: random.Random, most_rows: int = 4, most_conditions: int = 3) -> Table:
    names = rng.sample(list(SCHEMA), rng.randint(1, most_conditions))
    n_rows = rng.randint(1, most_rows)
    columns = {"Asset": [rng.choice(["walk", "run", "jump up", "sit"]) for _ in range(n_rows)]}
    columns |= {name: [rng.choice(CELLS[name]) for _ in range(n_rows)] for name in names}
    return Table.from_columns(columns, SCHEMA, {"policy": rng.choice(["collect", "first"])}, "t")


def slipped(table: Table) -> list[Table]:
    """The table after each slip, one by one: a row taken out, a cell changed."""
    tables = [table.with_rows_taken([r for r in range(table.n_rows) if r != row]) for row in range(table.n_rows)]
    for column in table.conditions:
        domain = column.condition.domain
        for row in range(table.n_rows):
            for slip in mutated(parse_cell(column.texts[row], domain), domain):
                tables.append(table.with_cell(row, column.condition.name, format_cell(slip.cell, domain)))
    return tables


def fails(table: Table, cases: list[Case]) -> bool:
    return any(judge(data_of(table.compile()), case).holds is False for case in cases)


def contexts_near(table: Table) -> list[dict[str, object]]:
    """A context for every way in which cells of the table, and of each after a slip, tell contexts apart."""
    whole = Slips.of(table).slipped
    values: dict[str, list[object]] = {}
    for column in whole.conditions:
        domain = column.condition.domain
        ends = {end for cell in column.cells if (s := getattr(cell.accepts, "spans", None)) for span in s for end in span}
        match column.condition.name:
            case "p":
                values["p"] = [False, True]
            case "e":
                values["e"] = ["A", "B", "C"]
            case "t":
                values["t"] = [[], ["Hot"], ["Half Way"], ["Hot", "Half Way"]]
            case name:
                near = {end + d for end in ends for d in ((-1, 0, 1) if name == "n" else (-1e-9, 0.0, 1e-9))} | {domain.ends[0]}
                values[name] = sorted(v for v in near if domain.ends[0] <= v <= domain.ends[1])
    return [dict(zip(values, point, strict=True)) for point in product(*values.values())]


@examples(0.6)
@given(st.integers(0, 2**32))
@example(1033964)  # a space of one context
def test_written_contexts_hold_and_every_slip_that_some_context_notices_makes_one_fail(seed):
    table = random_table(random.Random(seed))
    cases = with_names(reached_by(table, []).new_cases, [])
    assert check_cases(table, cases) == []
    compiled = table.compile()
    valid = [set(compiled.query(context).assets) for context in contexts_near(table)]
    for changed in slipped(table):
        other = changed.compile()
        is_noticeable = any(
            set(other.query(context).assets) != assets for context, assets in zip(contexts_near(table), valid, strict=True)
        )
        assert fails(changed, cases) is is_noticeable


@examples(0.6)
@given(st.integers(0, 2**32))
def test_the_written_contexts_reach_all_and_none_is_needless(seed):
    rng = random.Random(seed)
    table = random_table(rng)
    cases = with_names(reached_by(table, []).new_cases, [])
    again = reached_by(table, cases)
    assert again.left == []
    assert again.new_cases == []
    if cases:
        lost = rng.choice(cases)
        assert reached_by(table, [case for case in cases if case is not lost]).left


@examples(0.4)
@given(st.integers(0, 2**32))
def test_there_are_no_fewer_contexts_that_would_do(seed):
    table = random_table(random.Random(seed), most_rows=2, most_conditions=2)
    reached = reached_by(table, [])
    slips, wanted = reached.slips, reached.reach.reachable
    if not reached.reach.is_fewest or len(reached.reach.contexts) > 4:
        return
    search = case_contexts._Search(slips, case_contexts.opened(slips.slipped), None, case_contexts.SILENT)  # type: ignore[arg-type]
    targets = {search._targets_at(context) for context in contexts_near(table)} - {0}
    for few in combinations(targets, len(reached.reach.contexts) - 1):
        union = 0
        for one in few:
            union |= one
        assert union != wanted


@examples(0.4)
@given(st.integers(0, 2**32))
def test_contexts_that_grow_reach_what_going_through_all_reaches(seed):
    table = random_table(random.Random(seed), most_rows=5)
    whole = reached_by(table, [])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(case_contexts, "MOST_FLAGS", 0)
        grown = reached_by(table, [])
    assert grown.reach.reachable == whole.reach.reachable
    assert not grown.reach.is_fewest
    assert reached_by(table, with_names(grown.new_cases, [])).left == []


def test_where_contexts_are_drawn_they_reach_the_rows_and_can_happen():
    schema = SCHEMA | {"fast": {"type": "number", "min": 0, "max": 8, "expr": "x + x"}}
    columns = {"Asset": ["slow", "quick"], "fast": ["..3", "3..6"], "p": ["Any", "True"]}
    table = Table.from_columns(columns, schema, {"assume": ["not (p and x > 2.5)"]}, "t")
    reached = reached_by(table, [])
    assert reached.rows_left == [0, 1]
    cases = with_names(reached.new_cases, [])
    assert check_cases(table, cases) == []
    assert reached_by(table, cases).rows_left == []
    assert all("fast" not in case.facts for case in cases)
    assert all(case.facts["p"] == "False" or float(case.facts["x"]) <= 2.5 for case in cases)


def test_only_a_case_that_holds_and_expects_something_reaches():
    table = Table.from_columns({"Asset": ["walk", "run"], "p": ["True", "False"]}, SCHEMA, None, "t")
    for expected, rows in (("run", [0, 1]), ("", [0, 1]), ("walk", [1]), ("+walk", [1]), ("-run", [1])):
        assert reached_by(table, [Case("one", {"p": "True"}, expected)]).rows_left == rows
    exact, loose = (reached_by(table, [Case("one", {"p": "True"}, e)]) for e in ("walk", "+walk"))
    assert exact.reached.bit_count() > loose.reached.bit_count()


@pytest.mark.parametrize(
    ("text", "domain", "slips"),
    [
        ("0.2..3", NUMBER, ["(0.2..3]", "0.1..3", "[0.2..3)", "0.2..4"]),
        ("(5..", NUMBER, ["(6..", "5.."]),
        ("0..2", Domain("number", None, 0, 2), ["(0..2]", "[0..2)"]),
        ("170..-170", ANGLE, ["[170..-170)", "170..-169", "(170..-170]", "169..-170"]),
        ("3..5", INT, ["4..5", "2..5", "3..4", "3..6"]),
        ("2026-01-01..", DATE, ["2026-01-02..", "2025-12-31.."]),
        ("True", BOOL, ["False", "Any"]),
        ("A B", TEXT, ["B", "A", "Any"]),
        ("+InAir -Move", TAGS, ["-Move", "+InAir"]),
        ("not +InAir -Move", TAGS, ["Any"]),
        ("Any", NUMBER, []),
        ("3 ~2", NUMBER, []),
    ],
)
def test_what_becomes_of_a_cell(text, domain, slips):
    assert [format_cell(slip.cell, domain) for slip in mutated(parse_cell(text, domain), domain)] == slips


GAME = "Asset,speed,hit\nwalk,0..2,False\nrun,2..6,Any\n"
TOML = '[conditions.speed]\ntype = "number"\nmin = 0\nmax = 8\n[conditions.hit]\ntype = "bool"\n[tables.moves]\n'


@pytest.fixture
def game(tmp_path: Path) -> Path:
    (tmp_path / "moves.csv").write_text(GAME)
    (tmp_path / "contextdb.toml").write_text(TOML)
    return tmp_path


def test_the_command_writes_what_it_says_and_then_all_is_reached(game):
    table = str(game / "moves.csv")
    document = run("cases", table, "--json").json
    assert {"format", "rows", "rows_reached", "rows_without_case", "written", "mutants", "mutants_killed"} <= document.keys()
    assert (document["rows"], document["rows_reached"], document["rows_without_case"]) == (2, 0, ["walk", "run"])
    assert (document["written"], document["mutants_killed"]) == (0, 0)
    assert not (game / "moves.cases.csv").exists()
    written = run("cases", table, "--write", "--json").json
    assert written["written"] == len(written["contexts"]) > 0
    after = run("cases", table, "--json").json
    assert (after["rows_reached"], after["rows_without_case"], after["survivors"]) == (2, [], [])
    assert after["mutants_killed"] == after["mutants"] == document["mutants"]
    assert run("check", game, "--min-cases", "3", "--min-rows-reached", "100").code == 0


def test_a_deleted_file_of_cases_is_seen(game):
    result = run("check", game, "--min-cases", "1", "--min-rows-reached", "50", "--json")
    assert result.code == 1
    assert [f["message"] for f in result.json["findings"] if f["rule"] == "few-cases"] == [
        "0 saved contexts of the table expect something; wanted: 1.",
        "0 of 2 rows (0 %) are valid in a saved context that expects something; wanted: 50.00 %.",
    ]


def test_rows_of_tables_inside_a_table_are_reached_too(game):
    (game / "dive.csv").write_text("Asset,hit\nleft,True\nright,False\n")
    (game / "moves.csv").write_text("Asset,speed,hit\nwalk,0..2,False\n@dive,2..6,Any\n")
    result = run("cases", game / "moves.csv", "--write", "--json")
    assert (result.code, result.json["rows"]) == (0, 3)
    assert run("cases", game / "moves.csv", "--json").json["rows_reached"] == 3
    assert run("check", game).code == 0


def test_rows_of_a_base_are_reached_in_its_variant(game):
    (game / "contextdb.toml").write_text(TOML + '[tables.orc]\nbase = "moves"\nremove = "Gone"\n')
    (game / "orc.csv").write_text("Asset,speed,hit,Gone\nwalk,0..3,,\nroar,,True,\nrun,,,True\n")
    result = run("cases", game / "orc.csv", "--write", "--json")
    assert (result.code, result.json["rows"], result.json["rows_without_case"]) == (0, 2, ["walk", "roar"])
    after = run("cases", game / "orc.csv", "--json").json
    assert (after["rows_reached"], after["mutants_killed"]) == (2, after["mutants"])
    assert run("check", game).code == 0


def test_a_table_that_cannot_be_read_is_refused(game):
    (game / "moves.csv").write_text(GAME.replace("2..6", "2..x"))
    result = run("cases", game / "moves.csv")
    assert result.code == 2
    assert "2..x" in result.err
