"""What an update of a character takes from Python with everything on: microseconds of one core.

    python benchmarks/updates.py                      one character, and each of a thousand
    python benchmarks/updates.py --against CHECKOUT   beside another checkout of contextdb, in turn

The captured clips of one rig, or made ones, are in five databases that share one table of four conditions; two of their facts the
character gives itself. It searches every 0.1 s, stands on a slope and gives poses. A figure is the median of rounds of ten updates
at 30 a second. The two checkouts must decide the same.

The captured clips are not part of this project: the environment variable CONTEXTDB_MOCAP names their folder.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

HERE = Path(__file__).parents[1]
if __package__ in (None, ""):
    sys.path[0] = str(HERE if sys.argv[1:2] != ["worker"] else Path(sys.argv[2]))

import numpy as np  # noqa: E402  (behind the checkout whose benchmarks and contextdb are measured)

RATE, ROUNDS, CROWD = 30.0, 40, 1000
KINDS = {
    "back": ("walk-back",),
    "sides": ("walk-left", "walk-right"),
    "turns": ("walk-turn",),
    "runs": ("dash", "run", "jog"),
    "walks": ("",),
}
"""The databases, and how the names of their clips go on behind the set; the first that fits has a clip."""
GAITS = {
    "runs": ("Run", ">=1.5"),
    "walks": ("Any", "Any"),
    "back": ("Walk", "<=3"),
    "sides": ("Walk", "<=3"),
    "turns": ("Walk", "Any"),
}


def main() -> None:
    """Measure this checkout, and another one in turn."""
    parser = argparse.ArgumentParser(description="Measure updates of characters.")
    parser.add_argument("--against", type=Path, metavar="CHECKOUT", help="another checkout, measured in turn")
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    options = parser.parse_args()
    checkouts = [HERE, *([options.against] if options.against else [])]
    workers = [_started(checkout) for checkout in checkouts]
    print(workers[0].stdout.readline().strip(), *(worker.stdout.readline().strip()[:0] for worker in workers[1:]))
    for n in (1, CROWD):
        rounds = [[_round(worker, n) for worker in workers] for _ in range(options.rounds if n == 1 else options.rounds // 4)]
        if any(len({digest for _, digest in each}) > 1 for each in rounds):
            raise SystemExit("the checkouts do not decide the same.")
        for k, checkout in enumerate(checkouts):
            us = [each[k][0] for each in rounds[2:]]
            print(f"{'one' if n == 1 else f'each of {n:,}':14} {statistics.median(us):7.1f}  least {min(us):.1f}   {checkout.name}")
    for worker in workers:
        worker.kill()


def _started(checkout: Path) -> Any:
    words = [sys.executable, __file__, "worker", str(checkout)]
    from benchmarks.captured import FOLDER

    where = os.environ | {"CONTEXTDB_MOCAP": str(FOLDER)}
    return subprocess.Popen(words, env=where, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)


def _round(worker: Any, n: int) -> tuple[float, str]:
    worker.stdin.write(f"{n}\n")
    us, digest = worker.stdout.readline().split()
    return float(us), digest


# ---- what is measured


def work() -> None:
    """Update as many characters as each line says, and write what each update of one took, and what they did."""
    character = character_of()
    print(f"{sum(len(each.assets) for each in character.controller.selector.databases.values())} ranges", flush=True)
    running: dict[int, Iterator[tuple[float, str]]] = {}
    for line in sys.stdin:
        n = int(line)
        if n not in running:
            running[n] = rounds_of(character, n)
        us, digest = next(running[n])
        print(us, digest, flush=True)


def character_of() -> Any:
    """A character with everything on."""
    from contextdb import motion

    controller, schema, table, banks = parts_of()
    return motion.Character(controller, schema, table, motion.PoseStream(banks), ground=slope)


def parts_of(n_copies: int = 1) -> tuple[Any, Any, Any, Any]:
    """Its controller, features, table and poses, of each clip and copies of it."""
    from benchmarks import captured
    from contextdb import Table, motion
    from contextdb.motion.made.recipes import made_clips

    clips = {path.stem: path for path in sorted(captured.FOLDER.glob("bandai_namco/*.bvh"))}
    loaded = [motion.load_bvh(path) for path in clips.values()] or [made.clip for made in made_clips()]
    loaded += [replace(clip, name=f"{clip.name}_{n}") for n in range(1, n_copies) for clip in loaded]
    feet = ("Foot_L", "Foot_R") if clips else ("LeftFoot", "RightFoot")
    channels = [
        *({"type": "position", "bone": foot, "weight": 0.75} for foot in feet),
        *({"type": "velocity", "bone": bone} for bone in (*feet, "Hips")),
        {"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0]},
        {"type": "trajectory", "what": "direction", "at": [0.33, 0.67, 1.0], "weight": 1.5},
    ]
    schema = motion.FeatureSchema.from_dict("loco", {"rate": RATE, "channels": channels})
    kinds = {clip.name: _kind(clip.name) for clip in loaded}
    groups = {kind: [clip for clip in loaded if kinds[clip.name] == kind] for kind in KINDS}
    databases = {kind: motion.MotionDatabase.build(own, schema, end_s=0.3) for kind, own in groups.items() if own}
    banks = dict.fromkeys(databases, motion.PoseBank.build(loaded, schema))
    columns = {
        "Asset": list(kinds),
        "gait": [GAITS[kind][0] for kind in kinds.values()],
        "speed": [GAITS[kind][1] for kind in kinds.values()],
        "direction": ["Any" if kind in ("runs", "walks") else "0, 170" for kind in kinds.values()],
        "armed": ["Any"] * len(kinds),
    }
    conditions: dict[str, Any] = {
        "gait": {"type": "enum", "values": ["Walk", "Run"]},
        "speed": {"type": "number", "unit": "m/s"},
        "direction": {"type": "angle"},
        "armed": {"type": "bool"},
    }
    table = Table.from_columns(columns, conditions).compile()
    selector = motion.Selector([motion.Entry(kind, database) for kind, database in databases.items()])
    controller = motion.Controller(selector, motion.ControllerSettings(search_every_s=0.1))
    return controller, schema, table, banks


def _kind(name: str) -> str:
    what = name.partition("_")[2] if name.startswith("dataset") else name
    return next(kind for kind, starts in KINDS.items() if what.startswith(starts))


def slope(x: float, z: float) -> tuple[float, tuple[float, float, float]]:
    """A hill along z."""
    return 0.1 * z, (0.0, 0.995, -0.0995)


def rounds_of(first: Any, n: int) -> Iterator[tuple[float, str]]:
    """Rounds of ten updates: what one took each character, and what they did."""
    from contextdb import motion

    crowd = motion.Crowd(first.copy() for _ in range(n))
    ways = np.arange(n) % 61 / 10.0
    speeds = 0.8 + np.arange(n) % 29 / 10.0
    facts: dict[str, Any] = {"gait": ["Run" if speed > 2.0 else "Walk" for speed in speeds], "armed": False}
    one = {"gait": facts["gait"][0], "armed": False}
    tick = 0
    while True:
        took = 0.0
        for _ in range(10):
            tick += 1
            turned = ways + 0.5 * (tick // 45)
            sticks = np.column_stack((speeds * np.sin(turned), speeds * np.cos(turned)))
            stick = float(sticks[0, 0]), float(sticks[0, 1])
            began = time.process_time()
            given = [crowd[0].update(1.0 / RATE, stick, one)] if n == 1 else crowd.update(1.0 / RATE, sticks, facts)
            took += time.process_time() - began
        played = [each.decision.playing for each in given]
        roots = math.fsum(each.pose.root[0] for each in given if each.pose is not None)
        digest = f"{sum(0 if each is None else each.frame for each in played)}|{roots!r}"
        yield took / 10 / n * 1e6, digest


if __name__ == "__main__":
    work() if sys.argv[1:2] == ["worker"] else main()
