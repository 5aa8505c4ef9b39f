"""Casting two football teams for the rows of a table, beside a plain loop over rows and actors.

    python benchmarks/casting.py                 two football teams
    python benchmarks/casting.py --quick         fewer repeats
    python benchmarks/casting.py --json FILE     the same figures for programs

22 actors are offered for each of 3 roles of 1,000 rows; the loop reads the cells once, then tries actors role by role. The valid
rows of both are compared before anything is timed.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

import contextdb as cdb
from benchmarks import timing
from benchmarks.sections import print_aligned
from contextdb.cells.sets import Cell
from contextdb.compiled.table import CompiledTable

N_ROWS, N_ACTORS = 1_000, 22
ROLES = ("Defender", "Receiver", "Thrower")
POSITIONS = ["CB", "FS", "SS", "LB", "WR", "QB"]
FACTS: dict[str, dict[str, object]] = {
    "position": {"type": "enum", "values": POSITIONS},
    "speed": {"type": "number"},
    "is_airborne": {"type": "bool"},
}
SCHEMA = {f"{role}.{fact}": about for role in ROLES for fact, about in FACTS.items()}
Actor = dict[str, object]


def made_table(rng: random.Random) -> cdb.Table:
    """Rows that take about one actor in six for each role."""
    columns: dict[str, list[str]] = {"Asset Name": [f"play_{r}" for r in range(N_ROWS)]}
    for role in ROLES:
        columns[f"{role}.position"] = [" ".join(rng.sample(POSITIONS, rng.randint(1, 3))) for _ in range(N_ROWS)]
        columns[f"{role}.speed"] = [f"{rng.uniform(0, 8):.1f} ± 2" for _ in range(N_ROWS)]
        columns[f"{role}.is_airborne"] = [rng.choice(["Any", "True", "False"]) for _ in range(N_ROWS)]
    return cdb.Table.from_columns(columns, SCHEMA)


def made_actors(rng: random.Random) -> list[Actor]:
    """Two teams."""
    return [
        {
            "id": i,
            "position": rng.choice(POSITIONS),
            "speed": rng.uniform(0, 8),
            "is_airborne": rng.random() < 0.5,
            "distance": rng.uniform(0, 40),
        }
        for i in range(N_ACTORS)
    ]


def rows_by_loop(cells: list[list[list[tuple[str, Cell]]]], actors: list[Actor]) -> list[int]:
    """The rows that can be cast, by trying actors."""
    return [row for row, roles in enumerate(cells) if _can_cast(roles, actors, frozenset())]


def _can_cast(roles: list[list[tuple[str, Cell]]], actors: list[Actor], taken: frozenset[object]) -> bool:
    if not roles:
        return True
    return any(
        _can_cast(roles[1:], actors, taken | {actor["id"]})
        for actor in actors
        if actor["id"] not in taken and all(cell.holds(actor[fact]) for fact, cell in roles[0])
    )


def measured(repeats: int) -> dict[str, timing.Summary]:
    """What each way takes; they take turns."""
    rng = random.Random(0)
    table, actors = made_table(rng), made_actors(rng)
    compiled: CompiledTable = table.compile()
    offered = dict.fromkeys(ROLES, actors)
    cells = [[[(fact, table.condition(f"{r}.{fact}").cell(row)) for fact in FACTS] for r in ROLES] for row in range(N_ROWS)]
    valid = compiled.query({}, actors=offered, prefer="distance")
    if valid.indices.tolist() != rows_by_loop(cells, actors):
        raise AssertionError("the loop finds other rows")

    def with_castings() -> object:
        matches = compiled.query({}, actors=offered, prefer="distance")
        return [matches.casting(row) for row in matches.rows.tolist()]

    ways: dict[str, Callable[[], object]] = {
        "query with actors": lambda: compiled.query({}, actors=offered, prefer="distance").bits,
        f"the same, and the best casting of {len(valid)} valid rows": with_castings,
        "a plain loop, valid rows alone": lambda: rows_by_loop(cells, actors),
    }
    rounds: dict[str, list[timing.Nanoseconds]] = {name: [] for name in ways}
    with timing.no_collection():
        for _ in range(repeats):
            for name, ask in ways.items():
                rounds[name].append(timing.timed(lambda way: way(), [ask]))
    return {name: timing.Summary.of(times) for name, times in rounds.items()}


def main() -> None:
    """Measure every way, print the figures, and write them as JSON when that is asked for."""
    parser = argparse.ArgumentParser(description="Measure casting.")
    parser.add_argument("--quick", action="store_true", help="fewer repeats")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    print(" · ".join(f"{key} {value}" for key, value in (report["machine"] | report["versions"]).items()))
    figures = measured(5 if options.quick else 30)
    print(f"\ntwo football teams: {N_ACTORS} actors, {len(ROLES)} roles, {N_ROWS:,} rows; milliseconds, median (lowest … highest)")
    print_aligned(
        [(n, f"{s.median_us / 1e3:,.2f}", f"({s.low_us / 1e3:,.2f} … {s.high_us / 1e3:,.2f})") for n, s in figures.items()]
    )
    report["casting"] = {name: vars(summary) for name, summary in figures.items()}
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
