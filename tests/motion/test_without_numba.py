"""Where numba is missing the same loops run as they are: every number of every pose is the same."""

from __future__ import annotations

import subprocess
import sys

import pytest

SCRIPT = """
import hashlib, math, sys
if sys.argv[1] == "without":
    sys.modules["numba"] = None
from contextdb import motion
schema = motion.FeatureSchema.from_dict("loco", {"rate": 30.0, "channels": [
    {"type": "position", "bone": "LeftFoot"}, {"type": "velocity", "bone": "Hips"},
    {"type": "trajectory", "what": "position", "at": [0.33, 0.67]}]})
clips = [made.clip for made in motion.made_clips()][:8]
selector = motion.Selector([motion.Entry("loco", motion.MotionDatabase.build(clips, schema))])
bank, told = motion.PoseBank.build(clips, schema), hashlib.sha256()
for settings in (motion.PoseSettings(), motion.PoseSettings(root="path", blend="dead")):
    stream = motion.PoseStream(bank, settings)
    first = motion.Character(motion.Controller(selector), schema, None, stream)
    crowd = motion.Crowd([first.copy() for _ in range(9)])
    n_jumps = 0
    for tick in range(24):
        way = 2.1 * (tick // 8)
        moved = crowd.update(1.0 / 30.0, [(0.5 * i * math.sin(way), 0.5 * i * math.cos(way)) for i in range(9)])
        for one in moved:
            n_jumps += one.decision.action is motion.Action.JUMP
            for numbers in (one.pose.rotations, one.pose.positions, one.pose.root):
                told.update(repr([float(x) for row in numbers for x in (row if hasattr(row, "__len__") else [row])]).encode())
    assert n_jumps
print(told.hexdigest())
"""


def test_poses_are_the_same_to_the_last_bit_without_numba() -> None:
    pytest.importorskip("numba")
    answers = [subprocess.run([sys.executable, "-c", SCRIPT, how], capture_output=True, text=True) for how in ("with", "without")]
    assert [each.stderr for each in answers] == ["", ""]
    assert answers[0].stdout == answers[1].stdout
