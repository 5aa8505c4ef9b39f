"""`contextdb query`: the valid assets on standard output, why others are not, and an exit code that a script can rely on."""

from pathlib import Path

import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from running import run

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


# ---- the JSON document


def test_characters_that_json_cannot_hold_or_a_terminal_should_not_get_are_escaped(here: Path):
    (here / "t.csv").write_text("Asset,word\na\x9b31m\u2028,Any\n", encoding="utf-8")
    result = run("query", "t.csv", "word=half\udc80pair", "--json")
    assert result.code == 0
    assert result.out.isascii()
    assert result.json["matches"][0]["asset"] == "a\x9b31m\u2028"


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
