"""What each type of channel holds, against an oracle of matrices and loops; custom channels; mirrored features."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from motion_oracles import SlowBody, slow_channel
from strategies import examples, some
from test_mocap import FOLDER, listed, load

from contextdb.errors import MotionError, SchemaError
from contextdb.motion import Clip, FeatureSchema, query_from, steady_path
from contextdb.motion.clips.foot_bones import feet_of
from contextdb.motion.features.channels import AXES, WHATS
from contextdb.motion.features.extraction import clip_features, features_of
from contextdb.motion.features.schema import Channel

BONES = ("Hips", "Head", "LeftFoot", "RightHand", "LeftUpLeg")
WALK = make_clip("walk").clip
PAIRS = (("Left*", "Right*"),)


def schema_of(*channels, **keys):
    return FeatureSchema("test", 30.0, channels, **keys)


def features(clip, *channels, **keys):
    return features_of(clip, schema_of(*channels, **keys))


points = st.lists(st.floats(-1.0, 1.0).map(lambda x: round(x, 3)), min_size=1, max_size=2, unique=True).map(tuple)


@st.composite
def bone_channels(draw):
    kind = draw(st.sampled_from(["position", "velocity", "direction", "orientation", "angular_velocity"]))
    bone, other = draw(st.permutations(BONES))[:2]
    axis = draw(st.sampled_from(AXES)) if kind == "direction" else None
    at = draw(st.just(()) | st.lists(st.integers(-4, 4).map(lambda n: n / 30.0), min_size=1, max_size=2, unique=True).map(tuple))
    return Channel(kind, 1.0, bone, at=at, axis=axis, relative_to=draw(st.sampled_from([None, other])))


@st.composite
def trajectory_channels(draw):
    at, along = draw(st.tuples(points, st.just(())) | st.tuples(st.just(()), points))
    return Channel("trajectory", 1.0, what=draw(st.sampled_from(WHATS)), at=at, along=along)


@st.composite
def short_clips(draw):
    """Some frames of a made clip, begun anywhere, with every joint turned a little otherwise."""
    clip = make_clip(draw(st.sampled_from(["walk", "jog_turn_right_60", "stop_walk_tired", "walk_turn_left_90", "idle"]))).clip
    first, n_frames = draw(st.integers(0, 60)), draw(st.integers(1, 12))
    noise = np.random.default_rng(draw(st.integers(0, 9))).normal(0.0, 3.0, (n_frames, clip.values.shape[1]))
    values = clip.values[first : first + n_frames] + noise[: len(clip.values[first : first + n_frames])]
    values[:, 3] += draw(st.floats(-180.0, 180.0))
    return Clip("short", clip.skeleton, 1.0 / 30.0, values, clip.metres_per_unit)


@examples(0.6)
@given(short_clips(), st.lists(bone_channels() | trajectory_channels(), min_size=1, max_size=3, unique_by=lambda c: c.name))
def test_features_are_what_matrices_frame_by_frame_give(clip, channels):
    found = features(clip, *channels)
    body = SlowBody(clip)
    expected = [[x for channel in channels for x in slow_channel(body, channel, f)] for f in range(clip.n_frames)]
    assert found.shape == (clip.n_frames, sum(channel.n_features for channel in channels))
    assert np.allclose(found, expected, rtol=1e-5, atol=1e-4)


@examples(0.4)
@given(short_clips(), st.lists(bone_channels() | trajectory_channels(), min_size=1, max_size=3, unique_by=lambda c: c.name))
def test_mirrored_features_are_those_of_the_mirrored_matrices(clip, channels):
    found = clip_features(clip, schema_of(*channels, mirror=PAIRS), mirrored=True).features
    body = SlowBody(clip, flipped=True)
    expected = [[x for channel in channels for x in slow_channel(body, channel, f)] for f in range(clip.n_frames)]
    assert np.allclose(found, expected, rtol=1e-5, atol=1e-4)


SYMMETRIC = [
    *(Channel("position", 1.0, f"{side}Foot") for side in ("Left", "Right")),
    *(Channel("velocity", 1.0, f"{side}Hand", relative_to="Chest") for side in ("Left", "Right")),
    *(Channel("direction", 1.0, f"{side}Foot", axis="z") for side in ("Left", "Right")),
    *(Channel("position", 1.0, f"{side}Hand", at=(-0.1, 0.1)) for side in ("Left", "Right")),
    Channel("orientation", 1.0, "Head"),
    Channel("angular_velocity", 1.0, "Hips"),
    Channel("phase"),
    *(Channel("trajectory", what=what, at=(-0.5, 0.5)) for what in WHATS),
    *(Channel("trajectory", what=what, along=(-0.5, 0.0, 1.0)) for what in WHATS),
]


def test_clip_features_carry_the_body_s_path_and_the_same_features():
    schema = schema_of(*SYMMETRIC)
    found = clip_features(WALK, schema)
    assert np.array_equal(found.features, features_of(WALK, schema))
    assert found.root.dtype == np.float32
    assert found.root.shape == (WALK.n_frames, 3)
    assert found.root[-1, 1] - found.root[0, 1] == pytest.approx(1.3 * WALK.duration_s, abs=0.1)
    assert np.abs(found.root[:, 2]).max() < 0.3


# ---- single channels


def test_a_head_that_turns_against_the_chest_turns_relative_to_it():
    values = WALK.values.copy()
    schema = schema_of(Channel("direction", 1.0, "Head", relative_to="Neck"))
    values[:, :] = 0.0
    column = int(WALK.skeleton.channel_starts[WALK.skeleton.index("Head")]) + WALK.skeleton.channels[
        WALK.skeleton.index("Head")
    ].index("Yrotation")
    values[:, column] = 30.0
    found = features_of(replace(WALK, values=values), schema)
    assert np.allclose(found, [[0.5, 0.0, math.sqrt(0.75)]], atol=1e-6)
    assert schema.feature_names[0] == "Head direction z relative to Neck x"


def test_phases_of_a_clip_without_steps_are_zero_and_of_a_walk_go_round():
    assert not features(make_clip("idle").clip, Channel("phase")).any()
    found = features(WALK, Channel("phase")).reshape(-1, 2, 2)
    assert np.allclose(np.linalg.norm(found, axis=-1), 1.0, atol=1e-6)
    left, right = np.unwrap(np.arctan2(found[..., 0], found[..., 1]), axis=0).T
    assert (np.diff(left) > 0.0).all()
    assert left[-1] - left[0] == pytest.approx(4 * 2.0 * math.pi, abs=0.4)
    assert np.mean(left - right) % (2.0 * math.pi) == pytest.approx(math.pi, abs=0.3)


@pytest.mark.parametrize("n_frames", [0, 1, 2])
def test_every_channel_has_rows_for_clips_of_hardly_any_frames(n_frames):
    schema = schema_of(*SYMMETRIC, Channel("custom", function="height"), mirror=PAIRS)
    schema = schema.with_functions({"height": lambda poses, path: poses.positions[:, :1, 1]})
    clip = replace(WALK, values=WALK.values[:n_frames])
    for mirrored in (False, True):
        found = clip_features(clip, schema, mirrored=mirrored)
        assert found.features.shape == (n_frames, schema.n_features)
        assert found.root.shape == (n_frames, 3)
        assert np.isfinite(found.features).all()


def test_a_smoothed_facing_sways_less_and_turns_neither_later_nor_sooner():
    plain, smooth = (
        clip_features(WALK, schema_of(Channel("phase"), facing_smooth_s=seconds)).root[:, 2] for seconds in (0.0, 0.25)
    )
    assert np.std(smooth) < 0.5 * np.std(plain)
    turn = make_clip("walk_turn_left_90").clip
    plain, smooth = (clip_features(turn, schema_of(Channel("phase"), facing_smooth_s=s)).root[:, 2] for s in (0.0, 0.25))
    every = np.arange(len(plain))
    assert np.interp(np.mean(plain), smooth, every) == pytest.approx(np.interp(np.mean(plain), plain, every), abs=2.0)


@pytest.mark.skipif(not (FOLDER / "assets.csv").is_file(), reason="no captured clips: set CONTEXTDB_MOCAP to their folder")
def test_every_channel_of_every_captured_clip_is_finite_and_in_its_bounds():
    for row in some(listed(), 6):
        clip = load(row)
        feet, hips = feet_of(clip.skeleton), clip.skeleton.names[clip.skeleton.hips]
        unit = [Channel("direction", 1.0, feet[0]), Channel("orientation", 1.0, feet[1], relative_to=hips)]
        channels = [*unit, Channel("phase"), Channel("angular_velocity", 1.0, hips), Channel("velocity", 1.0, hips, at=(-0.2,))]
        channels += [Channel("trajectory", what=what, at=(-1.0, 0.0, 1.0)) for what in WHATS]
        channels += [Channel("trajectory", what=what, along=(-1.0, 0.0, 1.0)) for what in WHATS]
        found = features(clip, *channels)
        assert np.isfinite(found).all(), row["asset"]
        assert np.allclose(np.linalg.norm(found[:, :9].reshape(-1, 3, 3), axis=-1), 1.0, atol=1e-5), row["asset"]
        assert np.abs(found[:, 9:13]).max() <= 1.0 + 1e-6, row["asset"]
        assert np.abs(found[:, 13:16]).max() < 30.0, row["asset"]


# ---- custom channels


def reach(poses, path):
    """How far the hands are from each other, and how fast the body is."""
    hands = [poses.positions[:, poses.skeleton.index(f"{side}Hand")] for side in ("Left", "Right")]
    return np.column_stack((np.linalg.norm(hands[0] - hands[1], axis=1), np.linalg.norm(path.velocities, axis=1)))


CUSTOM = schema_of(Channel("custom", function="reach", size=2), Channel("trajectory", what="speed", at=(0.0,)))


def test_a_custom_channel_holds_what_its_function_gives_and_so_does_a_query():
    schema = CUSTOM.with_functions({"reach": reach})
    found = features_of(WALK, schema)
    assert np.array_equal(found[:, 1], found[:, 2])
    assert 0.3 < found[:, 0].min() < found[:, 0].max() < 1.5
    assert np.array_equal(query_from(schema, WALK, 9), found[9])
    assert np.array_equal(query_from(schema, WALK, 9, steady_path(3.0))[:2], found[9, :2])
    assert schema.feature_names == ("custom reach 1", "custom reach 2", "trajectory speed at 0 s")


def test_a_custom_function_sees_the_mirrored_poses_of_a_mirrored_clip():
    schema = replace(schema_of(Channel("custom", function="x")), mirror=PAIRS).with_functions(
        {"x": lambda poses, path: poses.positions[:, [poses.skeleton.index("LeftFoot")], 0]}
    )
    right = replace(schema, functions={"x": lambda poses, path: poses.positions[:, [poses.skeleton.index("RightFoot")], 0]})
    assert np.array_equal(clip_features(WALK, schema, mirrored=True).features, -clip_features(WALK, right).features)


def spoil(poses, path):
    poses.positions[:] = 0.0
    return np.zeros((poses.n_frames, 2))


WRONG = {
    "too narrow": (
        lambda poses, path: np.zeros((poses.n_frames, 1)),
        r"gives shape \(125, 1\)\. Accepted: 125 frames x 2 features",
    ),
    "too short": (lambda poses, path: np.zeros((3, 2)), r"gives shape \(3, 2\)"),
    "flat": (lambda poses, path: np.zeros(poses.n_frames), r"gives shape \(125,\)"),
    "nan": (lambda poses, path: np.full((poses.n_frames, 2), np.nan), r"gives nan in frame 0\. Accepted: finite numbers"),
    "huge": (lambda poses, path: np.full((poses.n_frames, 2), 1e300), r"gives 1e\+300 in frame 0"),
    "text": (lambda poses, path: "reach", "its function failed: ValueError"),
    "nothing": (lambda poses, path: None, r"gives shape \(\)"),
    "an error": (lambda poses, path: 1 / 0, "its function failed: ZeroDivisionError: division by zero"),
    "a change of the poses": (spoil, "its function failed: ValueError: assignment destination is read-only"),
    "no function": (7, "its function failed: TypeError"),
}


@pytest.mark.parametrize(("function", "message"), WRONG.values(), ids=WRONG)
def test_a_custom_function_that_gives_something_else_is_refused(function, message):
    with pytest.raises(MotionError, match=rf'walk: channel "custom reach": .*{message}'):
        features_of(WALK, CUSTOM.with_functions({"reach": function}))


def test_a_custom_channel_without_its_function_says_how_to_give_it():
    with pytest.raises(MotionError, match=r'walk: channel "custom reach" has no function\. Accepted: schema\.with_functions'):
        features_of(WALK, CUSTOM)


def test_a_function_that_no_channel_asks_for_is_refused_with_the_nearest():
    with pytest.raises(SchemaError, match=r'no channel of \[features\.test\] has function = "reech".*Did you mean "reach"\?'):
        CUSTOM.with_functions({"reech": reach})
