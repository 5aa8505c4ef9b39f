"""Feature schemas: what is read from contextdb.toml, and the numbers that come of a clip."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from strategies import for_each

from contextdb.errors import MotionError, QueryError, SchemaError
from contextdb.motion import Channel, Clip, FeatureSchema, MotionConfig, Skeleton, query_from, steady_path, with_path
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


def one_channel(**keys):
    return {"rate": 30.0, "channels": [keys]}


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


REFUSED = {
    "no rate": (
        {"channels": POINTS["channels"]},
        '[features.loco] has no "rate". Accepted: frames a second from 1 to 1000, such as 30.',
    ),
    "a rate in quotes": ({**POINTS, "rate": "30"}, '[features.loco] rate = "30": this is text, not a number.'),
    "a misspelt key": (
        {**POINTS, "rat": 3},
        '[features.loco] has no key "rat". Accepted: "rate", "channels", "root", "facing", "facing_smooth_s", "root_smooth_s", '
        '"mirror", '
        '"feet", "heels", "toes", "permutations". '
        'Did you mean "rate"?',
    ),
    "an empty list": ({"rate": 30.0, "channels": []}, "[features.loco] channels = []: the list is empty."),
    "channels that are not a list": (
        {"rate": 30.0, "channels": "all"},
        '[features.loco] channels = "all": this is text, not a list.',
    ),
    "a channel that is not a table": (
        {"rate": 30.0, "channels": ["LeftFoot"]},
        '[features.loco] channel 1 is "LeftFoot": this is text, not a table.',
    ),
    "no type": (one_channel(bone="Hips"), '[features.loco] channel 1 has no "type".'),
    "a misspelt type": (
        one_channel(type="positon", bone="Hips"),
        '[features.loco] channel 1 type = "positon": there is no such type. '
        'Accepted: "position", "velocity", "trajectory", "direction", '
        '"orientation", "angular_velocity", "phase", "custom", "permutation_time". '
        'Did you mean type = "position"?',
    ),
    "a type under another name": (one_channel(type="path", what="speed", at=[1]), 'Did you mean type = "trajectory"?'),
    "a key of another type": (one_channel(type="position", bone="Hips", along=[1]), 'channel 1 has no key "along".'),
    "an axis of a position": (one_channel(type="position", bone="Hips", axis="x"), 'channel 1 has no key "axis".'),
    "a bone relative to itself": (
        one_channel(type="velocity", bone="Hips", relative_to="Hips"),
        'relative_to = "Hips": this is the bone itself. Accepted: another bone, such as "Hips".',
    ),
    "a misspelt angular velocity": (
        one_channel(type="angular velocity", bone="Hips"),
        'Did you mean type = "angular_velocity"?',
    ),
    "a rotation for an orientation": (one_channel(type="rotation", bone="Hips"), 'Did you mean type = "orientation"?'),
    "a pose a day later": (one_channel(type="orientation", bone="Hips", at=[86400]), "a number is out of range or appears twice."),
    "feet that are no pair": (one_channel(type="phase", feet=["LeftFoot"]), 'feet = ["LeftFoot"]: this is not a pair of bones.'),
    "a phase of a bone": (one_channel(type="phase", bone="LeftFoot"), 'channel 1 has no key "bone".'),
    "a mirror that is not a list": ({**POINTS, "mirror": "Left*"}, 'mirror = "Left*": this is text, not a list.'),
    "a mirror of nothing": ({**POINTS, "mirror": []}, "mirror = []: the list is empty."),
    "a mirror of one bone": (
        {**POINTS, "mirror": [["Left*", "Left*"]]},
        '[features.loco] mirror = [["Left*", "Left*"]]: entry 1 is ["Left*", "Left*"]: this is not a pair of different names. '
        'Accepted: pairs of a left and a right bone, such as [["Left*", "Right*"]].',
    ),
    "a mirror that is one pair": ({**POINTS, "mirror": ["Left*"]}, 'entry 1 is "Left*": this is not a pair'),
    "a mirror with one star": (
        {**POINTS, "mirror": [["Left*", "Right"]]},
        'entry 1 is ["Left*", "Right"]: one name has a * and the other has none.',
    ),
    "a misspelt what": (one_channel(type="trajectory", what="postion", at=[1]), 'Did you mean what = "position"?'),
    "a what under another name": (one_channel(type="trajectory", what="facing", at=[1]), 'Did you mean what = "direction"?'),
    "both at and along": (one_channel(type="trajectory", what="speed", at=[1], along=[1]), 'channel 1 has both "at" and "along".'),
    "neither at nor along": (one_channel(type="trajectory", what="speed"), 'channel 1 has neither "at" nor "along".'),
    "no points": (one_channel(type="trajectory", what="speed", at=[]), "at = []: the list is empty."),
    "a point that is not a number": (
        one_channel(type="trajectory", what="speed", at=[1, "2"]),
        'at = [1, "2"]: "2" is text, not a number.',
    ),
    "a point twice": (one_channel(type="trajectory", what="speed", at=[1, 1.0]), "a number is out of range or appears twice."),
    "a point too far away": (one_channel(type="trajectory", what="speed", at=[61]), "a number is out of range or appears twice."),
    "a weight in quotes": (one_channel(type="position", bone="Hips", weight="2"), "Did you mean weight = 2?"),
    "weights that are all zero": (
        one_channel(type="position", bone="Hips", weight=0),
        "[features.loco]: the weight of every channel is 0.",
    ),
    "a facing of one bone": ({**POINTS, "facing": ["Hips", "Hips"]}, 'facing = ["Hips", "Hips"]: this is not a pair of bones.'),
}


@for_each(REFUSED.values())
def test_a_fault_of_a_schema_is_told_with_what_is_accepted(mapping, message):
    found = faults_of(mapping)
    assert len(found) == 1
    assert found[0].startswith("contextdb.toml: [features.loco]")
    assert message in found[0]


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


def test_all_faults_of_a_schema_are_reported_together():
    channels = [{"type": "positon"}, {"type": "velocity"}, 7, {"type": "trajectory", "what": "sped"}]
    assert len(faults_of({"rate": -1, "chanels": [], "channels": channels})) == 7


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


def test_a_missing_bone_is_told_with_the_clip_and_the_nearest_bone():
    schema = FeatureSchema.from_dict("x", one_channel(type="position", bone="leftfot"))
    with pytest.raises(MotionError, match=r'walk: there is no bone "leftfot".*Did you mean "LeftFoot"\?'):
        features_of(make_clip("walk").clip, schema)


def test_missing_bones_of_every_key_are_told_together_with_the_clip():
    schema = FeatureSchema.from_dict("new", NEW).with_functions({"reach": len})
    with pytest.raises(MotionError) as error:
        features_of(make_clip("walk").clip, schema)
    assert [fault.found for fault in error.value.faults] == ['there is no bone "Foot_L".', 'there is no bone "Foot_R".']


def test_a_phase_of_a_body_without_feet_asks_for_them():
    clip = Clip("snake", Skeleton(("Snake",), np.array([-1]), np.zeros((1, 3)), ((),)), 0.1, np.zeros((2, 0)))
    with pytest.raises(MotionError, match=r"snake: no pair of bones is named like feet\."):
        features_of(clip, FeatureSchema.from_dict("x", one_channel(type="phase")))


def test_a_body_more_than_a_thousand_kilometres_away_is_refused():
    skeleton = Skeleton(("Hips",), np.array([-1]), np.zeros((1, 3)), (("Xposition",),))
    schema = FeatureSchema.from_dict("x", {**one_channel(type="position", bone="Hips"), "rate": 10.0})
    for far in (1e9, 1e300):
        clip = Clip("far", skeleton, 0.1, np.array([[0.0], [far]]), 1e9)
        with pytest.raises(
            MotionError, match=r'far: bone "Hips" is more than 1,000 km away in frame 1\. Accepted: positions of a body'
        ):
            features_of(clip, schema)


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


@pytest.mark.parametrize("frame", [-1, 125, 10**9])
def test_a_frame_that_a_clip_has_not_is_refused(frame):
    with pytest.raises(QueryError, match="it has 125 frames at 30 a second"):
        query_from(LOCO, make_clip("walk").clip, frame)


def test_a_query_of_another_length_has_no_path_to_replace():
    with pytest.raises(QueryError, match="a query of 20 features"):
        with_path(LOCO, np.zeros(3), steady_path(1.0))
