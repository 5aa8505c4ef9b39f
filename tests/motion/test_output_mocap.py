"""Pose banks of captured clips, whose rigs have axes of their own; see `test_mocap`."""

import math

import numpy as np
import pytest
from strategies import in_full_runs
from test_mocap import listed, load, pytestmark
from test_output_bank import placed

from contextdb.motion import (
    Action,
    Controller,
    Entry,
    FeatureSchema,
    MotionDatabase,
    PoseBank,
    PoseSettings,
    PoseStream,
    Selector,
    Steered,
    mirrored,
    poses_of,
    with_path,
)
from contextdb.motion.clips.mirror import unevenness
from contextdb.motion.clips.skeleton import sided_pairs
from contextdb.motion.clips.steering import steered_path
from contextdb.motion.output.legs import leg_of

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


@in_full_runs
def test_a_steered_character_on_captured_clips_hardly_pops_and_slides_far_less_than_where_it_cuts():
    walks = [load(row) for row in listed() if row["asset"].startswith("bandai") and row["content"] in ("walk", "run")][:16]
    schema = FeatureSchema.from_dict("loco", {"rate": 30.0, "facing_smooth_s": 0.2, "channels": CHANNELS})
    bank, decided = PoseBank.build(walks, schema), steered(MotionDatabase.build(walks, schema), schema)
    off = PoseSettings(blend="none", path_alignment=False, min_stride=1.0, max_stride=1.0, foot_lock=False)
    cut, whole = (shown(bank, settings, decided) for settings in (off, PoseSettings()))
    clips = [shown_clip(bank, number) for number in range(len(bank.assets))]
    limit = np.quantile(np.concatenate([accelerations(positions).max(axis=1) for positions in clips]), 0.999)
    most = [accelerations(positions).max(axis=1) for positions, _ in (cut, whole)]
    n_jumps = sum(decision.action is Action.JUMP for decision, _, _ in decided)
    assert (most[0] > limit).sum() > 0.5 * n_jumps > 5
    assert (most[1] > limit).mean() < 0.01  # where it jumps twice within a tenth of a second
    assert most[1].max() < 1.5 * limit
    assert skate(bank, *whole) < 0.25 * skate(bank, *cut)


CHANNELS = [
    {"type": "position", "bone": "Foot_L"},
    {"type": "position", "bone": "Foot_R"},
    {"type": "velocity", "bone": "Hips"},
    {"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0]},
    {"type": "trajectory", "what": "direction", "at": [0.5, 1.0]},
]
STEP = 1.0 / 30.0


def steered(database, schema):
    """Twenty seconds of a character that turns every five."""
    controller, body, pose = Controller(Selector([Entry("loco", database)])), Steered(), database.raw(0)
    past, found = [body], []
    for tick in range(600):
        angle = 1.57 * (tick // 150)
        stick = (1.2 * math.sin(angle), 1.2 * math.cos(angle))
        dt = STEP if tick else 0.0
        body = body.moved(dt, stick)
        past = [*past, body][-31:]
        ahead = controller.upcoming(dt)
        pose = pose if ahead is None else database.raw(ahead.frame)
        found.append((controller.update(dt, with_path(schema, pose, steered_path(past, stick))), dt, body))
    return found


def shown(bank, settings, decided):
    stream = PoseStream(bank, settings)
    poses = [stream.update(*each) for each in decided]
    return np.array([pose.positions for pose in poses]), np.array([pose.contacts for pose in poses])


def shown_clip(bank, number):
    """A clip's positions where the clip has them."""
    n = int(bank.stops[number] - bank.starts[number])
    return np.array([placed(bank, number, frame / bank.rate)[0] for frame in range(n)])


def accelerations(positions):
    return np.linalg.norm(np.diff(positions, n=2, axis=0), axis=-1) / STEP**2


def skate(bank, positions, contacts):
    """Metres a second of toes while their feet are down in the clip."""
    toes = [leg_of(bank.skeleton, foot).toe for foot in bank.feet]
    moved = np.linalg.norm(np.diff(positions[:, toes][..., [0, 2]], axis=0), axis=-1)
    return float(moved[contacts[1:] & contacts[:-1]].mean() / STEP)
