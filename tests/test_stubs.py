"""Facts as Python types: what a type checker says of a context is what a query would say."""

from __future__ import annotations

from pathlib import Path
from typing import get_args, get_type_hints

import pytest

from contextdb.compiled.stubs import stubs_of
from contextdb.compiled.table import CompiledTable
from contextdb.errors import ContextError
from contextdb.tables.project import Project
from contextdb.tables.table import Table

api = pytest.importorskip("mypy.api", reason="mypy is not installed")

ROOT = Path(__file__).parent.parent
SCHEMA: dict[str, dict[str, object]] = {
    "ok": {"type": "bool", "description": "two\nlines # and more"},
    "n": {"type": "int", "min": -3},
    "speed": {"type": "number", "min": 0, "max": 9.5, "unit": "m/s"},
    "heading": {"type": "angle"},
    "state": {"type": "enum", "values": ["Ground", "Half Air"]},
    "word": {"type": "text"},
    "Defender.Tags": {"type": "tags", "values": ["Move.Run", "InAir"]},
    "any tags": {"type": "tags"},
}
CONTEXT = (
    '{"ok": True, "n": 3, "speed": 2.5, "heading": 90, "state": "Half Air", "word": "x", '
    '"Defender.Tags": {"Move", "InAir"}, "any tags": ["a"]}'
)


def compiled(schema: dict[str, dict[str, object]], name: str = "jog") -> CompiledTable:
    columns = {"Asset": ["a"], **{condition: ["Any"] for condition in schema}}
    return Table.from_columns(columns, schema, name=name).compile()


def names_in(text: str) -> dict[str, object]:
    """What the module holds when it is run."""
    module: dict[str, object] = {}
    exec(compile(text, "<stubs>", "exec"), module)
    return module


def judged(folder: Path, stubs: str, use: str = "") -> list[str]:
    """What mypy says, in strict mode, of the stubs and of a module that uses them."""
    (folder / "facts.py").write_text(stubs, encoding="utf-8")
    (folder / "use.py").write_text(f"import facts\n{use}", encoding="utf-8")
    options = ["--strict", "--no-error-summary", "--cache-dir", str(folder / "cache")]
    out, err, _ = api.run([*options, str(folder / "facts.py"), str(folder / "use.py")])
    assert err == ""
    return [line.partition("error: ")[2] for line in out.splitlines() if "error: " in line]


def test_mypy_accepts_a_context_that_a_query_answers(tmp_path: Path):
    table = compiled(SCHEMA)
    assert table.query(eval(CONTEXT)).assets == ["a"]
    assert judged(tmp_path, stubs_of({"jog": table}), f"context: facts.JogFacts = {CONTEXT}\n") == []


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ('"ok": True, ', "", 'Missing key "ok"'),
        ('"ok"', '"okay"', 'Extra key "okay"'),
        ('"n": 3', '"n": 3.5', 'item "n" has type "int"'),
        ('"speed": 2.5', '"speed": "fast"', 'item "speed" has type "float"'),
        ('"Half Air"', '"Water"', "Literal['Ground', 'Half Air']"),
        ('{"Move", ', '{"Swim", ', "Literal['Move', 'Move.Run', 'InAir']"),
    ],
)
def test_mypy_refuses_a_context_that_a_query_refuses(tmp_path: Path, right: str, wrong: str, said: str):
    assert right in CONTEXT
    table, context = compiled(SCHEMA), CONTEXT.replace(right, wrong)
    with pytest.raises(ContextError):
        table.query(eval(context))
    found = judged(tmp_path, stubs_of({"jog": table}), f"context: facts.JogFacts = {context}\n")
    assert any(said in line for line in found), found


def test_bounds_units_and_descriptions_stand_behind_the_facts_on_one_line():
    lines = stubs_of({"jog": compiled(SCHEMA)}).splitlines()
    assert "        'speed': float,  # 0..9.5 m/s" in lines
    assert "        'n': int,  # -3.." in lines
    assert "        'heading': float,  # degrees" in lines
    assert "        'ok': bool,  # two\\nlines # and more" in lines


def test_a_table_needs_the_facts_that_a_derived_one_is_computed_from():
    schema = {
        "speed": {"type": "number"},
        "target_speed": {"type": "number"},
        "closing": {"type": "number", "min": -9, "max": 9, "expr": "speed - target_speed"},
    }
    table = Table.from_columns({"Asset": ["a"], "closing": ["0..2"]}, schema, name="jog").compile()
    facts = names_in(stubs_of({"jog": table}))["JogFacts"]
    assert set(get_type_hints(facts)) == {"speed", "target_speed"} == set(table.asked)


def test_a_condition_of_several_tables_has_one_type():
    state = {"state": SCHEMA["state"]}
    text = stubs_of({"jog": compiled(state), "run": compiled(state, "run")})
    assert text.count("Literal[\n") == 1
    assert get_args(names_in(text)["State"]) == ("Ground", "Half Air")


def test_names_that_are_none_in_python_or_stand_twice_are_made_so(tmp_path: Path):
    values = {"type": "enum", "values": ["a'b\"", "x\ny", "Größe", "\\"]}
    schema = {
        name: values | {"description": name} for name in ("class", "Class", "a.b", "a b", "3", "…", "None", "Literal", "ﬁ", "fi")
    }
    tables = {name: compiled(schema, name) for name in ("jog", "Jog", "jog facts", "-", "2 tables", "表")}
    text = stubs_of(tables)
    assert judged(tmp_path, text) == []
    assert get_type_hints(names_in(text)["JogFacts"]).keys() == schema.keys()


def test_the_sample_tables_have_stubs_that_mypy_accepts(tmp_path: Path):
    tables = Project.load(ROOT / "tables").compile()
    text = stubs_of(tables)
    assert judged(tmp_path, text) == []
    assert text == stubs_of(Project.load(ROOT / "tables").compile())


def test_a_table_without_conditions_asks_for_no_facts(tmp_path: Path):
    assert judged(tmp_path, stubs_of({"jog": compiled({})}), "context: facts.JogFacts = {}\n") == []
