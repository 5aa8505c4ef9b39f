"""What files cost: load, save, diff and merge of a large table, beside polars' plain read and write, and daff.

    python benchmarks/files.py                 100,000 x 60, 1,000 changed cells; about a minute
    python benchmarks/files.py --quick         10,000 x 60
    python benchmarks/files.py --json FILE     the same figures for programs

Bars: load at most 4 times polars' read, save at most 3 times its write, a diff of 1,000 changed cells under 2 s. daff compares
tables held as Python lists, so its time is without reading; it gets the first tenth of the rows.
"""

from __future__ import annotations

import argparse
import gc
import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)

import numpy as np
import polars as pl

import contextdb as cdb
from benchmarks import generator, timing
from benchmarks.sections import print_aligned
from contextdb.edits.diffing import diff
from contextdb.tables.changes import Cells, Edit
from contextdb.tables.merging.merging import merge
from contextdb.tables.table import Table

FULL = generator.Shape("100,000 x 60", 100_000, 36, 12, 12)
QUICK = generator.Shape("10,000 x 60", 10_000, 36, 12, 12)
N_CHANGED = 1_000
DAFF_SHARE = 10

Work = Callable[[], Any]


def main() -> None:
    """Measure, print the figures and how they stand to the bars, and write them as JSON when that is asked for."""
    parser = argparse.ArgumentParser(description="Measure files, differences and merges.")
    parser.add_argument("--quick", action="store_true", help="10,000 rows")
    parser.add_argument("--repeats", type=int, default=5, metavar="N", help="how often each is measured (default: 5)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    shape = QUICK if options.quick else FULL
    print(timing.machine(), timing.versions(), sep="\n")
    with tempfile.TemporaryDirectory() as folder:
        found = measured(shape, Path(folder), options.repeats)
    _print(shape, found)
    if options.json:
        rows = {
            name: {"median_s": s.median_us / 1e6, "low_s": s.low_us / 1e6, "high_s": s.high_us / 1e6} for name, s in found.items()
        }
        document = {"format": 1, "machine": timing.machine(), "versions": timing.versions(), "size": shape.name, "files": rows}
        options.json.write_text(json.dumps(document, indent=1))


def measured(shape: generator.Shape, folder: Path, repeats: int) -> dict[str, timing.Summary]:
    """What each piece of work takes; the pieces take turns, so that the machine's load falls on all alike."""
    works = _works(shape, folder)
    rounds: dict[str, list[timing.Nanoseconds]] = {name: [] for name in works}
    for _ in range(repeats):
        for name, work in works.items():
            gc.collect()
            rounds[name].append(timing.timed(_call, (work,)))
    return {name: timing.Summary.of(found) for name, found in rounds.items()}


def _call(work: Work) -> Any:
    return work()


def _works(shape: generator.Shape, folder: Path) -> dict[str, Work]:
    cells = generator.make_table(shape, seed=1).cells()
    file, other = folder / "table.csv", folder / "other.csv"
    frame = pl.DataFrame(cells)
    frame.write_csv(file)
    base = cdb.load(file)
    ours, theirs = _changed(base, 1), _changed(base, 2)
    ours.save(other)
    read, reread = cdb.load(file), cdb.load(other)
    works: dict[str, Work] = {
        "polars read": lambda: pl.read_csv(file, infer_schema=False),
        "load": lambda: cdb.load(file),
        "load and compile": lambda: cdb.load(file).compile(),
        "polars write": lambda: frame.write_csv(folder / "written.csv"),
        "save": lambda: ours.save(folder / "saved.csv"),
        "diff, shared columns": lambda: diff(base, ours).n_changed,
        "diff, two files": lambda: diff(read, reread).n_changed,
        "merge": lambda: merge(base, ours, theirs).table,
    }
    return works | _daff_works(cells, ours, shape.n_rows // DAFF_SHARE)


def _changed(table: Table, seed: int) -> Table:
    """The table with some cells of random rows and columns set to Any or, where they say that, to something else."""
    rng = np.random.default_rng(seed)
    columns = {c.name: c.to_list() for c in table.columns}
    names = [c.name for c in table.columns if c.name.startswith("is_state")]
    for row in rng.choice(table.n_rows, N_CHANGED, replace=False).tolist():
        name = names[int(rng.integers(len(names)))]
        columns[name][row] = "True" if columns[name][row] != "True" else "False"
    edits = {
        name: {r: t for r, t in enumerate(texts) if t != table.text(r, name)} for name, texts in columns.items() if name in names
    }
    return Edit("Change", (Cells({name: cells for name, cells in edits.items() if cells}),)).apply(table)


def _daff_works(cells: dict[str, list[str]], after: Table, n_rows: int) -> dict[str, Work]:
    try:
        import daff
    except ImportError:
        return {}
    old = [list(cells), *map(list, zip(*(texts[:n_rows] for texts in cells.values()), strict=True))]
    new = [list(cells), *map(list, zip(*(c.to_list()[:n_rows] for c in after.columns), strict=True))]

    def compare() -> None:
        one, other = daff.PythonTableView(old), daff.PythonTableView(new)
        aligned = daff.Coopy.compareTables(one, other).align()
        daff.TableDiff(aligned, daff.CompareFlags()).hilite(daff.PythonTableView([]))

    return {f"daff, {n_rows:,} rows": compare}


def _print(shape: generator.Shape, found: dict[str, timing.Summary]) -> None:
    print(f"\n{shape.name}, {N_CHANGED:,} changed cells: seconds, the median with the lowest and the highest")
    rows = [
        (name, f"{s.median_us / 1e6:.3f}", f"{s.low_us / 1e6:.3f} to {s.high_us / 1e6:.3f}", f"n = {s.n}")
        for name, s in found.items()
    ]
    print_aligned(rows)
    load, save = (found[a].median_us / found[b].median_us for a, b in (("load", "polars read"), ("save", "polars write")))
    slowest = max(found[name].median_us for name in found if name.startswith("diff")) / 1e6
    for text, value, bar in (
        ("load / polars read", load, 4.0),
        ("save / polars write", save, 3.0),
        ("diff, seconds", slowest, 2.0),
    ):
        print(f"{text}: {value:.2f}, bar {bar:g}: {'held' if value <= bar else 'missed'}")


if __name__ == "__main__":
    main()
