"""A match node: which frame it enters, where the body is on the way, and that it arrives. Scenarios read like the talks."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from strategies import examples

from contextdb.errors import MotionError, QueryError
from contextdb.motion import Clip, MotionDatabase, query_from
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.markup.marks import Mark, Marks
from contextdb.motion.markup.markup import Markup
from contextdb.motion.nodes.match_node import MatchNode
from contextdb.motion.nodes.pose_match import pose_schema
from contextdb.motion.nodes.warping import Target
from contextdb.motion.selection.root_motion import RootMotion

RATE = 30.0
SKELETON = make_clip("walk").clip.skeleton
SCHEMA = pose_schema(SKELETON)
CLIPS = [make_clip(name).clip for name in ("walk", "run", "stop_walk", "stop_run", "walk_turn_left_90", "walk_turn_right_90")]


def made(markup="", clips=CLIPS):
    """A database of made clips; lines of markup may end early."""
    rows = [row + "," * (4 - row.count(",")) for row in markup.split()]
    return MotionDatabase.build(clips, SCHEMA, markup=Markup.parse("\n".join(["asset,tag,from,to,value", *rows])))


def handmade(paths, warps=None, features=None, **marks):
    """A database of bare paths, one asset each, with one feature that is 0 in every frame unless given."""
    root = np.concatenate(paths).astype(np.float32)
    stops = np.cumsum([len(path) for path in paths])
    starts = stops - [len(path) for path in paths]
    values = np.zeros((len(root), 1)) if features is None else np.asarray(features, float).reshape(len(root), -1)
    plain = MotionDatabase.from_features(values.astype(np.float32), starts, stops, [f"asset {i}" for i in range(len(paths))])
    given = Marks.none(len(root), len(paths))
    return replace(plain, root=root, marks=replace(given, **({} if warps is None else {"warps": np.array(warps)}), **marks))


def ahead(n_frames, speed=1.0):
    """A path straight ahead."""
    return np.column_stack((np.zeros(n_frames), np.arange(n_frames) * speed / RATE, np.zeros(n_frames)))


def node(database, **options):
    return MatchNode(database, rate=RATE if database.schema is None else None, **options)


def misses_by(play, target):
    """Metres from the target when its place is reached, and radians when its heading is."""
    there, facing = play.at(play.path.position_s), play.at(play.path.rotation_s)
    angle = 0.0 if target.turn_rad is None else abs(math.remainder(facing.turn_rad - target.turn_rad, math.tau))
    return math.hypot(there.left_m - target.left_m, there.ahead_m - target.ahead_m), angle


# ---- stitches


@examples(10)
@given(st.data())
def test_a_stitch_is_the_shortest_part_that_joins_two_poses_under_a_cost(data):
    lengths = data.draw(st.lists(st.integers(1, 9), min_size=1, max_size=3))
    features = data.draw(st.lists(st.integers(0, 6), min_size=sum(lengths), max_size=sum(lengths)))
    kinds = data.draw(st.lists(st.integers(0, 3), min_size=sum(lengths), max_size=sum(lengths)))
    flags = np.array([Mark.MATCH_RANGE, 0, Mark.EXCLUDED | Mark.MATCH_RANGE, Mark.DO_NOT_CHOOSE | Mark.MATCH_RANGE], np.uint8)
    costs, weights, tags = np.array([0.0, 0.0, 0.0, 0.0]), np.ones(4), np.zeros((4, 0), np.bool_)
    marks = {"kinds": np.array(kinds, np.uint16), "kind_marks": flags, "kind_biases": costs, "kind_root_weights": weights}
    made_by_hand = handmade([ahead(n) for n in lengths], features=features)
    database = replace(made_by_hand, marks=replace(made_by_hand.marks, **marks, kind_tags=tags))
    old, new, most = (data.draw(st.integers(0, 6)) for _ in range(3))
    parts = []
    for start, stop in zip(database.starts.tolist(), database.stops.tolist(), strict=True):
        for first in range(start, stop):
            for last in range(first + 1, stop):
                cost = (features[first] - old) ** 2 + (features[last] - new) ** 2
                if cost <= most and kinds[first] == 0 and all(kinds[frame] != 2 for frame in range(first, last + 1)):
                    parts.append((last - first, cost, first))
    play = node(database).stitch([old], [new], most)
    found = play and (round(play.duration_s * RATE), play.hit.cost, play.hit.frame)
    assert found == min(parts, default=None)
    if play is not None:
        assert play.at(play.duration_s).ahead_m == pytest.approx(play.duration_s)
        assert play.costs.total == pytest.approx(play.hit.cost)


def test_a_stitch_from_standing_to_walking_is_a_start_and_a_dearer_one_is_shorter():
    clips = {name: make_clip(name).clip for name in ("idle", "walk", "start_walk", "stop_walk", "jog")}
    stitches = MatchNode(MotionDatabase.build([clips["start_walk"], clips["stop_walk"]], SCHEMA))
    stands, walks = query_from(SCHEMA, clips["idle"], 10), query_from(SCHEMA, clips["walk"], 40)
    plays = [stitches.stitch(stands, walks, most) for most in (0.0, 0.05, 0.4)]
    assert plays[0] is None
    assert [play.hit.asset for play in plays[1:]] == ["start_walk", "start_walk"]
    assert plays[1].duration_s > plays[2].duration_s > 0.0
    back = stitches.stitch(walks, stands, 0.05)
    assert back.hit.asset == "stop_walk"
    while not back.is_done:
        back.advance(1 / 60)
    assert back.frame == back.hit.frame + round(back.duration_s * RATE)


@pytest.mark.parametrize("most", [-1.0, math.nan, "0.1", None])
def test_what_is_no_cost_of_a_stitch_is_refused(most):
    with pytest.raises(QueryError, match="the most that a part may cost is"):
        node(handmade([ahead(4)])).stitch([0.0], [0.0], most)


# ---- as in the talks


COVER = """
run,Excluded
walk,Excluded
walk_*,Excluded
stop_walk,Excluded
stop_run,MatchRange,1.8,3.2
stop_run,WarpPosition,0.0,4.0
stop_run,WarpRotation,3.0,4.0
"""


def test_a_running_character_that_decides_to_go_into_cover_stands_there_in_the_end():
    database = made(COVER)
    body = RootMotion(12.0, -3.0, 0.4)
    cover = body.then(RootMotion(0.6, 4.2, 0.5))  # where code wants it
    target = Target.seen_from(body, cover.left_m, cover.ahead_m, cover.turn_rad)
    play = node(database).enter(query_from(SCHEMA, make_clip("run").clip, 14), target)
    assert play.hit.asset == "stop_run"
    assert 1.8 <= play.entry_s <= 3.2  # it picked something further in the animation, within its match range
    shares = []
    while not play.is_done:
        shares.append(play.warp_share(play.time_s).position)
        there = play.advance(1.0 / 60.0)
    assert shares[0] == 0.0
    assert any(0.6 < share < 0.9 for share in shares)  # "the positional warping is 73% at this point"
    assert shares[-1] == 1.0  # "and the result is 100%"
    assert misses_by(play, target) == (pytest.approx(0.0, abs=1e-9), pytest.approx(0.0, abs=1e-9))
    stands = body.then(there)
    assert math.hypot(stands.left_m - cover.left_m, stands.ahead_m - cover.ahead_m) < 0.01
    assert abs(stands.turn_rad - cover.turn_rad) < 0.01


def test_a_mirrored_animation_ends_on_the_other_side():
    schema = pose_schema(SKELETON, mirror=(("Left*", "Right*"),))
    database = MotionDatabase.build([make_clip("walk_turn_left_90").clip], schema, mirror=True)
    ends = node(database).ends
    left, right = (ends[start:stop] for start, stop in zip(database.starts, database.stops, strict=True))
    np.testing.assert_allclose(right, left * [-1.0, 1.0, -1.0], atol=1e-4)


# ---- which frame


@st.composite
def questions(draw):
    """A hand-made database with warp ranges, excluded frames and gaps, and what a match node is asked."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    lengths = draw(st.lists(st.integers(0, 12), min_size=1, max_size=5))
    gaps = rng.integers(0, 3, len(lengths))
    stops = np.cumsum(lengths + gaps)
    starts, n_frames = stops - lengths, int(stops[-1])
    features = rng.normal(size=(n_frames, 2)).astype(np.float32)
    plain = MotionDatabase.from_features(features, starts, stops, [f"asset {i}" for i in range(len(lengths))])
    in_range = np.zeros(n_frames, np.bool_)
    for start, stop in zip(starts, stops, strict=True):
        in_range[start:stop] = True
    steps = rng.normal(size=(n_frames, 3)) * [0.2, 0.2, 0.5]
    root = np.where(in_range[:, None], np.cumsum(steps, axis=0), np.nan).astype(np.float32)
    if draw(st.booleans()):
        root[:, 2] = np.arctan2(np.sin(root[:, 2]), np.cos(root[:, 2]))
    ends = np.array(lengths)[:, None, None] / RATE * 1.2
    warps = np.where(rng.random((len(lengths), 2, 2)) < 0.3, np.nan, np.sort(rng.random((len(lengths), 2, 2))) * ends)
    marks = replace(
        Marks.none(n_frames, len(lengths)),
        kinds=rng.choice(3, n_frames, p=[0.7, 0.2, 0.1]).astype(np.uint16),
        kind_tags=np.zeros((3, 0), np.bool_),
        kind_marks=np.array([Mark.MATCH_RANGE, 0, Mark.EXCLUDED | Mark.MATCH_RANGE], np.uint8),
        kind_biases=np.array([0.0, 0.0, -1.0]),
        kind_root_weights=np.ones(3),
        warps=warps,
    )
    metres, angles = st.floats(-3.0, 3.0), st.floats(-7.0, 7.0)
    target = draw(st.builds(Target, metres, metres, st.none() | angles))
    weights = {name: draw(st.sampled_from([0.0, 0.5, 20.0])) for name in ("position_weight", "rotation_weight")}
    return replace(plain, root=root, marks=marks), rng.normal(size=2), target, weights


def slow_last(database, frame):
    """The last frame that playing on from one leads to."""
    last, stop = frame, int(database.stops[database.range_of(frame)])
    while last + 1 < stop and not database.marks.mark_of(last + 1) & Mark.EXCLUDED:
        last += 1
    return last


def slow_window(database, frame, which):
    """From and to of the warp window left to a frame, in seconds since its range's start; None when there is no time left."""
    i = database.range_of(frame)
    own, last = ((f - int(database.starts[i])) / RATE for f in (frame, slow_last(database, frame)))
    first, end = database.marks.warps[i, which].tolist()
    first, end = (own if math.isnan(first) else max(first, own)), (last if math.isnan(end) else min(end, last))
    return (first, end) if end - first > 1e-6 else None


def slow_end(database, frame):
    """Where the animation brings the body from a frame by itself: left, ahead, turn."""
    i = database.range_of(frame)
    start, last = int(database.starts[i]), slow_last(database, frame)
    path = [[float(value) for value in row] for row in database.root[frame : last + 1]]
    for before, row in pairwise(path):
        row[2] = before[2] + math.remainder(row[2] - before[2], math.tau)
    frames = [(f - start) / RATE for f in range(frame, last + 1)]
    times = [window[1] if (window := slow_window(database, frame, which)) else frames[-1] for which in (0, 1)]
    x, z = (float(np.interp(times[0], frames, [row[k] for row in path])) - path[0][k] for k in (0, 1))
    h = path[0][2]
    turn = float(np.interp(times[1], frames, [row[2] for row in path])) - h
    return math.cos(h) * x - math.sin(h) * z, math.sin(h) * x + math.cos(h) * z, turn


def slow_target_cost(database, frame, target, position_weight, rotation_weight):
    left, far, turn = slow_end(database, frame)
    angle = 0.0 if target.turn_rad is None else math.remainder(turn - target.turn_rad, math.tau)
    return position_weight * ((left - target.left_m) ** 2 + (far - target.ahead_m) ** 2) + rotation_weight * angle**2


@examples(2)
@given(questions())
def test_the_frame_entered_is_the_one_that_looking_at_every_frame_finds(question):
    database, query, target, weights = question
    costs = {}
    for frame in range(database.n_frames):
        if database.range_of(frame) >= 0 and database.marks.mark_of(frame) == Mark.MATCH_RANGE:
            motion = float(np.sum((database.features[frame].astype(float) - query) ** 2))
            costs[frame] = motion + slow_target_cost(database, frame, target, **weights)
    play = node(database, **weights).enter(query, target)
    if not costs:
        assert play is None
        return
    assert play.hit.cost == pytest.approx(min(costs.values()), rel=1e-9, abs=1e-9)
    assert costs[play.hit.frame] == pytest.approx(min(costs.values()), rel=1e-6, abs=1e-6)
    assert play.costs.total == pytest.approx(play.hit.cost)


@examples(2)
@given(questions(), st.data())
def test_from_any_frame_with_time_to_warp_the_target_is_reached(question, data):
    database, query, target, weights = question
    frames = [f for f in range(database.n_frames) if database.range_of(f) >= 0]
    if not frames:
        return
    frame = data.draw(st.sampled_from(frames))
    hit = replace(database.search(query), frame=frame, range=database.range_of(frame))
    play = node(database, **weights).play(hit, query, target)
    assert play.duration_s == pytest.approx((slow_last(database, frame) - frame) / RATE)
    start_s = (frame - int(database.starts[hit.range])) / RATE
    for which, reached_s in enumerate((play.path.position_s, play.path.rotation_s)):
        window = slow_window(database, frame, which)
        if window is None or (which and target.turn_rad is None):
            assert reached_s is None
            continue
        assert reached_s == pytest.approx(window[1] - start_s)
        there = play.at(reached_s)
        if which:
            assert abs(math.remainder(there.turn_rad - target.turn_rad, math.tau)) < 1e-9
        else:
            assert math.hypot(there.left_m - target.left_m, there.ahead_m - target.ahead_m) < 1e-9


def test_costs_say_what_comes_from_where():
    database = made("walk,CostModifier,,,0.25", clips=CLIPS[:1])
    query = query_from(SCHEMA, make_clip("run").clip, 3)
    target = Target(0.5, 2.0, 0.3)
    play = node(database, position_weight=2.0, rotation_weight=3.0).enter(query, target, penalties={"walk": 1.5})
    left, far, turn = slow_end(database, play.hit.frame)
    assert play.costs.motion == database.channel_costs(play.hit, query)
    assert play.costs.distance == pytest.approx(2.0 * ((left - 0.5) ** 2 + (far - 2.0) ** 2))
    assert play.costs.rotation == pytest.approx(3.0 * (turn - 0.3) ** 2)
    assert play.costs.biases == 1.75
    assert play.costs.total == pytest.approx(play.hit.cost)


def test_candidates_begin_with_the_frame_entered_and_tell_why_others_are_out():
    database = made(COVER)
    query, target = query_from(SCHEMA, make_clip("run").clip, 14), Target(0.0, 4.0, 0.0)
    found = node(database).candidates(query, target, 3)
    hit = node(database).search(query, target)
    assert (found.rows[0].frame, found.rows[0].cost) == (hit.frame, hit.cost)
    assert found.counts[LeftOut.MATCH_RANGE] > 0
    costs = node(database).target_costs(target)
    assert found.rows[1].biases["given"] == pytest.approx(costs[0][found.rows[1].frame] + costs[1][found.rows[1].frame])


# ---- playing


def test_advancing_ends_at_the_end_of_the_animation_and_stays_there():
    play = node(handmade([ahead(31)])).enter([0.0], Target(0.0, 3.0))
    placements = [play.advance(1.0 / 30.0) for _ in range(30)]
    assert play.is_done
    assert [there.ahead_m for there in placements] == pytest.approx([0.1 * (i + 1) for i in range(30)])
    assert play.advance(5.0) == placements[-1] == play.at(100.0) == RootMotion(0.0, 3.0, 0.0)
    assert play.frame == 30


def test_a_looping_animation_ends_with_its_range():
    play = node(handmade([ahead(31)], looping=np.array([True]))).enter([0.0], Target(0.0, 1.0))
    play.advance(10.0)
    assert play.is_done
    assert play.frame == 30


def test_it_plays_no_excluded_frame_and_arrives_before_one():
    database = made("run,Excluded,2.0,2.5", clips=CLIPS[1:2])
    play = node(database).enter(query_from(SCHEMA, make_clip("run").clip, 3), Target(0.0, 5.0))
    assert play.entry_s + play.duration_s == pytest.approx(59 / RATE)
    assert play.at(play.duration_s).ahead_m == pytest.approx(5.0)


def test_a_range_of_one_frame_is_done_at_once():
    play = node(handmade([ahead(1)])).enter([0.0], Target(0.0, 1.0, 1.0))
    assert play.is_done
    assert play.duration_s == 0.0
    assert play.advance(1.0) == RootMotion()
    assert play.costs.distance == 1.0
    assert (play.path.position_s, play.path.rotation_s) == (None, None)


def test_an_empty_database_has_nothing_to_enter():
    empty = MotionDatabase.build([], SCHEMA)
    assert node(empty).enter(np.zeros(SCHEMA.n_features), Target(0.0, 1.0)) is None
    no_frames = MotionDatabase.build([Clip("none", SKELETON, 1.0 / RATE, np.zeros((0, SKELETON.n_channels)))], SCHEMA)
    assert node(no_frames).enter(np.zeros(SCHEMA.n_features), Target(0.0, 1.0)) is None


# ---- what does not fit


def test_a_database_without_root_motion_is_refused():
    plain = MotionDatabase.from_features(np.zeros((3, 1)), [0], [3], ["a"])
    with pytest.raises(MotionError, match=r"has no root motion\. Accepted: x and z"):
        MatchNode(plain, rate=RATE)
    with pytest.raises(MotionError, match="shape"):
        MatchNode(replace(plain, root=np.zeros((2, 3), np.float32)), rate=RATE)
    with pytest.raises(MotionError, match=r'frame 1 is .*nan.* \(asset "a"\)'):
        MatchNode(replace(plain, root=np.array([[0, 0, 0], [0, np.nan, 0], [0, 0, 0]], np.float32)), rate=RATE)


@pytest.mark.parametrize("rate", [None, 0.0, -1.0, math.nan, "30"])
def test_a_rate_that_is_none_is_refused(rate):
    with pytest.raises(MotionError, match="rate"):
        MatchNode(handmade([ahead(3)]), rate=rate)


def test_a_rate_other_than_the_schemas_is_refused():
    with pytest.raises(MotionError, match="30, the schema's"):
        MatchNode(made(), rate=60.0)


@pytest.mark.parametrize("weight", [-1.0, math.nan, math.inf, 1e7, "heavy"])
def test_a_weight_that_is_none_is_refused(weight):
    for name in ("position_weight", "rotation_weight"):
        with pytest.raises(MotionError, match=name):
            node(handmade([ahead(3)]), **{name: weight})


def test_questions_that_do_not_fit_are_refused():
    asked = node(handmade([ahead(3)]))
    with pytest.raises(QueryError, match="the target is"):
        asked.enter([0.0], (0.0, 1.0))
    with pytest.raises(QueryError, match="the query has shape"):
        asked.enter([0.0, 1.0], Target(0.0, 1.0))
    with pytest.raises(QueryError, match="the frame is -1"):
        asked.play(asked.search([0.0], Target(0.0, 1.0), np.zeros(1, np.bool_)), [0.0], Target(0.0, 1.0))


@pytest.mark.parametrize("seconds", [-0.1, math.nan, math.inf, "1"])
def test_times_that_are_none_are_refused(seconds):
    play = node(handmade([ahead(3)])).enter([0.0], Target(0.0, 1.0))
    for ask in (play.advance, play.at, play.warp_share):
        with pytest.raises(QueryError, match="seconds, 0 or more"):
            ask(seconds)
