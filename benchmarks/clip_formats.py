"""How long it takes to read a clip of a minute at 60 frames a second, in each format.

    python benchmarks/clip_formats.py

A walk of 19 joints, again and again; each time is the median of five, with the lowest and the highest. FBX and USD are read by a
process of their own, which is started before.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name
sys.path.append(str(Path(__file__).parent.parent / "tests"))

import numpy as np
from clip_files import BODY, Moving, fbx, gltf, usda

from benchmarks import timing
from contextdb import motion
from contextdb.motion.made.recipes import make_clip

REPEATS = 5
FRAMES = 60 * 60


def main() -> None:
    """Measure and print."""
    body = Moving.of(make_clip("walk").clip)
    at = np.arange(FRAMES) % len(body.root)
    minute = Moving(body.names, body.parents, body.offsets, body.rotations[at], body.root[at], 60.0)
    print(f"{timing.machine()}\n{timing.versions()}")
    with tempfile.TemporaryDirectory() as folder:
        for ending, writer in {".fbx": fbx, ".glb": gltf, ".usda": usda}.items():
            small, large = Path(folder) / f"small{ending}", Path(folder) / f"minute{ending}"
            small.write_bytes(writer(BODY))
            large.write_bytes(writer(minute))
            measure(small, large)
        motion.write_bvh(motion.load_clips([Path(folder) / "minute.glb"])[0], Path(folder) / "minute.bvh")
        measure(Path(folder) / "minute.bvh", Path(folder) / "minute.bvh")


def measure(small: Path, large: Path) -> None:
    """Read one file to begin with, and another some times."""
    motion.load_clips([small])
    took = timing.seconds(lambda: motion.load_clips([large]), REPEATS)
    size = large.stat().st_size / 1e6
    print(f"{large.suffix:<6}{size:6.1f} MB{took.median_us / 1e6:8.2f} s  ({took.low_us / 1e6:.2f}, {took.high_us / 1e6:.2f})")


if __name__ == "__main__":
    main()
