"""Make FBX files as Mixamo gives them, from clips made by formulas: to try docs/mixamo.md without an account there.

    python examples/mixamo/make_clips.py game/clips

Bones are named "mixamorig:…", the unit is a centimetre, and the one take is called "mixamo.com". Walking and Running are on the
spot, as with "In Place" ticked.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from contextdb import motion

sys.path.insert(0, str(Path(__file__).parents[2]))
from examples.mixamo.ascii_fbx import Moving, fbx

CLIPS = {
    "Idle": "idle",
    "Walking": "walk",
    "Running": "run",
    "Left Turn": "walk_turn_left_90",
    "Right Turn": "walk_turn_right_90",
    "Start Walking": "start_walk",
    "Stop Walking": "stop_walk",
}
IN_PLACE = ("Walking", "Running")
NAMES = {"Chest": "Spine1", "LeftToe": "LeftToeBase", "RightToe": "RightToeBase"}


def main(folder: Path) -> None:
    """Write the files into a folder."""
    made = folder / "made"
    folder.mkdir(parents=True, exist_ok=True)
    made.mkdir()
    motion.write_made_clips(made)
    for name, recipe in CLIPS.items():
        body = Moving.of(motion.load_bvh(made / f"{recipe}.bvh"))
        body = replace(body, names=tuple(f"mixamorig:{NAMES.get(each, each)}" for each in body.names))
        body = in_place(body) if name in IN_PLACE else body
        (folder / f"{name}.fbx").write_bytes(fbx(body, takes=("mixamo.com",)))
    for file in made.iterdir():
        file.unlink()
    made.rmdir()


def in_place(body: Moving) -> Moving:
    """The same without its way over the ground, which is straight."""
    way = np.linspace(0.0, 1.0, len(body.root))[:, None] * (body.root[-1] - body.root[0]) * [1.0, 0.0, 1.0]
    return replace(body, root=body.root - way)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
