"""A baked cycle has its joints where the cycle has them, points where their joints hold them, and is read as it was written."""

import numpy as np
import pytest
from made_once import make_clip

from contextdb.errors import ContextError, FileError, MotionError
from contextdb.motion.clips.poses import LocalPoses, forward_kinematics
from contextdb.motion.storage.written_poses import write_arrays
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.walked import baked_cycle

CYCLE = Cycle.of(make_clip("walk").clip)
N = 24
BAKED = baked_cycle(CYCLE, N)
N_JOINTS = CYCLE.skeleton.n_joints


def moved(points, moment, joint):
    """Points of the rest pose as a joint has them."""
    matrix = BAKED["matrices"][moment, joint].astype(np.float64)
    return np.asarray(points) @ matrix[:, :3].T + matrix[:, 3]


@pytest.mark.parametrize("moment", [0, 7, N - 1])
def test_each_joint_is_where_the_cycle_has_it(moment):
    rotations, positions = CYCLE.at(moment / N)
    shown = forward_kinematics(LocalPoses(CYCLE.skeleton, 1.0, positions[None], rotations[None])).positions[0]
    for joint in range(N_JOINTS):
        np.testing.assert_allclose(moved(BAKED["rest"][joint], moment, joint), shown[joint], atol=1e-5)


def test_a_matrix_turns_and_stretches_nothing():
    turns = BAKED["matrices"][..., :3].astype(np.float64)
    np.testing.assert_allclose(turns @ turns.swapaxes(-1, -2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-5)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0, atol=1e-5)


def test_points_of_a_mesh_are_where_their_joints_hold_them():
    knee, foot = (CYCLE.skeleton.index(bone) for bone in ("LeftLeg", "LeftFoot"))
    points = np.array([[0.1, -0.5, 0.02], [0.08, -0.9, 0.0]])
    weights = np.zeros((2, N_JOINTS))
    weights[0, knee] = 1.0
    weights[1, [knee, foot]] = 0.25, 0.75
    found = baked_cycle(CYCLE, N, points, weights)["positions"]
    for moment in (0, 11):
        np.testing.assert_allclose(found[moment, 0], moved(points[0], moment, knee), atol=1e-5)
        mixed = 0.25 * moved(points[1], moment, knee) + 0.75 * moved(points[1], moment, foot)
        np.testing.assert_allclose(found[moment, 1], mixed, atol=1e-5)


def test_the_moment_behind_the_last_is_the_first():
    toe = CYCLE.skeleton.index("LeftToe")
    way = np.array([moved(BAKED["rest"][toe], moment % N, toe) for moment in range(N + 1)])
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    assert steps[-1] < 1.5 * steps[:-1].max()


def test_arrays_are_read_as_they_were_written_and_the_same_ones_give_the_same_bytes(tmp_path):
    files = [tmp_path / name for name in ("a.npz", "b.npz")]
    for file in files:
        write_arrays(BAKED, file)
    assert files[0].read_bytes() == files[1].read_bytes()
    with np.load(files[0]) as again:
        assert set(again.files) == set(BAKED)
        for name, array in BAKED.items():
            np.testing.assert_array_equal(again[name], array)


def test_a_mesh_or_a_file_that_does_not_fit_is_refused(tmp_path):
    points = np.zeros((2, 3))
    for weights in (None, np.ones((2, 3)), np.full((2, N_JOINTS), 0.5)):
        with pytest.raises(MotionError, match="weights"):
            baked_cycle(CYCLE, N, points, weights)
    with pytest.raises(MotionError, match="n_moments is 1"):
        baked_cycle(CYCLE, 1)
    with pytest.raises(FileError, match=r"ends in \.npz"):
        write_arrays(BAKED, tmp_path / "walk.txt")
    with pytest.raises(ContextError, match="not an array of numbers"):
        write_arrays({"x": [object()]}, tmp_path / "walk.npz")
