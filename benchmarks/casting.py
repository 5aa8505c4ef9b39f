"""Casting two football teams for the rows of a table, beside a plain loop over rows and actors.

    python -m benchmarks.casting

22 actors are offered for each of 3 roles of 1,000 rows; the loop reads the cells once, then tries actors role by role.
"""

from __future__ import annotations

import random
import statistics
import time
from collections.abc import Callable

import contextdb as cdb
from contextdb.cells import Cell
from contextdb.compiled import CompiledTable

N_ROWS, N_ACTORS, N_TIMES = 1_000, 22, 30
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


def timed(ask: Callable[[], object], n_times: int = N_TIMES) -> tuple[float, float]:
    """The median and the largest of some times, in milliseconds."""
    times = []
    for _ in range(n_times):
        start = time.perf_counter()
        ask()
        times.append((time.perf_counter() - start) * 1e3)
    return statistics.median(times), max(times)


def main() -> None:
    """Print one line a way."""
    rng = random.Random(0)
    table, actors = made_table(rng), made_actors(rng)
    compiled: CompiledTable = table.compile()
    offered = dict.fromkeys(ROLES, actors)
    cells = [[[(fact, table.condition(f"{r}.{fact}").cell(row)) for fact in FACTS] for r in ROLES] for row in range(N_ROWS)]
    valid = compiled.query({}, actors=offered, prefer="distance")
    assert valid.indices.tolist() == rows_by_loop(cells, actors)

    def with_castings() -> object:
        matches = compiled.query({}, actors=offered, prefer="distance")
        return [matches.casting(row) for row in matches]

    print(f"{N_ROWS:,} rows, {len(ROLES)} roles, {N_ACTORS} actors for each; {len(valid)} rows valid; median and largest")
    for name, ask in (
        ("query with actors", lambda: compiled.query({}, actors=offered, prefer="distance").bits),
        ("query, and the best casting of every valid row", with_castings),
        ("a plain loop, valid rows alone", lambda: rows_by_loop(cells, actors)),
    ):
        median, largest = timed(ask)
        print(f"{name:<50} {median:8.2f} ms  {largest:8.2f} ms")


if __name__ == "__main__":
    main()
