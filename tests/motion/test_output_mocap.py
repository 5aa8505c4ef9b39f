"""Pose banks of captured clips, whose rigs have axes of their own; see `test_mocap`."""

from __future__ import annotations

import numpy as np
import pytest
from test_mocap import listed, load, pytestmark
from test_output_bank import placed

from contextdb.motion import FeatureSchema, PoseBank, mirrored, poses_of
from contextdb.motion.clips.mirror import unevenness
from contextdb.motion.clips.skeleton import sided_pairs

__all__ = ["pytestmark"]
SETS = {"bandai": 30.0, "cmu": 60.0}


@pytest.mark.parametrize("name", SETS)
def test_captured_poses_are_the_clips_and_in_a_mirror_what_the_mirror_shows_on_an_even_rig(name):
    captured = [load(row) for row in listed() if row["asset"].startswith(name)][:6:2]
    pairs = tuple(sided_pairs(captured[0].skeleton.names))
    channel = {"type": "position", "bone": captured[0].skeleton.names[1]}
    rate = SETS[name]
    keys = {"rate": rate, "channels": [channel], "mirror": [list(pair) for pair in pairs]}
    rig = captured[0].skeleton
    same = [clip for clip in captured if np.allclose(clip.skeleton.offsets, rig.offsets) and clip.skeleton.names == rig.names]
    bank = PoseBank.build(same, FeatureSchema.from_dict("walk", keys), mirror=True)
    below = [joint for joint in range(rig.n_joints) if joint not in rig.ancestors(rig.hips)]
    uneven = sum(unevenness(rig, pairs).values()) * same[0].metres_per_unit
    for clip in same:
        poses = poses_of(clip, rate)
        for side, wanted, near in ((False, poses, 1e-5), (True, mirrored(poses, pairs), 1e-5 + uneven)):
            for frame in range(0, poses.n_frames, max(1, poses.n_frames // 9)):
                found = placed(bank, bank.range_of(clip.name, side), frame / rate)[0]
                np.testing.assert_allclose(found[below], wanted.positions[frame, below], atol=near)
