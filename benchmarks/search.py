"""How fast the best frame is found, beside other exact searches, on all clips and on a few of them.

    python benchmarks/search.py                 all captured clips, and 4 and 16 times as many frames
    python benchmarks/search.py --quick         a rough look
    python benchmarks/search.py --json FILE     the same figures for programs

A query is a frame's pose, a little disturbed. Half of the queries want to go on as that frame goes on, the other half another
frame's way. Warm searches are told the frame that plays now, cold ones are not; filtered ones may choose from a share of the clips,
another choice each round. The engines take turns, in rounds of other queries, each asked once; all must find frames of equal cost.

A controller that searches at each update is timed without a recorder, with one, and with one that has the candidates worked out at
once, as every recorder had before; then what it costs to ask a recorded search again, and with another weight.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

from benchmarks import captured, timing
from benchmarks.captured import Frames
from benchmarks.sections import print_aligned
from contextdb.motion import Controller, ControllerSettings, Decision, Entry, MotionDatabase, Selector, Trace

SIZES = (1, 4, 16)
SHARES = (0.5, 0.1, 0.01)
N_CHARACTERS = (100, 1000)
N_ROUNDS = 8
ALIKE = 1e-3
"""Other engines work in float32: costs so near, as a share, are equal."""

Asked = Callable[[int], int]


@dataclass(frozen=True, eq=False)
class Questions:
    """Queries float64 [Q, F], the frame that plays in each, and for each share of the clips a mask of ranges [Q, R]."""

    queries: NDArray[np.float64]
    currents: list[int]
    masks: dict[float, NDArray[np.bool_]]


def main() -> None:
    """Measure all sizes, print them, and write them as JSON when that is asked for."""
    parser = argparse.ArgumentParser(description="Measure the search for the best frame.")
    parser.add_argument("--quick", action="store_true", help="fewer queries")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    print(" · ".join(f"{key} {value}" for key, value in (report["machine"] | report["versions"]).items()))
    frames = captured.load()
    with timing.one_core(), timing.no_collection():
        for n in SIZES:
            report[f"x{n}"] = _measure(frames.copies(n), 40 if options.quick else 200)
    report["load_at_end"] = timing.machine()["load"]
    print(f"\nload at the end {report['load_at_end']}")
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def _measure(frames: Frames, n_queries: int) -> dict[str, Any]:
    start = time.perf_counter()
    names = [f"clip {i}" for i in range(len(frames.starts))]
    database = MotionDatabase.from_features(frames.features, frames.starts, frames.stops, names)
    database.search(frames.features[0])
    built_s = time.perf_counter() - start
    asked = _questions(frames, n_queries)
    share = database.layout.n_bytes / frames.features.nbytes
    size = f"{len(frames.features):,} frames x {frames.features.shape[1]} in {len(names)} ranges"
    print(f"\n{frames.name}: {size}; built in {built_s * 1e3:.0f} ms, {share:.2f} times the features' memory; microseconds")
    found = {what: _in_turns(frames, asked, engines) for what, engines in _engines(frames, database, asked).items()}
    _print(found)
    return {"frames": len(frames.features), "memory": share, "build_s": built_s, "searches": found} | _others(database, asked)


def _questions(frames: Frames, n: int) -> Questions:
    rng = np.random.default_rng(7)
    n_frames, n_ranges = len(frames.features), len(frames.starts)
    pose = frames.features.shape[1] - 12  # the last features are the way ahead
    queries, currents = [], []
    for i in range(n):
        at = int(rng.integers(n_ranges))
        frame = int(rng.integers(frames.starts[at], max(frames.starts[at] + 1, frames.stops[at] - 1)))
        query = frames.features[frame].astype(np.float64) + rng.normal(0.0, 0.1, frames.features.shape[1])
        if i % 2:
            query[pose:] = frames.features[rng.integers(n_frames), pose:]
        queries.append(query)
        currents.append(min(frame + 1, int(frames.stops[at]) - 1))
    masks = {}
    for share in SHARES:
        masks[share] = np.zeros((n, n_ranges), np.bool_)
        for part in np.array_split(masks[share], N_ROUNDS):
            part[:, rng.permutation(n_ranges)[: max(1, round(share * n_ranges))]] = True
    return Questions(np.array(queries), currents, masks)


def _engines(frames: Frames, database: MotionDatabase, asked: Questions) -> dict[str, dict[str, Asked]]:
    """For each kind of question, what answers question i with a frame."""
    queries, currents = asked.queries, asked.currents
    others = {
        name: engine for name, build in (("numpy", _numpy), ("faiss flat", _faiss)) if (engine := _built(name, build, frames))
    }
    whole: dict[str, Asked] = {name: engine(queries, None) for name, engine in others.items()}
    if tree := _built("scipy cKDTree", _tree, frames):
        whole["scipy cKDTree"] = tree(queries, None)
    found = {
        "all, cold": {"contextdb": lambda i: database.search(queries[i]).frame} | whole,
        "all, warm": {"contextdb": lambda i: database.search(queries[i], None, None, currents[i]).frame} | whole,
    }
    for share, masks in asked.masks.items():
        filtered: dict[str, Asked] = {"contextdb": lambda i, masks=masks: database.search(queries[i], masks[i]).frame}  # type: ignore[misc]
        found[f"{share:.0%} of clips"] = filtered | {name: engine(queries, masks) for name, engine in others.items()}
    return found


def _built(name: str, build: Callable[[Frames], Any], frames: Frames) -> Any:
    try:
        return build(frames)
    except ImportError as error:
        print(f"{name}: left out, {error.name} is not installed")
        return None


def _numpy(frames: Frames) -> Callable[[Any, Any], Asked]:
    """Matrix-vector product and argmin; frames of other clips are put out of reach."""
    norms = np.einsum("ij,ij->i", frames.features, frames.features)

    def engine(queries: Any, masks: Any) -> Asked:
        narrow = queries.astype(np.float32)
        if masks is None:
            return lambda i: int(np.argmin(norms - 2.0 * (frames.features @ narrow[i])))
        forbidden = [np.flatnonzero(~_of_frames(frames, mask)) for mask in masks]

        def ask(i: int) -> int:
            costs = norms - 2.0 * (frames.features @ narrow[i])
            costs[forbidden[i]] = np.inf
            return int(np.argmin(costs))

        return ask

    return engine


def _faiss(frames: Frames) -> Callable[[Any, Any], Asked]:
    """A flat index; other clips are left out by a bitmap of frames, made beforehand."""
    faiss: Any = import_module("faiss")

    faiss.omp_set_num_threads(1)
    index = faiss.IndexFlatL2(frames.features.shape[1])
    index.add(frames.features)

    def engine(queries: Any, masks: Any) -> Asked:
        narrow = queries.astype(np.float32)
        if masks is None:
            return lambda i: int(index.search(narrow[i : i + 1], 1)[1][0, 0])
        bits = [np.packbits(_of_frames(frames, mask), bitorder="little") for mask in masks]
        chosen = [faiss.SearchParameters(sel=faiss.IDSelectorBitmap(len(frames.features), faiss.swig_ptr(b))) for b in bits]
        return lambda i: int(index.search(narrow[i : i + 1], 1, params=chosen[i])[1][0, 0]) if len(bits) else -1

    return engine


def _tree(frames: Frames) -> Callable[[Any, Any], Asked]:
    """A k-d tree; it cannot be filtered."""
    from scipy.spatial import cKDTree

    tree = cKDTree(frames.features)
    return lambda queries, masks: lambda i: int(tree.query(queries[i])[1])


def _of_frames(frames: Frames, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return np.asarray(np.repeat(mask, frames.stops - frames.starts))


def _in_turns(frames: Frames, asked: Questions, engines: dict[str, Asked]) -> dict[str, dict[str, float]]:
    """Median and 95th percentile of each engine, in microseconds; the engines take turns, some other queries at a time."""
    numbers = range(len(asked.queries))
    costs = np.array([[_cost(frames, ask(i), asked.queries[i]) for i in numbers] for ask in engines.values()])
    if not np.allclose(costs, costs[0], rtol=ALIKE, atol=ALIKE):
        raise AssertionError(f"the engines {list(engines)} found frames of different costs: {np.ptp(costs, axis=0).max()} apart")
    times: dict[str, list[timing.Nanoseconds]] = {name: [] for name in engines}
    for some in np.array_split(numbers, N_ROUNDS):
        for name, ask in engines.items():
            timing.timed(ask, numbers[: timing.WARM_UP])
            times[name].append(timing.timed(ask, some.tolist()))
    found = {name: np.concatenate(rounds) / 1e3 for name, rounds in times.items()}
    ours = float(np.median(found["contextdb"]))
    return {
        name: {"median": float(np.median(t)), "p95": float(np.percentile(t, 95)), "ratio": float(np.median(t)) / ours}
        for name, t in found.items()
    }


def _cost(frames: Frames, frame: int, query: NDArray[np.float64]) -> float:
    return float(((frames.features[frame] - query) ** 2).sum())


def _print(found: dict[str, dict[str, dict[str, float]]]) -> None:
    lines = [("", "median", "p95", "/ours")]
    for what, engines in found.items():
        lines += [(f"{what}: {name}", f"{t['median']:.1f}", f"{t['p95']:.1f}", f"{t['ratio']:.1f}") for name, t in engines.items()]
    print_aligned(lines)


def _others(database: MotionDatabase, asked: Questions) -> dict[str, Any]:
    """What a new mask costs, and crowds whose characters each have a mask of their own."""
    masks = asked.masks[0.1]
    mask_us = timing.Summary.of([timing.timed(database.filter, list(masks))]).median_us
    print(f"  a new mask, other than the search itself: {mask_us:.2f}")
    found: dict[str, Any] = {"new_mask": mask_us}
    for n in N_CHARACTERS:
        at = np.arange(n) % len(asked.queries)
        for what, valid in (("all clips", None), ("10% of clips each", [masks[i] for i in at])):
            each_us = _crowd_us(database, asked.queries[at], [asked.currents[i] for i in at], valid) / n
            print(f"  search_many, {n:,} characters, {what}: {each_us:.1f} each")
            found[f"search_many, {n}, {what}"] = each_us
    return found | {"recording": _recording(database, asked), "asked_again": _asked_again(database, asked)}


class _AtOnce(Trace):
    """A trace that has the candidates of each search worked out when it is recorded."""

    def record(self, decision: Decision) -> None:
        """Keep a decision, and count its candidates."""
        super().record(decision)
        assert all(len(found) for _, found in decision.candidates), "a search has candidates"


def _recording(database: MotionDatabase, asked: Questions) -> dict[str, float]:
    """The median of an update that searches, in microseconds, with three recorders, which take turns."""
    selector = Selector([Entry("all", database)])
    recorders: dict[str, Callable[[], Trace | None]] = {
        "off": lambda: None,
        "on": lambda: Trace(databases=selector.databases),
        "candidates at once": lambda: _AtOnce(databases=selector.databases),
    }
    times: dict[str, list[timing.Nanoseconds]] = {name: [] for name in recorders}
    masks = asked.masks[0.5]
    for some in np.array_split(np.arange(len(asked.queries)), N_ROUNDS):
        for name, recorder in recorders.items():
            controller = Controller(selector, ControllerSettings(search_every_s=0.0), recorder=recorder())
            numbers = some[: max(2, len(some) // 5)] if name == "candidates at once" else some

            def update(i: int, controller: Controller = controller) -> Decision:
                return controller.update(1 / 60, asked.queries[i], {"all": masks[i]}, context={"speed": 1.0})

            times[name].append(timing.timed(update, numbers.tolist()))
    found = {name: float(np.median(np.concatenate(rounds))) / 1e3 for name, rounds in times.items()}
    told = ", ".join(f"{name} {each_us:,.0f} ({each_us / found['off']:.1f} times)" for name, each_us in found.items())
    print(f"  an update that searches, recording {told}")
    return found


def _asked_again(database: MotionDatabase, asked: Questions) -> dict[str, float]:
    """The median of all costs of a recorded search, and of the same with another weight, in milliseconds."""
    selector = Selector([Entry("all", database)])
    trace = Trace(databases=selector.databases)
    controller = Controller(selector, ControllerSettings(search_every_s=0.0), recorder=trace)
    for query in asked.queries[:N_ROUNDS]:
        controller.update(1 / 60, query)
    each = [decision.searches["all"] for decision in trace.reasked()]
    heavier = {database.channel_names[0]: 2.0}
    steps: dict[str, Callable[[Any], Any]] = {
        "costs": lambda one: one.costs,
        "weighed": lambda one: one.with_weights(heavier).costs,
    }
    found = {name: timing.Summary.of([timing.timed(step, each)]).median_us / 1e3 for name, step in steps.items()}
    print(f"  a recorded search asked again: all costs {found['costs']:.1f} ms, with another weight {found['weighed']:.2f} ms")
    return found


def _crowd_us(database: MotionDatabase, queries: Any, currents: list[int], valid: Any) -> float:
    return timing.Summary.of([timing.timed(lambda given: database.search_many(queries, given, currents), [valid] * 3)]).median_us


if __name__ == "__main__":
    main()
