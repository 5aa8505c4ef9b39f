"""Blends of cycles and changes of gait: weights that sum to one, feet that stand, a change while a foot is in the air."""

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip

from contextdb.motion import MotionError
from contextdb.motion.walking.blending import Gait, Mix
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.walker import GaitState, advanced, wanted_gait

SPEEDS = st.floats(0.0, 8.0)
AXES = st.floats(-1.5, 1.5)


@cache
def cycle(name):
    made = make_clip(name)
    return Cycle.of(made.clip, footfalls=made.footfalls)


@cache
def walk(**corners):
    return Gait("walk", [cycle("walk"), cycle("walk_fast")], **{corner: cycle(name) for corner, name in corners.items()})


@cache
def run(**corners):
    steady = [cycle("sprint"), cycle("jog"), cycle("run")]
    return Gait("run", steady, **{corner: cycle(name) for corner, name in corners.items()})


LEANING = {"turning_left": "jog_turn_left_60", "turning_right": "jog_turn_right_60"}
BOTH = {**LEANING, "speeding_up": "jog_tired", "slowing_down": "run_tired"}


# ---- weights


@given(SPEEDS, AXES, AXES, st.sampled_from([{}, LEANING, BOTH]))
def test_weights_sum_to_one_and_none_is_negative(speed, acceleration, turn, corners):
    weights = run(**corners).weights(speed, acceleration, turn)
    assert weights.sum() == pytest.approx(1.0)
    assert (weights >= 0.0).all()


@given(SPEEDS, AXES, AXES, st.sampled_from([{}, LEANING, BOTH]), st.tuples(*[st.floats(-1e-6, 1e-6)] * 3))
def test_weights_have_no_step(speed, acceleration, turn, corners, moved):
    gait = run(**corners)
    first = gait.weights(speed, acceleration, turn)
    second = gait.weights(speed + moved[0], acceleration + moved[1], turn + moved[2])
    assert np.abs(first - second).max() < 1e-5


def test_steady_cycles_are_kept_from_slow_to_fast():
    assert [each.name for each in run().steady] == ["jog", "run", "sprint"]


@given(AXES, AXES)
def test_a_corner_without_a_cycle_goes_to_its_steady_neighbour(acceleration, turn):
    np.testing.assert_allclose(run().weights(3.0, acceleration, turn), run().weights(3.0), atol=1e-12)
    leaning = run(**LEANING)
    np.testing.assert_allclose(leaning.weights(3.0, acceleration, turn), leaning.weights(3.0, 0.0, turn), atol=1e-12)


# ---- blends


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_blend_of_a_cycle_with_itself_is_that_cycle(share, phase):
    own = cycle("walk")
    mix = Mix.of([own, own], np.array([share, 1.0 - share]))
    np.testing.assert_allclose(mix.at(phase)[0], own.at(phase)[0], atol=1e-12)
    np.testing.assert_allclose(mix.at(phase)[1], own.at(phase)[1], atol=1e-12)
    assert mix.stride_m == pytest.approx(own.stride_m)
    np.testing.assert_allclose([mix.stances.down, mix.stances.up], [own.stances.down, own.stances.up], atol=1e-12)


@pytest.mark.parametrize(("first", "second"), [("walk", "walk_fast"), ("jog", "run"), ("run", "sprint"), ("walk_fast", "jog")])
@pytest.mark.parametrize("share", [0.25, 0.5, 0.8])
def test_a_foot_stands_still_in_a_blend(first, second, share):
    mix = Mix.of([cycle(first), cycle(second)], np.array([share, 1.0 - share]))
    reach = min(each.stances.length(0) / 2.0 - 1.0 / len(each.rotations) for each in mix.cycles)
    phases = np.linspace(-reach, reach, 200)
    places = np.array([mix.toes_at(phase)[0] + np.array([0.0, 0.0, mix.stride_m * phase]) for phase in phases])
    duration_s = sum(weight * each.duration_s for each, weight in zip(mix.cycles, mix.weights, strict=True))
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=-1) / (2.0 * reach / 199.0 * duration_s)
    assert speeds.max() < 0.02


def test_cycles_of_one_speed_of_other_rigs_or_none_are_refused():
    other = replace(cycle("walk_fast"), feet=("LeftToe", "RightToe"))
    with pytest.raises(MotionError, match="no steady cycle"):
        Gait("walk", [])
    with pytest.raises(MotionError, match="m/s fast"):
        Gait("walk", [cycle("walk"), cycle("walk")])
    with pytest.raises(MotionError, match="different rigs"):
        Gait("walk", [cycle("walk"), other])


# ---- changes of gait


def overlapping():
    return [Gait("walk", [cycle("walk"), cycle("jog")]), Gait("run", [cycle("walk_fast"), cycle("run")])]


@given(st.lists(SPEEDS, max_size=30))
def test_a_gait_is_kept_where_both_overlap_or_leave_a_gap(speeds):
    for gaits in (overlapping(), [walk(), run()]):
        low, high = sorted((gaits[0].fastest_mps, gaits[1].slowest_mps))
        now = 0
        for speed in speeds:
            wanted = wanted_gait(gaits, now, speed)
            assert wanted == (1 if speed > high else 0 if speed < low else now)
            now = wanted


def ramped(speeds, dphase=0.013):
    gaits = [walk(), run()]
    each = [Mix.of(gait.cycles, gait.weights(2.0)).stances for gait in gaits]
    state, phase, states = GaitState(0, 0), 0.1, []
    for speed in speeds:
        state = advanced(state, gaits, wanted_gait(gaits, state.now, speed), each, phase, dphase)
        phase += dphase
        states.append((phase % 1.0, state))
    return each, states


@given(st.lists(SPEEDS, min_size=20, max_size=20), st.floats(0.003, 0.08))
def test_a_change_begins_when_a_foot_lifts_and_is_over_before_that_foot_lands(speeds, dphase):
    each, states = ramped(np.repeat(speeds, 10), dphase)
    foot = None
    for (before, old), (after, new) in itertools.pairwise(states):
        if new.is_changing and not old.is_changing:
            own = each[new.now]
            lifted = [f for f in (0, 1) if own.is_down(f, before) and not own.is_down(f, after)]
            assert lifted
            foot = lifted[0]
        elif foot is not None and new.is_changing:
            assert not any(own.is_down(foot, after) and not own.is_down(foot, before) for own in (each[old.now], each[old.to]))
        assert 0.0 <= new.share < 1.0
