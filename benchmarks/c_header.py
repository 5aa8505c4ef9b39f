"""How fast the C header answers, beside Python's `query` and `live` in the same run.

    python benchmarks/c_header.py                 1,000 x 30 and 10,000 x 40
    python benchmarks/c_header.py --quick         fewer rounds
    python benchmarks/c_header.py --json FILE     the same figures for programs

One context in, row numbers out; the C program asks 2,000 different contexts a round, and its rows are compared with a reading of
every cell before anything is timed. It is compiled with $CC, else cc, and -O2.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

import numpy as np
from numpy.typing import NDArray

from benchmarks import generator, ours, timing
from benchmarks.sections import print_aligned
from contextdb.compiled.c_header import c_header_of
from contextdb.compiled.table import CompiledTable

N_CONTEXTS = 2000
C_ROUNDS = 10
"""So many rounds in C for one in Python: they are short, and what else the machine does falls on few of them."""
SOURCE = Path(__file__).with_suffix(".c")


def built(folder: Path, compiled: CompiledTable, compiler: str) -> Path:
    """The program that times the table."""
    (folder / "game.h").write_text(c_header_of({"game": compiled}), encoding="ascii")
    compiled.save(folder / "game.safetensors")
    program = folder / "c_header.exe"
    subprocess.run([compiler, "-std=c11", "-O2", f"-I{folder}", str(SOURCE), "-o", str(program)], check=True)
    return program


def facts_in_memory(contexts: generator.Contexts) -> NDArray[Any]:
    """The contexts as an array of the header's struct: int for bools and enums, double for numbers."""
    table = contexts.table
    fields = [(n, np.int32) for n in (*table.bool_names, *table.enum_names)] + [(n, np.float64) for n in table.number_names]
    facts = np.zeros(len(contexts), np.dtype(fields, align=True))
    for names, values in (
        (table.bool_names, contexts.bools),
        (table.enum_names, contexts.enums),
        (table.number_names, contexts.numbers),
    ):
        for i, name in enumerate(names):
            facts[name] = values[:, i]
    return facts


def asked(program: Path, contexts: generator.Contexts, answers: Sequence[Sequence[int]], rounds: int) -> tuple[float, NDArray[Any]]:
    """Nanoseconds of opening, and of a query in each round: alone, and with its rows met; float64 [rounds, 2]."""
    folder = program.parent
    facts_in_memory(contexts).tofile(folder / "facts")
    arguments = [str(program), *(str(folder / n) for n in ("game.safetensors", "facts", "rows")), str(rounds)]
    lines = subprocess.run(arguments, check=True, capture_output=True, text=True).stdout.splitlines()
    found = np.fromfile(folder / "rows", np.int64).reshape(-1, 2).tolist()
    if found != [[i, row] for i, rows in enumerate(answers) for row in rows]:
        raise AssertionError("the C program answers otherwise than a reading of every cell")
    return float(lines[0]), np.array([line.split() for line in lines[1:]], np.float64)


def measured(shape: generator.Shape, effort: timing.Effort, compiler: str) -> dict[str, timing.Summary]:
    """The figures of one size; half of the C rounds before Python's, half behind."""
    table = generator.make_table(shape)
    contexts = generator.make_contexts(table, N_CONTEXTS)
    dicts, answers = contexts.dicts(), contexts.answers()
    compiled = ours.build(table).compile()
    with tempfile.TemporaryDirectory() as folder:
        program = built(Path(folder), compiled, compiler)
        before = asked(program, contexts, answers, C_ROUNDS * effort.rounds)
        times = timing.measure(ours.engines(compiled, contexts, dicts, answers), effort)
        after = asked(program, contexts, answers, C_ROUNDS * effort.rounds)
        opened = [_opened(Path(folder) / "game.safetensors") for _ in range(effort.repeats)]
    rounds = np.concatenate([before[1], after[1]])
    found = {
        name: timing.Summary.of([r[None] for r in rounds[:, i]]) for i, name in enumerate(("C query", "C query, its rows met"))
    }
    found |= {name: timing.Summary.of(t.hot) for name, t in times.items()}
    found["C open"] = timing.Summary.of([np.array([ns]) for ns in (before[0], after[0])])
    return found | {"contextdb open": timing.Summary.of([np.array([ns]) for ns in opened])}


def _opened(path: Path) -> int:
    start = time.perf_counter_ns()
    CompiledTable.open(path)
    return time.perf_counter_ns() - start


def main() -> None:
    """Measure every size, print the figures, and write them as JSON when that is asked for."""
    parser = argparse.ArgumentParser(description="Measure the C header beside Python.")
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        print("no C compiler was found; $CC names one")
        return
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    said = subprocess.run([compiler, "--version"], capture_output=True, text=True).stdout.splitlines()
    report["compiler"] = said[0] if said else compiler
    print(" · ".join(f"{key} {value}" for key, value in (report["machine"] | report["versions"]).items()))
    print(report["compiler"], "-O2")
    for shape in generator.SHAPES:
        figures = measured(shape, timing.QUICK if options.quick else timing.FULL, compiler)
        print(f"\nOne query, {shape.name}: nanoseconds, median (lowest … highest of a round)")
        query_us = figures[ours.QUERY].median_us
        print_aligned([_line(name, s, query_us) for name, s in figures.items()])
        report[shape.name] = {name: vars(summary) for name, summary in figures.items()}
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def _line(name: str, summary: timing.Summary, query_us: float) -> tuple[str, str, str, str]:
    times = "" if name.endswith("open") else f"{query_us / summary.median_us:.1f} times query"
    return name, f"{summary.median_us * 1e3:,.0f}", f"({summary.low_us * 1e3:,.0f} … {summary.high_us * 1e3:,.0f})", times


if __name__ == "__main__":
    main()
