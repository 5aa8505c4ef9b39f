"""The C header says what soft cells cost, why a row is not valid, which rows an asset has, and picks as Python does."""

import math
import random
from pathlib import Path

import asking_c
import pytest
from asking_c import (
    CELLS,
    N_MOMENTS,
    OK,
    SCHEMA,
    SEED,
    TIMES,
    UNKNOWN,
    Answers,
    Facts,
    all_asked,
    artefact,
    ask_program,
    output_words,
    random_moment,
    random_nest,
    random_table,
)
from test_c_rules import moments_of, output_cells, ruled_table

from contextdb.compiled.c_header.naming import conditions_of
from contextdb.compiled.classes import WideMasks
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ContextError, PolicyError
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
        return OK, compiled.penalties(facts, unknown=unknown).tolist()  # type: ignore[arg-type]
    except ContextError:
        return -1, [0.0] * compiled.n_rows


def failing_in_python(compiled: CompiledTable, unknown: str, facts: Facts) -> list[int]:
    """What fails in each row, as the program says it: where only an open rule is refused, the other rows are told none the less."""
    try:
        explanation = compiled.explain(facts, unknown=unknown)  # type: ignore[arg-type]
    except ContextError as error:
        if "the rule" not in str(error):
            return [-1] * compiled.n_rows
        kept, left = (failing_in_python(compiled, mode, facts) for mode in ("any", "never"))
        return [-1 if may == 0 and fails == RULE else fails for may, fails in zip(kept, left, strict=True)]
    number = {c.name: i for i, c in enumerate(compiled.conditions)}
    found = []
    for row in range(compiled.n_rows):
        told = explanation.row(row)
        bits = sum({1 << number[f.condition] if f.condition in number else RULE for f in told.failures})
        found.append(bits | (0 if told.is_enabled else DISABLED))
    return found


def assert_told(compiled: CompiledTable, answers: Answers, moments: list[tuple[str, Facts]]) -> None:
    assert answers.status == OK
    for moment, told in zip(moments, answers.told, strict=True):
        status, costs = costs_in_python(compiled, *moment)
        assert told.penalties == (told.penalties[0] if status else OK, costs)
        assert (told.penalties[0] == OK) is (status == OK)
        assert told.why_not == failing_in_python(compiled, *moment)


def test_costs_of_soft_cells_and_failing_cells_are_those_of_python(ask: Path, tmp_path: Path):
    rng = random.Random(SEED + 21)
    for turn in range(12 * TIMES):
        compiled = ruled_table(rng, 20) if turn % 4 == 0 else soft_table(rng, rng.choice([1, 20, 70]))
        moments = moments_of(rng, 12)
        [answers] = all_asked(ask, tmp_path, conditions_of(data_of(compiled)), [artefact(compiled, tmp_path)], moments, memory=1)
        assert_told(compiled, answers, moments)


REACHES = {
    "n": (0.0, 1.0, 3.0),
    "speed": (0.0, 0.5, 3.0, 1e300),
    "heading": (0.0, 1.0, 20.0, math.nextafter(180.0, 0.0), 180.0, 200.0),
}
GROWING = {"n": ["2..3 ~1/2"], "speed": ["1..3 ~2/4", "5.. ~1.5/3"], "heading": ["0..90 ~1.5/30", "170, 20 ~2/7"]}


def test_rows_of_what_plays_and_their_costs_are_those_of_python(ask: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    rng = random.Random(SEED + 23)
    n_more = 0
    for name, cells in GROWING.items():
        monkeypatch.setitem(asking_c.CELLS, name, [*CELLS[name], *cells])
    for turn in range(30 * TIMES):
        for name, reaches in REACHES.items():
            monkeypatch.setitem(asking_c.SCHEMA, name, {**SCHEMA[name], "hysteresis": rng.choice(reaches)})
        if turn % 10 == 3:
            compiled = wide_table(rng)
        elif turn % 3 == 0:
            compiled = ruled_table(rng, 20)
        else:
            compiled = random_nest(rng, 15) if turn % 3 == 1 else random_table(rng, rng.choice([1, 20, 70]))
        moments = moments_of(rng, 12)
        [answers] = all_asked(ask, tmp_path, conditions_of(data_of(compiled)), [artefact(compiled, tmp_path)], moments, memory=1)
        for (unknown, facts), (status, rows), told in zip(moments, answers.rows, answers.told, strict=True):
            try:
                expected = data_of(compiled).query_widened(facts, unknown)
            except ContextError:  # a rule may be open in a row that is valid with widened facts alone
                assert told.widened[0] != OK, (unknown, facts)
                continue
            assert (status, told.widened) == (OK, (OK, expected.bits)), (unknown, facts)
            assert told.widened_penalties == (OK, expected.penalties.tolist()), (unknown, facts)
            n_more += expected.bits != rows
    assert n_more > 50


def wide_table(rng: random.Random) -> CompiledTable:
    """A table with a column whose bounds are so many that it keeps its masks in digits."""
    starts = [rng.uniform(-20.0, 20.0) for _ in range(3000)]
    columns = {
        "speed": [f"{start:.6f}..{start + 0.5:.6f}" for start in starts],
        "heading": [f"{9 * start:.6f}, 3" for start in starts],
    }
    compiled = Table.from_columns({"Asset": ["a"] * len(starts), **columns}, SCHEMA).compile()
    assert all(isinstance(masks, WideMasks) for masks in data_of(compiled).masks)
    return compiled


def test_a_row_whose_rule_is_open_is_a_fault_where_only_that_keeps_it_from_being_valid(ask: Path, tmp_path: Path):
    rng = random.Random(SEED + 22)
    n_open = 0
    for _ in range(4 * TIMES):
        rules = ["", "1 / speed > 0.2", "speed * n < 5", '1 / n > 0 or state == "A"', "speed / n < 1 and not ok"]
        columns = {name: [rng.choice(CELLS[name]) for _ in range(20)] for name in ("state", "n")}
        columns |= {"When": [rng.choice(rules) for _ in range(20)], "On": [rng.choice(["yes", "yes", "no"]) for _ in range(20)]}
        settings = TableSettings("open", when="When", enabled="On")
        compiled = Table.from_columns({"Asset": ["a"] * 20, **columns}, SCHEMA, settings).compile()
        facts = {"n": [0, 0, 1, 3], "speed": [0.0, 1.0, 1e308], "state": ["A", "B"], "ok": [True, False]}
        moments = [(rng.choice(UNKNOWN), {name: rng.choice(of) for name, of in facts.items()}) for _ in range(20)]
        [answers] = all_asked(ask, tmp_path, conditions_of(data_of(compiled)), [artefact(compiled, tmp_path)], moments, memory=1)
        assert_told(compiled, answers, moments)
        n_open += sum(-1 in told.why_not and max(told.why_not) >= 0 for told in answers.told)
    assert n_open > 5


def picked_table(rng: random.Random, n_rows: int, name: str, assets: str, has_inner: bool = False) -> Table:
    """A table from which much can be picked, by any policy, with rows that rest."""
    names = ["ok", "state", "speed"]
    schema = {n: {**SCHEMA[n], "weight": rng.choice([1.0, 0.1, 2.5])} for n in names}
    soft = rng.choice([[""], ["", " ~1", " ~0.5"]])
    cells = {
        n: ["Any" if rng.random() < 0.6 else rng.choice(PICK_CELLS[n]) + rng.choice(soft) for _ in range(n_rows)] for n in names
    }
    jobs = {
        "priority": ["0", "1", "-2"],
        "weight": ["1", "0", "2.5", "0.1"],
        "once": ["yes", "no"],
        "cooldown_s": ["0", "1.2", "7"],
    }
    jobs["cooldown_turns"] = ["0", "1", "3"]
    told = {job: [rng.choice(["", *values]) for _ in range(n_rows)] for job, values in jobs.items()}
    used = {job: job for job in jobs if rng.random() < (0.7 if job in ("priority", "weight") else 0.3)}
    policy = rng.choice(["collect", "priority", "specific", "cheapest", "collect", "first", "unique"])
    own, outputs = output_cells(rng, n_rows)
    given = rng.choice([(), (("damage", 7), ("offset", (1.5, 2.0)))])
    settings = TableSettings(
        name, policy=policy, fallback="rest", fallback_outputs=given, outputs=tuple(own), typed=outputs, **used
    )
    said = [rng.choice([*assets, "@inner"] if has_inner else assets) for _ in range(n_rows)]
    return Table.from_columns({"Asset": said, **cells, **{job: told[job] for job in used}, **own}, schema, settings)


PICK_CELLS = {"ok": ["True", "False"], "state": ["A", "B C"], "speed": ["<5", "1..", "0..10"]}


def picks_in_python(
    compiled: CompiledTable, moments: list[tuple[str, Facts]], memory: int
) -> list[tuple[bool, int, list[int], int]]:
    """Whether a query and the pick from it are refused, the row that is picked, its outputs, and the digest of the picker."""
    picker, found = compiled.picker(seed=7, memory=memory), []
    for turn, (unknown, facts) in enumerate(moments):
        try:
            pick = picker.pick(compiled.query(facts, unknown=unknown), time_s=0.5 * turn, who=3)  # type: ignore[arg-type]
            found.append((False, -1 if pick.row is None else pick.row, output_words(pick.outputs), picker.digest()))
        except (ContextError, PolicyError):
            found.append((True, -1, output_words(compiled.outputs.fallback), picker.digest()))
    return found


def assert_picks(ask: Path, folder: Path, compiled: CompiledTable, moments: list[tuple[str, Facts]], memory: int) -> int:
    """How many picks gave a row."""
    about = conditions_of(data_of(compiled)), [artefact(compiled, folder)], moments, 0, memory, compiled.outputs.declared
    [answers] = all_asked(ask, folder, *about)
    expected = picks_in_python(compiled, moments, memory)
    digests = [told.digest if digest else 0 for told, (*_, digest) in zip(answers.told, expected, strict=True)]  # 0: nobody yet
    picks = [(told.pick[0] > 0, *told.pick[1:], told.outputs, digest) for told, digest in zip(answers.told, digests, strict=True)]
    assert picks == expected
    return sum(row >= 0 for _, row, *_ in picks)


def test_picks_are_those_of_a_picker_in_python(ask: Path, tmp_path: Path):
    rng = random.Random(SEED + 31)
    n_picked = 0
    for turn in range(40 * TIMES):
        outer = picked_table(rng, rng.choice([1, 6, 30, 30, 150]), "outer", "abcd", has_inner=turn % 3 == 0)
        inner = picked_table(rng, 8, "inner", "aef")
        compiled = outer.compile({"inner": inner})
        moments = [random_moment(rng, ["ok", "state", "speed"], 0.01) for _ in range(N_MOMENTS)]
        n_picked += assert_picks(ask, tmp_path, compiled, moments, rng.choice([0, 1, 1, 3, 8]))
    assert n_picked > 400


def test_picks_from_a_table_with_rules_are_those_of_python(ask: Path, tmp_path: Path):
    rng = random.Random(SEED + 32)
    for _ in range(6 * TIMES):
        compiled = ruled_table(rng, 30, {"policy": rng.choice(["specific", "cheapest", "collect"])})
        assert_picks(ask, tmp_path, compiled, moments_of(rng, N_MOMENTS), 1)
