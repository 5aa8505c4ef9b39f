"""The paths and queries of a crowd are those of its characters one by one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

from contextdb.errors import QueryError
from contextdb.motion import FeatureSchema, Trajectory, with_path
from contextdb.motion.clips.trajectory import ManyTrajectories
from contextdb.motion.features.extraction import trajectory_features
from contextdb.motion.features.path_features import with_paths, write_paths

WHATS = ("position", "direction", "velocity", "direction_to_velocity", "speed")


@st.composite
def schemas(draw):
    channels = [{"type": "position", "bone": "LeftFoot"}]
    for what in draw(st.lists(st.sampled_from(WHATS), unique=True)):
        how = draw(st.sampled_from(["at", "along"]))
        points = draw(st.sets(st.floats(-3.0, 3.0).map(lambda point: point + 0.0), min_size=1, max_size=3))  # one zero
        channels.append({"type": "trajectory", "what": what, how: sorted(points)})
    return FeatureSchema.from_dict("crowd", {"rate": 30.0, "channels": channels})


@st.composite
def trajectories(draw, n_frames, now):
    """A path that walks, stands, or both in turns; also one that never leaves its place."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    speeds = rng.choice([0.0, draw(st.sampled_from([0.0, 0.001, 0.1]))], (n_frames, 1))
    positions = (rng.normal(size=(n_frames, 2)) * speeds).cumsum(axis=0)
    return Trajectory(draw(st.just(30.0)), positions, rng.normal(size=n_frames).cumsum() * 0.2, now)


@examples(2)
@given(schemas(), st.data())
def test_the_queries_of_a_crowd_are_those_of_each_alone_to_the_last_bit(schema, data):
    n_frames = data.draw(st.integers(1, 20))
    now = data.draw(st.integers(0, n_frames - 1))
    paths = data.draw(st.lists(trajectories(n_frames, now), max_size=4))
    poses = np.random.default_rng(1).normal(size=(len(paths), schema.n_features))
    singly = [with_path(schema, pose, path) for pose, path in zip(poses, paths, strict=True)]
    expected = np.array(singly, np.float32).reshape(len(paths), schema.n_features)
    for wanted in (paths, ManyTrajectories.of(paths)):
        found = with_paths(schema, poses, wanted)
        assert found.dtype == np.float32
        assert np.array_equal(found, expected)


@examples(2)
@given(schemas(), st.data())
def test_the_features_of_a_wished_path_are_those_that_a_database_has_of_it(schema, data):
    n_frames = data.draw(st.integers(1, 20))
    path = data.draw(trajectories(n_frames, data.draw(st.integers(0, n_frames - 1))))
    pose = np.random.default_rng(1).normal(size=(1, schema.n_features))
    expected, found = pose.copy(), pose.astype(np.float32)
    for channel in schema.channels:
        if channel.type == "trajectory":
            expected[:, schema.slices[channel.name]] = trajectory_features(channel, path, np.array([path.now]))
    write_paths(schema, found, ManyTrajectories.of([path]))
    assert found == pytest.approx(expected, rel=1e-7, abs=1e-9)
    assert np.array_equal(with_path(schema, pose[0], path), found[0])


def test_paths_of_different_shapes_are_no_crowd():
    short, long = (Trajectory(30.0, np.zeros((n, 2)), np.zeros(n)) for n in (3, 4))
    with pytest.raises(QueryError, match=r"path 1 has 4 frames at 30 a second.* Accepted: as path 0: 3 frames"):
        ManyTrajectories.of([short, long])
    with pytest.raises(QueryError, match="the present at 3"):
        ManyTrajectories(30.0, np.zeros((1, 3, 2)), np.zeros((1, 3)), 3)
    with pytest.raises(QueryError, match=r"positions of shape \(3, 2\)"):
        ManyTrajectories(30.0, np.zeros((3, 2)), np.zeros((1, 3)))


def test_each_query_needs_its_path():
    schema = FeatureSchema.from_dict("one", {"rate": 30.0, "channels": [{"type": "trajectory", "what": "speed", "at": 0.5}]})
    path = Trajectory(30.0, np.zeros((3, 2)), np.zeros(3))
    with pytest.raises(QueryError, match=r"the queries have shape \(2, 1\), and there is 1 path"):
        with_paths(schema, np.zeros((2, 1)), [path])
    with pytest.raises(QueryError, match="a path for each query of 1 feature"):
        with_paths(schema, np.zeros((1, 3)), [path])
