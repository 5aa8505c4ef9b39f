"""The parts of the benchmark: each measures, prints an aligned text, and gives the same figures for JSON."""

from __future__ import annotations

import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

import contextdb as cdb
from benchmarks import batch as batches
from benchmarks import ours, peers, yardsticks
from benchmarks.generator import SHAPES, GameTable, Shape, make_contexts, make_table
from benchmarks.timing import Effort, Engine, Summary, measure, one_core, seconds

ROOT = Path(__file__).parent.parent
N_CONTEXTS = 2000
ZEN = "zen-engine, one core"

PEERS: dict[str, Callable[[GameTable], Callable[[dict[str, Any]], Any]]] = {
    "Python loop, every cell": peers.python_loop,
    "Python loop, without Any": lambda table: peers.python_loop(table, with_any=False),
    "numpy over rows": peers.numpy_rows,
    "polars filter": peers.polars_filter,
    "DuckDB prepared": peers.duckdb_prepared,
    "sqlite3 prepared": peers.sqlite_prepared,
    ZEN: peers.zen_table,
    "pyroaring": lambda table: yardsticks.roaring(yardsticks.BitVectors.of(table)),
    "masks, numpy": lambda table: yardsticks.numpy_masks(yardsticks.BitVectors.of(table)),
    "masks, big ints + dicts (h)": lambda table: yardsticks.big_ints(yardsticks.BitVectors.of(table)),
    "masks, generated code (h4)": lambda table: yardsticks.generated_code(yardsticks.BitVectors.of(table)),
}


def single(effort: Effort, quick: bool) -> dict[str, Any]:
    """One context as a dict in, row numbers out."""
    return {shape.name: _single(shape, effort) for shape in SHAPES}


def _single(shape: Shape, effort: Effort) -> dict[str, Any]:
    table = make_table(shape)
    contexts = make_contexts(table, N_CONTEXTS)
    dicts, answers = contexts.dicts(), contexts.answers()
    start = time.perf_counter()
    compiled = ours.build(table).compile()
    compiled.query(dicts[0])
    built = {ours.QUERY: time.perf_counter() - start}
    engines = [Engine("an empty call", lambda context: None, dicts), *ours.engines(compiled, contexts, dicts, answers)]
    for name, build in PEERS.items():
        start = time.perf_counter()
        try:
            with one_core(name == ZEN):
                engines.append(Engine(name, build(table), dicts, answers, on_one_core=name == ZEN))
        except ImportError as error:
            print(f"{name}: left out, {error.name} is not installed")
        built[name] = time.perf_counter() - start
    times = measure(engines, effort)
    rows_mean = np.mean([len(a) for a in answers])
    print(f"\nOne query, {shape.name}: a dict in, row numbers out ({rows_mean:.1f} valid rows on average); microseconds")
    return _print_single({n: (Summary.of(t.hot), Summary.of(t.cold)) for n, t in times.items()}, built)


def _print_single(summaries: dict[str, tuple[Summary, Summary]], built: dict[str, float]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    hot_ours, cold_ours = summaries[ours.QUERY]
    lines = [("", "hot", "rounds", "n", "/ours", "cold", "rounds", "n", "/ours", "build ms")]
    for name, (hot, cold) in summaries.items():
        ratios = hot.median_us / hot_ours.median_us, cold.median_us / cold_ours.median_us
        build_ms = f"{built[name] * 1e3:.0f}" if name in built else ""
        lines.append((name, *_cells(hot), f"{ratios[0]:.2f}", *_cells(cold), f"{ratios[1]:.2f}", build_ms))
        found[name] = {"hot": asdict(hot), "cold": asdict(cold), "hot_ratio": ratios[0], "cold_ratio": ratios[1]}
        found[name]["build_s"] = built.get(name)
    print_aligned(lines)
    return found


def batch(effort: Effort, quick: bool) -> dict[str, Any]:
    """A frame of contexts in, counts and hits out."""
    return {shape.name: _batch(shape, effort, 10_000 if quick else 100_000) for shape in SHAPES}


def _batch(shape: Shape, effort: Effort, n: int) -> dict[str, Any]:
    table = make_table(shape)
    contexts = make_contexts(table, n)
    few = contexts.first(min(n // 20, 10_000_000 // shape.n_rows))
    vectors = yardsticks.BitVectors.of(table)
    compiled = ours.build(table).compile()
    texts, enums = contexts.frame(), contexts.frame(enums_as_text=False)
    builders: list[tuple[str, int, Callable[[], Callable[[], batches.Answer]]]] = [
        ("contextdb query_many", n, lambda: lambda: _counts_and_hits(compiled, texts)),
        ("contextdb query_many, polars Enums", n, lambda: lambda: _counts_and_hits(compiled, enums)),
        ("unfused encoding + same kernel", n, lambda: batches.unfused_kernel(vectors, texts)),
        ("the same, polars Enums", n, lambda: batches.unfused_kernel(vectors, enums)),
        ("masks, numpy", n, lambda: batches.numpy_masks(vectors, texts)),
        ("DuckDB join", len(few), lambda: batches.duckdb_join(table, few)),
    ]
    found: list[batches.Batch] = []
    for name, size, build in builders:
        try:
            found.append(batches.Batch(name, size, build()))
        except ImportError as error:
            print(f"{name}: left out, {error.name} is not installed")
    _check_batches(found, batches.reference(few), len(few))
    print(f"\nBatch, {shape.name}: contexts to counts and hits, encoding included")
    return _print_batch(found, effort)


def _counts_and_hits(compiled: cdb.CompiledTable, frame: Any) -> batches.Answer:
    many = compiled.query_many(frame)
    return many.counts, many.hits


def _check_batches(engines: Sequence[batches.Batch], reference: batches.Answer, n_few: int) -> None:
    """Compare with a reading of every cell as far as that goes, and the engines that go further with each other."""
    hits_of_all = None
    for engine in engines:
        counts, hits = engine.ask()
        agrees = np.array_equal(counts[:n_few], reference[0])
        if engine.n == n_few:
            agrees &= np.array_equal(hits, reference[1])
        else:
            hits_of_all = hits if hits_of_all is None else hits_of_all
            agrees &= np.array_equal(hits, hits_of_all)
        if not agrees:
            raise AssertionError(f"{engine.name} answers otherwise")


def _print_batch(engines: Sequence[batches.Batch], effort: Effort) -> dict[str, Any]:
    times: dict[str, list[Any]] = {engine.name: [] for engine in engines}
    for _ in range(effort.repeats):
        for engine in engines:
            times[engine.name].append(seconds(engine.ask, 1))
    found: dict[str, Any] = {}
    lines = [("", "contexts", "ms", "lowest..highest", "contexts/s", "ours/")]
    for engine in engines:
        each = sorted(s.median_us for s in times[engine.name])
        rate = engine.n / float(np.median(each)) * 1e6
        found[engine.name] = {
            "n": engine.n,
            "repeats": len(each),
            "median_us": float(np.median(each)),
            "low_us": each[0],
            "high_us": each[-1],
        }
        found[engine.name] |= {"contexts_per_s": rate, "ratio": found[engines[0].name].get("contexts_per_s", rate) / rate}
        spread = f"{each[0] / 1e3:.1f}..{each[-1] / 1e3:.1f}"
        middle = f"{np.median(each) / 1e3:.1f}"
        lines.append((engine.name, f"{engine.n:,}", middle, spread, f"{rate:,.0f}", f"{found[engine.name]['ratio']:.2f}"))
    print_aligned(lines)
    return found


def bounds(effort: Effort, quick: bool) -> dict[str, Any]:
    """One number column whose bounds are all distinct: the case in which a mask for each class would be quadratic."""
    n_rows = 10_000
    rng = np.random.default_rng(5)
    lows = rng.permutation(n_rows) / 100 + rng.random(n_rows) / 200
    highs = lows + 2 + rng.random(n_rows) * 23
    cells = {"Asset Name": [f"asset_{r}" for r in range(n_rows)], "number": [f"{a}..{b}" for a, b in zip(lows, highs, strict=True)]}
    table = cdb.Table.from_columns(cells, schema={"number": {"type": "number"}})
    facts = [{"number": x} for x in (rng.random(N_CONTEXTS) * 120).tolist()]
    answers = [np.flatnonzero((lows <= f["number"]) & (f["number"] <= highs)).tolist() for f in facts]
    tracemalloc.start()
    compiled = table.compile()
    compiled.query(facts[0])
    kept = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    flat = (len(np.unique(lows)) + len(np.unique(highs)) + 2) * ((n_rows + 63) // 64) * 8
    engines = [
        Engine("query, its rows not read", compiled.query, facts),
        Engine("query and row numbers", lambda f: compiled.query(f).indices, facts, answers),
    ]
    summaries = {name: (Summary.of(t.hot), Summary.of(t.cold)) for name, t in measure(engines, effort).items()}
    print(f"\nA number column with {n_rows:,} distinct bounds on each side, {n_rows:,} rows")
    print(f"  masks {compiled.nbytes / 1e6:.2f} MB (one for each class would be {flat / 1e6:.1f} MB)")
    print(f"  kept in all after the first query: {kept / 1e6:.2f} MB")
    print(f"  {np.mean([len(a) for a in answers]):.0f} valid rows on average; microseconds")
    print_aligned(
        [("", "hot", "rounds", "n", "cold", "rounds", "n"), *((n, *_cells(h), *_cells(c)) for n, (h, c) in summaries.items())]
    )
    times = {name: {"hot": asdict(h), "cold": asdict(c)} for name, (h, c) in summaries.items()}
    return {"mask_bytes": compiled.nbytes, "kept_bytes": kept, "flat_bytes": flat, "times": times}


def recompile(effort: Effort, quick: bool) -> dict[str, Any]:
    """One cell changed and the table compiled again, against compiling it whole."""
    return {shape.name: _recompile(shape, effort) for shape in SHAPES}


def _recompile(shape: Shape, effort: Effort) -> dict[str, Any]:
    made = make_table(shape)
    context = make_contexts(made, 1).dicts()[0]
    table = ours.build(made)
    table.compile().query(context)
    edits = {
        "bool": (made.bool_names[3], "True"),
        "enum": (made.enum_names[2], made.values[2][1]),
        "number": (made.number_names[1], "12.25..31.75"),
    }
    work: dict[str, Callable[[], Any]] = {
        "read all texts": lambda: ours.build(made),
        "read, compile, first query": lambda: ours.build(made).compile().query(context),
    }
    for kind, (name, text) in edits.items():
        work[f"one {kind} cell: edit"] = lambda name=name, text=text: table.with_cell(7, name, text)  # type: ignore[misc]
        work[f"one {kind} cell: edit, compile, first query"] = lambda name=name, text=text: (  # type: ignore[misc]
            table.with_cell(7, name, text).compile().query(context)
        )
    found = {name: asdict(seconds(each, effort.repeats * 3)) for name, each in work.items()}
    print(f"\nCompiling, {shape.name}; milliseconds")
    lines = [("", "median", "lowest..highest", "n")]
    lines += [
        (n, f"{s['median_us'] / 1e3:.2f}", f"{s['low_us'] / 1e3:.2f}..{s['high_us'] / 1e3:.2f}", str(s["n"]))
        for n, s in found.items()
    ]
    print_aligned(lines)
    return found


def startup(effort: Effort, quick: bool) -> dict[str, Any]:
    """Fresh processes, from start to end; and what `import contextdb` loads."""
    table = ROOT / "tables" / "hit_mid_air.csv"
    commands = {
        "python, nothing imported": ["-c", ""],
        "import numpy": ["-c", "import numpy"],
        "import contextdb": ["-c", "import contextdb"],
        "contextdb query on a sample table": ["-m", "contextdb", "query", str(table), "IsInMidAirAnim=False", "--unknown", "any"],
        "contextdb check on the sample tables": ["-m", "contextdb", "check", str(table.parent)],
    }
    found: dict[str, Any] = {n: asdict(seconds(lambda c=c: _run(c), effort.repeats * 2)) for n, c in commands.items()}  # type: ignore[misc]
    heavy = "textual", "scipy", "rich", "safetensors", "polars"
    loaded = _run(["-c", f"import contextdb, sys; print(*(m for m in {heavy} if m in sys.modules))"]).split()
    print("\nFresh processes, start to end; milliseconds")
    lines = [("", "median", "lowest..highest", "n")]
    lines += [
        (n, f"{s['median_us'] / 1e3:.0f}", f"{s['low_us'] / 1e3:.0f}..{s['high_us'] / 1e3:.0f}", str(s["n"]))
        for n, s in found.items()
    ]
    print_aligned(lines)
    print(f"  of {', '.join(heavy)}, `import contextdb` loads: {', '.join(loaded) or 'none'}")
    return found | {"loaded": loaded}


def _run(arguments: list[str]) -> str:
    """Run Python; a command that refuses its arguments is no measurement."""
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, cwd=ROOT)
    if done.returncode not in (0, 1) or "Traceback" in done.stderr:
        raise RuntimeError(f"{' '.join(arguments)} failed:\n{done.stderr}")
    return done.stdout


def _cells(summary: Summary) -> tuple[str, str, str]:
    return f"{summary.median_us:.2f}", f"{summary.low_us:.2f}..{summary.high_us:.2f}", str(summary.n)


def print_aligned(lines: Sequence[tuple[str, ...]]) -> None:
    """Columns as wide as they need: the first to the left, figures to the right."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for first, *rest in lines:
        print("  ".join([f"  {first:<{widths[0]}}", *(f"{text:>{w}}" for text, w in zip(rest, widths[1:], strict=True))]))
