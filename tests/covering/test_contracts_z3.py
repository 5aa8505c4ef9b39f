"""Contracts against a second prover: z3 finds a context that breaks one exactly where ours says so, and each counterexample of ours
breaks it for z3 too. `PYTHONPATH=tests python tests/covering/test_contracts_z3.py 10000` compares 10,000."""

from __future__ import annotations

import random
import sys
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import contextdb as cdb
from contextdb.covering.contracts import prove
from contextdb.schema.contracts import VERBS, Contract

z3 = pytest.importorskip("z3")

SCHEMA: dict[str, dict[str, object]] = {
    "p": {"type": "bool"},
    "Actor.q": {"type": "bool"},
    "n": {"type": "int", "min": 0, "max": 6},
    "x": {"type": "number", "min": 0, "max": 10},
    "y": {"type": "number", "min": 0, "max": 10},
    "a": {"type": "angle"},
    "e": {"type": "enum", "values": ["A", "B", "C"]},
    "t": {"type": "tags", "values": ["Hot", "Wet", "Odd"]},
    "d": {"type": "date", "min": "2026-01-01", "max": "2026-01-07"},
    "w": {"type": "text"},
    "fast": {"type": "bool", "expr": "x > 4 or (p and n >= 3)"},
}
Said = tuple[str, Any]
"""A text, and the same as a formula."""


@dataclass
class World:
    """The facts of a context as z3 has them."""

    facts: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        make = {"bool": z3.Bool, "number": z3.Real, "angle": z3.Real} | dict.fromkeys(("int", "enum", "date", "text"), z3.Int)
        self.facts = {name: make[str(s["type"])](name) for name, s in SCHEMA.items() if s["type"] in make and "expr" not in s}
        self.facts |= {f"t.{tag}": z3.Bool(f"t.{tag}") for tag in SCHEMA["t"]["values"]}  # type: ignore[attr-defined]
        f = self.facts
        f["fast"] = z3.Or(f["x"] > 4, z3.And(f["p"], f["n"] >= 3))

    @property
    def domain(self) -> Any:
        f = self.facts
        bounds = [z3.And(f[name] >= 0, f[name] <= SCHEMA[name]["max"]) for name in ("n", "x", "y")]
        return z3.And(*bounds, f["a"] >= -180, f["a"] < 180, f["e"] >= 0, f["e"] < 3, f["d"] >= 1, f["d"] <= 7)

    def at(self, context: Mapping[str, Any]) -> Any:
        """The facts of one context, as a formula; a text that no cell has is another number than those that cells have."""
        parts = []
        for name, value in context.items():
            kind = SCHEMA[name]["type"]
            if kind == "tags":
                parts += [self.facts[f"t.{tag}"] == (tag in value) for tag in SCHEMA["t"]["values"]]  # type: ignore[attr-defined]
            else:
                number = "ABC".find(str(value)) if kind in ("enum", "text") else int(str(value)[-2:]) if kind == "date" else value
                parts.append(self.facts[name] == number)
        return z3.And(True, *parts)

    def cell(self, name: str, rng: random.Random) -> Said:
        fact, kind = self.facts.get(name), SCHEMA[name]["type"]
        if rng.random() < 0.4:
            return "Any", z3.BoolVal(True)
        if kind == "bool":
            value = rng.random() < 0.5
            return str(value), fact == value
        if kind in ("enum", "text"):
            values = rng.sample(range(3), rng.randint(1, 2))
            text, formula = " ".join("ABC"[v] for v in values), z3.Or(*(fact == v for v in values))
            return (f"not {text}", z3.Not(formula)) if rng.random() < 0.3 else (text, formula)
        if kind == "tags":
            tag, sign = rng.choice(["Hot", "Wet", "Odd"]), rng.choice("+-")
            own = self.facts[f"t.{tag}"]
            return f"{sign}{tag}", own if sign == "+" else z3.Not(own)
        ends = (-170, 171) if kind == "angle" else (1, 8) if kind == "date" else (0, 7)
        low, high = sorted((rng.randrange(*ends), rng.randrange(*ends)))
        if kind == "angle" and low < high and rng.random() < 0.3:
            return f"{high}..{low}", z3.Or(fact >= high, fact <= low)
        if low < high - 1 and rng.random() < 0.5:
            return f"({self.end(name, low)}..{self.end(name, high)}]", z3.And(fact > low, fact <= high)
        return f"{self.end(name, low)}..{self.end(name, high)}", z3.And(fact >= low, fact <= high)

    @staticmethod
    def end(name: str, value: int) -> str:
        """An end of an interval as a cell has it."""
        return f"2026-01-0{value}" if name == "d" else str(value)

    def truth(self, rng: random.Random, depth: int) -> Said:
        if depth and rng.random() < 0.6:
            (one, a), (other, b) = self.truth(rng, depth - 1), self.truth(rng, depth - 1)
            word = rng.choice(["and", "or"])
            return f"({one} {word} not {other})", (z3.And if word == "and" else z3.Or)(a, z3.Not(b))
        f, number = self.facts, rng.randrange(8)
        return rng.choice(
            [
                ("p", f["p"]),
                ("Actor.q", f["Actor.q"]),
                ("fast", f["fast"]),
                (f"x > {number}", f["x"] > number),
                (f"n != {number}", f["n"] != number),
                (f"a in '{10 * number}..100'", z3.And(f["a"] >= 10 * number, f["a"] <= 100)),
                ("e in ['A', 'C']", f["e"] != 1),
                ("'Wet' in t", f["t.Wet"]),
                (f"d in '2026-01-02..2026-01-0{2 + number % 6}'", z3.And(f["d"] >= 2, f["d"] <= 2 + number % 6)),
                ("w in ['A', 'B']", z3.Or(f["w"] == 0, f["w"] == 1)),
                ("x > y", f["x"] > f["y"]),
                (f"x + y <= {2 * number}", f["x"] + f["y"] <= 2 * number),
            ]
        )


def breaking(contract: Contract, rows: list[Any], is_kind: list[bool], ranks: list[float]) -> Any:
    """The contexts that break a contract, as a formula."""
    of_kind = [row for row, own in zip(rows, is_kind, strict=True) if own]
    others = [row for row, own in zip(rows, is_kind, strict=True) if not own]
    match contract.verb:
        case "some":
            return z3.Not(z3.Or(False, *of_kind))
        case "every":
            return z3.Or(False, *others)
        case "none":
            return z3.Or(False, *of_kind)
        case "at_most":
            return z3.Sum([z3.If(row, 1, 0) for row in of_kind] or [z3.IntVal(0)]) > contract.most
    won = [
        z3.And(row, *(z3.Not(other) for other, above in zip(rows, ranks, strict=True) if above > rank))
        for row, own, rank in zip(rows, is_kind, ranks, strict=True)
        if not own
    ]
    return z3.Or(z3.Not(z3.Or(False, *rows)), *won)


@examples(10)
@given(st.integers(0, 2**32))
def test_a_second_prover_agrees(seed: int):
    compare(seed)


def compare(seed: int) -> bool | None:
    """Draw a contract and a table, and ask both; gives what came out."""
    rng, world = random.Random(seed), World()
    names = rng.sample(list(SCHEMA), rng.randint(1, 5))
    n_rows, policy = rng.randint(1, 7), rng.choice(["collect", "first", "priority", "specific"])
    cells = [{name: world.cell(name, rng) for name in names} for _ in range(n_rows)]
    priorities = [rng.randrange(3) for _ in range(n_rows)]
    columns = {"Asset": [f"{rng.choice('ab')}_{row}" for row in range(n_rows)], "Priority": list(map(str, priorities))}
    columns |= {name: [row[name][0] for row in cells] for name in names}
    assumed = [world.truth(rng, 1) for _ in range(rng.randrange(2))]
    when = world.truth(rng, 2) if rng.random() < 0.8 else ("True", z3.BoolVal(True))
    settings = {"policy": policy, "priority": "Priority", "assume": [text for text, _ in assumed]}
    table = cdb.Table.from_columns(columns, SCHEMA, settings, "t")
    verb, kind = rng.choice(VERBS), "asset like 'a*'"
    demand = {verb: (rng.randrange(3), kind) if verb == "at_most" else kind}
    contract = Contract("c", table="t", when=when[0], **demand)  # type: ignore[arg-type]
    specific = [sum(row[name][0] != "Any" for name in names) for row in cells]
    ranks = {"first": [-row for row in range(n_rows)], "specific": list(zip(priorities, specific, strict=True))}.get(
        policy, priorities
    )
    rows = [z3.And(True, *(formula for _, formula in row.values())) for row in cells]
    solver = z3.Solver()
    solver.add(world.domain, when[1], *(formula for _, formula in assumed))
    solver.add(breaking(contract, rows, [asset.startswith("a") for asset in table.assets], ranks))  # type: ignore[arg-type]
    proof = prove(contract, table, samples=2000)
    assert not proof.problem, proof.problem
    if proof.holds is None:
        assert any(word in text for text, _ in (when, *assumed) for word in ("x > y", "x + y"))
    else:
        assert (solver.check() == z3.unsat) is proof.holds
    if proof.witness is not None:
        assert table.compile().query(dict(proof.witness.context)).assets == list(proof.witness.assets)
        assert solver.check(world.at(proof.witness.context)) == z3.sat
    return proof.holds


if __name__ == "__main__":
    print(Counter(str(compare(seed)) for seed in range(int(sys.argv[1]))))
