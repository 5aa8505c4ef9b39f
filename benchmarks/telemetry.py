"""Telemetry: how fast recorded moments are held against a table, and how much memory that takes.

    python -m benchmarks.telemetry [--rows 5000000] [--table 1000x30]

Two recordings of as many rows as --rows, in files of a million: "skewed", where the game comes back to the same contexts, and
"distinct", where numbers hardly ever repeat. Each is observed in a process of its own, twice: the first run compiles what is not
compiled yet. The yardstick is what polars takes to group the same columns as they are, in the same run.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from benchmarks.coverage_tables import made_table
from contextdb.table import Table

FILE_ROWS = 1_000_000
N_COMMON = 50_000


def main() -> None:
    """Make the recordings, observe them, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=5_000_000)
    parser.add_argument("--table", default="1000x30")
    arguments = parser.parse_args()
    n_rows, n_conditions = map(int, arguments.table.split("x"))
    table = made_table("tree", n_rows, n_conditions)
    print(f"Python {sys.version.split()[0]}, polars {pl.__version__}, {table.name}, {arguments.rows:,} rows\n")
    print(f"{'recording':10} {'what':10} {'rows/s':>12} {'time s':>8} {'peak MB':>8} {'covered':>9} {'distinct':>10}")
    for kind in ("skewed", "distinct"):
        with tempfile.TemporaryDirectory() as folder:
            record(table, kind, arguments.rows, Path(folder))
            for what in ("warm-up", "observe", "group_by"):
                _print_line(kind, what, arguments.rows, _alone(what, table, f"{folder}/*.parquet"))


def record(table: Table, kind: str, n_rows: int, folder: Path) -> None:
    """Write moments to files of a million rows; the same for the same arguments."""
    for start in range(0, n_rows, FILE_ROWS):
        rng = np.random.default_rng([1, start])
        n = min(FILE_ROWS, n_rows - start)
        pick = np.minimum(rng.zipf(1.3, n), N_COMMON) - 1 if kind == "skewed" else None
        columns = {c.condition.name: _facts(c.condition.domain, at, n, pick, rng) for at, c in enumerate(table.conditions)}
        pl.DataFrame(columns).write_parquet(folder / f"{start:012}.parquet", row_group_size=1 << 17)


def _facts(domain: Any, at: int, n: int, pick: Any, rng: np.random.Generator) -> pl.Series:
    own = rng if pick is None else np.random.default_rng(at)
    size = n if pick is None else N_COMMON
    if domain.kind == "number":
        facts = pl.Series(own.uniform(domain.minimum, domain.maximum, size), dtype=pl.Float32)
    elif domain.kind == "bool":
        facts = pl.Series(own.random(size) < 0.3)
    else:
        facts = pl.Series(domain.values).gather(own.integers(0, len(domain.values), size))
    return facts if pick is None else facts.gather(pick)


def _alone(what: str, table: Table, files: str) -> dict[str, Any]:
    """Run in a fresh process, so that its peak of memory is its own."""
    context = multiprocessing.get_context("spawn")
    with context.Pool(1) as pool:
        return pool.apply(_timed, (what, table, files))


def _timed(what: str, table: Table, files: str) -> dict[str, Any]:
    import resource

    from contextdb.telemetry import observe

    started = time.perf_counter()
    if what == "group_by":
        names = [c.condition.name for c in table.conditions]
        n = pl.scan_parquet(files).group_by(names).len().select(pl.len()).collect(engine="streaming").item()
        found: dict[str, Any] = {"distinct": n, "covered": float("nan")}
    else:
        seen = observe(table, files)
        found = {"distinct": seen.distinct, "covered": seen.covered}
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return found | {"time_s": time.perf_counter() - started, "peak": peak}


def _print_line(kind: str, what: str, rows: int, found: dict[str, Any]) -> None:
    speed, peak = rows / found["time_s"], found["peak"]
    print(
        f"{kind:10} {what:10} {speed:12,.0f} {found['time_s']:8.2f} {peak:8.0f} {found['covered']:9.4%} {found['distinct']:10,}",
        flush=True,
    )


if __name__ == "__main__":
    main()
