"""Time engines side by side, so that what the machine does meanwhile falls on all of them alike.

All engines are built and checked first. Then they take turns in rounds of different inputs, each after it has answered the same
inputs; a time is the median of all calls, its spread the lowest and the highest median of a round. Cold calls come after 32 MB of
other writes, as in a game that asks once a frame. Compare within one run: absolute times move with the machine's load, ratios much
less.
"""

from __future__ import annotations

import gc
import os
import platform
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Nanoseconds = NDArray[np.int64]

WARM_UP = 5
COLD_BYTES = 32 << 20
PACKAGES = (
    "contextdb", "numpy", "polars", "numba", "duckdb", "zen-engine", "pyroaring", "pyarrow", "scipy", "faiss-cpu", "textual",
    "textual-fastdatatable", "daff",
)  # fmt: skip


@dataclass(frozen=True)
class Effort:
    """How long to measure: `hot_s` seconds and at most `most_calls` calls for each engine, in `rounds` rounds, and `cold_calls`."""

    rounds: int = 8
    hot_s: float = 1.0
    most_calls: int = 2000
    cold_calls: int = 48
    repeats: int = 5


FULL = Effort()
QUICK = Effort(rounds=3, hot_s=0.1, most_calls=300, cold_calls=9, repeats=3)


@dataclass(frozen=True)
class Engine:
    """Something that answers: `ask(inputs[i])` gives the rows `answers[i]`, as a list or an array."""

    name: str
    ask: Callable[[Any], Any]
    inputs: Sequence[Any]
    answers: Sequence[Sequence[int]] | None = None
    """None for a part of the work, which has no rows to check."""
    on_one_core: bool = False
    build_s: float = 0.0


@dataclass
class Times:
    """What an engine took: nanoseconds of every call, one array a round."""

    hot: list[Nanoseconds] = field(default_factory=list)
    cold: list[Nanoseconds] = field(default_factory=list)


@dataclass(frozen=True)
class Summary:
    """A median in microseconds, the lowest and highest median of a round, and the number of calls."""

    median_us: float
    low_us: float
    high_us: float
    n: int

    @classmethod
    def of(cls, rounds: Sequence[Nanoseconds]) -> Summary:
        """Summarise the calls of several rounds."""
        medians = [float(np.median(r)) / 1e3 for r in rounds]
        calls = np.concatenate(rounds)
        return cls(float(np.median(calls)) / 1e3, min(medians), max(medians), len(calls))


@contextmanager
def one_core(is_wanted: bool = True) -> Iterator[None]:
    """Keep this thread, and those that it starts, on one core, where the system has a way to ask for it."""
    if not is_wanted or not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


@contextmanager
def no_collection() -> Iterator[None]:
    """Keep the garbage collector from running in the middle of a call."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def timed(ask: Callable[[Any], Any], inputs: Sequence[Any]) -> Nanoseconds:
    """The nanoseconds of each call."""
    clock, times = time.perf_counter_ns, []
    for each in inputs:
        start = clock()
        ask(each)
        times.append(clock() - start)
    return np.array(times, np.int64)


def seconds(work: Callable[[], Any], repeats: int) -> Summary:
    """Time a longer piece of work; each repeat counts as a round."""
    with no_collection():
        return Summary.of([timed(lambda _: work(), (None,)) for _ in range(repeats)])


def check(engine: Engine, budget_s: float = 2.0) -> None:
    """Compare an engine's answers with the right ones, as many as the budget allows, the last ones first."""
    if engine.answers is None:
        return
    stop = time.perf_counter() + budget_s
    for k in reversed(range(len(engine.inputs))):
        found = [int(r) for r in engine.ask(engine.inputs[k])]
        if found != list(engine.answers[k]):
            raise AssertionError(f"{engine.name}: context {k} has the rows {engine.answers[k]}, not {found}")
        if time.perf_counter() > stop and k < len(engine.inputs) - 20:
            return


def measure(engines: Sequence[Engine], effort: Effort) -> dict[str, Times]:
    """Check every engine, then time them in turns."""
    calls: dict[str, int] = {}
    for engine in engines:
        with one_core(engine.on_one_core):
            check(engine)
            pilot = float(np.median(timed(engine.ask, engine.inputs[:WARM_UP])))
        calls[engine.name] = int(np.clip(effort.hot_s * 1e9 / pilot, effort.rounds * 3, min(effort.most_calls, len(engine.inputs))))
    times = {engine.name: Times() for engine in engines}
    with no_collection():
        for i in range(effort.rounds):
            for engine in engines:
                n = calls[engine.name] // effort.rounds
                times[engine.name].hot.append(_hot_round(engine, engine.inputs[i * n : (i + 1) * n]))
        other = np.zeros(COLD_BYTES // 8, np.uint64)
        for i in range(3):
            for engine in engines:
                times[engine.name].cold.append(_cold_round(engine, effort.cold_calls // 3, i, other))
    return times


def _hot_round(engine: Engine, inputs: Sequence[Any]) -> Nanoseconds:
    with one_core(engine.on_one_core):
        timed(engine.ask, inputs)  # so that none of them finds contexts in the caches that another engine brought there
        return timed(engine.ask, inputs)


def _cold_round(engine: Engine, n: int, start: int, other: NDArray[np.uint64]) -> Nanoseconds:
    found = []
    with one_core(engine.on_one_core):
        for i in range(n):
            at = (start * n + i) * 67 % len(engine.inputs)
            other += np.uint64(1)
            found.append(timed(engine.ask, engine.inputs[at : at + 1]))
    return np.concatenate(found)


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    cpu = Path("/proc/cpuinfo")
    models = (
        [line.partition(":")[2].strip() for line in cpu.read_text().splitlines() if "model name" in line] if cpu.exists() else []
    )
    return {
        "cpu": models[0] if models else platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "load": round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None,
    }


def versions() -> dict[str, str]:
    """The versions of Python and of every package that is measured."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found
