"""Moving through a range, and the movement over the ground that comes of it, against walking every frame."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lines import RATE, line
from made_once import make_clip

from contextdb.motion import Entry, FeatureSchema, MotionDatabase, Selector
from contextdb.motion.markup.markup import Markup
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.playhead import Playhead
from contextdb.motion.selection.root_motion import NO_MOTION, RootMotion

SCHEMA = FeatureSchema.from_dict("loco", {"rate": 30.0, "channels": [{"type": "velocity", "bone": "Hips"}]})


@given(st.integers(1, 7), st.booleans(), st.integers(0, 8), st.integers(0, 40))
def test_a_long_step_leads_where_as_many_steps_of_one_frame_lead(n, is_looping, excluded, steps):
    rows = ("walk,Looping,,,\n" if is_looping else "") + f"walk,Excluded,{excluded / RATE},{excluded / RATE},\n"
    head = Playhead.of(line(rows, walk=range(n)), 0, RATE)
    time_s, passed, n_loops = 0.0, [], 0
    for _ in range(steps):
        move = head.moved(time_s, 1.0 / RATE)
        passed += [frame for span in move.spans for frame in range(*span)]
        time_s, n_loops = move.time_s, n_loops + move.n_loops
        if move.is_ended:
            break
    at_once = head.moved(0.0, steps / RATE)
    assert at_once.time_s == pytest.approx(time_s)
    assert at_once.frame == (move.frame if steps else 0)
    assert at_once.n_loops == n_loops
    assert set(passed) == {frame for span in at_once.spans for frame in range(*span)}
    if excluded > 0:
        assert excluded not in passed


def test_a_range_of_one_frame_has_ended_when_time_passes():
    head = Playhead.of(line("walk,Looping,,,", walk=[0]), 0, RATE)
    assert not head.moved(0.0, 0.0).is_ended
    assert head.moved(0.0, 0.01).is_ended


# ---- root motion


def made_controller(name, markup=""):
    database = MotionDatabase.build([make_clip(name).clip], SCHEMA, markup=Markup.parse("asset,tag,from,to,value\n" + markup))
    return database, Controller(Selector([Entry("a", database)]), ControllerSettings(search_every_s=1e6))


@pytest.mark.parametrize("dt_s", [1.0 / 30.0, 1.0 / 60.0, 0.11])
def test_the_movements_of_all_updates_together_are_the_path_of_the_clip(dt_s):
    database, one = made_controller("start_walk")
    one.update(0.0, database.raw(0))
    moved = NO_MOTION
    for _ in range(round(4.0 / dt_s)):
        moved = moved.then(one.update(dt_s, database.raw(0)).root_motion)
    time_s = one.playing.time_s
    x, z, heading = (np.interp(time_s * 30.0, np.arange(len(database.root)), database.root[:, i]) for i in range(3))
    first_x, first_z, first = database.root[0]
    left = math.cos(first) * (x - first_x) - math.sin(first) * (z - first_z)
    ahead = math.sin(first) * (x - first_x) + math.cos(first) * (z - first_z)
    assert (moved.left_m, moved.ahead_m, moved.turn_rad) == pytest.approx((left, ahead, heading - first), abs=1e-4)


def test_a_looping_circle_comes_back_to_where_it_began():
    database, one = made_controller("walk_turn_left_90", "*,Looping,,,")
    one.update(0.0, database.raw(0))
    n_round = database.n_frames - 1  # the last frame is the first once more
    turned = float(database.root[-1, 2] - database.root[0, 2])
    n_loops = round(8.0 * math.pi / turned)
    moved = NO_MOTION
    for _ in range(n_loops * n_round):
        moved = moved.then(one.update(1.0 / 30.0, database.raw(0)).root_motion)
    assert moved.turn_rad == pytest.approx(n_loops * turned, abs=1e-3)
    assert math.hypot(moved.left_m, moved.ahead_m) < 2.0  # the circle is 1.7 m across
    one.update(0.0, database.raw(0))
    at_once = one.update(n_loops * n_round / 30.0, database.raw(0)).root_motion
    assert (at_once.left_m, at_once.ahead_m, at_once.turn_rad) == pytest.approx(
        (moved.left_m, moved.ahead_m, moved.turn_rad), abs=1e-3
    )


def test_a_jump_moves_nobody():
    clips = [make_clip(name).clip for name in ("idle", "run")]
    database = MotionDatabase.build(clips, SCHEMA)
    one = Controller(Selector([Entry("a", database)]), ControllerSettings(search_every_s=0.0))
    one.update(0.0, database.raw(0))
    jump = one.update(1.0 / 30.0, database.raw(int(database.starts[1]) + 60))
    assert jump.playing.asset == "run"
    assert abs(jump.root_motion.ahead_m) < 0.01
    assert one.update(1.0 / 30.0, database.raw(int(database.starts[1]) + 61)).root_motion.ahead_m == pytest.approx(0.12, abs=0.03)


def test_the_root_weight_is_that_of_the_playing_frame():
    database, one = made_controller("walk", "walk,RootMotionWeight,0.5,,0.25\n")
    assert one.update(0.0, database.raw(0)).root_weight == 1.0
    decision = one.update(0.6, database.raw(0))
    assert decision.root_weight == 0.25
    scaled = decision.root_motion.scaled(decision.root_weight)
    assert scaled.ahead_m == pytest.approx(decision.root_motion.ahead_m / 4.0)


MOVES = st.builds(RootMotion, *[st.floats(-3.0, 3.0)] * 3)


@given(MOVES, MOVES, MOVES)
def test_movements_join_in_any_grouping_as_positions_do(a, b, c):
    joined, grouped = a.then(b).then(c), a.then(b.then(c))
    assert (joined.left_m, joined.ahead_m) == pytest.approx((grouped.left_m, grouped.ahead_m), abs=1e-9)
    heading, position = 0.0, np.zeros(2)
    for move in (a, b, c):  # (x, z) = left along +x and ahead along +z, turned by the heading towards +x
        position += [
            math.cos(heading) * move.left_m + math.sin(heading) * move.ahead_m,
            math.cos(heading) * move.ahead_m - math.sin(heading) * move.left_m,
        ]
        heading += move.turn_rad
    assert (joined.left_m, joined.ahead_m) == pytest.approx(tuple(position), abs=1e-9)


@given(MOVES, st.integers(0, 20))
def test_a_repeated_movement_is_made_as_often(move, times):
    expected = NO_MOTION
    for _ in range(times):
        expected = expected.then(move)
    found = move.repeated(times)
    assert (found.left_m, found.ahead_m, found.turn_rad) == pytest.approx(
        (expected.left_m, expected.ahead_m, expected.turn_rad), abs=1e-9
    )
