"""Captured clips of others: every one is read, and its hips move as the list of the clips says.

The clips are not part of this project. Set CONTEXTDB_MOCAP to a folder with `assets.csv` and the BVH files it lists.
"""

import csv
import os
from pathlib import Path

import numpy as np
import pytest
from strategies import some

from contextdb.motion import FeatureSchema, MotionDatabase, load_bvh, poses_of

BESIDE = Path(__file__).parents[2].parent / "shared" / "data" / "mocap"
FOLDER = Path(os.environ.get("CONTEXTDB_MOCAP", BESIDE))
pytestmark = pytest.mark.skipif(
    not (FOLDER / "assets.csv").is_file(), reason="no captured clips: set CONTEXTDB_MOCAP to their folder"
)

UNITS = {"cmu/131": 0.056444}
"""Metres per unit of the clips that are not in centimetres."""


def listed():
    with (FOLDER / "assets.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def load(row):
    unit = next((unit for start, unit in UNITS.items() if row["asset"].startswith(start)), 0.01)
    return load_bvh(FOLDER / row["asset"], metres_per_unit=unit)


def test_every_captured_clip_is_read_and_moves_as_fast_as_listed():
    assert len(listed()) == len(list(FOLDER.glob("*/*.bvh")))
    for row in some(listed(), 4):
        clip = load(row)
        assert (clip.n_frames, round(clip.rate)) == (int(row["frames"]), int(row["fps"])), row["asset"]
        hips = poses_of(clip).positions[:, clip.skeleton.hips][:, [0, 2]]
        speed = np.linalg.norm(np.diff(hips, axis=0), axis=1).mean() * clip.rate
        assert speed == pytest.approx(float(row["mean_speed_mps"]), abs=0.01), row["asset"]


def test_captured_walks_face_where_they_go_and_have_their_left_hand_on_the_left():
    channels = [
        {"type": "trajectory", "what": "velocity", "at": 0},
        {"type": "position", "bone": "Hand_L"},
        {"type": "position", "bone": "Hand_R"},
    ]
    schema = FeatureSchema.from_dict("walk", {"rate": 30.0, "channels": channels})
    rows = [row for row in listed() if row["asset"].startswith("bandai") and row["content"] in ("walk", "run")]
    database = MotionDatabase.build(map(load, rows), schema)
    for start, stop, asset in zip(database.starts, database.stops, database.assets, strict=True):
        left, ahead, left_hand, _, _, right_hand, _, _ = database.normalisation.undo(database.features[start:stop]).mean(axis=0)
        assert abs(left) < 0.4 * ahead, asset
        assert left_hand > right_hand + 0.1, asset


def test_a_captured_frame_is_found_by_its_own_features():
    channels = [{"type": "position", "bone": "Foot_L"}, {"type": "velocity", "bone": "Hips"}]
    channels += [
        {"type": "trajectory", "what": "position", "at": [-0.33, 0.33, 1.0]},
        {"type": "trajectory", "what": "direction", "along": [1.0]},
    ]
    schema = FeatureSchema.from_dict("walk", {"rate": 30.0, "channels": channels})
    database = MotionDatabase.build([load(row) for row in listed() if row["asset"].startswith("bandai")][::6], schema)
    for i in range(len(database.assets)):
        frame = int(database.starts[i] + database.stops[i]) // 2
        assert database.search(database.raw(frame)).frame == frame
