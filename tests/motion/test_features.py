"""Feature schemas: what is read from contextdb.toml, and the numbers that come of a clip."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip

from contextdb.errors import SchemaError
from contextdb.motion import Channel, Clip, FeatureSchema, MotionConfig, query_from, steady_path, with_path
from contextdb.motion.features.extraction import features_of

POINTS = {
    "rate": 30.0,
    "channels": [
        {"type": "position", "bone": "LeftFoot", "weight": 0.75},
        {"type": "velocity", "bone": "Hips", "weight": 1},
        {"type": "trajectory", "what": "position", "at": [-0.5, 0.33, 1.0], "weight": 1.0},
        {"type": "trajectory", "what": "direction", "along": [0.5, 2.0], "weight": 1.5},
        {"type": "trajectory", "what": "velocity", "at": 0.5},
        {"type": "trajectory", "what": "speed", "at": [0.0, 1.0]},
    ],
}
LOCO = FeatureSchema.from_dict("loco", POINTS)


def faults_of(mapping):
    with pytest.raises(SchemaError) as error:
        FeatureSchema.from_dict("loco", mapping, file="contextdb.toml")
    return [str(fault) for fault in error.value.faults]


# ---- reading


def test_a_schema_is_read_with_its_channels_in_order():
    assert (LOCO.name, LOCO.rate, LOCO.n_features) == ("loco", 30.0, 3 + 3 + 6 + 4 + 2 + 2)
    assert LOCO.channels[0] == Channel("position", 0.75, "LeftFoot")
    assert LOCO.channels[3] == Channel("trajectory", 1.5, None, "direction", (), (0.5, 2.0))
    assert LOCO.weights.tolist() == [0.75, 1.0, 1.0, 1.5, 1.0, 1.0]
    assert LOCO.slices["trajectory direction along 0.5 2 m"] == slice(12, 16)
    assert LOCO.feature_names[:3] == ("LeftFoot position left", "LeftFoot position up", "LeftFoot position ahead")
    assert LOCO.feature_names[6] == "trajectory position at -0.5 s left"
    assert LOCO.feature_names[-1] == "trajectory speed at 1 s"
    assert LOCO.bones == ("LeftFoot", "Hips")


def test_root_and_facing_are_read():
    schema = FeatureSchema.from_dict("x", {**POINTS, "root": "Pelvis", "facing": ["LeftArm", "RightArm"]})
    assert (schema.root, schema.facing) == ("Pelvis", ("LeftArm", "RightArm"))
    assert schema.bones[-3:] == ("Pelvis", "LeftArm", "RightArm")


NEW = {
    "rate": 30.0,
    "facing_smooth_s": 0.2,
    "mirror": [["Left*", "Right*"], ["Tail_L", "Tail_R"]],
    "channels": [
        {"type": "direction", "bone": "Head"},
        {"type": "direction", "bone": "Head", "axis": "-x", "relative_to": "Chest"},
        {"type": "orientation", "bone": "Hips", "at": -0.1},
        {"type": "angular_velocity", "bone": "Chest", "group": "spin"},
        {"type": "phase"},
        {"type": "phase", "feet": ["Foot_L", "Foot_R"]},
        {"type": "custom", "function": "reach", "size": 2, "weight": 0.5},
        {"type": "trajectory", "what": "direction_to_velocity", "along": [0.0, 1.0]},
    ],
}


def test_every_type_of_channel_is_read_with_its_keys():
    schema = FeatureSchema.from_dict("new", NEW)
    assert (schema.facing_smooth_s, schema.mirror) == (0.2, (("Left*", "Right*"), ("Tail_L", "Tail_R")))
    assert schema.channels[0] == Channel("direction", 1.0, "Head", axis="z")
    assert schema.channels[1] == Channel("direction", 1.0, "Head", axis="-x", relative_to="Chest")
    assert schema.channels[5].feet == ("Foot_L", "Foot_R")
    assert schema.channels[6] == Channel("custom", 0.5, function="reach", size=2)
    assert {name: part.stop - part.start for name, part in schema.slices.items()} == {
        "Head direction z": 3,
        "Head direction -x relative to Chest": 3,
        "Hips orientation at -0.1 s": 6,
        "Chest angular velocity": 3,
        "phase": 4,
        "phase Foot_L Foot_R": 4,
        "custom reach": 2,
        "trajectory direction_to_velocity along 0 1 m": 4,
    }
    assert len(set(schema.feature_names)) == schema.n_features == 29
    assert schema.feature_names[6] == "Hips orientation at -0.1 s x axis left"
    assert schema.bones == ("Head", "Chest", "Hips", "Foot_L", "Foot_R")


def test_schemas_can_be_compared_whatever_their_functions():
    schema = FeatureSchema.from_dict("new", NEW)
    assert schema.with_functions({"reach": len}) == schema
    assert hash(schema.with_functions({"reach": len})) == hash(schema)


def test_a_schema_and_a_configuration_show_themselves_in_one_short_line():
    schema = FeatureSchema.from_dict("new", NEW)
    assert repr(schema) == '<FeatureSchema "new": 29 features, 8 channels, 30 frames a second>'
    config = MotionConfig({"new": schema}, file="contextdb.toml")
    assert repr(config) == "<MotionConfig: 1 schema, 0 databases, 0 selectors, 0 controllers>"


def test_a_channel_twice_is_refused_but_two_with_other_points_are_not():
    past = {"type": "trajectory", "what": "position", "at": [-0.5], "weight": 0.5}
    assert 'has the channel "trajectory position at -0.5 s" 2 times' in faults_of({"rate": 30.0, "channels": [past, past]})[0]
    assert FeatureSchema.from_dict("x", {"rate": 30.0, "channels": [past, {**past, "at": [0.5]}]}).n_features == 4


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5), lambda x: st.lists(x, max_size=3)
)
KEYS = st.sampled_from(
    ["type", "bone", "what", "at", "along", "weight", "group", "axis", "relative_to", "feet", "function", "size", "x"]
)
WORDS = st.sampled_from(["position", "velocity", "trajectory", "speed", "direction", "Hips", "phase", "custom", "orientation", "z"])


@given(st.lists(st.dictionaries(KEYS, JUNK | WORDS | st.just([1.0, 2.0]), max_size=6) | JUNK, max_size=4) | JUNK, JUNK, JUNK)
def test_any_mapping_is_a_schema_or_a_schema_error(channels, rate, mirror):
    try:
        schema = FeatureSchema.from_dict("any", {"rate": rate, "channels": channels, "mirror": mirror, "facing_smooth_s": rate})
    except SchemaError as refused:
        faults = refused.faults
    else:
        assert schema.n_features > 0
        return
    assert all(str(fault).startswith("[features.any]") for fault in faults)


# ---- extraction


def moved(clip, degrees, x, z):
    """The same clip, begun elsewhere and turned."""
    values = clip.values.copy()
    turn = np.deg2rad(degrees)
    values[:, 0] = x + np.cos(turn) * clip.values[:, 0] + np.sin(turn) * clip.values[:, 2]
    values[:, 2] = z - np.sin(turn) * clip.values[:, 0] + np.cos(turn) * clip.values[:, 2]
    values[:, 3] += degrees
    return Clip(clip.name, clip.skeleton, clip.frame_time_s, values, clip.metres_per_unit)


@given(st.floats(-720, 720), st.floats(-1000, 1000), st.floats(-1000, 1000))
def test_features_do_not_depend_on_where_the_clip_begins_and_where_it_faces(degrees, x, z):
    clip = make_clip("walk_turn_left_90").clip
    assert np.allclose(features_of(moved(clip, degrees, x, z), LOCO), features_of(clip, LOCO), atol=2e-5)


def test_no_feature_looks_across_a_moment_at_which_the_body_is_put_elsewhere():
    walk = make_clip("walk").clip
    first = np.zeros_like(walk.values[:1])  # a pose of reference, 20 m behind the walk
    first[0, 2] = walk.values[0, 2] - 20.0 / walk.metres_per_unit
    clip = Clip(walk.name, walk.skeleton, walk.frame_time_s, np.concatenate((first, walk.values)), walk.metres_per_unit)
    np.testing.assert_allclose(features_of(clip, LOCO)[1:], features_of(walk, LOCO), atol=1e-5)


def test_a_turning_trajectory_bends_to_its_side():
    left, right = (features_of(make_clip(f"walk_turn_{side}_90").clip, LOCO) for side in ("left", "right"))
    at_1s = LOCO.feature_names.index("trajectory position at 1 s left")
    facing = LOCO.feature_names.index("trajectory direction along 0.5 m left")
    assert left[:60, at_1s].min() > 0.4
    assert right[:60, at_1s].max() < -0.4
    assert left[:60, facing].mean() > 0.4
    assert right[:60, facing].mean() < -0.4


def test_the_speed_of_a_trajectory_is_that_of_its_velocity():
    features = features_of(make_clip("run").clip, LOCO)
    speed = features[:, LOCO.feature_names.index("trajectory speed at 1 s")]
    assert np.allclose(speed, 3.6, atol=0.05)


def test_clips_without_frames_or_with_one_have_as_many_rows():
    skeleton = make_clip("idle").clip.skeleton
    for n_frames in (0, 1):
        clip = Clip("short", skeleton, 0.1, np.zeros((n_frames, skeleton.n_channels)))
        assert features_of(clip, LOCO).shape == (n_frames, LOCO.n_features)


# ---- queries


def test_a_query_from_a_clip_is_that_frame_s_features():
    clip = make_clip("jog").clip
    assert np.array_equal(query_from(LOCO, clip, 7), features_of(clip, LOCO)[7])


def test_a_wished_path_replaces_the_trajectory_and_leaves_the_pose():
    clip = make_clip("jog").clip
    pose = query_from(LOCO, clip, 7)
    query = query_from(LOCO, clip, 7, steady_path(2.0, 90.0))
    assert np.array_equal(query, with_path(LOCO, pose, steady_path(2.0, 90.0)))
    assert np.array_equal(query[:6], pose[:6])
    wanted = dict(zip(LOCO.feature_names, query.tolist(), strict=True))
    radius = 2.0 / (np.pi / 2.0)
    assert wanted["trajectory position at 1 s left"] == pytest.approx(radius, abs=0.01)
    assert wanted["trajectory position at 1 s ahead"] == pytest.approx(radius, abs=0.01)
    assert wanted["trajectory position at -0.5 s ahead"] == pytest.approx(-radius * math.sin(np.pi / 4.0), abs=0.01)
    assert wanted["trajectory direction along 2 m left"] == pytest.approx(1.0, abs=0.01)
    assert wanted["trajectory speed at 1 s"] == pytest.approx(2.0, abs=0.01)
