"""How long coverage takes, by which method, and how near its bounds are, on made tables in three shapes and five sizes.

    python benchmarks/coverage.py                 all sizes
    python benchmarks/coverage.py --quick         the two small sizes
    python benchmarks/coverage.py --json FILE     the same figures for programs

Every part of a report is timed by itself: the count within its budget, 200,000 samples, gaps, findings. Beside it, where the
package `dd` is installed, the decision diagram of the same rows; then all overlaps and gaps of tables of published sizes.
Memory is the highest of the process so far, so sizes go upwards. A first small report is not timed.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not the folder of this file: numba would take it for the package coverage

import contextdb as cdb
from benchmarks import timing
from benchmarks.coverage_peers import PUBLISHED, diagram_of, diagrams, published_figures
from benchmarks.coverage_tables import SHAPES, SIZES, made_table
from benchmarks.sections import print_aligned
from contextdb.compiled.table import data_of
from contextdb.covering import coverage
from contextdb.covering.count import uncovered_share
from contextdb.covering.engine import WORK, finding_steps, search_steps
from contextdb.covering.gaps import find_gaps
from contextdb.covering.judge import Judge
from contextdb.covering.report import wilson
from contextdb.covering.sample import Sampler
from contextdb.covering.space import Space

SAMPLES = 200_000
HEADER = (
    "table",
    "space",
    "count",
    "covered",
    "width",
    "samples",
    "99 % width",
    "gaps",
    "found",
    "findings",
    "rows told",
    "memory",
    "diagram",
)
PUBLISHED_HEADER = ("published size", "overlaps", "time", "covered", "time", "gaps", "time")


def main() -> None:
    """Measure all sizes, print them, and write them as JSON when that is asked for."""
    parser = argparse.ArgumentParser(description="Measure context coverage.")
    parser.add_argument("--quick", action="store_true", help="the two small sizes")
    parser.add_argument("--size", type=int, metavar="ROWS", help="one size only")
    parser.add_argument("--work", type=int, default=WORK, help="steps of the count")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    sizes = [s for s in (SIZES[:2] if options.quick else SIZES) if options.size in (None, s[0])]
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    print("\n".join(f"{name}: {facts}" for name, facts in report.items() if name != "format"))
    coverage(made_table("few", 100, 12), work=100_000, samples=5000)
    report["tables"] = []
    peer = diagrams()
    print(f"diagrams: {peer[0]}" if peer else "diagrams: skipped, the package dd is not installed")
    lines: list[tuple[str, ...]] = [HEADER]
    for n_rows, n_conditions in sizes:
        for shape in SHAPES:
            figures = measured(made_table(shape, n_rows, n_conditions), options.work, peer and peer[1])
            report["tables"].append(figures)
            lines.append(_line(figures))
            print_aligned([lines[0], lines[-1]])
    print_aligned(lines)
    if not options.quick and options.size is None:
        report["published"] = [published_figures(*size) for size in PUBLISHED]
        print_aligned([PUBLISHED_HEADER, *map(_published_line, report["published"])])
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n")


def measured(table: cdb.Table, work: int, peer: Any) -> dict[str, Any]:
    """Each part of one table's coverage, with its time."""
    compiled = data_of(table.compile())
    space, space_s = _timed(lambda: Space.of(compiled))
    left, count_s = _timed(lambda: uncovered_share(space, space.boxes, work))
    sampler = Sampler(space)
    counts, samples_s = _timed(lambda: sampler.sampled(SAMPLES, np.random.default_rng(0)))
    low, high = wilson(SAMPLES - round(float(counts.histogram[0])), SAMPLES)
    steps = search_steps(WORK, len(space.boxes))
    found, gaps_s = _timed(lambda: find_gaps(space, counts.uncovered, 801, steps))
    judge = Judge(space, compiled, table, finding_steps(WORK, len(space.boxes)))
    findings, findings_s = _timed(judge.findings)
    return {
        "table": table.name,
        "space_s": space_s,
        "count_s": count_s,
        "method": "exact" if left.is_exact else "bounds",
        "lower": 1.0 - left.upper,
        "upper": 1.0 - left.lower,
        "work": left.work,
        "samples_s": samples_s,
        "estimate": [low, high],
        "gaps_s": gaps_s,
        "gaps": len(found.boxes),
        "gaps_complete": found.is_complete,
        "findings_s": findings_s,
        "findings": len(findings),
        "findings_complete": judge.is_complete,
        "diagram": diagram_of(space, peer) if peer else "-",
        "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
    }


def _timed(work: Callable[[], Any]) -> tuple[Any, float]:
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start


def _line(figures: dict[str, Any]) -> tuple[str, ...]:
    width = figures["upper"] - figures["lower"]
    return (
        figures["table"],
        f"{figures['space_s']:.3f} s",
        f"{figures['count_s']:.3f} s",
        f"{figures['lower']:.6f}" if not width else "bounds",
        f"{width:.2g}" if width else "exact",
        f"{figures['samples_s']:.3f} s",
        f"{figures['estimate'][1] - figures['estimate'][0]:.2g}",
        f"{figures['gaps_s']:.3f} s",
        f"{figures['gaps']}{'' if figures['gaps_complete'] else '+'}",
        f"{figures['findings_s']:.3f} s",
        f"{figures['findings']}{'' if figures['findings_complete'] else '+'}",
        f"{figures['memory_mb']} MB",
        figures["diagram"],
    )


def _published_line(figures: dict[str, Any]) -> tuple[str, ...]:
    return (
        figures["table"],
        f"{figures['overlaps']:,}",
        f"{figures['overlaps_s']:.3f} s",
        f"{figures['covered']:.6f}{'' if figures['is_exact'] else '+'}",
        f"{figures['count_s']:.3f} s",
        f"{figures['gaps']:,}{'' if figures['gaps_complete'] else '+'}",
        f"{figures['gaps_s']:.3f} s",
    )


if __name__ == "__main__":
    main()
