"""What a frame of the playground costs: two characters, a vault gate, a contested ball, and the link on.

    python benchmarks/playground.py             a minute of the game in each state
    python benchmarks/playground.py --quick     ten seconds
    python benchmarks/playground.py --json FILE the same figures for programs

The listener is in another process. "saved" is with a listener too, and somebody saves the table every second; the file is read and
compiled in the frame. The first second is left out. "CPU" is the time for which the game's thread was running: what a frame takes
on a machine that does nothing else. A frame at 60 a second has 16.7 ms.
"""

from __future__ import annotations

import argparse
import gc
import json
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

import numpy as np

from benchmarks import timing
from benchmarks.live_link import Other
from benchmarks.sections import print_aligned
from contextdb.motion import write_made_clips
from contextdb.telemetry.link import doors
from examples.playground.__main__ import RATE, TABLES
from examples.playground.game import Game
from examples.playground.stick import REST, Stick

STATES = ("no link", "off", "on", "saved")
STICKS = (
    (1.0, REST),
    (2.0, Stick(0.0, 1.0)),
    (2.0, Stick(1.0, 0.0)),
    (3.0, Stick(0.0, -1.0, run=True)),
    (2.0, Stick(-1.0, 0.0, strafe=True)),
    (3.0, Stick(0.0, 1.0, run=True)),
)


def stick_at(time_s: float) -> Stick:
    """The player's stick, the same again and again."""
    left_s = time_s % sum(seconds for seconds, _ in STICKS)
    for seconds, stick in STICKS:
        if left_s < seconds:
            return stick
        left_s -= seconds
    return REST


def frames(game: Game, seconds: float, saved: Path | None) -> timing.Nanoseconds:
    """What each frame of the game took, and how much of that its thread was running: [frames, 2]."""
    taken, texts = [], [] if saved is None else [saved.read_text(encoding="utf-8")]
    if texts:
        texts.append(texts[0].replace("0.9..1.7", "0.9..1.6"))
    n_first = round(RATE)
    for frame in range(n_first + round(seconds * RATE)):
        if saved is not None and frame % n_first == 0:
            saved.write_text(texts[frame // n_first % 2], encoding="utf-8")
        stick = stick_at(frame / RATE)
        start, ran = time.perf_counter_ns(), time.thread_time_ns()
        game.update(1.0 / RATE, stick)
        if frame >= n_first:
            taken.append((time.perf_counter_ns() - start, time.thread_time_ns() - ran))
        time.sleep(0.001)  # the link's thread has its turn where a game waits for the screen
    return np.array(taken, np.int64)


def measure(folder: Path, seconds: float) -> dict[str, Any]:
    """Frames in every state."""
    found = {}
    for state in STATES:
        with Game(folder, None if state == "no link" else "benchmark", settle_s=0.0) as game:
            other = None
            if game.link is not None:
                other = Other(dict(doors.doors())[game.link.name])
                other.be("off" if state == "off" else "on", game.link)
            gc.collect()
            taken = frames(game, seconds, folder / "moves.csv" if state == "saved" else None) / 1e6
            if other is not None:
                other.end()
            n_versions = game.watch.snapshot().number
        found[state] = {
            "median_ms": np.median(taken, axis=0).tolist(),
            "p99_ms": np.percentile(taken, 99, axis=0).tolist(),
            "longest_ms": taken.max(axis=0).tolist(),
            "frames": len(taken),
            "versions": n_versions,
        }
    return found


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description="Measure what a frame of the playground costs.")
    parser.add_argument("--quick", action="store_true", help="ten seconds of the game, for a rough look")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    print(" · ".join(f"{key} {value}" for key, value in report["machine"].items()))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "tables"
        shutil.copytree(TABLES, folder, ignore=shutil.ignore_patterns("*.bvh", ".contextdb-cache"))
        write_made_clips(folder / "clips", of_game=True)
        report["playground"] = found = measure(folder, 10.0 if options.quick else 60.0)
    print("\nA frame of two characters; milliseconds\n")
    heads = [f"{name}{of}" for of in ("", " CPU") for name in ("median", "99 %", "longest")]
    lines: list[tuple[str, ...]] = [("state", *heads, "frames", "versions")]
    for state, one in found.items():
        figures = [f"{one[name][i]:.2f}" for i in (0, 1) for name in ("median_ms", "p99_ms", "longest_ms")]
        lines.append((state, *figures, f"{one['frames']:,}", str(one["versions"])))
    print_aligned(lines)
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
