"""Pose matching: where an animation is started, which part of it counts, and which of several is the best."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip

from contextdb.errors import ContextDBError, MotionError, QueryError, SchemaError
from contextdb.motion import Markup, MotionDatabase, Skeleton, query_from
from contextdb.motion.answers import NamedAssets
from contextdb.motion.nodes.pose_match import best_start, hands_of, pose_schema

SKELETON = make_clip("walk").clip.skeleton
SCHEMA = pose_schema(SKELETON)
NAMES = ("walk", "walk_tired", "jog", "run", "idle")
CLIPS = [make_clip(name).clip for name in NAMES]
DATABASE = MotionDatabase.build(CLIPS, SCHEMA)
LOOPING = MotionDatabase.build(CLIPS, SCHEMA, markup=Markup.parse("asset,tag,from,to\nwalk,Looping,,\njog,Looping,,\n"))


def pose(name, time_s):
    return query_from(SCHEMA, make_clip(name).clip, round(time_s * SCHEMA.rate))


def skeleton_of(*names):
    """A chain of bones."""
    return Skeleton(names, np.arange(len(names)) - 1, np.zeros((len(names), 3)), ((),) * len(names))


# ---- as in the seed


def test_a_locomotion_loop_is_started_in_the_phase_the_feet_are_in():
    foot = SCHEMA.slices["LeftFoot position"]
    for time_s in (0.2, 0.5, 0.8):
        query = pose("walk_tired", time_s)
        hit = best_start(LOOPING, query, "walk")
        found = LOOPING.raw(hit)
        assert np.abs(found[foot] - query[foot]).max() < 0.12
        assert math.copysign(1.0, found[foot][2]) == math.copysign(1.0, query[foot][2])  # the same foot is in front


def test_the_assets_of_a_tables_answer_are_such_a_list():
    valid = NamedAssets(["walk", "an asset of another database"])
    assert best_start(DATABASE, pose("run", 0.4), valid).asset == "walk"


def test_of_some_clips_only_the_first_frames_count():
    within = {"jog": (0.0, 0.2), "walk": (0.0, math.inf)}
    for asset in ("jog", "walk", "run"):
        hit = best_start(LOOPING, pose(asset, 2.0), asset, within=within)
        assert (LOOPING.time_s(hit) <= 0.2 + 1e-6) == (asset == "jog")


def test_the_entrance_may_be_marked_in_the_markup_once_and_for_all():
    markup = Markup.parse("asset,tag,from,to\nwalk,MatchRange,0.2,0.5\n")
    database = MotionDatabase.build(CLIPS, SCHEMA, markup=markup)
    assert 0.2 <= database.time_s(best_start(database, pose("walk", 2.5), "walk")) <= 0.5 + 1e-6


def test_hands_tell_a_swing_of_the_left_from_one_of_the_right():
    schema = pose_schema(SKELETON, ["LeftHand", "RightHand"])
    walk = make_clip("walk").clip
    cycle_s = 31 / 30.0
    database = MotionDatabase.build([walk], schema)
    query = query_from(schema, walk, 40)
    apart_s = database.time_s(best_start(database, query)) - 40 / 30.0
    assert math.remainder(apart_s, cycle_s) == pytest.approx(0.0, abs=1e-6)  # not half a cycle off, where the other hand swings
    assert pose_schema(SKELETON, hands=True).bones[-2:] == ("LeftHand", "RightHand")


# ---- the schema


def test_feet_and_hips_are_compared_positions_above_velocities():
    assert SCHEMA.bones == ("LeftFoot", "RightFoot", "Hips")
    weights = {channel.name: channel.weight for channel in SCHEMA.channels}
    assert weights == {f"{bone} {kind}": w for kind, w in (("position", 1.0), ("velocity", 0.5)) for bone in SCHEMA.bones}


def test_a_metre_counts_the_same_for_every_bone():
    for kind in ("position", "velocity"):
        scales = [DATABASE.normalisation.scale[SCHEMA.slices[f"{bone} {kind}"]] for bone in SCHEMA.bones]
        assert len(set(np.concatenate(scales).tolist())) == 1


def test_hands_are_the_bones_nearest_the_root_that_are_called_so():
    fingers = skeleton_of("Hips", "LeftHand", "LeftHandThumb", "RightHandThumb", "RightHand")
    assert hands_of(fingers) == ("LeftHand", "RightHand")
    assert hands_of(skeleton_of("Hips", "lWrist", "rWrist")) == ("lWrist", "rWrist")
    assert hands_of(skeleton_of("Handy:Hips", "Handy:LeftArm", "Handy:RightArm", "Handy:LeftHand", "Handy:RightHand")) == (
        "Handy:LeftHand",
        "Handy:RightHand",
    )


def test_bones_that_are_not_there_are_refused_with_the_nearest():
    with pytest.raises(MotionError, match=r'there is no bone "LeftFot"(?s:.*)Did you mean "LeftFoot"(?s:.*)"Tail"'):
        pose_schema(SKELETON, ["LeftFot", "Tail"])
    with pytest.raises(MotionError, match="named like feet"):
        pose_schema(skeleton_of("a", "b"))
    with pytest.raises(MotionError, match="named like hands"):
        pose_schema(skeleton_of("a", "b"), ["a"], hands=True)


@pytest.mark.parametrize(
    "options",
    [{"rate": 0.0}, {"position_weight": -1.0}, {"position_weight": 0.0, "velocity_weight": 0.0}, {"bones": ["Hips", "Hips"]}],
    ids=str,
)
def test_a_schema_that_cannot_be_is_refused(options):
    with pytest.raises(SchemaError):
        pose_schema(SKELETON, **options)


# ---- the search


@given(
    st.integers(0, DATABASE.n_frames - 1),
    st.none() | st.lists(st.sampled_from(NAMES), unique=True),
    st.none() | st.tuples(st.integers(0, 40), st.integers(0, 40)).map(sorted),
)
def test_the_start_is_the_one_that_looking_at_every_frame_finds(frame, names, span):
    query = DATABASE.raw(frame)
    within = None if span is None else (span[0] / 10.0, span[1] / 10.0)
    costs = {}
    for i, asset in enumerate(LOOPING.assets):
        for f in range(LOOPING.starts[i], LOOPING.stops[i]):
            time_s = (f - LOOPING.starts[i]) / 30.0
            is_inside = within is None or LOOPING.marks.looping[i] or within[0] - 1e-6 <= time_s <= within[1] + 1e-6
            if (names is None or asset in names) and is_inside:
                costs[f] = sum(LOOPING.channel_costs(f, query).values())
    hit = best_start(LOOPING, query, names, within=within)
    assert bool(hit) == bool(costs)
    if costs:
        assert hit.cost == pytest.approx(min(costs.values()), abs=1e-9)
        assert costs[hit.frame] == pytest.approx(hit.cost, abs=1e-9)


def test_no_asset_and_no_frame_within_is_a_miss():
    assert not best_start(DATABASE, pose("run", 0.4), [])
    assert not best_start(DATABASE, pose("run", 0.4), "run", within=(100.0, 200.0))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"assets": "wlk"}, r'no asset "wlk"\. .*Did you mean "walk"'),
        ({"assets": ["walk", 3]}, 'no asset "3"'),
        ({"within": {"joog": (0.0, 1.0)}}, 'no asset "joog".*Did you mean "jog"'),
        ({"within": (1.0, 0.0)}, "within is"),
        ({"within": (-1.0, 0.0)}, "within is"),
        ({"within": (0.0,)}, "within is"),
        ({"within": (0.0, math.nan)}, "within is"),
        ({"within": (math.inf, math.inf)}, "within is"),
        ({"within": 0.5}, "within is"),
        ({"within": {"jog": None}}, "within is"),
    ],
    ids=str,
)
def test_what_is_no_part_of_a_clip_is_refused(options, message):
    with pytest.raises(QueryError, match=message):
        best_start(DATABASE, pose("run", 0.4), **options)


def test_times_need_a_schema():
    bare = MotionDatabase.from_features([[0.0]], [0], [1], ["a"])
    assert best_start(bare, [0.0], "a").frame == 0
    with pytest.raises(ContextDBError, match="built from clips"):
        best_start(replace(bare), [0.0], "a", within=(0.0, 1.0))
