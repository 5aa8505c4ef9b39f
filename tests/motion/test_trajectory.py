"""The path of a body over the ground."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip

from contextdb.motion import Clip, Skeleton, Trajectory, poses_of, root_trajectory, steady_path
from contextdb.motion.clips.trajectory import after_seconds, along_path, heading_vectors, smoothed, to_own_frame

EVERY = np.arange(61.0)


def straight(speed, n_frames=61, rate=30.0):
    positions = np.stack((np.zeros(n_frames), np.arange(n_frames) * speed / rate), axis=-1)
    return Trajectory(rate, positions, np.zeros(n_frames))


@given(st.floats(-10, 10), st.floats(-10, 10), st.floats(-10, 10))
def test_own_coordinates_keep_lengths_and_have_ahead_along_the_heading(x, z, heading):
    own = to_own_frame(np.array([x, z]), np.array(heading))
    assert np.hypot(*own) == pytest.approx(np.hypot(x, z), abs=1e-9)
    assert own[1] == pytest.approx(float(np.array([x, z]) @ heading_vectors(np.array(heading))), abs=1e-9)


def body(angles, pair=(1.0, -1.0)):
    """The path of hips that turn by these degrees about y, with a thigh at each of two distances to the left."""
    offsets = np.array([[0.0, 1.0, 0.0], [pair[0], 0.0, 0.0], [pair[1], 0.0, 0.0]])
    skeleton = Skeleton(("Hips", "LeftUpLeg", "RightUpLeg"), np.array([-1, 0, 0]), offsets, (("Yrotation",), (), ()))
    return root_trajectory(poses_of(Clip("turn", skeleton, 0.1, np.array(angles, float)[:, None], 1.0)))


def test_a_body_faces_at_right_angles_to_its_thighs():
    assert np.allclose(np.rad2deg(body([0.0, 45.0, 90.0]).headings), [0.0, 45.0, 90.0])


def test_headings_go_on_past_half_a_turn():
    angles = np.arange(0.0, 1000.0, 50.0)
    assert np.allclose(np.rad2deg(body(angles).headings), angles)


def test_a_body_that_faces_straight_up_keeps_the_heading_it_had():
    offsets = np.array([[0.0, 0, 0], [1.0, 0, 0], [-1.0, 0, 0]])
    skeleton = Skeleton(("Hips", "LeftUpLeg", "RightUpLeg"), np.array([-1, 0, 0]), offsets, (("Yrotation", "Zrotation"), (), ()))
    values = np.array([[30.0, 90.0], [30.0, 0.0], [30.0, 90.0], [50.0, 90.0], [50.0, 0.0]])
    path = root_trajectory(poses_of(Clip("roll", skeleton, 0.1, values, 1.0)))
    assert np.allclose(np.rad2deg(path.headings), [30.0, 30.0, 30.0, 30.0, 50.0])


def test_a_body_without_sides_faces_where_its_root_points():
    skeleton = Skeleton(("Snake",), np.array([-1]), np.zeros((1, 3)), (("Yrotation",),))
    path = root_trajectory(poses_of(Clip("snake", skeleton, 0.1, np.array([[0.0], [90.0]]))))
    assert np.allclose(np.rad2deg(path.headings), [0.0, 90.0])


def test_root_and_facing_can_be_declared():
    poses = poses_of(make_clip("walk").clip)
    head = root_trajectory(poses, root="Head", facing=("LeftArm", "RightArm"))
    assert np.array_equal(head.positions, poses.positions[:, poses.skeleton.index("Head")][:, [0, 2]])
    assert not np.allclose(head.headings, root_trajectory(poses).headings)


def test_points_in_time_are_where_the_body_will_be_and_go_straight_on_beyond_the_end():
    path = straight(2.0)
    for seconds in (-1.0, 0.0, 0.25, 1.0, 3.0):
        points = after_seconds(path, EVERY, seconds)
        assert np.allclose(points.positions[:, 1], 2.0 * (EVERY / 30.0 + seconds))
        assert np.allclose(points.velocities, [0.0, 2.0])


def test_points_along_the_path_are_so_many_metres_away():
    for metres in (-1.0, 0.0, 0.5, 2.0, 10.0):
        points = along_path(straight(2.0), EVERY, metres)
        assert np.allclose(points.positions[:, 1], 2.0 * EVERY / 30.0 + metres)


def test_a_path_that_ends_standing_has_its_end_as_farthest_point():
    path = straight(2.0)
    stopped = Trajectory(30.0, np.concatenate((path.positions, np.repeat(path.positions[-1:], 30, axis=0))), np.zeros(91))
    points = along_path(stopped, np.arange(91.0), 3.0)
    assert points.positions[:, 1].max() == pytest.approx(4.0)
    assert points.positions[-1, 1] == pytest.approx(4.0)
    standing = Trajectory(30.0, np.zeros((10, 2)), np.linspace(0.0, 1.0, 10))
    assert np.allclose(along_path(standing, np.arange(10.0), 1.0).positions, 0.0)


def test_a_path_of_one_frame_stays_where_it_is():
    path = Trajectory(30.0, np.array([[1.0, 2.0]]), np.array([0.5]))
    for points in (after_seconds(path, np.zeros(1), 1.0), along_path(path, np.zeros(1), 1.0)):
        assert points.positions.tolist() == [[1.0, 2.0]]
        assert points.velocities.tolist() == [[0.0, 0.0]]
        assert points.headings.tolist() == [0.5]


@given(st.floats(0.3, 6.0), st.floats(-120.0, 120.0), st.floats(-1.0, 1.0))
def test_a_steady_path_has_the_speed_and_turn_it_was_asked_for(speed, turn, seconds):
    path = steady_path(speed, turn, rate=60.0)
    assert path.positions[path.now].tolist() == [0.0, 0.0]
    assert path.headings[path.now] == 0.0
    points = after_seconds(path, np.array([float(path.now)]), seconds)
    assert np.hypot(*points.velocities[0]) == pytest.approx(speed, rel=0.01)
    assert np.rad2deg(points.headings[0]) == pytest.approx(turn * seconds, abs=1e-6)
    assert path.lengths[-1] == pytest.approx(speed * 4.0, rel=0.01)
    own = to_own_frame(points.velocities, points.headings)[0]
    assert own[1] == pytest.approx(speed, rel=0.01)


@given(st.lists(st.floats(-10.0, 10.0), max_size=12), st.floats(0.0, 200.0))
def test_smoothing_the_values_backwards_gives_the_same_backwards(values, deviation):
    found = smoothed(np.array(values), deviation)
    assert found.shape == (len(values),)
    assert np.allclose(smoothed(np.array(values)[::-1], deviation)[::-1], found, atol=1e-9)
