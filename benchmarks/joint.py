"""How long it takes to find clip, frame and cast for several characters at once.

    python benchmarks/joint.py                   2 roles x 200 clips x 6 actors, and larger
    python benchmarks/joint.py --quick           fewer questions
    python benchmarks/joint.py --json FILE       the same figures for programs

The clips are pieces of captured clips, three seconds each (see `benchmarks/captured.py`), put on paths on which two bodies come up
to each other. A question is the poses and places of actors near a moment of some clip. "whole" asks a table of a row a clip with
these actors first; its cells take about two actors of three in each role. The first way and the last find equal costs, which is
checked first; they take turns.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

import contextdb as cdb
from benchmarks import captured, timing
from benchmarks.sections import print_aligned
from contextdb.motion import JointDatabase, JointSearcher, MotionDatabase
from contextdb.motion.joint.hit import JointHit

ROLES = ("Tackler", "Carrier", "Judge")
POSITIONS = ("back", "middle", "front")
SIZES = ((2, 200, 6), (2, 200, 22), (2, 1000, 6), (3, 200, 6))
"""Roles, clips and actors."""
N_FRAMES, RATE = 90, 30.0
N_ROUNDS = 6
BAR_MS = 2.0

Way: TypeAlias = Callable[["Question"], float]


@dataclass(frozen=True, eq=False)
class Question:
    """The poses, places and positions of some actors."""

    queries: dict[int, NDArray[np.float64]]
    places: dict[int, tuple[float, float, float]]
    actors: list[dict[str, Any]]


def joint_of(n_roles: int, n_clips: int, rng: np.random.Generator) -> JointDatabase:
    """Pieces of captured motion, on paths that meet."""
    frames = captured.load()
    n_pieces = n_roles * n_clips
    while sum((frames.stops - frames.starts) // N_FRAMES) < n_pieces:
        frames = frames.copies(2)
    whole = zip(frames.starts.tolist(), frames.stops.tolist(), strict=True)
    firsts = [i for start, stop in whole for i in range(start, stop - N_FRAMES + 1, N_FRAMES)]
    picked = rng.choice(firsts, n_pieces, replace=False)
    features = np.concatenate([frames.features[first : first + N_FRAMES] for first in picked])
    starts = np.arange(n_pieces) * N_FRAMES
    names = [f"tackle_{i // n_roles}.{ROLES[i % n_roles]}" for i in range(n_pieces)]
    database = MotionDatabase.from_features(features, starts, starts + N_FRAMES, names)
    root = np.concatenate([_path(i % n_roles, rng) for i in range(n_pieces)]).astype(np.float32)
    return JointDatabase.of(replace(database, root=root), ROLES[:n_roles])


def _path(role: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """The path of a role, from some metres away to the middle: [N_FRAMES, 3]."""
    angle = role * 2.5 + rng.normal(0.0, 0.4)
    away = np.linspace(rng.uniform(2.0, 6.0), 0.5, N_FRAMES)
    return np.column_stack((away * np.sin(angle), away * np.cos(angle), np.full(N_FRAMES, angle + np.pi)))


def question_of(joint: JointDatabase, n_actors: int, rng: np.random.Generator) -> Question:
    """Actors about as in a moment of some clip."""
    at = int(rng.integers(len(joint.assets)))
    frames = joint.frames[:, int(joint.firsts[at]) + int(rng.integers(N_FRAMES // 2))]
    assert joint.database.root is not None, "given above"
    queries, places = {}, {}
    for actor in range(n_actors):
        frame = int(frames[actor % len(frames)])
        queries[actor] = joint.database.raw(frame) + rng.normal(0.0, 0.3, joint.database.n_features)
        x, z, heading = (joint.database.root[frame] + rng.normal(0.0, 0.5, 3)).tolist()
        places[actor] = (x, z, heading)
    return Question(queries, places, [{"id": a, "position": str(rng.choice(POSITIONS))} for a in range(n_actors)])


def table_of(joint: JointDatabase) -> cdb.CompiledTable:
    """A row a clip, whose cells take two of three positions for each role."""
    rng = random.Random(0)
    columns = {"Asset Name": list(joint.assets)}
    columns |= {f"{role}.position": [" ".join(rng.sample(POSITIONS, 2)) for _ in joint.assets] for role in joint.roles}
    return cdb.Table.from_columns(
        columns, {name: {"type": "enum", "values": list(POSITIONS)} for name in list(columns)[1:]}
    ).compile()


def measured(n_roles: int, n_clips: int, n_actors: int, n_questions: int) -> dict[str, timing.Summary]:
    """What each way takes."""
    rng = np.random.default_rng(0)
    joint = joint_of(n_roles, n_clips, rng)
    searcher, table = JointSearcher(joint), table_of(joint)

    def whole(asked: Question) -> JointHit:
        return searcher.search(asked.queries, asked.places, valid=table.query({}, actors=dict.fromkeys(joint.roles, asked.actors)))

    ways: dict[str, Way] = {
        "joint search": lambda asked: searcher.search(asked.queries, asked.places).cost,
        "whole: query with actors, and search": lambda asked: whole(asked).cost,
        "the best of each clip and cast": lambda asked: searcher.candidates(asked.queries, asked.places, 1)[0].cost,
    }
    questions = [question_of(joint, n_actors, rng) for _ in range(n_questions)]
    names = list(ways)
    for asked in questions[:3]:
        if ways[names[0]](asked) != ways[names[2]](asked) or not whole(asked):
            raise AssertionError("the ways find other costs")
    rounds: dict[str, list[timing.Nanoseconds]] = {name: [] for name in ways}
    for some in np.array_split(np.arange(n_questions), N_ROUNDS):
        for name, ask in ways.items():
            numbers = some if name != names[2] else some[:1]
            rounds[name].append(timing.timed(ask, [questions[i] for i in numbers]))
    return {name: timing.Summary.of(times) for name, times in rounds.items()}


def main() -> None:
    """Measure every size, print the figures, and write them as JSON when that is asked for."""
    parser = argparse.ArgumentParser(description="Measure the search for clip, frame and cast.")
    parser.add_argument("--quick", action="store_true", help="fewer questions")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions(), "joint": []}
    print(" · ".join(f"{key} {value}" for key, value in (report["machine"] | report["versions"]).items()))
    with timing.one_core(), timing.no_collection():
        for n_roles, n_clips, n_actors in SIZES:
            figures = measured(n_roles, n_clips, n_actors, 12 if options.quick else 60)
            print(f"\n{n_roles} roles x {n_clips:,} clips of {N_FRAMES} frames x {n_actors} actors; ms, median (lowest … highest)")
            print_aligned(
                [(n, f"{s.median_us / 1e3:,.2f}", f"({s.low_us / 1e3:,.2f} … {s.high_us / 1e3:,.2f})") for n, s in figures.items()]
            )
            each = {name: vars(summary) for name, summary in figures.items()}
            report["joint"].append({"roles": n_roles, "clips": n_clips, "actors": n_actors, "ways": each})
    first = report["joint"][0]["ways"]["joint search"]["median_us"] / 1e3
    print(f"\nthe bar of {BAR_MS:g} ms for {SIZES[0][0]} x {SIZES[0][1]} x {SIZES[0][2]}: {'met' if first < BAR_MS else 'missed'}")
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
