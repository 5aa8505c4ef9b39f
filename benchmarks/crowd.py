"""What a crowd costs when its characters are asked together, beside the same calls one by one.

    python benchmarks/crowd.py                      picks, searches and whole frames of a crowd, in one or two minutes
    python benchmarks/crowd.py --quick              a rough look
    python benchmarks/crowd.py --only searches      one section: picks, searches, frames
    python benchmarks/crowd.py --json FILE          the same figures for programs

Both ways take turns, in rounds, on all cores that the process may use, and each answers what the other answers, which is checked
first. A figure is the median of the rounds. The ratio is that of a round, the median, the least and the greatest; beside it stand
the ratio of the fastest rounds, and that of the CPU time of all cores together, which does not depend on how many cores are free.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import time
import tomllib
from collections.abc import Callable, Sequence
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

import contextdb as cdb
from benchmarks import captured, timing
from benchmarks.captured import Frames
from benchmarks.sections import print_aligned
from contextdb import motion
from contextdb.motion import (
    Controller,
    ControllerGroup,
    ControllerSettings,
    Decision,
    Entry,
    FeatureSchema,
    MotionConfig,
    MotionDatabase,
    Selector,
    Steered,
    Trajectory,
)
from contextdb.motion.clips.steering import steered_path
from contextdb.motion.features.extraction import trajectory_features
from contextdb.motion.features.path_features import with_paths
from contextdb.motion.made.recipes import made_clips
from contextdb.motion.search.filters import Biases

TABLES = Path(__file__).parent.parent / "tables"
N_AGENTS = 10_000
TABLE_SIZES = (1, 10)
"""Times that the rows of the sample table are in a table."""
N_CHARACTERS = 1000
SIZES = (1, 4, 16)
"""Times that the captured clips are in a database."""
SHARES = (1.0, 0.5, 0.1)
GROUPS = (100, 1000)
DT_S, RATE = 1.0 / 30.0, 30.0
PAST = 30
"""Moments of the past that a path holds."""

Work = Callable[[], object]
Took = tuple[float, float]
Figures = dict[str, float]


def main() -> None:
    """Measure the sections asked for, print them, and write them as JSON when that is asked for too."""
    parser = argparse.ArgumentParser(description="Measure crowds.")
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    parser.add_argument("--only", nargs="+", choices=list(SECTIONS), default=list(SECTIONS), help="sections to run")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    print(" · ".join(f"{key} {value}" for key, value in (report["machine"] | report["versions"]).items()))
    for name in options.only:
        report[name] = SECTIONS[name](5 if options.quick else 15)
    report["load_at_end"] = timing.machine()["load"]
    print(f"\nload at the end {report['load_at_end']}")
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def _in_turns(works: dict[str, tuple[Work, Work]], n: int, n_rounds: int) -> dict[str, Figures]:
    """Microseconds a character of both ways, one by one and together, and their ratios."""
    found = {}
    for name, pair in works.items():
        with timing.no_collection():
            found[name] = _figures([[_took(work) for work in pair] for _ in range(n_rounds)], n)
    return found


def _took(work: Work) -> Took:
    """The microseconds of some work: on the clock, and of all cores' time."""
    start, cpu = time.perf_counter(), time.process_time()
    work()
    return (time.perf_counter() - start) * 1e6, (time.process_time() - cpu) * 1e6


def _figures(rounds: Sequence[Sequence[Took]], n: int) -> Figures:
    """Medians of both ways, of n characters, and of the ratios of rounds the median, the least and the greatest."""
    clock, cpu = np.moveaxis(np.array(rounds), 2, 0)
    ratios = clock[:, 0] / clock[:, 1]
    each, crowd = np.median(clock, axis=0) / n
    spread = {
        "ratio": np.median(ratios),
        "least": ratios.min(),
        "greatest": ratios.max(),
        "fastest": clock[:, 0].min() / clock[:, 1].min(),
        "cpu": np.median(cpu[:, 0] / cpu[:, 1]),
    }
    return {"one by one": float(each), "together": float(crowd)} | {name: float(value) for name, value in spread.items()}


def _print(title: str, found: dict[str, Figures]) -> None:
    print(f"\n{title}")
    lines = [("", "one by one", "together", "ratio", "least..greatest", "of fastest", "of CPU time")]
    for name, of in found.items():
        spread = f"{of['least']:.1f}..{of['greatest']:.1f}"
        told = (
            f"{of['one by one']:.2f}",
            f"{of['together']:.2f}",
            f"{of['ratio']:.1f}",
            spread,
            f"{of['fastest']:.1f}",
            f"{of['cpu']:.1f}",
        )
        lines.append((name, *told))
    print_aligned(lines)


# ---- picks: facts in, a row of each character out


def _picks(n_rounds: int) -> dict[str, Any]:
    """Query and pick for every agent: in a loop, by a picker and without one, and by query_many and pick_many."""
    works: dict[str, tuple[Work, Work]] = {}
    for times in TABLE_SIZES:
        compiled, columns = _moves(times), _facts(N_AGENTS)
        contexts = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
        arrays = {name: np.array(values) for name, values in columns.items()}  # as a crowd is kept
        together, singly = (partial(how, compiled, compiled.picker(seed=0)) for how in (_picked_together, _picked_one_by_one))
        if together(arrays).tolist() != singly(contexts):
            raise AssertionError("pick_many does not pick what pick picks.")
        without = partial(_picked_without_picker, compiled, contexts, random.Random(0), [""] * N_AGENTS)
        works[f"{compiled.n_rows:,} rows: picker.pick"] = partial(singly, contexts), partial(together, arrays)
        works[f"{compiled.n_rows:,} rows: compiled.pick"] = without, partial(together, arrays)
    found = _in_turns(works, N_AGENTS, n_rounds)
    _print(f"Query and pick of {N_AGENTS:,} agents, tables like locomotion; microseconds an agent", found)
    return found


def _picked_together(compiled: Any, picker: Any, columns: Any) -> Any:
    return picker.pick_many(compiled.query_many(columns))


def _picked_one_by_one(compiled: Any, picker: Any, contexts: Any) -> Any:
    picks = [picker.pick(compiled.query(facts), who=i) for i, facts in enumerate(contexts)]
    return [-1 if pick.row is None else pick.row for pick in picks]


def _picked_without_picker(compiled: Any, contexts: Sequence[dict[str, Any]], dice: random.Random, last: list[str]) -> None:
    for i, facts in enumerate(contexts):
        last[i] = compiled.pick(compiled.query(facts), rng=dice, last=last[i])


def _moves(times: int) -> Any:
    """The sample table, its rows so many times, each time with other assets."""
    table = cdb.Project.load(TABLES).tables["locomotion"]
    names = [column.name for column in table.columns]
    rows = [{name: table.text(row, name) for name in names} for row in range(table.n_rows)]
    more = [row | {"Asset Name": f"{row['Asset Name']}_{i}"} for i in range(1, times) for row in rows]
    return table.with_rows(table.n_rows, more).compile()


def _facts(n: int) -> dict[str, list[Any]]:
    """Facts of n agents, as columns."""
    rng = np.random.default_rng(5)
    return {
        "gait": rng.choice(["Idle", "Walk", "Run"], n).tolist(),
        "speed": rng.uniform(0.0, 5.0, n).tolist(),
        "direction": rng.uniform(-180.0, 180.0, n).tolist(),
        "style": rng.choice(["normal", "tired"], n).tolist(),
    }


# ---- searches: a mask of its own for each character


def _searches(n_rounds: int) -> dict[str, Any]:
    """1,000 characters, each with its own mask, on three sizes of databases."""
    found: dict[str, Any] = {}
    frames = captured.load()
    for size in SIZES:
        own = frames.copies(size)
        works = _search_works(own)
        found[own.name] = _in_turns(works, N_CHARACTERS, n_rounds)
        name = f"{own.name}: {len(own.features):,} frames in {len(own.starts):,} ranges"
        _print(f"Searches of {N_CHARACTERS:,} characters on {name}; microseconds a character", found[own.name])
    return found


def _search_works(frames: Frames) -> dict[str, tuple[Work, Work]]:
    names = [f"clip {i}" for i in range(len(frames.starts))]
    database = MotionDatabase.from_features(frames.features, frames.starts, frames.stops, names)
    queries, currents = _questions(frames)
    rng = np.random.default_rng(9)
    works = {}
    for share in SHARES:
        masks = np.zeros((N_CHARACTERS, len(names)), np.bool_)
        for mask in masks:
            mask[rng.permutation(len(names))[: max(1, round(share * len(names)))]] = True
        what = f"{share:.0%} of clips each, as flags"
        works[what] = _search_work(database, queries, currents, masks, list(masks))
    columns = {"Asset": names, "style": ["abcdefghij"[i % 10] for i in range(len(names))]}
    compiled = cdb.Table.from_columns(columns, {"style": {"type": "text"}}).compile()
    many = compiled.query_many({"style": ["abcdefghij"[i] for i in rng.integers(0, 10, N_CHARACTERS)]})
    works["10% of clips each, as answers of a table"] = _search_work(database, queries, currents, many, list(many))
    return works


def _search_work(database: MotionDatabase, queries: Any, currents: list[int], many: Any, each: list[Any]) -> tuple[Work, Work]:
    asked = list(zip(queries, each, currents, strict=True))

    def singly() -> object:
        return [database.search(query, valid, None, current) for query, valid, current in asked]

    def together() -> object:
        return database.search_many(queries, many, currents)

    if singly() != together():
        raise AssertionError("search_many does not find what search finds.")
    return singly, together


def _questions(frames: Frames) -> tuple[NDArray[np.float64], list[int]]:
    """A disturbed frame for each character, half of them with another frame's way ahead; and the frame that comes next."""
    rng = np.random.default_rng(7)
    at = rng.integers(0, len(frames.starts), N_CHARACTERS)
    playing = rng.integers(frames.starts[at], np.maximum(frames.starts[at] + 1, frames.stops[at] - 1))
    queries = frames.features[playing] + rng.normal(0.0, 0.1, (N_CHARACTERS, frames.features.shape[1]))
    queries[::2, -12:] = frames.features[rng.integers(0, len(frames.features), len(queries[::2])), -12:]
    return queries, np.minimum(playing + 1, frames.stops[at] - 1).tolist()


# ---- frames: from sticks to decisions


def _frames(n_rounds: int) -> dict[str, Any]:
    """The parts of a character-frame: paths, queries, and the controllers' updates, with searches and without."""
    schema, selector = _made()
    found = {}
    for n in GROUPS:
        crowd = _Crowd(schema, selector, n)
        found[str(n)] = _in_turns(crowd.works(), n, max(3, n_rounds // 3)) | crowd.updates(4 * n_rounds)
        _print(f"Frames of {n:,} characters on made clips, two databases; microseconds a character", found[str(n)])
    return found


def _made() -> tuple[FeatureSchema, Selector]:
    """The sample project's schema, and its databases of made clips."""
    schema = MotionConfig.from_dict(tomllib.loads((TABLES / "contextdb.toml").read_text(encoding="utf-8"))).features["loco"]
    clips = [each.clip for each in made_clips()]
    shared: dict[str, Any] = {"biases": Biases(0.0, -0.005, -0.01), "end_s": 0.3}
    loco = MotionDatabase.build(clips, schema, **shared)
    worn = [clip for clip in clips if clip.name.endswith("_tired")]
    tired = MotionDatabase.build(worn, schema, normalisation=loco.normalisation, **shared)
    selector = Selector([Entry("loco_tired", tired, 2.75), Entry("loco", loco)])
    selector.search(np.zeros(schema.n_features))
    selector.search_many(np.zeros((2, schema.n_features)))
    return schema, selector


class _Crowd:
    """Characters that walk along sticks, once in a group and once each with its own controller."""

    def __init__(self, schema: FeatureSchema, selector: Selector, n: int) -> None:
        self.schema, self.n = schema, n
        settings = ControllerSettings(search_every_s=60.0)  # a search when it is forced, and when a clip has ended
        self.group = ControllerGroup([Controller(selector, settings) for _ in range(n)])
        self.alone = [Controller(selector, settings) for _ in range(n)]
        self.moves, self.ticks, self.rng = _moves(1), count(), np.random.default_rng(2)
        self.past = [[Steered()] for _ in range(n)]
        self._turn_sticks()

    def _turn_sticks(self) -> None:
        speeds, ways = self.rng.uniform(0.0, 4.0, self.n), self.rng.uniform(-np.pi, np.pi, self.n)
        self.sticks = np.stack((speeds * np.sin(ways), speeds * np.cos(ways)), axis=1)
        self.facts = {
            "gait": np.select([speeds < 0.3, speeds < 2.0], ["Idle", "Walk"], "Run").tolist(),
            "speed": speeds,
            "direction": np.zeros(self.n),
            "style": ["normal"] * self.n,
        }

    def works(self) -> dict[str, tuple[Work, Work]]:
        """Paths and queries, made one by one and together."""
        for _ in range(PAST):
            self._step()
        each = self._each()
        paths, poses = [steered_path(*one) for one in each], self.group.poses(DT_S)
        return {
            "one's path, by moments and at once": (
                lambda: [_path_by_moments(bodies, stick) for bodies, stick in each],
                lambda: [steered_path(bodies, stick) for bodies, stick in each],
            ),
            "one's query, by channels and at once": (
                lambda: [_query_by_channels(self.schema, pose, paths[i]) for i, pose in enumerate(poses)],
                lambda: [motion.with_path(self.schema, pose, paths[i]) for i, pose in enumerate(poses)],
            ),
            "queries with paths": (
                lambda: [motion.with_path(self.schema, pose, paths[i]) for i, pose in enumerate(poses)],
                lambda: with_paths(self.schema, poses, paths),
            ),
        }

    def updates(self, n_ticks: int) -> dict[str, Figures]:
        """Updates in which the characters search, and in which they do not."""
        times: dict[bool, list[list[Took]]] = {True: [], False: []}
        with timing.no_collection():
            for tick in range(n_ticks):
                is_forced = tick % 2 == 0
                singly, together, searched = self._updated(self._step(), self.moves.query_many(self.facts), is_forced)
                if is_forced or searched < 0.05:
                    times[is_forced].append([singly, together])
        return {f"updates {'with' if how else 'without'} a search": _figures(own, self.n) for how, own in times.items() if own}

    def _updated(self, queries: Any, many: Any, force: bool) -> tuple[Took, Took, float]:
        """Update all: what it took one by one and together, and the share that searched."""
        each = list(zip(self.alone, queries, many, strict=True))
        for controller in self.alone:
            controller.upcoming(DT_S)
        decisions: list[list[Decision]] = [[], []]
        together = _took(lambda: decisions[0].extend(self.group.update(DT_S, queries, many, force=force)))
        singly = _took(lambda: decisions[1].extend(one.update(DT_S, q, v, force=force) for one, q, v in each))
        if [decision.playing for decision in decisions[0]] != [decision.playing for decision in decisions[1]]:
            raise AssertionError("a group does not decide as its controllers do alone.")
        searched = sum(decision.searched for decision in decisions[0])
        return singly, together, searched / self.n

    def _step(self) -> Any:
        if next(self.ticks) % 30 == 29:
            self._turn_sticks()
        self.past = [[*past, past[-1].moved(DT_S, stick)][-PAST:] for past, stick in self._each()]
        return with_paths(self.schema, self.group.poses(DT_S), [steered_path(*one) for one in self._each()])

    def _each(self) -> list[tuple[list[Steered], tuple[float, float]]]:
        """Where each body was, and its stick."""
        return list(zip(self.past, [(float(x), float(z)) for x, z in self.sticks], strict=True))


def _path_by_moments(past: Sequence[Steered], stick: tuple[float, float]) -> Trajectory:
    """The path of a body, each moment of it moved to alone: what `steered_path` gives."""
    bodies = [*past, *(past[-1].moved(i * DT_S, stick) for i in range(1, round(RATE) + 1))]
    headings = np.unwrap([body.heading for body in bodies])
    return Trajectory(RATE, np.array([body.position for body in bodies]), headings, len(past) - 1)


def _query_by_channels(schema: FeatureSchema, pose: Any, path: Trajectory) -> Any:
    """A query with a path, each point of each channel looked up alone, as a database does: what `with_path` gives."""
    query, now = np.array(pose, np.float32), np.array([path.now])
    for channel in schema.channels:
        if channel.type == "trajectory":
            query[schema.slices[channel.name]] = trajectory_features(channel, path, now)[0]
    return query


SECTIONS: dict[str, Callable[[int], dict[str, Any]]] = {"picks": _picks, "searches": _searches, "frames": _frames}


if __name__ == "__main__":
    main()
