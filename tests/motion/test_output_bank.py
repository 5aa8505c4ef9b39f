"""Pose banks: the clips' own poses, between frames, over loops and in a mirror."""

import pickle
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from played import LOOPS, NAMES, RATE, SCHEMA, bank, clips, database

from contextdb.errors import ContextError, MotionError
from contextdb.motion import PoseBank, mirrored, poses_of, resampled
from contextdb.motion.clips.clip import parse_bvh
from contextdb.motion.clips.feet import footfalls
from contextdb.motion.clips.poses import LocalPoses, forward_kinematics, local_poses
from contextdb.motion.clips.quaternions import about_axis, multiply, rotate


def placed(bank, number, time_s):
    """The joints of a moment in the clip's own place, by the forward kinematics of the clips."""
    sample = bank.sample_of(number, time_s)
    x, z, heading = bank.moment_of(number, time_s).root
    local = LocalPoses(bank.skeleton, bank.rate, bank.translations(sample.positions)[None], sample.rotations[None].copy())
    poses = forward_kinematics(local)
    turn = about_axis("y", np.array(heading))
    return rotate(turn, poses.positions[0]) + np.array([x, 0.0, z]), multiply(turn, poses.rotations[0])


@pytest.mark.parametrize("name", NAMES)
def test_every_frame_of_a_bank_is_the_clips_frame(name):
    poses = poses_of(next(clip for clip in clips() if clip.name == name), RATE)
    for frame in range(0, poses.n_frames, 7):
        positions, rotations = placed(bank(), bank().range_of(name), frame / RATE)
        np.testing.assert_allclose(positions, poses.positions[frame], atol=1e-5)
        apart = 1.0 - np.abs((rotations * poses.rotations[frame]).sum(axis=-1))
        assert apart.max() < 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_mirrored_poses_on_the_rigs_own_offsets_are_where_the_mirror_shows_them(name):
    clip = next(clip for clip in clips() if clip.name == name)
    poses = mirrored(poses_of(clip, RATE), SCHEMA.mirror)
    number = bank().range_of(name, True)
    for frame in range(0, poses.n_frames, 11):
        np.testing.assert_allclose(placed(bank(), number, frame / RATE)[0], poses.positions[frame], atol=1e-5)


def test_a_bank_has_the_ranges_the_root_and_the_rate_of_its_database():
    assert (bank().assets, bank().rate) == (database().assets, database().schema.rate)
    np.testing.assert_array_equal(bank().starts, database().starts)
    np.testing.assert_array_equal(bank().stops, database().stops)
    np.testing.assert_array_equal(bank().mirrored, database().mirrored)
    np.testing.assert_array_equal(bank().root, database().root)


def test_clips_at_another_rate_are_resampled_as_the_clips_are():
    schema = replace(SCHEMA, rate=50.0)
    made = PoseBank.build(clips()[:2], schema)
    wanted = forward_kinematics(resampled(local_poses(clips()[1]), 50.0))
    for frame in range(0, wanted.n_frames, 13):
        np.testing.assert_allclose(placed(made, 1, frame / 50.0)[0], wanted.positions[frame], atol=1e-5)


@given(st.floats(0.0, 1.0), st.integers(0, 60))
def test_between_two_frames_a_pose_lies_between_them(share, frame):
    number = bank().range_of("run")
    before, after = (bank().sample_of(number, (frame + i) / RATE) for i in (0, 1))
    middle = bank().sample_of(number, (frame + share) / RATE)
    np.testing.assert_allclose(middle.positions, before.positions + share * (after.positions - before.positions), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(middle.rotations, axis=-1), 1.0, atol=1e-12)
    whole, part = ((np.abs((before.rotations * each.rotations).sum(axis=-1))).clip(0, 1) for each in (after, middle))
    np.testing.assert_allclose(np.arccos(part), share * np.arccos(whole), atol=2e-3)


def test_a_loop_goes_on_at_its_beginning_and_another_clip_holds_its_ends():
    walk, start = bank().range_of("walk"), bank().range_of("start_walk")
    last_s = bank().last_s(walk)
    beyond, again = bank().sample_of(walk, last_s + 0.21), bank().sample_of(walk, 0.21)
    np.testing.assert_allclose(beyond.rotations, again.rotations, atol=1e-9)
    ends = bank().sample_of(start, bank().last_s(start)), bank().sample_of(start, bank().last_s(start) + 1.0)
    np.testing.assert_array_equal(ends[0].rotations, ends[1].rotations)
    np.testing.assert_array_equal(bank().sample_of(start, -1.0).rotations, bank().sample_of(start, 0.0).rotations)


def test_a_planted_foot_is_a_contact_in_the_bank():
    falls = footfalls(next(clip for clip in clips() if clip.name == "walk"))
    number = bank().range_of("walk")
    for foot, name in enumerate(bank().feet):
        middle = float(np.mean(falls.down[name][1]))
        assert bank().contacts_at(number, middle)[foot] == falls.is_down(name, middle) == True  # noqa: E712
        swing = (falls.down[name][1][1] + falls.down[name][2][0]) / 2
        assert not bank().contacts_at(number, float(swing))[foot]


def test_a_skeleton_that_leaves_a_joint_behind_is_played_from_its_hips():
    text = """HIERARCHY
ROOT World
{ OFFSET 0 0 0 CHANNELS 0
 JOINT Hips { OFFSET 0 90 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT LeftUpLeg { OFFSET 9 0 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 -90 0 } }
  JOINT RightUpLeg { OFFSET -9 0 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 -90 0 } }
 }
}
MOTION
Frames: 3
Frame Time: 0.033333
"""
    rows = "".join(f"0 90 {10 * i} 0 0 {5 * i} 0 10 0 0 0 0\n" for i in range(3))
    clip = parse_bvh(
        text.replace("{", "{\n")
        .replace("}", "\n}")
        .replace(" CHANNELS", "\nCHANNELS")
        .replace(" JOINT", "\nJOINT")
        .replace(" End", "\nEnd")
        + rows,
        "ahead",
    )
    made = PoseBank.build([clip], replace(SCHEMA, mirror=()))
    poses = poses_of(clip, RATE)
    for frame in range(3):
        np.testing.assert_allclose(placed(made, 0, frame / RATE)[0][1:], poses.positions[frame, 1:], atol=1e-6)
    assert np.abs(made.positions[:, 0, [0, 2]]).max() < 1e-6


def test_clips_that_are_no_one_rig_are_refused_together():
    walk = clips()[1]
    other = parse_bvh(
        "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n"
        "MOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0\n",
        "pole",
    )
    with pytest.raises(MotionError) as caught:
        PoseBank.build([walk, walk, other], SCHEMA)
    said = str(caught.value)
    assert 'two clips are named "walk"' in said
    assert re.search('pole: its bones are not those of "walk": .*Try to put the clips on one rig: rig =', said)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: PoseBank.build([], SCHEMA), "there is no clip"),
        (lambda: PoseBank.build(clips()[:1], replace(SCHEMA, mirror=()), mirror=True), "declares no bone pairs"),
        (lambda: bank().sample("wolk", 0.0), '"walk"'),
        (lambda: PoseBank.build(clips()[:1], SCHEMA).sample("idle", 0.0, True), "has no mirrored poses"),
    ],
)
def test_what_a_bank_cannot_do_is_told(wrong, said):
    with pytest.raises(MotionError, match=said):
        wrong()


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: PoseBank.build(clips(), "loco"),
        lambda: PoseBank.build("walk", SCHEMA),
        lambda: PoseBank.build(clips(), SCHEMA, markup="loops"),
        lambda: PoseBank.build(clips(), SCHEMA, mirror="walk"),
        lambda: bank().sample("walk", "now"),
    ],
)
def test_arguments_of_another_type_are_told(wrong):
    with pytest.raises(ContextError):
        wrong()


def test_the_same_clips_give_the_same_bank():
    again = PoseBank.build([make_clip(name).clip for name in NAMES], SCHEMA, mirror=True, markup=LOOPS)
    for name in ("rotations", "positions", "root", "contacts", "starts", "moving"):
        np.testing.assert_array_equal(getattr(again, name), getattr(bank(), name))


def test_a_bank_that_was_pickled_gives_the_same_moments():
    again = pickle.loads(pickle.dumps(bank()))
    for name in ("rotations", "positions", "spins", "velocities"):
        np.testing.assert_array_equal(getattr(again.sample_of(1, 0.517), name), getattr(bank().sample_of(1, 0.517), name))


def test_joints_are_at_their_places_against_a_body_at_the_origin():
    sample = bank().sample_of(2, 0.4)
    local = LocalPoses(bank().skeleton, RATE, bank().translations(sample.positions)[None], sample.rotations[None].copy())
    turned = rotate(about_axis("y", np.array(0.3)), forward_kinematics(local).positions[0])
    np.testing.assert_allclose(bank().joints_at(2, 0.4, 0.3), turned, atol=1e-12)
