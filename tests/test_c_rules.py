"""The C header computes rules and derived facts as Python does, to the last bit that an answer depends on."""

import math
import random
from pathlib import Path
from typing import Any
from unittest import mock

import pytest
from asking_c import (
    BAD_FILE,
    CELLS,
    N_MOMENTS,
    OK,
    OTHER_TABLE,
    SCHEMA,
    SEED,
    TIMES,
    Facts,
    all_asked,
    artefact,
    ask_program,
    asked,
    python_says,
    random_moment,
)
from damaged_files import damaged_program, mutated
from random_rules import ANGLE_CELLS, NUMBER_CELLS, Drawing, derived_conditions

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import BOOL
from contextdb.cells.outputs import Output
from contextdb.compiled.c_header.naming import conditions_of
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.expressions import read_expression
from contextdb.schema.settings import TableSettings, conditions_from_dict
from contextdb.tables.table import Table

DERIVED_CELLS = {
    "d_number": NUMBER_CELLS,
    "d_angle": ANGLE_CELLS,
    "d_int": NUMBER_CELLS,
    "d_day": CELLS["day"],
    "d_ok": CELLS["ok"],
    "d_state": CELLS["state"],
    "d_word": CELLS["word"],
    "d_tags": CELLS["tags"],
    "d_declared": CELLS["Defender.Tags"],
}
TRUTH = Condition("", BOOL)


@pytest.fixture(scope="session")
def ask(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program that asks any artefact."""
    return ask_program(tmp_path_factory.mktemp("ask"))


def ruled_table(rng: random.Random, n_rows: int, settings: dict[str, Any] | None = None) -> CompiledTable:
    """A table with a few columns, plain and derived, rules that name these and other facts, and outputs."""
    schema = derived_conditions(rng, SCHEMA)
    drawing = Drawing(rng, conditions_from_dict(schema))
    derived = [name for name in schema if name not in SCHEMA]
    names = [*rng.sample(list(SCHEMA), rng.randrange(4)), *rng.sample(derived, rng.randrange(3))]
    cells = {name: [rng.choice(["Any", *(CELLS | DERIVED_CELLS)[name]]) for _ in range(n_rows)] for name in names}  # type: ignore[operator]
    rules = [drawing.drawn(drawing.truth, TRUTH) for _ in range(rng.choice([1, 3, n_rows]))]
    own, outputs = output_cells(rng, n_rows)
    said = [rng.choice(["", *rules]) for _ in range(n_rows)]
    columns = {"Asset": [rng.choice("abcd") for _ in range(n_rows)], **cells, "When": said, **own}
    told = {"when": "When", "outputs": tuple(own), "typed": outputs} | (settings or {})
    return Table.from_columns(columns, schema, TableSettings("ruled", **told)).compile()


def output_cells(rng: random.Random, n_rows: int) -> tuple[dict[str, list[str]], tuple[Output, ...]]:
    """Columns of outputs of every type, and what is declared of them."""
    drawn = {"damage": ["1", "-9"], "loud": ["True", "False"], "blend": ["0.25", "1e300"], "mood": ["Calm", "Very Angry"]}
    drawn |= {"line": ["Größe", "a b", ""], "offset": ["1 2.5", "0 -1"]}
    cells = {name: [rng.choice(values) for _ in range(n_rows)] for name, values in drawn.items()}
    moods = Output("mood", "enum", values=("Calm", "Very Angry"))
    plain = (Output("damage", "int", 3), Output("loud", "bool"), Output("blend", "number"), Output("line"))
    return cells, (*plain, moods, Output("offset", "numbers", size=2))


def moments_of(rng: random.Random, n: int) -> list[tuple[str, Facts]]:
    """Contexts in which numbers are often no round ones."""
    missing = rng.choice([0.0, 0.02, 0.2])
    found = []
    for _ in range(n):
        unknown, facts = random_moment(rng, SCHEMA, missing)
        for name in ("speed", "heading"):
            if name in facts and rng.random() < 0.5:
                facts = {**facts, name: rng.choice([rng.uniform(-9, 9), rng.uniform(-1, 1) * 10 ** rng.randrange(-9, 9)])}
        found.append((unknown, facts))
    return found


def test_rules_and_derived_facts_are_computed_as_python_computes_them(ask: Path, tmp_path: Path):
    rng = random.Random(SEED + 11)
    n_valid = n_faults = 0
    for _ in range(40 * TIMES):
        compiled = ruled_table(rng, rng.choice([1, 5, 70]))
        moments = moments_of(rng, N_MOMENTS)
        [(status, answers)] = asked(ask, tmp_path, conditions_of(data_of(compiled)), [artefact(compiled, tmp_path)], moments)
        assert status == OK
        for moment, answer in zip(moments, answers, strict=True):
            expected = python_says(compiled, *moment)
            is_same = answer == expected or (answer[0] > 0 and expected[0] > 0)  # of two faults each names its first
            rules = data_of(compiled).when
            assert is_same, (moment, answer, expected, rules and [r.expression.text for r in rules.rules])
        n_valid += sum(rows > 0 for _, rows in answers)
        n_faults += sum(fault > 0 for fault, _ in answers)
    assert n_valid > 200
    assert n_faults > 50


def plain_table(rules: list[str], schema: dict[str, dict[str, object]], **columns: list[str]) -> CompiledTable:
    """A table of a few rules that are written out."""
    cells = {"Asset": [f"row {i}" for i in range(len(rules))], **columns, "When": rules}
    return Table.from_columns(cells, schema, TableSettings("ruled", when="When")).compile()


NUMBERS: dict[str, dict[str, object]] = {"a": {"type": "number"}, "b": {"type": "number"}}
SOME = [0.0, 1.0, -1.0, 2.5, -2.5, 0.5, 1.5, 3.0, 1e-300, 5e-324, 1e308, -1e308, math.inf, -math.inf, 180.0, -180.0, 0.1, 1e17, 7.3]


def test_every_function_gives_the_same_bits_as_in_python(ask: Path, tmp_path: Path):
    forms = ["a + b", "a - b", "a * b", "a / b", "a // b", "a % b", "-a", "abs(a)", "hypot(a, b)", "sqrt(a)", "floor(a)", "ceil(a)"]
    forms += ["round(a)", "atan2(a, b)", "wrap_angle(a)", "a ** 7", "min(a, b, 1)", "max(a, b, 1)", "clamp(a, b, 3)"]
    rng = random.Random(3)
    numbers = [*SOME, *(rng.uniform(-9, 9) * 10.0 ** rng.randrange(-3, 6) for _ in range(12))]
    pairs = [(a, b) for a in numbers for b in numbers]
    schema = {**NUMBERS, "found": {"type": "number"}, "r": {"type": "number"}}
    for form in forms:
        compiled = plain_table(
            [f"{form} == found", f"{form} == {form}"], {**schema, "r": {"type": "number", "expr": form}}, r=["Any", "Any"]
        )
        values = [read_expression(form, compiled.asked).evaluate({"a": a, "b": b}) for a, b in pairs]
        moments: list[tuple[str, Facts]] = [
            ("never", {"a": a, "b": b, "found": 0.0 if v is None else v}) for (a, b), v in zip(pairs, values, strict=True)
        ]
        [(_, answers)] = asked(ask, tmp_path, conditions_of(data_of(compiled)), [artefact(compiled, tmp_path)], moments)
        assert [rows for _, rows in answers] == [0 if v is None else 3 for v in values], form


def test_a_missing_fact_of_a_rule_and_a_rule_without_a_finite_value_are_named(ask: Path, tmp_path: Path):
    compiled = plain_table(["a / b > 0", "ok or a > 1"], {**NUMBERS, "ok": {"type": "bool"}})
    moments: list[tuple[str, Facts]] = [
        *((unknown, {"a": 1.0, "b": 0.0, "ok": True}) for unknown in ("error", "any", "never")),
        *((unknown, {"b": 1.0, "ok": True}) for unknown in ("error", "any", "never")),
    ]
    [(_, answers)] = asked(ask, tmp_path, conditions_of(data_of(compiled)), [artefact(compiled, tmp_path)], moments)
    assert answers == [(5, 0), (0, 0b11), (0, 0b10), (5, 0), (0, 0b11), (0, 0b10)]
    assert answers == [python_says(compiled, *moment) for moment in moments]


def test_a_fact_that_is_computed_needs_all_that_it_names_as_in_python(ask: Path, tmp_path: Path):
    schema: dict[str, dict[str, object]] = {**NUMBERS, "ok": {"type": "bool"}}
    schema |= {"some": {"type": "bool", "expr": "ok or a > 1"}, "more": {"type": "number", "expr": "b if some else 1 / a"}}
    compiled = Table.from_columns({"Asset": ["x"], "more": ["2.."]}, schema).compile()
    facts = [{"a": 1.0, "b": 3.0, "ok": True}, {"b": 3.0, "ok": True}, {"a": 2.0, "b": 3.0}, {"a": 1.0, "ok": False}, {}]
    moments: list[tuple[str, Facts]] = [(unknown, some) for some in facts for unknown in ("error", "any", "never")]
    [(_, answers)] = asked(ask, tmp_path, conditions_of(data_of(compiled)), [artefact(compiled, tmp_path)], moments)
    assert [status for status, _ in answers[::3]] == [OK, 5, 5, 5, 5]
    assert answers == [python_says(compiled, *moment) for moment in moments]


def test_a_condition_that_the_game_does_not_know_is_refused_or_any(ask: Path, tmp_path: Path):
    schema = {
        **NUMBERS,
        "new": {"type": "bool"},
        "twice": {"type": "number", "expr": "2 * a"},
        "odd": {"type": "bool", "expr": "not new"},
    }
    rules = ["a > 1", "new", "twice > 2", "odd"]
    compiled = plain_table(rules, schema, b=["1", "Any", "Any", "2"], new=["True"] * 4, odd=["False"] * 4)
    known = tuple(c for c in conditions_of(data_of(compiled)) if c.name != "new")
    moments: list[tuple[str, Facts]] = [("error", {"a": 1.0, "b": 1.0}), ("error", {"a": 2.0, "b": 2.0})]
    whole = artefact(compiled, tmp_path)
    assert asked(ask, tmp_path, known, [whole], moments) == [(OTHER_TABLE, [])]
    assert asked(ask, tmp_path, known, [whole], moments, strange=1) == [(OK, [(0, 0b0010), (0, 0b1110)])]


def test_a_file_of_an_older_version_without_programs_is_refused(ask: Path, tmp_path: Path):
    compiled = plain_table(["a > 1"], NUMBERS)
    with mock.patch("contextdb.compiled.programs.programs_to_tensors", return_value={}):
        older = artefact(compiled, tmp_path)
    assert CompiledTable.open(tmp_path / "table.safetensors").query({"a": 2}).assets == ["row 0"]
    assert asked(ask, tmp_path, conditions_of(data_of(compiled)), [older], []) == [(OTHER_TABLE, [])]


@pytest.mark.parametrize("seed", range({1: 2, 8: 8}.get(TIMES, 70)))
def test_damaged_programs_are_refused_or_computed_and_never_crash_it(ask: Path, tmp_path: Path, seed: int):
    rng = random.Random(SEED + seed)
    compiled = ruled_table(rng, 40, {"policy": rng.choice(["specific", "cheapest", "collect", "first"])})
    whole = artefact(compiled, tmp_path)
    damaged = [damaged_program(rng, whole) if i % 3 else mutated(rng, whole) for i in range(1_500)]
    about = conditions_of(data_of(compiled)), [whole, *damaged], moments_of(rng, 4), seed % 2, 1, compiled.outputs.declared
    found = all_asked(ask, tmp_path, *about)
    assert {answers.status for answers in found} >= {OK, BAD_FILE}
