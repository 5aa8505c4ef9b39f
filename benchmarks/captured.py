"""The frames that searches are measured on: all captured clips there are, or made ones, and copies with smooth noise.

N frames, F features, R ranges. The captured clips are not part of this project: the environment variable CONTEXTDB_MOCAP names
their folder, which holds folders of BVH files.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import motion
from contextdb.motion import Clip, FeatureSchema
from contextdb.motion.features.extraction import features_of
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.made.recipes import made_clips

BESIDE = Path(__file__).parents[1].parent / "shared" / "data" / "mocap"
FOLDER = Path(os.environ.get("CONTEXTDB_MOCAP", BESIDE))
UNITS = {"131_": 0.056444}
"""Metres per unit of the clips that are not in centimetres, by the start of their names."""
BONES = {
    "left": ("LeftFoot", "Foot_L", "lfoot", "LeftAnkle"),
    "right": ("RightFoot", "Foot_R", "rfoot", "RightAnkle"),
    "hips": ("Hips", "root"),
}
NOISE, KNOT_S = 0.25, 1.0

Features = NDArray[np.float32]
Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Frames:
    """Features [N, F], normalised and weighted, and the ranges [start, stop) that they are in."""

    name: str
    features: Features
    starts: Numbers
    stops: Numbers

    def copies(self, n: int) -> Frames:
        """The frames and n - 1 copies, each moved by noise that changes smoothly in time."""
        rng = np.random.default_rng(n)
        features = np.concatenate([self.features, *(self._moved(rng) for _ in range(n - 1))])
        shifts = np.repeat(np.arange(n) * len(self.features), len(self.starts))
        name = self.name if n == 1 else f"{self.name} x {n}"
        return Frames(name, features, np.tile(self.starts, n) + shifts, np.tile(self.stops, n) + shifts)

    def _moved(self, rng: np.random.Generator) -> Features:
        moved = self.features.copy()
        for start, stop in zip(self.starts, self.stops, strict=True):
            at = np.arange(stop - start) / (KNOT_S * RATE)
            before = at.astype(np.int64)
            share = at - before
            knots = rng.normal(0.0, NOISE, (int(before[-1]) + 2, moved.shape[1]))
            share = (share * share * (3.0 - 2.0 * share))[:, None]
            moved[start:stop] += (knots[before] * (1.0 - share) + knots[before + 1] * share).astype(np.float32)
        return moved


RATE = 30.0


def load() -> Frames:
    """The 27 features of feet, hips and the way ahead, of every clip there is."""
    found = clips()
    name = "captured clips" if found else "made clips (no captured ones: set CONTEXTDB_MOCAP)"
    found = found or [made.clip for made in made_clips()]
    schemas = [_schema(clip) for clip in found]
    blocks = [features_of(clip, schema) for clip, schema in zip(found, schemas, strict=True)]
    normalisation = Normalisation.of(blocks, schemas[0])
    scale = np.concatenate([np.full(c.n_features, np.sqrt(c.weight)) for c in schemas[0].channels])
    stops = np.cumsum([len(block) for block in blocks])
    starts = stops - [len(block) for block in blocks]
    features = np.concatenate([normalisation.apply(block) * scale for block in blocks]).astype(np.float32)
    return Frames(name, features, starts, stops)


def clips() -> list[Clip]:
    """All captured clips; none where there are none."""
    return list(_captured())


def _captured() -> Iterator[Clip]:
    for path in sorted(FOLDER.glob("*/*.bvh")):
        unit = next((unit for start, unit in UNITS.items() if path.name.startswith(start)), 0.01)
        yield motion.load_bvh(path, metres_per_unit=unit)


def _schema(clip: Clip) -> FeatureSchema:
    left, right, hips = (_bone(clip, BONES[bone]) for bone in ("left", "right", "hips"))
    points = {"type": "trajectory", "at": [0.33, 0.67, 1.0]}
    channels: list[dict[str, Any]] = [
        {"type": "position", "bone": left, "weight": 0.75},
        {"type": "position", "bone": right, "weight": 0.75},
        {"type": "velocity", "bone": left},
        {"type": "velocity", "bone": right},
        {"type": "velocity", "bone": hips},
        points | {"what": "position"},
        points | {"what": "direction", "weight": 1.5},
    ]
    return FeatureSchema.from_dict("loco", {"rate": RATE, "channels": channels})


def _bone(clip: Clip, names: Sequence[str]) -> str:
    return next(name for name in names if name in clip.skeleton)
