"""Contracts: proved as trying every context says, and every counterexample breaks what it says it breaks."""

import datetime
import fnmatch
import random
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import oracles
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from random_projects import DOMAINS, HALF_TURNS, Drawing, RandomProject, RandomTable, Row, Term, random_project
from strategies import examples

import contextdb as cdb
from contextdb.covering.contracts import Proof, prove
from contextdb.schema.contracts import VERBS, Contract
from contextdb.schema.settings import TableSettings

MOST_CONTEXTS = 6000
PATTERNS = ("A", "*A*", "outer_[024]", "inner*", "nothing", "*", "?")


def is_kind(asset: str, pattern: str) -> bool:
    return fnmatch.fnmatchcase(asset, pattern)


def path_of(project: RandomProject, row: Row) -> str:
    """The asset of a row as a query names it."""
    return "/".join([*(table for table, _ in row if len(row) > 1), project.asset(row)])


def rank(project: RandomProject, table: RandomTable, at: int) -> tuple[float, ...]:
    """How much a row of one table is preferred under its policy; more is better."""
    policy = table.settings["policy"]
    if policy == "first":
        return (-at,)
    if policy == "unique":
        return ()
    priority = int(table.columns["Priority"][at] or 0) if "Priority" in table.columns else 0
    cells = [table.columns[name][at] for name in table.conditions]
    n_said = sum(text != "Any" and "~" not in text for text in cells)
    has_rule = bool(table.rules and table.rules[at] is not None)
    return (priority, n_said + has_rule) if policy == "specific" else (priority,)


def winners(project: RandomProject, valid: Sequence[Row], depth: int = 0) -> list[Row]:
    """The rows that may be picked: at each depth those of the highest rank."""
    if not valid or len(valid[0]) <= depth:
        return list(valid)
    steps = {row[depth] for row in valid}
    best = max(rank(project, project.tables[table], at) for table, at in steps)
    won: list[Row] = []
    for step in sorted(steps):
        if rank(project, project.tables[step[0]], step[1]) == best:
            inner = [row for row in valid if row[depth] == step]
            ended = [row for row in inner if len(row) == depth + 1]
            won += ended or winners(project, inner, depth + 1)
    return won


def is_broken(project: RandomProject, contract: Contract, pattern: str, valid: Sequence[Row]) -> bool:
    """Whether a contract is broken where these rows are valid."""
    of_kind = [row for row in valid if is_kind(path_of(project, row), pattern)]
    match contract.verb:
        case "some":
            return not of_kind
        case "every":
            return len(of_kind) < len(valid)
        case "none":
            return bool(of_kind)
        case "at_most":
            return len(of_kind) > contract.most
    return not valid or not all(is_kind(path_of(project, row), pattern) for row in winners(project, valid))


def truths(term: Term, facts: Mapping[str, object]) -> list[object]:
    """What an expression is in a context; of an angle at half a turn by each comparison alone, and as -180 and 180 throughout."""
    turned = [name for name in facts if DOMAINS[name].kind == "angle" and facts[name] == -180.0]
    ways = [dict.fromkeys(turned, half_turn) for half_turn in HALF_TURNS]
    return [term.value(facts), *(term.value({**facts, **way}) for way in ways)]


def drawn(seed: int) -> tuple[RandomProject, RandomProject, Contract, str, Term | None]:
    """A project, the same with what the contract is about assumed, the contract, the pattern of its kind, and its premise."""
    rng = random.Random(seed)
    while True:
        project = random_project(rng)
        when = Drawing(rng).truth(project.named) if project.named and rng.random() < 0.7 else None
        premised = replace(project, assume=[*project.assume, *([when] if when else [])])
        if premised.n_contexts <= MOST_CONTEXTS:
            break
    pattern, verb = rng.choice(PATTERNS), rng.choice(VERBS)
    kind = f"asset like '{pattern}'"
    limit = (rng.randrange(3), rng.choice([None, kind]))
    contract = Contract("c", table="outer", when=when.text if when else None, **{verb: limit if verb == "at_most" else kind})
    return project, premised, contract, "*" if contract.kind is None else pattern, when


def proved(project: RandomProject, contract: Contract) -> Proof:
    with tempfile.TemporaryDirectory() as folder:
        table = cdb.Project.load(project.write(Path(folder) / "p"))["outer"]
        return prove(contract, table, samples=4000)


@examples(4)
@given(st.integers(0, 2**32))
@example(4650)  # a winner, where no row can be picked
def test_a_contract_holds_exactly_where_no_context_breaks_it(seed: int):
    project, premised, contract, pattern, when = drawn(seed)
    proof = proved(project, contract)
    contexts = [(facts, share) for facts, share in premised.contexts if is_certain(project, when, facts)]
    valid = [[row for row in project.rows if project.is_valid(row, facts)] for facts, _ in contexts]
    broken = [is_broken(project, contract, pattern, rows) for rows in valid]
    if proof.holds:
        assert not any(broken), (contract, next(c for c, b in zip(contexts, broken, strict=True) if b))
        assert (proof.lower, proof.upper, proof.witness) == (1.0, 1.0, None)
        assert not proof.is_vacuous or not contexts
    if proof.holds is False:
        assert proof.witness is not None
        facts = project.complete({name: fact(name, value) for name, value in proof.witness.context.items()})
        assert all(term.value(facts) is not False for term in project.assume)
        assert when is None or when.value(facts) is True
        rows = [row for row in project.rows if project.is_valid(row, facts)]
        assert [path_of(project, row) for row in rows] == list(proof.witness.assets)
        assert is_broken(project, contract, pattern, rows)
    total = sum(share for _, share in contexts)
    if total and premised.is_measurable:
        share = 1.0 - float(sum(share for (_, share), b in zip(contexts, broken, strict=True) if b) / total)
        width = 0.0 if proof.lower == proof.upper else proof.upper - proof.lower
        assert proof.lower - width - 1e-9 <= share <= proof.upper + width + 1e-9


def is_certain(project: RandomProject, when: Term | None, facts: Mapping[str, object]) -> bool:
    """Whether a context can happen and is as the contract says, however half a turn is taken."""
    assumed = all(False not in truths(term, facts) for term in project.assume)
    return assumed and (when is None or all(truth is True for truth in truths(when, facts)))


def fact(name: str, value: object) -> object:
    """A fact of a counterexample as oracles have it."""
    kind = DOMAINS[name].kind
    if kind == "tags":
        return frozenset(value)
    if kind == "date":
        return float((datetime.date.fromisoformat(value) - oracles.EPOCH).days)
    return float(value) if kind in ("int", "number", "angle") else value


ORDERS = st.builds("d {} {}".format, st.sampled_from(["<", "<=", ">", ">="]), st.sampled_from(range(-180, 181, 90)))
PREMISES = st.lists(st.one_of(ORDERS, ORDERS.map("(p or {})".format)), min_size=1, max_size=3, unique=True)
HEADINGS: list[tuple[int, ...]] = [HALF_TURNS, *((angle,) for angle in range(-135, 180, 45))]  # type: ignore[list-item]


@examples(50)
@given(PREMISES, st.integers(0, 3), st.sampled_from([(-90, 90), (0, 180), (-180, 0), (90, 180)]))
@example(["d > -20", "d < 20"], 0, (-90, 90))
@example(["d > -20", "d < 20"], 1, (-90, 90))
def test_half_a_turn_is_one_of_its_two_names_throughout_a_contract(premises: list[str], n_assumed: int, ends: tuple[int, int]):
    """Python's `eval` knows no circle, so both names of half a turn are tried."""
    schema = {"d": {"type": "angle"}, "p": {"type": "bool"}}
    columns = {"Asset": ["a"], "d": [f"{ends[0]}..{ends[1]}"], "p": ["Any"]}
    table = cdb.Table.from_columns(columns, schema, TableSettings("t", assume=tuple(premises[:n_assumed])))
    proof = prove(Contract("c", table="t", when=" and ".join(premises[n_assumed:]) or None, some="asset == 'a'"), table)
    is_valid = {names: any(ends[0] <= d <= ends[1] for d in names) for names in HEADINGS}
    moments = product(HEADINGS, (False, True))
    as_said = [names for names, p in moments if any(all(eval(part, {"d": d, "p": p}) for part in premises) for d in names)]
    assert (proof.holds, proof.is_vacuous) == (all(is_valid[names] for names in as_said), not as_said)


MOVES = """
[conditions.HasBall]
type = "bool"
[conditions.speed]
type = "number"
min = 0
max = 10
[tables.moves]
outputs = { Tags = { type = "text" }, damage = { type = "int", default = 0 } }
weight = "Weight"
"""
ROWS = """Asset,HasBall,speed,Tags,damage,Weight
carry_walk,True,..4,,1,
carry_run,True,3..,,2,
idle,False,..1,,,
Carry_taunt,Any,2,,9,0
"""


@pytest.fixture
def moves(tmp_path: Path) -> Callable[[str], cdb.Table]:
    """Makes the table with a contract below it."""

    def make(contract: str) -> cdb.Table:
        (tmp_path / "contextdb.toml").write_text(f'{MOVES}[contracts.c]\ntable = "moves"\n{contract}\n')
        (tmp_path / "moves.csv").write_text(ROWS)
        return cdb.Project.load(tmp_path)["moves"]

    return make


@pytest.mark.parametrize(
    ("contract", "holds", "cells"),
    [
        ("when = 'HasBall'\nsome = \"asset like 'carry*'\"", True, None),
        ("some = \"asset like 'carry*'\"", False, {"HasBall": "False"}),
        ("when = 'HasBall and speed != 2'\nevery = \"asset like 'carry*'\"", True, None),
        ("when = 'HasBall'\nevery = \"asset like 'carry*'\"", False, {"HasBall": "True", "speed": "2"}),
        ("when = 'speed > 2'\nnone = 'damage > 2'", True, None),
        ("none = 'damage > 2'", False, {"speed": "2"}),
        ("at_most = 3", True, None),
        ("at_most = 1", False, {"HasBall": "True", "speed": "2"}),
        ("at_most = { n = 1, of = \"asset not like 'C*'\" }", False, {"HasBall": "True", "speed": "3..4"}),
        ("when = 'HasBall'\nwinner = \"asset like 'carry*'\"", True, None),
        ("when = 'speed < 2'\nwinner = 'weight > 0'", False, {"HasBall": "False", "speed": "(1..2)"}),
        ("when = 'speed > 4 and speed < 3'\nnone = 'weight >= 0'", True, None),
    ],
)
def test_a_kind_of_rows_is_told_by_asset_weight_and_outputs(
    contract: str, holds: bool, cells: dict[str, str] | None, moves: Callable[[str], cdb.Table]
):
    table = moves(contract)
    proof = prove(table.schema.contracts["c"], table)
    assert (proof.holds, proof.witness and dict(proof.witness.cells)) == (holds, cells)


def test_a_single_context_breaks_a_contract_that_holds_in_a_share_of_1(moves: Callable[[str], cdb.Table]):
    table = moves("when = 'HasBall'\nnone = 'damage > 2'")
    proof = prove(table.schema.contracts["c"], table)
    assert (proof.holds, proof.lower, proof.upper) == (False, 1.0, 1.0)


def test_a_row_that_rests_lets_the_rows_behind_it_win(tmp_path: Path):
    rows = {"Asset": ["shout", "idle"], "p": ["Any", "Any"], "Priority": ["2", "1"], "Once": ["True", ""]}
    schema = {"p": {"type": "bool"}}
    always = {"policy": "priority", "priority": "Priority"}
    contract = Contract("c", table="t", winner="asset == 'shout'")
    resting = cdb.Table.from_columns(rows, schema, {**always, "once": "Once"}, "t")
    assert prove(contract, resting).holds is False
    plain = {name: texts for name, texts in rows.items() if name != "Once"}
    assert prove(contract, cdb.Table.from_columns(plain, schema, always, "t")).holds is True


def test_what_boxes_cannot_tell_is_drawn_and_what_cannot_be_drawn_is_open():
    speeds = {name: {"type": "number", "min": 0, "max": 10} for name in ("speed", "target")}
    table = cdb.Table.from_columns({"Asset": ["a"], "speed": ["..9"], "target": ["Any"]}, speeds, name="t")
    broken = prove(Contract("c", table="t", when="speed > target", some="asset == 'a'"), table)
    assert broken.holds is False
    assert broken.witness is not None
    assert broken.witness.context["speed"] > max(9, broken.witness.context["target"])
    assert prove(Contract("c", table="t", when="speed + target == 19 and speed > 9", some="asset == 'a'"), table).holds is None
    assert prove(Contract("c", table="t", when="speed > target and speed < 5", some="asset == 'a'"), table).holds is True


def test_what_a_contract_names_and_nobody_has_is_its_problem(moves: Callable[[str], cdb.Table]):
    table = moves("when = 'Down'\nsome = 'damage > 2'")
    proof = prove(table.schema.contracts["c"], table)
    assert (proof.holds, proof.problem.partition(".")[0]) == (None, '"Down", character 1: there is no condition "Down"')
