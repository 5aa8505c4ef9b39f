"""Permutations of clips: what their features are, what a search finds among them, and that playing on in another is no jump."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from motion_oracles import SlowBody, slow_channel
from strategies import examples
from test_channels import PAIRS, bone_channels, short_clips

from contextdb.errors import MotionError, QueryError, SchemaError
from contextdb.motion import (
    Action,
    Channel,
    Controller,
    ControllerSettings,
    Entry,
    FeatureSchema,
    JointDatabase,
    LivePose,
    MotionConfig,
    MotionDatabase,
    PoseBank,
    PoseHistory,
    Selector,
    Trace,
    measure,
    poses_of,
    query_from,
    query_from_pose,
    resampled,
    write_bvh,
)
from contextdb.motion.clips.clip import parse_bvh
from contextdb.motion.clips.poses import local_poses
from contextdb.motion.features.channels import Permutations
from contextdb.motion.features.extraction import clip_features, clip_permutations
from contextdb.motion.made.game import make_joint_clip
from contextdb.motion.measuring.coverage import coverage
from contextdb.motion.measuring.usage import near_clips
from contextdb.motion.storage.building import build_all
from contextdb.motion.trace.views import decision_lines

N_FRAMES = 60
RIG = """HIERARCHY
ROOT Hips
{
 OFFSET 0 0 0
 CHANNELS 3 Xposition Yposition Zposition
 JOINT LeftUpLeg
 {
  OFFSET 10 0 0
  CHANNELS 3 Zrotation Xrotation Yrotation
 }
 JOINT RightUpLeg
 {
  OFFSET -10 0 0
  CHANNELS 3 Zrotation Xrotation Yrotation
 }
 JOINT RightHand
 {
  OFFSET 0 0 0
  CHANNELS 3 Xposition Yposition Zposition
 }
}
"""
KEYS = {
    "rate": 30,
    "permutations": {"count": 3, "step_s": 0.2, "from_s": 0.2},
    "channels": [{"type": "position", "bone": "RightHand", "permuted": True}, {"type": "permutation_time"}],
}
HAND, TIME = "RightHand position permuted", "permutation time"
SCHEMA = FeatureSchema.from_dict("catch", KEYS)


def reaching(name, side=1.0):
    """A body that walks ahead, 3 cm a frame, and a hand that rises ever faster: in no two frames is it at one place."""
    rows = [f"0 90 {3 * i} " + "0 " * 6 + f"{side * i} {0.02 * i * i} 20" for i in range(N_FRAMES)]
    return parse_bvh(RIG + f"MOTION\nFrames: {N_FRAMES}\nFrame Time: 0.0333333333\n" + "\n".join(rows), name)


CLIP, OTHER = reaching("catch"), reaching("other", side=-1.0)
DATABASE = MotionDatabase.build([CLIP, OTHER], SCHEMA)


def ball_query(frame, event, in_s):
    """The hand shall be in `in_s` seconds where it is in the frame `event` of the clip, seen from the body in `frame`."""
    query = query_from(SCHEMA, CLIP, 0)
    hand, body = np.array([event, 90 + 0.02 * event**2, 20 + 3 * event]), np.array([0, 0, 3 * frame])
    query[SCHEMA.slices[HAND]] = (hand - body) / 100.0
    query[SCHEMA.slices[TIME]] = in_s
    return query


# ---- features


@examples(0.4)
@given(short_clips(), bone_channels(), st.integers(0, 2), st.booleans())
def test_a_permuted_channel_is_the_bone_ahead_seen_from_the_body_now(clip, channel, i, mirrored):
    channels = (replace(channel, at=(), permuted=True), Channel("permutation_time"))
    schema = FeatureSchema("test", 30.0, channels, mirror=PAIRS, permutations=Permutations(3, 0.1, 1.0 / 30.0))
    flipped = mirrored and channel.type in ("position", "velocity")  # SlowBody mirrors no axes of bones, and no turns
    found = clip_permutations(clip, schema, mirrored=flipped)[i].features
    body, ahead_s = SlowBody(clip, flipped), schema.permutation_s[i]
    expected = [[x for each in channels for x in slow_channel(body, each, f, ahead_s)] for f in range(clip.n_frames)]
    assert found == pytest.approx(np.array(expected), abs=2e-4)


def test_channels_that_are_not_permuted_and_the_path_are_the_same_in_each_permutation():
    channels = (Channel("position", bone="Head"), Channel("trajectory", what="position", at=(0.5,)), Channel("permutation_time"))
    walk = make_clip("walk").clip
    plain = clip_features(walk, FeatureSchema("plain", 30.0, channels[:2]))
    for i, part in enumerate(clip_permutations(walk, FeatureSchema("p", 30.0, channels, permutations=Permutations(2, 0.1, 0.3)))):
        assert np.array_equal(part.features[:, :-1], plain.features)
        assert part.features[0, -1] == pytest.approx(0.3 + 0.1 * i)
        assert np.array_equal(part.root, plain.root)


def test_of_a_looping_clip_a_permutation_looks_beyond_its_end_into_its_start():
    walk = make_clip("walk").clip
    schema = FeatureSchema("p", 30.0, (Channel("velocity", bone="Head", permuted=True),), permutations=Permutations(1, 0.0, 0.5))
    plain = clip_features(walk, FeatureSchema("p", 30.0, (Channel("velocity", bone="Head"),)), looping=True).features
    found = clip_features(walk, schema, looping=True).features
    assert found[-1, 1] == pytest.approx(plain[15, 1], abs=1e-4)  # upward; its last frame is its first once more


def test_a_query_is_that_of_a_permutation():
    part = clip_permutations(CLIP, SCHEMA)[2]
    assert np.array_equal(query_from(SCHEMA, CLIP, 7, permutation=2), part.features[7])
    with pytest.raises(QueryError, match="there is no permutation 3"):
        query_from(SCHEMA, CLIP, permutation=3)


# ---- databases


@pytest.mark.parametrize("in_s", [0.2, 0.4, 0.6])
def test_a_search_finds_the_frame_from_which_the_hand_is_at_the_ball_in_time(in_s):
    frame, event = 40 - round(in_s * 30), 40
    hit = DATABASE.search(ball_query(frame, event, in_s))
    assert (hit.asset, DATABASE.time_s(hit)) == ("catch", pytest.approx(frame / 30.0))
    assert DATABASE.permutation_s(hit.range) == pytest.approx(in_s)
    assert DATABASE.candidates(ball_query(frame, event, in_s), 1).rows[0].permutation_s == pytest.approx(in_s)


def test_each_clip_has_a_range_for_each_permutation_and_they_follow_one_another():
    schema = FeatureSchema.from_dict("catch", KEYS | {"mirror": [["Left*", "Right*"]], "channels": [{"type": "permutation_time"}]})
    walks = [make_clip(name).clip for name in ("walk", "jog")]
    database = MotionDatabase.build(walks, schema, mirror=["jog"])
    assert database.assets == ("walk",) * 3 + ("jog",) * 6
    assert database.mirrored.tolist() == [False] * 6 + [True] * 3
    assert [database.permutation_s(i) for i in range(9)] == pytest.approx([0.2, 0.4, 0.6] * 3)


def test_features_that_are_not_all_permutations_of_their_clips_are_refused():
    with pytest.raises(MotionError, match='features of "catch" are not those of its 3 permutations'):
        MotionDatabase.from_parts(clip_permutations(CLIP, SCHEMA)[:2], SCHEMA)


def test_the_cache_keeps_every_permutation_of_a_clip(tmp_path):
    write_bvh(CLIP, tmp_path / "catch.bvh")
    config = MotionConfig.from_dict({"features": {"catch": KEYS}, "databases": {"db": {"clips": "*.bvh", "features": "catch"}}})
    first, again = (build_all(config, tmp_path)["db"] for _ in range(2))
    assert (first.computed, again.cached) == (("catch",), ("catch",))
    assert np.array_equal(first.database.features, again.database.features)
    assert first.digest == again.digest
    fewer = KEYS | {"permutations": {"count": 2, "step_s": 0.2, "from_s": 0.2}}
    other = MotionConfig.from_dict({"features": {"catch": fewer}, "databases": {"db": {"clips": "*.bvh", "features": "catch"}}})
    assert build_all(other, tmp_path)["db"].computed == ("catch",)


def test_a_joint_clip_has_a_joint_range_for_each_permutation():
    channels = [{"type": "position", "bone": "RightHand", "permuted": True}]
    schema = FeatureSchema.from_dict("two", {"rate": 30, "permutations": {"count": 2, "step_s": 0.1}, "channels": channels})
    joint = JointDatabase.of(MotionDatabase.build(make_joint_clip("greet_walk").values(), schema), ("Host", "Guest"))
    assert joint.assets == ("greet_walk", "greet_walk")
    assert [[joint.database.permutation_s(i) for i in roles] for roles in joint.ranges.tolist()] == [[0.0, 0.0], [0.1, 0.1]]


def test_a_query_from_the_pose_that_is_shown_takes_the_pose_for_what_comes():
    clip = make_clip("walk").clip
    bones = (("position", "RightHand", None), ("velocity", "Head", None), ("direction", "LeftFoot", "Hips"))
    channels = [Channel(kind, bone=bone, relative_to=other, permuted=True) for kind, bone, other in bones]
    schema = FeatureSchema("live", 30.0, (*channels, Channel("permutation_time")), permutations=Permutations(2, 0.3, 0.2))
    poses, local, history = poses_of(clip, 30.0), local_poses(clip), PoseHistory(clip.skeleton, 30.0)
    shown = [LivePose(poses.positions[f], resampled(local, 30.0).rotations[f]) for f in range(poses.n_frames)]
    for pose in shown[:-1]:
        history.add(pose)
    assert query_from_pose(schema, shown[-1], history) == pytest.approx(query_from(schema, clip, len(shown) - 1), abs=1e-4)


# ---- playing


def controller(**settings):
    return Controller(Selector([Entry("db", DATABASE)]), ControllerSettings(**({"search_every_s": 0.2} | settings)))


def test_a_clip_plays_on_while_its_permutations_count_down():
    playing = controller(jump_threshold_s=0.2, history_s=0.5)
    start = playing.update(0.0, ball_query(22, 40, 0.6))
    assert (start.action, start.playing.frame - DATABASE.starts[2]) == (Action.START, 22)
    for frame, in_s in ((28, 0.4), (34, 0.2)):
        found = playing.update(0.2, ball_query(frame, 40, in_s))
        assert (found.action, found.playing.asset) == (Action.CONTINUE, "catch")
        assert (found.playing.time_s, found.playing.permutation_s) == pytest.approx((frame / 30.0, in_s))
        assert found.cost == pytest.approx(0.0, abs=1e-6)


def test_playing_on_costs_what_the_cheapest_permutation_of_the_playing_frame_costs():
    playing, rng = controller(jump_threshold_s=3.0), np.random.default_rng(1)
    playing.update(0.0, ball_query(20, 40, 0.6))
    for _ in range(8):
        query = ball_query(30, int(rng.integers(10, 50)), float(rng.uniform(0.0, 0.8)))
        found = playing.update(0.2, query)
        same = [3 * (found.before.range // 3) * N_FRAMES + k * N_FRAMES + found.before.frame % N_FRAMES for k in range(3)]
        costs = [sum(DATABASE.channel_costs(frame, query).values()) for frame in same]
        assert found.continuing_cost == pytest.approx(min(costs))
        assert found.before.frame == same[int(np.argmin(costs))]


def test_what_plays_goes_on_in_a_database_that_was_built_with_other_permutations():
    playing = controller()
    playing.update(0.0, ball_query(22, 40, 0.6))
    fewer = replace(SCHEMA, permutations=Permutations(1, 0.0, 0.4))
    playing.selector = Selector([Entry("db", MotionDatabase.build([CLIP, OTHER], fewer))])
    found = playing.update(0.2, ball_query(28, 40, 0.4))
    assert (found.action, found.playing.asset, found.playing.permutation_s) == (Action.CONTINUE, "catch", 0.4)


def test_frames_just_played_are_left_out_in_every_permutation():
    playing = controller(history_s=1.0, jump_threshold_s=0.1)
    recorded = playing.recorder = Trace()
    playing.update(0.0, ball_query(22, 40, 0.6))
    playing.update(0.2, ball_query(28, 40, 0.4))
    why = recorded[1].candidates[0][1].why[: 3 * N_FRAMES].reshape(3, N_FRAMES)
    assert (why[:, 22:32] != 0).sum() == 3 * 10 - 1  # all but the frame that plays on
    assert (why[:, 32:] == 0).all()


def test_what_is_recorded_says_which_permutation_plays(tmp_path):
    playing = controller()
    recorded = playing.recorder = Trace()
    playing.update(0.0, ball_query(28, 40, 0.4))
    recorded.save(tmp_path / "session.parquet")
    assert Trace.load(tmp_path / "session.parquet")[0].playing == playing.playing
    assert "frame 88 of db, permutation 0.4 s" in "\n".join(decision_lines(recorded[0]))


def test_a_clip_is_counted_once_whatever_its_permutations():
    plain = FeatureSchema("plain", 30.0, (Channel("position", bone="RightHand"),))
    bank = PoseBank.build([CLIP, OTHER], plain)
    recorded = []
    for database in (DATABASE, MotionDatabase.build([CLIP, OTHER], plain)):
        trace = Trace()
        playing = Controller(Selector([Entry("db", database)]), ControllerSettings(search_every_s=0.1), recorder=trace)
        for i in range(10):
            playing.update(0.1 if i else 0.0, database.raw(3 * i))
        found = measure(trace, bank, databases={"db": database})
        recorded.append((found.frames_used_share, trace.stats().frames_used_share, found.assets_never_used))
    assert recorded[0] == recorded[1]
    assert len(near_clips(DATABASE, 100.0)) == 2
    assert coverage({"db": DATABASE}).n_frames == 2 * N_FRAMES


# ---- settings


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"permutations": 3}, "this is a number, not a table"),
        ({"permutations": {"count": 2}}, 'permutations has no "step_s"'),
        ({"permutations": {"count": 2, "step_s": 0.0}}, "out of range"),
        ({"permutations": {"count": 100, "step_s": 1.0}}, "the last looks 99 s ahead"),
        ({"channels": [{"type": "position", "bone": "Hips"}]}, "no channel looks ahead by them"),
        ({"channels": [{"type": "position", "bone": "Hips", "permuted": True, "at": 0.1}]}, 'both "at" and "permuted"'),
        ({"channels": [{"type": "phase", "permuted": True}]}, 'has no key "permuted"'),
    ],
)
def test_a_wrong_setting_is_named(changes, said):
    with pytest.raises(SchemaError, match=said):
        FeatureSchema.from_dict("catch", KEYS | changes)


def test_a_permuted_channel_needs_permutations():
    with pytest.raises(SchemaError, match='has the channel "RightHand position permuted", but no permutations'):
        FeatureSchema.from_dict("catch", {key: value for key, value in KEYS.items() if key != "permutations"})
