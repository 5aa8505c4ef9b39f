"""The play rate of a controller: as fast as the query asks for, within limits, and known to all that follows."""

from functools import cache
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip

from contextdb.motion import (
    Controller,
    ControllerGroup,
    ControllerSettings,
    Entry,
    FeatureSchema,
    MotionDatabase,
    Selector,
    Trace,
    steady_path,
    with_path,
)
from contextdb.motion.markup.markup import Markup
from contextdb.motion.trace.views import decision_lines

RATE = 30.0
STEP = 1.0 / RATE
SHARE = 0.36
"""So much of a missing speed is made up for, in logarithms: `CDBM_RATE_SHARE` in controller.h."""
SCHEMA = FeatureSchema.from_dict(
    "loco",
    {
        "rate": RATE,
        "channels": [
            {"type": "position", "bone": "LeftFoot"},
            {"type": "trajectory", "what": "position", "at": [0.33, 0.5, 1.0]},
        ],
    },
)
LOOPS = Markup.parse("asset,tag,from,to,value\nwalk,Looping,,,\n")
SELDOM = ControllerSettings(search_every_s=60.0)


@cache
def selector(schema=SCHEMA):
    return Selector([Entry("loco", MotionDatabase.build([make_clip("walk").clip], schema, markup=LOOPS))])


def database():
    return selector().databases["loco"]


def own_mps():
    """How fast the walk goes."""
    (x, z, _), (to_x, to_z, _) = database().root[[0, -1]].tolist()
    return ((to_x - x) ** 2 + (to_z - z) ** 2) ** 0.5 / ((database().n_frames - 1) / RATE)


def query(speed, frame=0):
    return with_path(SCHEMA, database().raw(frame), steady_path(speed, reach_s=1.0, rate=RATE))


def driven(speeds, settings=SELDOM, recorder=None):
    controller = Controller(selector(), settings, recorder)
    return [controller.update(STEP if i else 0.0, query(speed)) for i, speed in enumerate(speeds)]


@pytest.mark.parametrize("times", [0.7, 1.0, 1.5])
def test_a_clip_plays_a_third_of_the_way_in_logarithms_to_the_wanted_speed(times):
    first = driven([times * own_mps()])[0]
    assert first.play_rate == pytest.approx(times**SHARE, rel=0.03)


def test_the_split_is_that_of_the_screen_shown_in_the_talk():
    time_scale = 1.18**SHARE
    assert time_scale == pytest.approx(1.06, abs=0.005)


@given(st.floats(0.3, 9.0), st.floats(0.2, 1.0), st.floats(1.0, 2.0))
def test_the_rate_stays_within_its_limits(times, least, most):
    settings = ControllerSettings(search_every_s=60.0, min_play_rate=least, max_play_rate=most)
    assert all(least <= each.play_rate <= most for each in driven([times * own_mps()] * 5, settings))


def test_one_and_one_is_off():
    off = ControllerSettings(search_every_s=60.0, min_play_rate=1.0, max_play_rate=1.0)
    assert [each.play_rate for each in driven([3.0] * 5, off)] == [1.0] * 5


def test_who_is_to_stand_plays_at_the_clips_own_rate():
    assert driven([0.0])[0].play_rate == 1.0


def test_the_clip_moves_on_by_the_rate_and_so_does_what_comes_up():
    controller = Controller(selector(), SELDOM)
    rate = controller.update(0.0, query(1.5 * own_mps())).play_rate
    before, ahead = controller.playing, controller.upcoming(STEP)
    after = controller.update(STEP, query(1.5 * own_mps()))
    assert rate > 1.1
    assert after.playing == ahead
    assert after.playing.time_s - before.time_s == pytest.approx(rate * STEP)
    ahead_m = after.root_motion.ahead_m
    assert ahead_m == pytest.approx(rate * STEP * own_mps(), rel=0.2)


def test_frames_that_were_passed_quickly_are_remembered():
    controller = Controller(selector(), ControllerSettings(search_every_s=60.0, max_play_rate=3.0, history_s=5.0))
    for i in range(20):
        controller.update(STEP if i else 0.0, query(6.0))
    frames = {frame for played in controller.state.history for frame in range(played.start, played.stop)}
    assert frames == set(range(min(frames), max(frames) + 1))
    assert len(frames) > 25


def test_the_rate_changes_by_and_by_while_a_clip_plays_on():
    rates = [each.play_rate for each in driven([own_mps()] + [1.8 * own_mps()] * 60)]
    assert max(b - a for a, b in pairwise(rates)) < 0.04
    assert rates[-1] == pytest.approx(1.8**SHARE, rel=0.05)


def test_without_a_channel_of_the_path_every_clip_has_its_own_rate():
    schema = FeatureSchema.from_dict("feet", {"rate": RATE, "channels": [{"type": "position", "bone": "LeftFoot"}]})
    controller = Controller(selector(schema), SELDOM)
    assert controller.update(0.0, [9.0, 9.0, 9.0]).play_rate == 1.0


@pytest.mark.parametrize("what", ["velocity", "speed"])
def test_velocities_and_speeds_of_a_path_say_the_same(what):
    channels = [{"type": "trajectory", "what": what, "at": [0.5]}]
    schema = FeatureSchema.from_dict("path", {"rate": RATE, "channels": channels})
    raw = selector(schema).databases["loco"].raw(30)
    controller = Controller(selector(schema), SELDOM)
    assert controller.update(0.0, 1.5 * raw).play_rate == pytest.approx(1.5**SHARE, rel=0.2)


@given(st.lists(st.floats(0.3, 4.0), min_size=2, max_size=8))
def test_a_group_plays_at_the_rates_of_its_controllers_alone(speeds):
    group = ControllerGroup([Controller(selector(), SELDOM) for _ in range(2)])
    alone = driven(speeds)
    for i, speed in enumerate(speeds):
        for decision in group.update(STEP if i else 0.0, [query(speed), query(speed)]):
            assert (decision.play_rate, decision.playing) == (alone[i].play_rate, alone[i].playing)


def test_a_controller_restored_goes_on_at_its_rate():
    controller = Controller(selector(), SELDOM)
    controller.update(0.0, query(2.0))
    state = controller.state
    first = controller.update(STEP, query(2.5))
    controller.restore(state)
    again = controller.update(STEP, query(2.5))
    assert (again.playing, again.play_rate, again.root_motion) == (first.playing, first.play_rate, first.root_motion)


def test_a_session_keeps_the_rate_and_shows_it(tmp_path):
    trace = Trace(0, selector().databases)
    made = driven([2.0] * 3, recorder=trace)
    trace.save(tmp_path / "session.parquet")
    again = Trace.load(tmp_path / "session.parquet")
    assert [each.play_rate for each in again] == [each.play_rate for each in made]
    assert any("play rate" in line for line in decision_lines(again[1]))
