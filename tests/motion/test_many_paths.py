"""The bodies, paths and queries of a crowd are those of its characters one by one."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import examples

from contextdb.errors import MotionError, QueryError
from contextdb.motion import FeatureSchema, Trajectory, with_path
from contextdb.motion.clips.many_paths import ManyTrajectories
from contextdb.motion.clips.many_steered import ManySteered, steered_paths
from contextdb.motion.clips.steering import Steered, steered_path
from contextdb.motion.features.extraction import trajectory_features
from contextdb.motion.features.path_features import with_paths, write_paths

WHATS = ("position", "direction", "velocity", "direction_to_velocity", "speed")
SIZES = st.floats(-20.0, 20.0)
PAIRS = st.tuples(SIZES, SIZES)
BODIES = st.builds(Steered, PAIRS, PAIRS, PAIRS, SIZES, SIZES, st.sampled_from([0.1, 0.27]), st.sampled_from([0.1, 0.27]))


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


@given(st.lists(st.tuples(BODIES, PAIRS, SIZES), max_size=4), st.booleans(), st.floats(0.0, 1.0))
def test_the_bodies_of_a_crowd_move_as_each_alone(drawn, is_facing, dt_s):
    bodies, wanted, facing = ([each[i] for each in drawn] for i in range(3))
    assume(all(_is_clear(*each, is_facing) for each in drawn))
    sticks = np.array(wanted).reshape(-1, 2)
    moved = ManySteered.of(bodies).moved(dt_s, sticks, facing if is_facing else None)
    assert list(moved) == [moved[i] for i in range(len(bodies))]
    for i, body in enumerate(bodies):
        alone, own = body.moved(dt_s, wanted[i], facing[i] if is_facing else None), moved[i]
        assert (own.velocity_halflife_s, own.heading_halflife_s) == (alone.velocity_halflife_s, alone.heading_halflife_s)
        assert (own.heading, own.turn_rate) == pytest.approx((alone.heading, alone.turn_rate), rel=1e-9, abs=1e-9)
        for name in ("position", "velocity", "acceleration"):
            assert getattr(own, name) == pytest.approx(getattr(alone, name), rel=1e-9, abs=1e-9)


@given(st.lists(st.tuples(BODIES, PAIRS, SIZES), min_size=1, max_size=4), st.integers(1, 5), st.floats(0.0, 1.5))
def test_the_paths_of_a_crowd_are_those_of_each_alone(drawn, n_moments, reach_s):
    bodies, wanted, _ = ([each[i] for each in drawn] for i in range(3))
    past, pasts = [ManySteered.of(bodies)], [[body] for body in bodies]
    for _ in range(n_moments - 1):
        past.append(past[-1].moved(1.0 / 30.0, wanted))
        pasts = [[*own, past[-1][i]] for i, own in enumerate(pasts)]
    assume(all(_is_clear(own[-1], stick, 0.0, False) for own, stick in zip(pasts, wanted, strict=True)))
    paths = steered_paths(past, wanted, reach_s=reach_s)
    assert len(paths) == len(bodies)
    for i, own in enumerate(pasts):
        alone = steered_path(own, wanted[i], reach_s=reach_s)
        assert (paths[i].rate, paths[i].now) == (alone.rate, alone.now)
        assert paths[i].positions == pytest.approx(alone.positions, rel=1e-9, abs=1e-9)
        assert paths[i].headings == pytest.approx(alone.headings, rel=1e-9, abs=1e-9)


def _is_clear(body, wanted, facing, is_facing):
    """Whether rounding cannot decide which way the body turns, or whether it stands."""
    goal = facing if is_facing else math.atan2(*wanted)
    is_standing_sure = is_facing or abs(math.hypot(*wanted) - 0.1) > 1e-6
    return is_standing_sure and abs(abs(math.remainder(goal - body.heading, 2.0 * math.pi)) - math.pi) > 1e-6


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


def test_sticks_that_fit_no_crowd_are_refused():
    bodies = ManySteered.of([Steered()] * 2)
    with pytest.raises(MotionError, match=r"the velocities that are requested have shape \(1, 2\)"):
        bodies.moved(0.1, [[0.0, 1.0]])
    with pytest.raises(MotionError, match=r"the facing has shape \(3,\)"):
        bodies.moved(0.1, np.zeros((2, 2)), np.zeros(3))
    with pytest.raises(MotionError, match="there is no body to steer"):
        steered_paths([], np.zeros((0, 2)))
    with pytest.raises(MotionError, match="different numbers of bodies"):
        steered_paths([bodies, ManySteered.of([Steered()])], [[0.0, 1.0]])


def test_a_stick_or_facing_that_is_no_number_is_refused_with_its_body():
    bodies = ManySteered.of([Steered()] * 2)
    with pytest.raises(
        MotionError, match=r"the velocity \[nan, 0.0\] is asked of body 1. Accepted: numbers from -1e\+09 to 1e\+09"
    ):
        bodies.moved(0.1, [[0.0, 1.0], [np.nan, 0.0]])
    with pytest.raises(MotionError, match=r"the facing inf is asked of body 0. Accepted: radians"):
        bodies.moved(0.1, [[0.0, 1.0]] * 2, [np.inf, 0.0])
