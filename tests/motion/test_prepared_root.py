"""The path of a body is made from hips that sway: known paths of made clips come back, and no joint moves in the world."""

from dataclasses import replace

import numpy as np
import pytest
from made_once import make_clip
from strategies import for_each

from contextdb.motion import FeatureSchema, PoseBank, poses_of, root_trajectory
from contextdb.motion.clips.mirror import mirrored
from contextdb.motion.clips.poses import LocalPoses, Poses, forward_kinematics
from contextdb.motion.clips.quaternions import about_axis, rotate
from contextdb.motion.clips.trajectory import Trajectory, unbroken
from contextdb.motion.made.body import about_turn, timeline
from contextdb.motion.made.recipes import ABOUT_TURNS, RAMP_S, RECIPES

SMOOTH = FeatureSchema.from_dict(
    "loco",
    {"rate": 30.0, "root_smooth_s": 0.2, "channels": [{"type": "position", "bone": "LeftFoot"}], "mirror": [["Left*", "Right*"]]},
)
STRAIGHT = [name for name, recipe in RECIPES.items() if not recipe.turn_dps]
BENDS = [name for name, recipe in RECIPES.items() if recipe.turn_dps]
SWAY_M = 0.04


def way_of(name):
    """Where the recipe says that the body is: places, headings, shares of the pace and phases."""
    recipe = (RECIPES | ABOUT_TURNS)[name]
    ramp_s = RAMP_S[recipe.gait]
    if recipe.change == "turn":
        way = about_turn(recipe.pace, recipe.turned_deg, recipe.n_cycles, ramp_s)
    else:
        way = timeline(recipe.pace, recipe.turn_dps, recipe.change, recipe.n_cycles, ramp_s)
    return [way.at(values, way.frame_times) for values in (way.places, way.headings, way.shares, way.phases)]


def swaying(name: str) -> Poses:
    """The poses of a made clip whose hips sway by some centimetres more with each cycle."""
    poses = poses_of(make_clip(name).clip)
    _, headings, shares, phases = way_of(name)
    metres = SWAY_M * np.sqrt(shares) * np.cos(2.0 * np.pi * phases)
    positions = poses.positions.copy()
    positions[:, poses.skeleton.hips, 0] += metres * np.cos(headings)
    positions[:, poses.skeleton.hips, 2] -= metres * np.sin(headings)
    return replace(poses, positions=positions)


def frames_of_movement(positions):
    speeds = np.linalg.norm(np.gradient(positions, 1.0 / 30.0, axis=0), axis=-1)
    moving = np.flatnonzero(speeds > 0.1 * max(1.0, speeds.max()))
    return moving[[0, -1]] if len(moving) else np.zeros(2)


@for_each(STRAIGHT)
def test_a_straight_path_comes_back_within_a_centimetre_and_a_degree_and_starts_and_stops_within_a_frame(name):
    poses, (places, headings, _, _) = swaying(name), way_of(name)
    path = SMOOTH.path_of(poses)
    assert np.linalg.norm(path.positions - places, axis=-1).max() < 0.01
    assert np.rad2deg(np.abs(path.headings - headings)).max() < 1.0
    assert np.abs(frames_of_movement(path.positions) - frames_of_movement(places)).max() <= 1


@pytest.mark.parametrize("name", BENDS)
def test_a_bend_comes_back_within_a_centimetre_behind_its_ends(name):
    poses, (places, headings, _, _) = swaying(name), way_of(name)
    path = SMOOTH.path_of(poses)
    inside = slice(12, -12)
    assert np.linalg.norm(path.positions - places, axis=-1)[inside].max() < 0.01
    assert np.rad2deg(np.abs(path.headings - headings))[inside].max() < 2.5


@pytest.mark.parametrize("name", ABOUT_TURNS)
def test_a_turn_about_keeps_its_moment_and_its_heading(name):
    poses, (_, headings, _, _) = swaying(name), way_of(name)
    assert np.rad2deg(np.abs(SMOOTH.path_of(poses).headings - headings)).max() < 2.5


def test_no_joint_moves_in_the_world_when_the_root_does():
    clip = make_clip("walk_turn_left_90").clip
    bank, plain = (PoseBank.build([clip], replace(SMOOTH, root_smooth_s=smooth_s)) for smooth_s in (0.2, 0.0))
    assert np.abs(bank.root - plain.root).max() > 0.01
    np.testing.assert_allclose(in_world(bank), in_world(plain), atol=2e-3)  # kept in 16 bits a number


def in_world(bank: PoseBank):
    """Where all joints are in each frame: [F, J, 3]."""
    samples = [bank.sample_of(0, frame / bank.rate) for frame in range(bank.n_frames)]
    rotations, positions = (np.array([getattr(each, name) for each in samples]) for name in ("rotations", "positions"))
    against = forward_kinematics(
        LocalPoses(bank.skeleton, bank.rate, np.array([bank.translations(each) for each in positions]), rotations)
    ).positions
    x, z, headings = bank.root.astype(np.float64).T
    return rotate(about_axis("y", headings)[:, None], against) + np.stack((x, np.zeros(len(x)), z), axis=-1)[:, None]


def test_a_mirrored_path_is_the_path_in_a_mirror():
    poses = swaying("walk_turn_left_45")
    path, other = SMOOTH.path_of(poses), SMOOTH.path_of(mirrored(poses, SMOOTH.mirror))
    np.testing.assert_allclose(other.positions, path.positions * [-1.0, 1.0], atol=1e-9)
    np.testing.assert_allclose(other.headings, -path.headings, atol=1e-9)


@pytest.mark.parametrize("n_frames", [1, 2, 4, 5, 6])
def test_clips_of_few_frames_have_a_path(n_frames):
    poses = swaying("walk")
    few = replace(poses, positions=poses.positions[:n_frames], rotations=poses.rotations[:n_frames])
    assert np.isfinite(SMOOTH.path_of(few).positions).all()


def test_without_the_key_the_path_is_that_of_the_hips():
    poses = swaying("walk")
    plain = replace(SMOOTH, root_smooth_s=0.0).path_of(poses)
    np.testing.assert_array_equal(plain.positions, root_trajectory(poses).positions)


def test_a_first_frame_that_stands_elsewhere_does_not_bend_the_path_behind_it():
    poses = swaying("walk")
    elsewhere = replace(
        poses,
        positions=np.concatenate((poses.positions[:1] - [0.0, 0.0, 20.0], poses.positions)),
        rotations=np.concatenate((poses.rotations[:1], poses.rotations)),
    )
    path, alone = SMOOTH.path_of(elsewhere), SMOOTH.path_of(poses)
    np.testing.assert_allclose(path.positions[1:], alone.positions, atol=1e-9)
    np.testing.assert_allclose(path.headings[1:], alone.headings, atol=1e-9)


def test_a_body_that_is_fast_all_the_time_has_one_path():
    ride = Trajectory(30.0, np.column_stack((np.zeros(30), np.arange(30.0) ** 1.3)), np.zeros(30))
    assert unbroken(ride) == [slice(0, 30)]
