"""Cycles and their stances: cut from made clips, whose speed, cadence and steps are known."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from strategies import for_each

from contextdb.errors import ContextError
from contextdb.motion import Clip, MotionError
from contextdb.motion.clips.poses import LocalPoses, forward_kinematics
from contextdb.motion.made.recipes import RECIPES
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.places import joined, moved, movement_of, movement_to, undone
from contextdb.motion.walking.stances import Stances, blended_stances

STEADY = [name for name, recipe in RECIPES.items() if recipe.change == "steady" and recipe.gait != "Idle"]
PHASES = st.floats(0.0, 1.0, exclude_max=True)
METRES = st.floats(-5.0, 5.0)
PLACES = st.tuples(METRES, METRES, st.floats(-3.0, 3.0))


def part(clip, first, last):
    return Clip(clip.name, clip.skeleton, clip.frame_time_s, clip.values[first : last + 1], clip.metres_per_unit, clip.up)


# ---- places


@given(PLACES)
def test_a_place_undone_is_the_origin(place):
    np.testing.assert_allclose(joined(undone(place), place), (0.0, 0.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(joined(place, undone(place)), (0.0, 0.0, 0.0), atol=1e-9)


@given(PLACES)
def test_the_movement_to_a_place_comes_there(place):
    np.testing.assert_allclose(moved(movement_to(place), 1.0), place, atol=1e-6)


@given(PLACES, PLACES, st.floats(-1.0, 1.0))
def test_a_movement_seen_from_a_place_on_the_body_is_the_same_movement(movement, place, share):
    there = joined(moved(movement, share), place)
    np.testing.assert_allclose(joined(place, moved(movement_of(movement, place), share)), there, atol=1e-4)


# ---- cycles


@for_each(STEADY, [True, False])
def test_a_made_clip_gives_its_speed_cadence_and_turn(name, is_given):
    made = make_clip(name)
    cycle = Cycle.of(made.clip, footfalls=made.footfalls if is_given else None)
    pace = made.recipe.pace
    assert cycle.speed_mps == pytest.approx(pace.speed_mps, abs=1e-6)
    assert cycle.cadence == pytest.approx(pace.cycles_per_s, abs=1e-6)
    assert cycle.stride_m == pytest.approx(pace.stride_m, abs=1e-6)
    assert cycle.turn_dps == pytest.approx(made.recipe.turn_dps, abs=1e-6)


@pytest.mark.parametrize("name", ["walk", "run", "walk_turn_left_45"])
def test_phase_0_is_the_left_foot_in_mid_stance_and_the_right_foot_follows_half_a_cycle_later(name):
    made = make_clip(name)
    cycle, half = Cycle.of(made.clip, footfalls=made.footfalls), made.recipe.pace.duty / 2.0
    moment = 1.0 / len(cycle.rotations)
    for foot, middle in enumerate((1.0, 0.5)):  # down from its first moment within the stance to its last
        assert 0.0 <= cycle.stances.down[foot] - (middle - half) < moment
        assert 0.0 <= (middle + half) % 1.0 - cycle.stances.up[foot] < moment


@pytest.mark.parametrize(("name", "moments"), [("walk", 2.0), ("jog", 1.0), ("run", 1.0)])  # a walk's toe gives way at first
def test_a_foot_that_is_down_stands_still_below_a_body_that_moves_at_the_cycles_speed(name, moments):
    made = make_clip(name)
    cycle = Cycle.of(made.clip, footfalls=made.footfalls)
    reach = cycle.stances.length(0) / 2.0 - moments / len(cycle.rotations)
    phases = np.linspace(-reach, reach, 200)
    places = np.array([cycle.toes_at(phase)[0] + np.array([0.0, 0.0, cycle.stride_m * phase]) for phase in phases])
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=-1) / (2.0 * reach / 199.0 * cycle.duration_s)
    assert speeds.max() < 0.02


def test_toes_are_where_the_joints_have_them():
    cycle = Cycle.of(make_clip("run").clip)
    for moment in range(len(cycle.rotations)):
        phase = moment / len(cycle.rotations)
        rotations, positions = cycle.at(phase)
        placed = forward_kinematics(LocalPoses(cycle.skeleton, 1.0, positions[None], rotations[None]))
        toes = [cycle.skeleton.index("LeftToe"), cycle.skeleton.index("RightToe")]
        np.testing.assert_allclose(placed.positions[0, toes], cycle.toes_at(phase), atol=1e-9)


@pytest.mark.parametrize("first", [0, 5, 11, 20])
def test_a_loop_that_begins_anywhere_gives_the_same_cycle(first):
    clip = make_clip("jog").clip
    n = round(clip.rate / make_clip("jog").recipe.pace.cycles_per_s)
    whole, turned = Cycle.of(part(clip, 0, n)), Cycle.of(part(clip, first, first + n))
    assert turned.speed_mps == pytest.approx(whole.speed_mps, abs=1e-6)
    for phase in np.linspace(0.0, 1.0, 7):
        shift = abs(np.abs((whole.at(phase)[0] * turned.at(phase)[0]).sum(axis=-1)) - 1.0).max()
        assert shift < 1e-3
        np.testing.assert_allclose(whole.at(phase)[1], turned.at(phase)[1], atol=5e-3)


def test_a_cycle_goes_on_without_a_step_over_its_end():
    cycle = Cycle.of(make_clip("walk").clip)
    for near in (0.0, 0.37, 0.9999):
        before, after = cycle.at(near - 1e-6), cycle.at(near + 1e-6)
        np.testing.assert_allclose(np.abs((before[0] * after[0]).sum(axis=-1)), 1.0, atol=1e-9)
        np.testing.assert_allclose(before[1], after[1], atol=1e-4)


def test_a_clip_whose_ends_differ_is_refused_with_the_joint():
    with pytest.raises(
        MotionError, match=r"walk: the cycle's end is not its beginning: \".+\" and others are up to .+ cm and .+° from"
    ):
        Cycle.of(part(make_clip("walk").clip, 0, 20))


def test_wider_limits_take_a_clip_that_was_refused_and_close_it():
    made = make_clip("walk_slow")
    leaning = made.clip.values.copy()
    leaning[:, 6] += np.linspace(0.0, 30.0, made.clip.n_frames)  # the spine, more and more
    clip = Clip("walk_slow", made.clip.skeleton, made.clip.frame_time_s, leaning, made.clip.metres_per_unit)
    with pytest.raises(MotionError, match="at most 3 cm and 5°"):
        Cycle.of(clip)
    cycle = Cycle.of(clip, most_m=0.2, most_deg=15.0)
    assert cycle.speed_mps == pytest.approx(made.recipe.pace.speed_mps, abs=1e-6)
    np.testing.assert_allclose(cycle.at(0.0)[1], cycle.at(1.0)[1], atol=1e-9)


@pytest.mark.parametrize(("name", "says"), [("idle", "0.00 m far"), ("start_walk", "end is not its beginning|no whole cycle")])
def test_a_clip_without_a_cycle_is_refused(name, says):
    made = make_clip(name)
    clip = made.clip if name == "idle" else part(made.clip, 0, 25)
    with pytest.raises(MotionError, match=says):
        Cycle.of(clip)


# ---- stances


@given(PHASES, PHASES, PHASES)
def test_a_stance_says_when_it_changes(down, up, phase):
    stances = Stances((down, 0.0), (up, 0.5))
    until = stances.until_change(0, phase)
    assert 0.0 <= until < 1.0
    assert stances.is_down(0, phase) == ((phase - down) % 1.0 < (up - down) % 1.0)
    assert 0.0 <= stances.share_of_state(0, phase) <= 1.0
    if until > 1e-6:
        assert stances.is_down(0, phase + 0.5 * until) == stances.is_down(0, phase)


@given(PHASES, PHASES, st.integers(1, 4), st.floats(0.01, 1.0))
def test_a_blend_of_equal_stances_is_that_stance(down, up, n, first):
    stances = Stances((down, 0.25), (up, 0.75), (1.0, 0.5))
    weights = np.array([first, *[1.0] * (n - 1)]) / (first + n - 1)
    blended = blended_stances([stances] * n, weights.tolist())
    np.testing.assert_allclose([blended.down, blended.up, blended.holds], [stances.down, stances.up, stances.holds], atol=1e-12)


@given(PHASES, st.floats(-0.2, 0.2), st.floats(0.0, 1.0))
def test_an_edge_of_a_blend_is_between_the_edges_over_the_end_of_a_cycle_too(edge, apart, share):
    first, second = Stances((edge, 0.0), (0.9, 0.5)), Stances(((edge + apart) % 1.0, 0.0), (0.9, 0.5))
    down = blended_stances([first, second], [1.0 - share, share]).down[0]
    way = (down - edge + 0.5) % 1.0 - 0.5
    assert min(0.0, apart) - 1e-9 <= way <= max(0.0, apart) + 1e-9


@given(PHASES, PHASES, PHASES)
def test_stances_counted_from_elsewhere_say_the_same(down, shift, phase):
    stances = Stances((down, 0.2), ((down + 0.6) % 1.0, 0.8))
    until = stances.until_change(0, phase + shift)
    if 1e-6 < until < 0.39:
        assert stances.shifted(shift).until_change(0, phase) == pytest.approx(until, abs=1e-9)


def test_drawn_curves_give_edges_and_how_much_a_foot_is_held():
    phases = np.arange(100) / 100
    left = np.where((phases < 0.305) | (phases > 0.705), 1.0, 0.0)
    right = np.where((phases > 0.205) & (phases < 0.805), 0.5, 0.0)
    stances = Stances.of_curves(np.column_stack((left, right)))
    np.testing.assert_allclose(stances.down, (0.70, 0.20), atol=0.011)
    np.testing.assert_allclose(stances.up, (0.30, 0.80), atol=0.011)
    assert stances.holds == (1.0, 0.5)
    assert math.isclose(stances.middle(1), 0.5, abs_tol=0.01)


@pytest.mark.parametrize("curves", [np.ones((9, 2)), np.zeros((9, 2)), np.ones((9, 3)), [[2.0, 0.0], [0.0, 1.0]], np.ones((0, 2))])
def test_curves_without_one_stance_a_foot_are_refused(curves):
    with pytest.raises(MotionError):
        Stances.of_curves(curves)


def test_a_third_foot_is_refused():
    with pytest.raises(ContextError, match="no foot 2"):
        Stances((0.0, 0.5), (0.5, 0.0)).is_down(2, 0.0)
