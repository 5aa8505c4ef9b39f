"""A character over a line: what its owner sends, and how far from it a copy is that hears late and not all.

    python benchmarks/network.py                 0 to 200 ms of delay, 0 to 10 % of loss
    python benchmarks/network.py --quick         one minute each, in place of five
    python benchmarks/network.py --json FILE     the same figures for programs

The owner sends a packet after each update. The copy plays a delay later: by then what was not lost has arrived, and it is compared
with what its owner showed at that tick. The body is the game's, and arrives. A pop is a frame in which
a joint is accelerated by 60 m/s2 more than any of the owner's.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import tomllib
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)

from benchmarks import timing
from benchmarks.sections import print_aligned
from contextdb import motion
from contextdb.motion.made.recipes import made_clips

TABLES = Path(__file__).parent.parent / "tables"
HZ = 60
DELAYS_MS, LOSSES = (0, 50, 100, 200), (0.0, 0.01, 0.05, 0.1)
POP_MPS2 = 60.0
APART_M = 0.02
FORMS = {
    "delay_ms": "{:.0f}",
    "loss": "{:.0%}",
    "bytes_per_s": "{:.0f}",
    "mean_cm": "{:.2f}",
    "p99_cm": "{:.1f}",
    "longest_apart_s": "{:.2f}",
    "pops_per_min": "{:.1f}",
    "equal_share": "{:.1%}",
}
STICKS = [(0.0, 0.0), (0.0, 1.2), (1.2, 0.0), (0.0, 2.8), (-2.0, 2.0)]


def made() -> motion.Character:
    """A character of the made clips, all of which may play."""
    config = motion.MotionConfig.from_dict(tomllib.loads((TABLES / "contextdb.toml").read_text(encoding="utf-8")))
    schema, clips = config.features["loco"], [each.clip for each in made_clips()]
    selector = motion.Selector([motion.Entry("made", motion.MotionDatabase.build(clips, schema))])
    return motion.Character(motion.Controller(selector), schema, None, motion.PoseStream(motion.PoseBank.build(clips, schema)))


def session(first: motion.Character, delay_ms: float, loss: float, seconds: float) -> dict[str, float]:
    """The figures of one line."""
    rng, owner, copy = random.Random(1), first.copy(), first.copy()
    line: deque[tuple[Any, ...]] = deque()
    sent, apart, jumps, worst_s, since_s = 0, list[float](), 0, 0.0, 0.0
    stick = STICKS[0]
    own_positions, other_positions = deque[np.ndarray](maxlen=3), deque[np.ndarray](maxlen=3)
    for tick in range(int(seconds * HZ)):
        if tick % 45 == 0:
            stick = rng.choice(STICKS)
        own = owner.update(1 / HZ, stick)
        data = owner.pack()
        sent += len(data)
        line.append((b"" if rng.random() < loss else data, stick, own.body, own.pose))
        if len(line) <= delay_ms * HZ / 1000:
            continue
        data, then, body, shown = line.popleft()
        pose = copy.unpack(data, 1 / HZ, then, body=body).pose
        assert pose is not None, "it has a stream"
        off = float(np.linalg.norm(shown.positions - pose.positions, axis=1).max())
        apart.append(off)
        since_s = since_s + 1 / HZ if off > APART_M else 0.0
        worst_s = max(worst_s, since_s)
        own_positions.append(shown.positions)
        other_positions.append(pose.positions)
        if len(own_positions) == 3:
            jumps += _change(other_positions) - _change(own_positions) > POP_MPS2
    n = len(apart)
    return {
        "delay_ms": delay_ms,
        "loss": loss,
        "bytes_per_s": sent / seconds,
        "mean_cm": 100 * sum(apart) / n,
        "p99_cm": 100 * float(np.quantile(apart, 0.99)),
        "longest_apart_s": worst_s,
        "pops_per_min": jumps * 60 / seconds,
        "equal_share": sum(off == 0.0 for off in apart) / n,
    }


def _change(positions: deque[np.ndarray]) -> float:
    """The largest acceleration of a joint in three frames."""
    first, second, third = positions
    return float(np.linalg.norm(third - 2 * second + first, axis=1).max()) * HZ * HZ


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="one minute each, in place of five")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    arguments = parser.parse_args()
    print(" · ".join(f"{key} {value}" for key, value in (timing.machine() | timing.versions()).items()))
    first = made()
    figures = [session(first, delay, loss, 60 if arguments.quick else 300) for delay in DELAYS_MS for loss in LOSSES]
    print(f"\none character over a line, {HZ} updates a second")
    lines: list[tuple[str, ...]] = [
        ("delay ms", "loss", "bytes/s", "apart cm", "p99 cm", "longest over 2 cm, s", "pops/min", "equal to the bit")
    ]
    for each in figures:
        lines.append(tuple(form.format(each[name]) for name, form in FORMS.items()))
    print_aligned(lines)
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
