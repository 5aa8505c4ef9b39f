"""How long a proof of a contract takes, and how near its bounds are, on made tables in three shapes.

    python benchmarks/contracts.py                     1,000 x 30
    python benchmarks/contracts.py --rows 5000 --conditions 40
    python benchmarks/contracts.py --count 10 --json FILE

Contracts are drawn from a seed: each verb as often, over all contexts or under a `when` of one or two facts, for a kind that is a
family of assets or every second row. Times are those of one core, so that a busy machine changes them little. A first small proof
is not timed.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)

import contextdb as cdb
from benchmarks import timing
from benchmarks.coverage_tables import GRID, SHAPES, made_table
from benchmarks.sections import print_aligned
from contextdb.cells.conditions import Condition
from contextdb.covering.contracts import Proof, prove
from contextdb.schema.contracts import VERBS, Contract, Verb

HEADER = ("table", "contract", "n", "median", "longest", "hold", "broken", "open", "exact", "median width", "widest")


@dataclass(frozen=True)
class Timed:
    """One proof, with its seconds."""

    proof: Proof
    seconds: float

    @property
    def width(self) -> float:
        return self.proof.upper - self.proof.lower


def main() -> None:
    """Prove all, print the figures, and write them as JSON when that is asked for."""
    parser = argparse.ArgumentParser(description="Measure proofs of contracts.")
    parser.add_argument("--rows", type=int, default=1000)
    parser.add_argument("--conditions", type=int, default=30)
    parser.add_argument("--count", type=int, default=30, help="contracts of each verb and shape")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    print(f"machine: {timing.machine()}\nversions: {timing.versions()}")
    prove(Contract("first", table="t", some="asset like '*'"), made_table("few", 50, 8))
    lines, every = list[tuple[str, ...]]([HEADER]), list[Timed]()
    report: dict[str, object] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    for shape in SHAPES:
        table = made_table(shape, options.rows, options.conditions)
        table = replace(table, settings=replace(table.settings, policy="first"))
        table.compile()
        for verb in VERBS:
            rng = np.random.default_rng([SHAPES.index(shape), VERBS.index(verb)])
            proofs = [_timed(_contract(verb, table, rng), table) for _ in range(options.count)]
            every += proofs
            lines.append(_line(table.name, verb, proofs))
            print_aligned([HEADER, lines[-1]])
            report[f"{table.name} {verb}"] = [[p.seconds, p.proof.holds, p.proof.lower, p.proof.upper] for p in proofs]
    print_aligned([*lines, _line("all", "", every)])
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n")


def _contract(verb: Verb, table: cdb.Table, rng: np.random.Generator) -> Contract:
    """A contract of the kind that a designer writes."""
    n_terms = int(rng.integers(0, 3))
    chosen = rng.choice(len(table.conditions), n_terms, replace=False)
    when = " and ".join(_term(table.conditions[i].condition, rng) for i in chosen) or None
    start = int(rng.integers(table.n_rows))
    kind = f"asset like 'Anim_{start // 10:04}*'" if rng.random() < 0.5 else "asset like '*[02468]'"
    demand: Any = {verb: (int(rng.integers(1, 4)), kind) if verb == "at_most" else kind}
    return Contract("c", table=table.name, when=when, **demand)


def _term(condition: Condition, rng: np.random.Generator) -> str:
    name, domain = condition.name, condition.domain
    if domain.kind == "bool":
        return name if rng.random() < 0.5 else f"not {name}"
    if domain.values is not None:
        return f"{name} == '{domain.values[int(rng.integers(len(domain.values)))]}'"
    return f"{name} {rng.choice(['<', '>'])} {int(rng.integers(1, GRID))}"


def _timed(contract: Contract, table: cdb.Table) -> Timed:
    start = time.process_time()
    proof = prove(contract, table)
    assert not proof.problem, proof.problem
    return Timed(proof, time.process_time() - start)


def _line(table: str, verb: str, proofs: list[Timed]) -> tuple[str, ...]:
    seconds = sorted(one.seconds for one in proofs)
    wide = sorted(one.width for one in proofs if one.width)
    counts = [str(sum(one.proof.holds is holds for one in proofs)) for holds in (True, False, None)]
    return (
        table,
        verb,
        str(len(proofs)),
        f"{seconds[len(seconds) // 2]:.3f} s",
        f"{seconds[-1]:.2f} s",
        *counts,
        str(len(proofs) - len(wide)),
        f"{wide[len(wide) // 2]:.2g}" if wide else "-",
        f"{wide[-1]:.2g}" if wide else "-",
    )


if __name__ == "__main__":
    main()
