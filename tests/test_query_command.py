"""`contextdb query`: the valid assets on standard output, why others are not, and an exit code that a script can rely on."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from running import Result, run

from contextdb.cells.domains import Domain
from contextdb.cells.facts import describe, read_fact
from contextdb.cells.sets import Cell
from contextdb.commands.query_command import read_facts
from contextdb.compiled.pick import Outcome
from contextdb.errors import ContextError
from contextdb.tables.table import Table

TOML = """
[conditions.state]
type = "enum"
values = ["Ground", "In Air"]
[conditions.speed]
type = "number"
min = 0
max = 10
unit = "m/s"
[conditions.heading]
type = "angle"
[conditions.ok]
type = "bool"
[conditions."Defender.Tags"]
type = "tags"
values = ["Move.Run", "Stunned"]
[tables.moves]
enabled = "On"
"""
CSV = '''Asset,On,state,speed,heading,ok,Defender.Tags
run,True,Ground,3..6,"0, 45",Any,+Move
jump,True,"""In Air""",0..4,Any,True,-Stunned
fall,True,Any,Any,"180, 90",False,Any
old,False,Ground,3..6,Any,Any,Any
'''
FACTS = ["state=Ground", "speed=4", "heading=10", "ok=True", "Defender.Tags=Move.Run"]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the table `moves`."""
    (tmp_path / "contextdb.toml").write_text(TOML, encoding="utf-8")
    (tmp_path / "moves.csv").write_text(CSV, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


def refused(*arguments: str) -> list[str]:
    """The messages of a command that could not be done."""
    result = run("query", *arguments)
    assert (result.code, result.out) == (2, "")
    return result.err.splitlines()


# ---- the answer


def test_the_valid_assets_stand_on_standard_output_with_their_rows():
    assert run("query", "moves", *FACTS) == Result(0, "1 of 4 rows valid in moves\n\nrow  asset\n  1  run\n", "")


def test_without_a_valid_asset_the_nearest_rows_are_told_and_the_exit_code_is_1():
    result = run("query", "moves", "state=Ground", "speed=7", "heading=0", "ok=True", "Defender.Tags=Move.Run")
    assert (result.code, result.err) == (1, "")
    assert result.lines == [
        "0 of 4 rows valid in moves",
        "",
        "nearest rows that are not valid, and the cells to change",
        "",
        "row  asset  condition              fact    cell      change to",
        "  1  run    speed                  7 m/s   3..6      3..7",
        "  4  old    speed                  7 m/s   3..6      3..7",
        "            (the row is disabled)",
        '  2  jump   state                  Ground  "In Air"  Ground "In Air"',
        "            speed                  7 m/s   0..4      0..7",
    ]


def test_explain_tells_the_nearest_rows_beside_the_valid_ones():
    result = run("query", "moves", *FACTS, "--explain", "--most", "1")
    assert result.code == 0
    assert result.lines[-2:] == ["row  asset  condition              fact  cell  change to", "  4  old    (the row is disabled)"]
    assert len(run("query", "moves", *FACTS, "--explain").lines) > len(result.lines)
    assert run("query", "moves", *FACTS, "--explain", "--most", "0") == run("query", "moves", *FACTS)


def test_in_a_narrow_terminal_each_failing_cell_has_its_own_lines(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("COLUMNS", "60")
    lines = run("query", "moves", "state=Ground", "speed=7", "heading=0", "ok=True", "Defender.Tags=Move.Run").lines
    assert lines[4:7] == ["1  run", "   speed is 7 m/s", '     change "3..6" to "3..7"']
    assert "   the row is disabled" in lines


@pytest.mark.parametrize(("fact", "count"), [("speed=3..5", 2), ("speed=0..20", 3), ("heading=0 ± 90", 3), ("speed=not 3..5", 3)])
def test_a_set_of_values_finds_the_rows_that_may_match(fact: str, count: int):
    result = run("query", "moves", "--unknown", "any", "ok=True" if fact == "speed=3..5" else "ok=", fact, "--json")
    assert result.json["count"] == count


def test_of_a_set_of_values_it_is_said_which_rows_always_match():
    result = run("query", "moves", "--unknown", "any", "speed=3..5")
    assert result.lines[2:] == ["row  matches  asset", "  1  always   run", "  2  may      jump", "  3  always   fall"]


RULED = """
[conditions.speed]
type = "number"
[conditions.target]
type = "number"
[tables.t]
when = "Rule"
priority = "P"
policy = "priority"
"""


def test_it_is_said_which_rows_only_may_be_valid_and_who_is_picked(here: Path):
    (here / "contextdb.toml").write_text(RULED)
    (here / "t.csv").write_text("Asset,speed,Rule,P\na,Any,,1\nb,Any,target > 1,5\nc,Any,,5\n")
    asked = run("query", "t.csv", "speed=3", "--unknown", "any")
    assert [line.split() for line in asked.out.splitlines()[2:6]] == [
        ["row", "matches", "asset", "pick"],
        ["1", "always", "a", *["outranked", "by", "b", "and", "1", "more", "(priority", "5)"]],
        ["2", "may", "b", *["picked,", "chance", "50", "%"]],
        ["3", "always", "c", *["picked,", "chance", "50", "%"]],
    ]
    a, b, c = run("query", "t.csv", "speed=3", "--unknown", "any", "--json").json["matches"]
    assert (a["chance"], a["not_picked"]) == (0.0, "outranked by b and 1 more (priority 5)")
    assert (b["chance"], b["undecided"], c["chance"]) == (0.5, True, 0.5)
    assert "undecided" not in c
    assert "may" not in run("query", "t.csv", "speed=3", "target=2").out


def test_a_set_of_values_for_a_fact_that_only_a_rule_names_is_text_in_json(here: Path):
    (here / "contextdb.toml").write_text(RULED)
    (here / "t.csv").write_text("Asset,speed,Rule,P\na,Any,target > 1,1\n")
    document = run("query", "t.csv", "speed=3", "target=0..3", "--json").json
    assert document["context"] == {"speed": 3.0, "target": "0..3"}


@pytest.mark.parametrize(("unknown", "assets"), [("any", ["run", "fall"]), ("never", [])])
def test_missing_facts_are_treated_as_said(unknown: str, assets: list[str]):
    result = run("query", "moves", "state=Ground", "--unknown", unknown, "--json")
    assert [m["asset"] for m in result.json["matches"]] == assets
    assert result.code == (0 if assets else 1)


def test_options_may_stand_anywhere():
    assert run("query", "--json", "moves", FACTS[0], "--unknown=any", *FACTS[1:]).json["count"] == 1


def test_a_table_without_conditions_is_asked_without_facts(here: Path):
    (here / "bare.csv").write_text("Asset\na\nb\n", encoding="utf-8")
    assert run("query", "bare.csv") == Result(0, "2 of 2 rows valid in bare\n\nrow  asset\n  1  a\n  2  b\n", "")


def test_a_name_with_an_equals_sign_can_be_given(here: Path):
    (here / "odd.csv").write_text("Asset,a=b,a\nx,1,2\n", encoding="utf-8")
    assert run("query", "odd.csv", "a=b=1", "a=2").code == 0


def test_an_artefact_is_asked_like_a_table():
    assert run("compile", "moves", "-o", "m.safetensors").code == 0
    assert run("query", "m.safetensors", *FACTS) == run("query", "moves", *FACTS)
    assert run("query", "m.safetensors", *FACTS, "--json", "--explain") == run("query", "moves.csv", *FACTS, "--json", "--explain")


# ---- the JSON document


def test_the_json_document_has_the_promised_fields():
    document = run("query", "moves", *FACTS, "--json").json
    assert document == {
        "format": 1,
        "table": "moves",
        "context": {"state": "Ground", "speed": 4.0, "heading": 10.0, "ok": True, "Defender.Tags": ["Move.Run"]},
        "count": 1,
        "matches": [{"row": 0, "asset": "run", "always": True}],
    }
    assert list(document) == ["format", "table", "context", "count", "matches"]


def test_the_json_document_of_an_empty_answer_is_whole_and_the_exit_code_1():
    result = run("query", "moves", "--unknown", "any", "speed=11", "state=In Air", "heading=0", "--json")
    assert (result.code, result.err) == (1, "")
    assert result.json == {
        "format": 1,
        "table": "moves",
        "context": {"state": "In Air", "speed": 11.0, "heading": 0.0},
        "count": 0,
        "matches": [],
    }


def test_the_json_document_explains_on_demand():
    document = run("query", "moves", *FACTS, "--json", "--explain", "--most", "2").json
    assert document["explain"] == [
        {"row": 3, "asset": "old", "enabled": False, "failures": []},
        {
            "row": 1,
            "asset": "jump",
            "enabled": True,
            "failures": [{"condition": "state", "cell": '"In Air"', "fact": "Ground", "change_to": 'Ground "In Air"'}],
        },
    ]


def test_sets_and_infinite_numbers_are_text_in_json():
    document = run("query", "moves", "--unknown", "any", "speed=inf", "heading=0 ± 90", "--json").json
    assert document["context"] == {"speed": "inf", "heading": "-90..90"}
    json.dumps(document, allow_nan=False)


def test_characters_that_json_cannot_hold_or_a_terminal_should_not_get_are_escaped(here: Path):
    (here / "t.csv").write_text("Asset,word\na\x9b31m\u2028,Any\n", encoding="utf-8")
    result = run("query", "t.csv", "word=half\udc80pair", "--json")
    assert result.code == 0
    assert result.out.isascii()
    assert result.json["matches"][0]["asset"] == "a\x9b31m\u2028"


# ---- what is refused


def test_missing_facts_are_named_with_what_to_write():
    assert refused("moves", "state=Ground", "ok=True", "speed=1", "heading=1") == [
        'contextdb: the fact "Defender.Tags" is missing. '
        "Accepted: a value for each condition, or --unknown any, or --unknown never."
    ]
    assert refused("moves")[0].startswith('contextdb: the fact "state" is missing (5 facts missing: "state", "speed", ')
    assert refused("moves", *FACTS[1:], "state=")[0].startswith('contextdb: the fact "state" is missing.')
    assert refused("moves", *FACTS[:1], *FACTS[2:], "speed=nan")[0].startswith('contextdb: the fact "speed" is missing.')


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        (
            "sped=1",
            'there is no condition "sped". Accepted: "state", "speed", "heading", "ok", "Defender.Tags". Did you mean "speed"?',
        ),
        ("Speed=1", 'Did you mean "speed"?'),
        ("speed", '"speed" is not a fact. Accepted: FACT=VALUE, without spaces round the =. Did you mean "speed=…"?'),
        ("=1", 'there is no condition "".'),
        ("speed=fast", 'column "speed": cannot read "fast" as a number.'),
        ("speed=5..3", 'column "speed": '),
        ("speed=1 ~2", "a set without a penalty"),
        ("state=Gruond", 'column "state": "Gruond" is not a declared value. Accepted: "Ground", "In Air". Did you mean "Ground"?'),
        ("ok=maybe", 'column "ok": cannot read "maybe" as a bool.'),
        ("heading=inf", 'column "heading": '),
        ("Defender.Tags=Stuned", 'Did you mean "Stunned"?'),
        ("On=True", 'there is no condition "On".'),
    ],
)
def test_a_fact_that_cannot_be_meant_is_refused_with_what_can(argument: str, message: str):
    (line,) = refused("moves", "--unknown", "any", argument)
    assert line.startswith("contextdb: ")
    assert message in line


def test_all_wrong_facts_are_told_at_once():
    assert len(refused("moves", "sped=1", "state=Air", "speed=x", "ok")) == 4


def test_a_fact_given_twice_is_refused():
    assert refused("moves", "ok=True", "ok=True") == ['contextdb: the fact "ok" is given twice. Accepted: each fact once.']


def test_a_table_that_cannot_be_read_is_refused_with_all_its_faults(here: Path):
    (here / "moves.csv").write_text("Asset,On,speed,ok\na,True,fast,True\nb,True,1,perhaps\n", encoding="utf-8")
    told = refused("moves", "speed=1", "ok=True")
    assert [line.partition(": cannot")[0] for line in told] == [
        'contextdb: moves.csv, line 2, column "speed"',
        'contextdb: moves.csv, line 3, column "ok"',
    ]


def test_a_misspelt_table_is_named_with_the_nearest():
    assert refused("moevs", "speed=1") == [
        "contextdb: moevs: there is no such table. Accepted: a file, a folder of one table, or the name of a table of the project. "
        'Did you mean "moves"?'
    ]


@pytest.mark.parametrize("most", ["-1", "x", "1.5", ""])
def test_a_number_of_rows_is_a_whole_number_from_0_up(most: str):
    assert refused("moves", *FACTS, f"--most={most}") == [
        f'contextdb query: argument --most: "{most}" is not a number of rows, such as 10.',
        'Try "contextdb query --help".',
    ]


# ---- facts as texts


@given(strategies.tables(least_conditions=1), st.data())
def test_a_fact_written_as_text_is_the_fact(table: Table, data: st.DataObject):
    compiled = table.compile()
    context, _ = data.draw(strategies.contexts(table))
    facts = {c.name: read_fact(context.get(c.name), c) for c in compiled.conditions}
    said = {name: fact for name, fact in facts.items() if not isinstance(fact, (Cell, frozenset))}
    texts = [f"{name}={_as_text(fact, compiled.asked[name].domain)}" for name, fact in said.items()]
    assert read_facts(texts, compiled) == said


def _as_text(fact: object, domain: Domain) -> str:
    return '"' + fact.replace('"', '""') + '"' if isinstance(fact, str) else describe(fact, domain)  # type: ignore[arg-type]


@given(st.lists(st.text(max_size=20), max_size=4))
def test_any_arguments_are_facts_or_refused(texts: list[str]):
    compiled = Table.from_columns({"Asset": ["a"], "x": ["1"], "y": ["b"]}, {"x": {"type": "number"}}).compile()
    faults = 0
    try:
        facts = read_facts(texts, compiled)
    except ContextError as error:
        facts, faults = {}, len(error.faults)
    assert set(facts) <= {"x", "y"}
    assert len(facts) == len(texts) if not faults else faults <= len(texts)


def test_the_valid_rows_are_looked_through_once_and_not_for_each_of_them(tmp_path, monkeypatch):
    (tmp_path / "t.csv").write_text("Asset,on\n" + "".join(f"a{i},True\n" for i in range(50)), encoding="utf-8")
    asked: list[int] = []
    monkeypatch.setattr(Outcome, "prefers_some", property(lambda outcome: bool(asked.append(len(outcome.rows)))))
    assert len(run("query", tmp_path / "t.csv", "on=true").lines) > 50
    assert asked == [50]
