"""The C header says what soft cells cost, why a row is not valid, which rows an asset has, and picks as Python does."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from asking_c import CELLS, OK, SCHEMA, Answers, Facts, all_asked, artefact, ask_program
from strategies import IS_FULL
from test_c_rules import moments_of, ruled_table

from contextdb.compiled.c_header.face import conditions_of
from contextdb.compiled.table import CompiledTable
from contextdb.errors import ContextError
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table

RULE, DISABLED = 1 << 62, 1 << 61


@pytest.fixture(scope="session")
def ask(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program that asks any artefact."""
    return ask_program(tmp_path_factory.mktemp("ask"))


def soft_table(rng: random.Random, n_rows: int) -> CompiledTable:
    """A table in which many cells are soft, and some rows disabled."""
    names = rng.sample(list(SCHEMA), 4)
    softness = ["", " ~2", " ~0.7", " ~1e9"]
    cells = {n: [rng.choice(CELLS[n]).split(" ~")[0] + rng.choice(softness) for _ in range(n_rows)] for n in names}
    cells = {n: ["Any" if c.startswith("Any") else c for c in column] for n, column in cells.items()}
    enabled = [rng.choice(["yes", "yes", "no"]) for _ in range(n_rows)]
    columns = {"Asset": [rng.choice("abcd") for _ in range(n_rows)], **cells, "On": enabled}
    return Table.from_columns(columns, SCHEMA, TableSettings("soft", enabled="On")).compile()


def costs_in_python(compiled: CompiledTable, unknown: str, facts: Facts) -> tuple[int, list[float]]:
    try:
        return OK, compiled.penalties(facts, unknown).tolist()  # type: ignore[arg-type]
    except ContextError:
        return -1, [0.0] * compiled.n_rows


def failing_in_python(compiled: CompiledTable, unknown: str, facts: Facts) -> list[int]:
    """What fails in each row, as the program says it."""
    try:
        explanation = compiled.explain(facts, unknown)  # type: ignore[arg-type]
    except ContextError:
        return [-1] * compiled.n_rows
    number = {c.name: i for i, c in enumerate(compiled.conditions)}
    found = []
    for row in range(compiled.n_rows):
        told = explanation.row(row)
        bits = sum({1 << number[f.condition] if f.condition in number else RULE for f in told.failures})
        found.append(bits | (0 if told.is_enabled else DISABLED))
    return found


def assert_told(compiled: CompiledTable, answers: Answers, moments: list[tuple[str, Facts]]) -> None:
    assert answers.status == OK
    for moment, (fault, _), told in zip(moments, answers.rows, answers.told, strict=True):
        status, costs = costs_in_python(compiled, *moment)
        assert told.penalties == (told.penalties[0] if status else OK, costs)
        assert (told.penalties[0] == OK) is (status == OK)
        if fault == OK:  # else Python refuses, where C says of an open rule that it does not hold
            assert told.why_not == failing_in_python(compiled, *moment)


def test_costs_of_soft_cells_and_failing_cells_are_those_of_python(ask: Path, tmp_path: Path):
    rng = random.Random(21)
    for turn in range(100 if IS_FULL else 12):
        compiled = ruled_table(rng, 20) if turn % 4 == 0 else soft_table(rng, rng.choice([1, 20, 70]))
        moments = moments_of(rng, 12)
        [answers] = all_asked(ask, tmp_path, conditions_of(compiled), [artefact(compiled, tmp_path)], moments, memory=1)
        assert_told(compiled, answers, moments)
