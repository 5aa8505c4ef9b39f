"""The clips of the game: the project's made clips, and a few more that are bent out of these. Nothing here is captured.

Those that a table and a search choose among are in `clips/`, those that play once and end at a target in `clips/once/`.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from contextdb import motion
from contextdb.errors import Fault, FileError, Place

Bump = tuple[str, str, float, float, float]
"""A joint, its channel, from when to when in seconds, and by how much in between, in centimetres or degrees."""

SIDEWAYS = ("walk", "jog")
"""Made clips that are there once more for who strafes: hips and legs turn to the way, see `path_alignment` of `[output.NAME]`."""
BACKWARDS = ("walk", "jog")
"""Made clips that are there once more, played from their end."""
HANDS_UP: list[Bump] = [(f"{side}Arm", "Xrotation", 0.1, 1.2, -160.0) for side in ("Left", "Right")]
LEGS_UP: list[Bump] = [
    (f"{side}{joint}", "Xrotation", 0.85, 1.65, bend)
    for side in ("Left", "Right")
    for joint, bend in (("UpLeg", -75.0), ("Leg", 95.0), ("Arm", -35.0))
]
ONCE: dict[str, tuple[str, float, list[Bump]]] = {
    "vault_run": ("run", 2.4, [("Hips", "Yposition", 0.8, 1.7, 72.0), ("Chest", "Xrotation", 0.6, 1.6, 25.0), *LEGS_UP]),
    "vault_walk": ("walk_fast", 2.6, [("Hips", "Yposition", 0.7, 1.9, 74.0), ("Chest", "Xrotation", 0.5, 1.8, 35.0), *LEGS_UP]),
    "catch_contested": ("idle", 1.5, [("Hips", "Yposition", 0.3, 0.95, 45.0), *HANDS_UP]),
    "catch_high": ("idle", 1.5, [("Hips", "Yposition", 0.35, 0.9, 28.0), *HANDS_UP]),
    "catch_miss": ("idle", 1.5, [("Chest", "Xrotation", 0.3, 1.4, 35.0), *HANDS_UP[:1], ("Hips", "Yposition", 0.3, 1.2, -9.0)]),
}
"""Of each clip that plays once the made clip it is bent out of, how long it is, and the bumps."""


def write_clips(folder: Path) -> None:
    """Write all clips below a folder, unless they are there."""
    once = folder / "once"
    if once.is_dir() and len(list(once.glob("*.bvh"))) == len(ONCE):
        return
    once.mkdir(parents=True, exist_ok=True)
    motion.write_made_clips(folder)
    for name in SIDEWAYS:
        motion.write_bvh(motion.make_clip(name).clip, folder / f"{name}_strafe.bvh")
    for name in BACKWARDS:
        clip = motion.make_clip(name).clip
        motion.write_bvh(replace(clip, values=clip.values[::-1].copy()), folder / f"{name}_back.bvh")
    for name, (base, seconds, bumps) in ONCE.items():
        motion.write_bvh(bent(name, base, seconds, bumps), once / f"{name}.bvh")


def bent(name: str, base: str, seconds: float, bumps: list[Bump]) -> motion.Clip:
    """A made clip with some of its channels raised for a while."""
    clip = motion.make_clip(base).clip
    values = clip.values[: round(seconds / clip.frame_time_s) + 1].copy()
    times_s = np.arange(len(values)) * clip.frame_time_s
    columns = [(joint, channel) for joint, has in zip(clip.skeleton.names, clip.skeleton.channels, strict=True) for channel in has]
    for joint, channel, from_s, to_s, amount in bumps:
        share = np.clip((times_s - from_s) / (to_s - from_s), 0.0, 1.0)
        values[:, columns.index((joint, channel))] += amount * np.sin(np.pi * share) ** 2
    return replace(clip, name=name, values=values)


def project_of_clips(clips: Path, folder: Path) -> None:
    """Make a project of any folder of BVH clips, with the table that `contextdb motion describe` makes of them."""
    found = sorted(clips.glob("*.bvh"))
    if not found:
        raise FileError(Fault("there is no BVH clip.", "a folder with files *.bvh", place=Place(str(clips))))
    (folder / "clips").mkdir(parents=True, exist_ok=True)
    for path in found:
        shutil.copyfile(path, folder / "clips" / path.name)
    words = [sys.executable, "-m", "contextdb", "motion", "describe", str(folder / "clips"), "--out", str(folder / "moves.csv")]
    subprocess.run(words, check=True)
