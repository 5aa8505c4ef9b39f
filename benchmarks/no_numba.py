"""How much slower everything is without numba: the same work in processes with it and without it, which take turns.

    python benchmarks/no_numba.py             a table of 2,000 rows x 30 conditions, the samples, and captured or made clips
    python benchmarks/no_numba.py --rounds 5  more turns
    python benchmarks/no_numba.py --only check

A figure is CPU time, the least of all turns and of the repeats in each; each process does the work once before, so that what is
compiled is not timed. Work that goes on for longer than its limit without numba is given up, and its ratio is a lower bound. What
the two give must be equal.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parent.parent
if __package__ in (None, ""):
    sys.path[0] = str(ROOT)  # not this folder: its coverage.py is no package of that name

SIZE = (2_000, 30)
NARROW = (2_000, 20)
SHAPE = "tree"
WORK_OF_COUNT = 40_000_000
N_CONTEXTS, N_MOMENTS, N_QUERIES = 100_000, 300_000, 100
N_SINGLE, N_CROWD, N_TICKS = 2_000, 200, 30
REPEATS, REPEAT_S = 20, 0.5
"""The work is repeated in a process until it was done so often, or has taken so long."""
LIMIT_S = 120.0
Work = Callable[[], object]
"""Gives what both ways must give alike."""


def main() -> None:
    """Measure each piece of work in turns, and print a line for it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3, help="turns of each")
    parser.add_argument("--only", metavar="TEXT", default="", help="only work whose name holds this")
    parser.add_argument("--limit", type=float, default=LIMIT_S, metavar="S", help="give work up after so many seconds")
    parser.add_argument("--alone", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.alone:
        _alone(*options.alone)
        return
    print(f"{'work':46} {'numba s':>9} {'without s':>9} {'ratio':>7}")
    for name in WORK:
        if options.only in name:
            _print_line(name, options.rounds, options.limit)


def _print_line(name: str, n_rounds: int, limit_s: float) -> None:
    times: dict[str, list[float]] = {"with": [], "without": []}
    given = set()
    for _ in range(n_rounds):
        for how, own in times.items():
            found = _timed(name, how, limit_s)
            if found is None:
                print(f"{name:46} {min(times['with']):9.3f} {'-':>9} {'> ' + format(limit_s, '.0f') + ' s':>7}")
                return
            own.append(found["cpu_s"])
            given.add(found["given"])
    if len(given) != 1:
        raise SystemExit(f"{name}: with numba and without do not give the same.")
    with_s, without_s = (min(own) for own in times.values())
    print(f"{name:46} {with_s:9.5f} {without_s:9.5f} {without_s / with_s:7.1f}", flush=True)


def _timed(name: str, how: str, limit_s: float) -> dict[str, Any] | None:
    """What a process of its own took and gave; None where it was given up."""
    line = [sys.executable, __file__, "--alone", name, how]
    try:
        out = subprocess.run(line, capture_output=True, text=True, check=True, timeout=limit_s, env={**os.environ}).stdout
    except subprocess.TimeoutExpired:
        return None
    found: dict[str, Any] = json.loads(out)
    return found


def _alone(name: str, how: str) -> None:
    if how == "without":
        sys.modules["numba"] = None  # type: ignore[assignment]
    with tempfile.TemporaryDirectory() as folder:
        work = WORK[name](Path(folder))
        given = work()
        times: list[float] = []
        while len(times) < REPEATS and sum(times) < REPEAT_S:
            start = time.process_time()
            work()
            times.append(time.process_time() - start)
    text = json.dumps(given, sort_keys=True)
    print(json.dumps({"cpu_s": min(times), "given": hashlib.sha256(text.encode()).hexdigest()}))


# ---- the work


def _tables() -> list[Any]:
    """The samples."""
    from contextdb.tables.project import Project

    return [table.flat() for table in Project.load(ROOT / "tables").tables.values()]


def _made(shape: str = SHAPE, size: tuple[int, int] = SIZE) -> Any:
    from benchmarks.coverage_tables import made_table

    return made_table(shape, *size)


def _contexts(table: Any, n: int, folder: Path) -> list[dict[str, Any]]:
    import polars as pl

    from benchmarks.telemetry import record

    record(table, "distinct", n, folder)
    return pl.read_parquet(folder / "*.parquet").to_dicts()


def _query(folder: Path) -> Work:
    table = _made()
    compiled, contexts = table.compile(), _contexts(table, N_SINGLE, folder)
    return lambda: [len(compiled.query(context).indices) for context in contexts]


def _live(folder: Path) -> Work:
    """A context of which one fact changes at a time."""
    table = _made()
    compiled, contexts = table.compile(), _contexts(table, N_SINGLE, folder)
    names = list(contexts[0])

    def play() -> list[int]:
        live, found = compiled.live(contexts[0]), []
        for i, context in enumerate(contexts):
            live[names[i % len(names)]] = context[names[i % len(names)]]
            found.append(len(live.matches().indices))
        return found

    return play


def _compile(_folder: Path) -> Work:
    return lambda: _made().compile().n_rows


def _query_many(folder: Path) -> Work:
    import polars as pl

    from benchmarks.telemetry import record

    table = _made()
    record(table, "distinct", N_CONTEXTS, folder)
    columns = pl.read_parquet(folder / "*.parquet")
    compiled = table.compile()
    return lambda: compiled.query_many(columns).counts.tolist()


def _coverage(tables: Callable[[], list[Any]], work: int, _folder: Path) -> Work:
    from contextdb.covering import coverage

    opened = tables()
    return lambda: [coverage(table, work=work).to_json() for table in opened]


def _check(tables: Callable[[], list[Any]], _folder: Path) -> Work:
    from contextdb.checks.rows import check_rows

    opened = tables()
    return lambda: [[(f.rule, f.row, list(f.by)) for f in check_rows(table)] for table in opened]


def _observe(kind: str, folder: Path) -> Work:
    from benchmarks.telemetry import record
    from contextdb.telemetry import observe

    table = _made()
    record(table, kind, N_MOMENTS, folder)
    return lambda: observe(table, f"{folder}/*.parquet").to_json()


def _evaluate(folder: Path) -> Work:
    from benchmarks.telemetry import record
    from contextdb.telemetry.evaluate_file import Question, evaluate_file

    table = _made()
    record(table, "distinct", N_MOMENTS, folder)
    question = Question(table.compile(), "error", None)
    return lambda: [evaluate_file(question, path, lambda _: None).hits.tolist() for path in sorted(folder.glob("*.parquet"))]


def _casting(_folder: Path) -> Work:
    from benchmarks.casting import ROLES, made_actors, made_table

    rng = random.Random(0)
    compiled, actors = made_table(rng).compile(), made_actors(rng)

    def cast() -> list[int]:
        for _ in range(5):
            matches = compiled.query({}, actors=dict.fromkeys(ROLES, actors), prefer="distance")
            rows = [row for row in matches if matches.casting(row)]
        return rows

    return cast


def _search(kind: str, _folder: Path) -> Work:
    from benchmarks import captured
    from contextdb.motion import MotionDatabase

    frames = captured.load()
    names = [f"clip {i}" for i in range(len(frames.starts))]
    database = MotionDatabase.from_features(frames.features, frames.starts, frames.stops, names)
    rng = np.random.default_rng(0)
    picks = rng.integers(len(frames.features), size=(N_QUERIES, 2))
    queries = (frames.features[picks[:, 0]] + frames.features[picks[:, 1]]).astype(np.float64) / 2.0
    if kind == "many":
        return lambda: [hit.frame for hit in database.search_many(queries)]
    valid = rng.random((N_QUERIES, len(names))) < 0.3 if kind == "filtered" else np.ones((N_QUERIES, len(names)), np.bool_)
    return lambda: [database.search(query, own).frame for query, own in zip(queries, valid, strict=True)]


@cache
def _clips() -> tuple[Any, list[Any]]:
    from benchmarks.poses import CHANNELS, RATE
    from contextdb import motion

    return motion.FeatureSchema.from_dict("loco", {"rate": RATE, "channels": CHANNELS}), [made.clip for made in motion.made_clips()]


def _build(_folder: Path) -> Work:
    from contextdb.motion import MotionDatabase

    schema, clips = _clips()
    return lambda: MotionDatabase.build(clips, schema).n_frames


def _clip_work(name: str, _folder: Path) -> Work:
    from contextdb import motion

    _, clips = _clips()
    return lambda: repr(getattr(motion, name)(clips))


def _characters(n: int, with_poses: bool, _folder: Path) -> Work:
    """A crowd's ticks, from its beginning each time."""
    from benchmarks.poses import RATE
    from contextdb import motion

    schema, clips = _clips()
    selector = motion.Selector([motion.Entry("loco", motion.MotionDatabase.build(clips, schema))])
    stream = motion.PoseStream(motion.PoseBank.build(clips, schema)) if with_poses else None
    first = motion.Character(motion.Controller(selector), schema, None, stream)
    speeds, ways = 0.3 + np.arange(n) % 37 / 10.0, np.arange(n) % 61 / 10.0
    sticks = np.column_stack((speeds * np.sin(ways), speeds * np.cos(ways)))

    def play() -> list[str]:
        crowd, found = motion.Crowd([first.copy() for _ in range(n)]), []
        for _ in range(N_TICKS):
            if n == 1:
                crowd[0].update(1.0 / RATE, (float(sticks[0, 0]), float(sticks[0, 1])))
            else:
                crowd.update(1.0 / RATE, sticks)
            found += [repr(one.controller.playing) for one in crowd]
        return found

    return play


WORK: dict[str, Callable[[Path], Work]] = {
    "query, 2,000 contexts": _query,
    "a live context, 2,000 changes": _live,
    "query_many, 100,000 contexts": _query_many,
    "compile, with the making of the table": _compile,
    "coverage of the samples": partial(_coverage, _tables, WORK_OF_COUNT),
    "coverage, 2,000 x 30, a hundredth of the work": partial(_coverage, lambda: [_made()], WORK_OF_COUNT // 100),
    "coverage, 2,000 x 20, few cells": partial(_coverage, lambda: [_made("few", NARROW)], WORK_OF_COUNT),
    "coverage, 2,000 x 20, many cells": partial(_coverage, lambda: [_made("many", NARROW)], WORK_OF_COUNT),
    "coverage, 2,000 x 20, a tree": partial(_coverage, lambda: [_made("tree", NARROW)], WORK_OF_COUNT),
    "check of the samples": partial(_check, _tables),
    "check, 2,000 x 30": partial(_check, lambda: [_made()]),
    "telemetry, contexts that come back": partial(_observe, "skewed"),
    "telemetry, contexts that do not": partial(_observe, "distinct"),
    "evaluate, 300,000 contexts": _evaluate,
    "casting, 22 actors": _casting,
    "motion search, 100 queries": partial(_search, "all"),
    "motion search, 100 queries, a third of the clips": partial(_search, "filtered"),
    "motion search, 100 queries together": partial(_search, "many"),
    "motion build, the made clips": _build,
    "motion describe, the made clips": partial(_clip_work, "describe"),
    "motion prepare, the made clips": partial(_clip_work, "prepare"),
    "a character's 30 updates without poses": partial(_characters, 1, False),
    "a character's 30 updates": partial(_characters, 1, True),
    "a crowd of 200, 30 updates without poses": partial(_characters, N_CROWD, False),
    "a crowd of 200, 30 updates": partial(_characters, N_CROWD, True),
}

if __name__ == "__main__":
    main()
