"""Telemetry: how fast recorded moments are held against a table, in how much memory, and what polars' and DuckDB's joins need.

    python benchmarks/telemetry.py                          1,000 rows x 30 conditions, 5 million moments of each kind
    python benchmarks/telemetry.py --rows 50000000 --peer-rows 0          without yardsticks: grouping them takes 14 GB
    python benchmarks/telemetry.py --table 5000x40 --peer-rows 50000

Two recordings: "skewed", where the game comes back to the same 50,000 contexts, and "distinct", where numbers hardly ever repeat.
Each is observed in a process of its own, whose peak of memory is told; "warm" is one that has observed the first file before, so
that loading kernels and compiling the table are not timed. CPU is over all cores: where those are busy with other things it says
more than the time does. The yardsticks are what polars takes to group the same columns, and to read them alone; and joins that
answer the same question, on fewer moments, since they take so long. DuckDB is left out where it is not installed. All that answer
the question must agree.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)

from benchmarks.coverage_tables import made_table
from benchmarks.telemetry_peers import with_duckdb, with_polars
from contextdb.tables.table import Table

FILE_ROWS = 1_000_000
N_COMMON = 50_000
Found = dict[str, Any]


def main() -> None:
    """Make the recordings, observe them, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=5_000_000, help="moments of each recording")
    parser.add_argument("--peer-rows", type=int, default=100_000, help="moments that are joined; 0: no yardsticks")
    parser.add_argument("--table", default="1000x30", help="rows x conditions")
    parser.add_argument("--folder", help="where recordings are made for the time of the run (default: the system's)")
    arguments = parser.parse_args()
    n_rows, n_conditions = map(int, arguments.table.split("x"))
    table = made_table("tree", n_rows, n_conditions)
    versions = f"Python {sys.version.split()[0]}, polars {pl.__version__}, numpy {np.__version__}"
    print(f"{platform.machine()}, {os.cpu_count()} cores, {versions}; table {table.name}\n")
    head = ("moments", "recording", "what", "moments/s", "time s", "CPU s", "peak MB", "covered", "distinct")
    print("{:>11} {:9} {:11} {:>11} {:>8} {:>8} {:>8} {:>9} {:>11}".format(*head))
    for kind in ("skewed", "distinct"):
        with tempfile.TemporaryDirectory(dir=arguments.folder) as folder:
            record(table, kind, arguments.rows, Path(folder))
            for what in ("observe", "warm", "group_by", "read") if arguments.peer_rows else ("observe", "warm"):
                _print_line(kind, what, arguments.rows, _alone(what, table, f"{folder}/*.parquet"))
    if arguments.peer_rows:
        _compare(table, arguments.peer_rows, arguments.folder)


def _compare(table: Table, n_rows: int, parent: str | None) -> None:
    """The joins, and this on the same moments."""
    for kind in ("skewed", "distinct"):
        with tempfile.TemporaryDirectory(dir=parent) as folder:
            record(table, kind, n_rows, Path(folder))
            answers = set()
            for what in ("warm", "polars join", "duckdb join"):
                found = _alone(what, table, f"{folder}/0*.parquet")
                if "missing" in found:
                    print(f"{n_rows:11,} {kind:9} {what:11} {found['missing']} is not installed")
                    continue
                answers.add((found["hits"], found["uncovered"]))
                _print_line(kind, what, n_rows, found)
            if len(answers) != 1:
                raise SystemExit(f"They do not agree: {sorted(answers)}")


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


def _alone(what: str, table: Table, files: str) -> Found:
    """Run in a fresh process, so that its peak of memory is its own."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_timed, (what, table, files))


def _timed(what: str, table: Table, files: str) -> Found:
    if what == "warm":
        _observe(table, str(sorted(Path(files).parent.glob(Path(files).name))[0]))
    started, cpu = time.perf_counter(), time.process_time()
    try:
        found = _WORK[what](table, files)
    except ImportError as error:
        return {"missing": error.name}
    return found | {"time_s": time.perf_counter() - started, "cpu_s": time.process_time() - cpu, "peak": _peak_mb()}


def _peak_mb() -> float:
    """The highest memory of this process; Linux counts the parent's in getrusage."""
    status = Path("/proc/self/status")
    if status.exists():
        return next(float(line.split()[1]) / 1024 for line in status.read_text().splitlines() if line.startswith("VmHWM"))
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 if sys.platform != "darwin" else 1 << 20)


def _observe(table: Table, files: str) -> Found:
    from contextdb.telemetry import observe

    seen = observe(table, files)
    told = {"distinct": seen.distinct, "covered": seen.covered}
    return told | {"hits": sum(seen.hits), "uncovered": seen.uncovered}


def _group_by(table: Table, files: str) -> Found:
    names = [c.condition.name for c in table.conditions]
    return {"distinct": pl.scan_parquet(files).group_by(names).len().select(pl.len()).collect(engine="streaming").item()}


def _read(table: Table, files: str) -> Found:
    names = [c.condition.name for c in table.conditions]
    for path in sorted(Path(files).parent.glob(Path(files).name)):
        for batch in pl.scan_parquet(path).select(names).collect_batches(chunk_size=1 << 16):
            batch.n_chunks()
    return {}


def _polars(table: Table, files: str) -> Found:
    hits, uncovered = with_polars(table, files)
    return {"hits": hits, "uncovered": uncovered}


def _duckdb(table: Table, files: str) -> Found:
    hits, uncovered = with_duckdb(table, files, str(Path(files).parent))
    return {"hits": hits, "uncovered": uncovered}


_WORK: dict[str, Callable[[Table, str], Found]] = {
    "observe": _observe,
    "warm": _observe,
    "group_by": _group_by,
    "read": _read,
    "polars join": _polars,
    "duckdb join": _duckdb,
}


def _print_line(kind: str, what: str, rows: int, found: Found) -> None:
    covered = f"{found['covered']:.4%}" if "covered" in found else ""
    distinct = f"{found['distinct']:,}" if "distinct" in found else ""
    speed = f"{rows / found['time_s']:,.0f}"
    times = f"{found['time_s']:8.2f} {found['cpu_s']:8.2f} {found['peak']:8.0f}"
    print(f"{rows:11,} {kind:9} {what:11} {speed:>11} {times} {covered:>9} {distinct:>11}", flush=True)


if __name__ == "__main__":
    main()
