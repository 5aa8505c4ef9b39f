"""How long it takes to make a table and markup of clips.

    python benchmarks/prepare.py          all captured clips; made ones without CONTEXTDB_MOCAP

The clips are read once for each command, as the commands do. Each time is the median of three, with the lowest and the highest.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

from benchmarks import captured, timing
from contextdb import motion
from contextdb.motion.made.recipes import made_clips
from contextdb.motion.preparing.proposal import KINDS

REPEATS = 3


def main() -> None:
    """Measure and print."""
    clips = captured.clips() or [made.clip for made in made_clips()]
    print(f"{timing.machine()}\n{timing.versions()}")
    seconds = sum(clip.duration_s for clip in clips)
    print(f"{len(clips)} clips, {seconds:.0f} s of movement; median (lowest, highest) of {REPEATS}")
    works: dict[str, Callable[[], object]] = {
        "read": captured.clips,
        "describe": lambda: motion.describe(clips),
        "prepare": lambda: motion.prepare(clips),
        "prepare without cuts": lambda: motion.prepare(clips, kinds=[kind for kind in KINDS if kind != "cuts"]),
    }
    for name, work in works.items():
        took = timing.seconds(work, REPEATS)
        print(f"{name:<22}{took.median_us / 1e6:8.2f} s  ({took.low_us / 1e6:.2f}, {took.high_us / 1e6:.2f})")


if __name__ == "__main__":
    main()
