"""Quaternions, forward kinematics, resampling and the skeleton's guesses about sides."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from motion_oracles import place_joint, rotation_about
from test_bvh import SMALL, clips

from contextdb.errors import MotionError
from contextdb.motion import Clip, Skeleton, poses_of, resampled
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.bone_names import meant_bone, nearest_bones
from contextdb.motion.clips.clip import parse_bvh
from contextdb.motion.clips.poses import local_poses
from contextdb.motion.clips.skeleton import sided_pairs

ANGLES = st.floats(-360.0, 360.0)


@given(st.lists(st.tuples(st.sampled_from("XYZ"), ANGLES), max_size=4))
def test_euler_angles_turn_as_a_product_of_matrices(turns):
    expected = np.eye(3)
    for axis, degrees in turns:
        expected = expected @ rotation_about(axis, degrees)
    angles = np.deg2rad([degrees for _, degrees in turns])
    found = quaternions.from_euler([axis.lower() for axis, _ in turns], angles)
    assert np.allclose(quaternions.matrices(found), expected, atol=1e-12)


@given(st.permutations("xyz"), st.tuples(ANGLES, ANGLES, ANGLES))
def test_euler_angles_of_a_rotation_make_that_rotation_again(axes, degrees):
    rotation = quaternions.from_euler(axes, np.deg2rad(degrees))
    again = quaternions.from_euler(axes, quaternions.to_euler("".join(axes), rotation))
    assert np.allclose(quaternions.matrices(again), quaternions.matrices(rotation), atol=1e-6)


@given(st.tuples(ANGLES, ANGLES, ANGLES))
def test_a_rotation_read_from_its_matrix_is_the_same_rotation(degrees):
    rotation = quaternions.from_euler("zxy", np.deg2rad(degrees))
    again = quaternions.from_matrices(quaternions.matrices(rotation))
    assert np.allclose(abs((again * rotation).sum()), 1.0, atol=1e-12)


@given(st.sampled_from("xyz"), ANGLES)
def test_a_rotation_vector_is_axis_times_angle_the_shorter_way_round(axis, degrees):
    found = quaternions.rotation_vectors(quaternions.about_axis(axis, np.deg2rad(degrees)))
    short = np.deg2rad((degrees + 180.0) % 360.0 - 180.0)
    assert np.allclose(np.delete(found, "xyz".index(axis)), 0.0, atol=1e-9)
    assert abs(found["xyz".index(axis)]) == pytest.approx(abs(short), abs=1e-9)
    assert np.allclose(np.sin(found["xyz".index(axis)]), np.sin(short), atol=1e-9)


@given(st.tuples(ANGLES, ANGLES, ANGLES), st.tuples(ANGLES, ANGLES, ANGLES))
def test_a_product_turns_by_the_right_factor_first_and_an_inverse_turns_back(first, second):
    a, b = (quaternions.from_euler("xyz", np.deg2rad(degrees)) for degrees in (first, second))
    vector = np.array([1.0, -2.0, 3.0])
    both = quaternions.rotate(quaternions.multiply(a, b), vector)
    assert np.allclose(both, quaternions.rotate(a, quaternions.rotate(b, vector)), atol=1e-9)
    assert np.allclose(quaternions.rotate(quaternions.inverse(a), quaternions.rotate(a, vector)), vector, atol=1e-9)


def test_a_blend_takes_the_shorter_way_round():
    first, second = (quaternions.about_axis("y", np.deg2rad(angle)) for angle in (170.0, -170.0))
    middle = quaternions.blend(first, second, np.array([0.5]))
    assert np.allclose(quaternions.matrices(middle), rotation_about("Y", 180.0), atol=1e-12)


@given(clips(), st.sampled_from("yzx"), st.sampled_from([1.0, 0.01]))
def test_forward_kinematics_places_joints_where_asking_each_parent_does(clip, up, unit):
    clip = Clip(clip.name, clip.skeleton, clip.frame_time_s, clip.values, unit, up)
    poses = poses_of(clip)
    assert poses.positions.shape == (clip.n_frames, clip.skeleton.n_joints, 3)
    for frame in range(clip.n_frames):
        for joint in range(clip.skeleton.n_joints):
            position, rotation = place_joint(clip, frame, joint)
            assert np.allclose(poses.positions[frame, joint], position, atol=1e-9 * (1 + np.abs(position).max()))
            assert np.allclose(quaternions.matrices(poses.rotations[frame, joint]), rotation, atol=1e-9)


@pytest.mark.parametrize(("up", "axis"), [("y", 1), ("z", 2), ("x", 0)])
def test_the_declared_axis_points_up_in_metres(up, axis):
    offsets = np.zeros((2, 3))
    offsets[1, axis] = 170.0
    skeleton = Skeleton(("Hips", "Head"), np.array([-1, 0]), offsets, (("Xrotation",), ()))
    head = poses_of(Clip("stand", skeleton, 0.1, np.zeros((1, 1)), 0.01, up)).positions[0, 1]
    assert np.allclose(head, [0.0, 1.7, 0.0])


def test_position_channels_stand_instead_of_the_offset_on_their_axes():
    text = SMALL.replace("CHANNELS 3 Zrotation Xrotation Yrotation", "CHANNELS 1 Yposition")
    text = text.replace("10 20 30 40 50 60", "0 0 0 7").replace("11 21 31 41 51 61", "0 0 0 8")
    local = local_poses(parse_bvh(text, "clip", metres_per_unit=1.0))
    assert local.positions[:, 1].tolist() == [[1.0, 7.0, 0.5], [1.0, 8.0, 0.5]]
    assert local.positions[0, 0].tolist() == [0.0, 90.0, 0.0]


def test_resampling_to_the_same_rate_as_printed_changes_nothing():
    clip = parse_bvh(SMALL, "clip")  # 0.0333333 s is meant to be 1/30 s
    local = local_poses(clip)
    assert np.array_equal(resampled(local, 30.0).positions, local.positions)


def test_resampling_keeps_places_in_time_and_bones_in_length():
    local = local_poses(make_clip("walk").clip)
    for rate in (7.0, 30.0, 59.94, 120.0):
        poses = poses_of(make_clip("walk").clip, rate)
        assert poses.n_frames == int((len(local.positions) - 1) / 30.0 * rate + 0.05) + 1
        legs = np.linalg.norm(np.diff(poses.positions[:, 11:14], axis=1), axis=-1)
        assert np.allclose(legs, legs[0], atol=1e-9)
        speed = (poses.positions[-1, 0, 2] - poses.positions[0, 0, 2]) / ((poses.n_frames - 1) / rate)
        assert speed == pytest.approx(1.3, abs=0.02)


@pytest.mark.parametrize("printed", [0.00833333, 0.0083333, 0.008333])
def test_resampling_keeps_the_last_frame_of_a_clip_whose_frame_time_is_printed_short(printed):
    skeleton = parse_bvh(SMALL, "clip").skeleton
    assert poses_of(Clip("five_seconds", skeleton, printed, np.zeros((601, 9))), 30.0).n_frames == 151
    assert poses_of(Clip("short_of_it", skeleton, printed, np.zeros((600, 9))), 30.0).n_frames == 150


def test_one_frame_and_no_frames_can_be_resampled():
    skeleton = parse_bvh(SMALL, "clip").skeleton
    for n_frames in (0, 1):
        poses = poses_of(Clip("short", skeleton, 0.01, np.zeros((n_frames, 9))), 30.0)
        assert poses.positions.shape == (n_frames, 2, 3)


def test_sides_are_told_from_the_names_of_bones():
    names = ["Hips", "LeftFoot", "RightFoot", "Thigh_L", "Thigh_R", "lfemur", "rfemur", "lowerback", "rig:L_Arm", "rig:R_Arm"]
    names += ["Bip01 L Hand", "Bip01 R Hand", "LHip", "RHip", "leftToe"]
    pairs = [("LeftFoot", "RightFoot"), ("Thigh_L", "Thigh_R"), ("lfemur", "rfemur"), ("rig:L_Arm", "rig:R_Arm")]
    assert sided_pairs(names) == [*pairs, ("Bip01 L Hand", "Bip01 R Hand"), ("LHip", "RHip")]


def skeleton_of(*joints):
    names = [name for name, _, _ in joints]
    parents = [names.index(parent) if parent else -1 for _, parent, _ in joints]
    offsets = np.array([[x, 0.0, 0.0] for _, _, x in joints])
    return Skeleton(tuple(names), np.array(parents), offsets, tuple(() for _ in names))


def test_a_body_faces_across_its_thighs_even_behind_joints_without_length():
    skeleton = skeleton_of(
        ("root", "", 0),
        ("lhip", "root", 0),
        ("lfemur", "lhip", 9),
        ("rhip", "root", 0),
        ("rfemur", "rhip", -9),
        ("chest", "root", 0),
    )
    assert skeleton.facing_pair == (2, 4)
    assert skeleton.hips == 0


def test_the_hips_are_the_joint_above_both_thighs_and_not_a_root_that_stays_behind():
    skeleton = skeleton_of(("reference", "", 0), ("Hips", "reference", 0), ("Leg_L", "Hips", 1), ("Leg_R", "Hips", -1))
    assert skeleton.hips == 1


def test_a_skeleton_without_sides_has_its_root_as_hips():
    skeleton = skeleton_of(("Snake", "", 0), ("Tail", "Snake", 1))
    assert (skeleton.facing_pair, skeleton.hips) == (None, 0)


def test_a_missing_bone_is_told_with_the_nearest_one():
    with pytest.raises(MotionError, match=r'there is no bone "LeftFot".*Did you mean "LeftFoot"\?'):
        make_clip("walk").clip.skeleton.index("LeftFot")


@pytest.mark.parametrize(
    ("wanted", "meant"),
    [
        ("LeftFoot", "Foot_L"),
        ("mixamorig:RightUpLeg", "UpperLeg_R"),
        ("Bip01 L Hand", "Hand_L"),
        ("l_forearm", "LowerArm_L"),
        ("rfoot", "Foot_R"),
        ("Pelvis", "Hips"),
        ("RightToeBase", "Toes_R"),
        ("head", "Head"),
        ("LeftWing", None),
        ("Ωμος", None),
    ],
)
def test_a_bone_that_another_rig_calls_otherwise_is_guessed_by_its_side_and_its_words(wanted, meant):
    names = ("Hips", "Spine", "Head", "Foot_L", "Foot_R", "UpperLeg_R", "Hand_L", "Hand_R", "LowerArm_L", "LowerArm_R", "Toes_R")
    assert meant_bone(wanted, names) == meant
    assert meant is None or nearest_bones(wanted, names, 3)[0] == meant
