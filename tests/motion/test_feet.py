"""When feet are down: the questions of Forsyth's talk, and finding the answers in any clip."""

import math

import numpy as np
import pytest
from made_once import make_clip

from contextdb.errors import MotionError
from contextdb.motion import Clip, Skeleton
from contextdb.motion.clips.feet import Footfalls, footfalls, phases

FALLS = Footfalls(4.0, {"LeftFoot": np.array([[0.0, 1.0], [2.0, 3.0]]), "RightFoot": np.zeros((0, 2))})


@pytest.mark.parametrize(
    ("time_s", "is_down", "share"), [(0.0, True, 0.0), (0.25, True, 0.25), (1.5, False, 0.5), (2.0, True, 0.0), (3.5, False, 0.5)]
)
def test_a_foot_tells_whether_it_is_down_and_how_far_through(time_s, is_down, share):
    assert FALLS.is_down("LeftFoot", time_s) is is_down
    assert FALLS.share_of_state("LeftFoot", time_s) == pytest.approx(share)


def test_a_foot_that_never_comes_down_is_up_for_the_whole_clip():
    assert not FALLS.is_down("RightFoot", 2.0)
    assert FALLS.share_of_state("RightFoot", 1.0) == 0.25


def test_an_unknown_foot_is_refused_with_the_nearest():
    with pytest.raises(MotionError, match='Did you mean "LeftFoot"'):
        FALLS.is_down("leftfoot", 0.0)


@pytest.mark.parametrize("name", ["walk", "walk_turn_left_90", "sprint", "start_run", "stop_walk_tired", "idle"])
def test_footfalls_found_in_a_made_clip_are_those_it_was_made_with(name):
    made = make_clip(name)
    found = footfalls(made.clip)
    assert found.feet == ("LeftFoot", "RightFoot")
    for foot in found.feet:
        assert found.down[foot] == pytest.approx(made.footfalls.down[foot], abs=1.01 / 30.0)


def sliding(*speeds_mps, rate=100.0):
    """A clip whose only two joints, feet, slide along z: each speed for a tenth of a second."""
    steps = np.repeat(speeds_mps, 10) / rate
    skeleton = Skeleton(("LeftFoot", "RightFoot"), np.array([-1, 0]), np.zeros((2, 3)), (("Zposition",), ()))
    return Clip("slide", skeleton, 1.0 / rate, np.insert(np.cumsum(steps), 0, 0.0)[:, None], 1.0)


def test_a_foot_is_down_while_it_is_slow():
    assert footfalls(sliding(2, 2, 0, 0, 2)).down["LeftFoot"] == pytest.approx(np.array([[0.2, 0.4]]), abs=0.011)
    found = footfalls(sliding(0.5, 2), slowest_mps=0.6).down["LeftFoot"]
    assert found == pytest.approx(np.array([[0.0, 0.1]]), abs=0.011)


def test_a_foot_held_still_in_the_air_is_up():
    skeleton = Skeleton(("LeftFoot", "RightFoot"), np.array([-1, 0]), np.zeros((2, 3)), (("Yposition",), ()))
    heights = np.concatenate((np.zeros(20), np.linspace(0.0, 0.5, 10), np.full(20, 0.5)))
    down = footfalls(Clip("kick", skeleton, 0.01, heights[:, None], 1.0)).down["LeftFoot"]
    assert down == pytest.approx(np.array([[0.0, 0.19 + 0.01]]), abs=0.011)


def test_one_noisy_frame_neither_lifts_nor_plants_a_foot():
    values = np.zeros((40, 1))
    values[20:] = 0.05
    skeleton = sliding(1).skeleton
    assert footfalls(Clip("twitch", skeleton, 0.01, values, 1.0)).down["LeftFoot"] == pytest.approx(np.array([[0.0, 0.39]]))
    values = np.arange(40.0)[:, None] * 0.1
    values[20:] -= 0.1
    assert footfalls(Clip("blink", skeleton, 0.01, values, 1.0)).down["LeftFoot"].shape == (0, 2)


def test_a_clip_of_one_frame_has_its_feet_down_and_one_of_none_has_no_intervals():
    skeleton = sliding(1).skeleton
    assert footfalls(Clip("one", skeleton, 0.1, np.zeros((1, 1)))).down["LeftFoot"].tolist() == [[0.0, 0.0]]
    assert footfalls(Clip("none", skeleton, 0.1, np.zeros((0, 1)))).down["LeftFoot"].shape == (0, 2)


def test_a_skeleton_without_feet_asks_for_their_names():
    skeleton = Skeleton(("Snake",), np.array([-1]), np.zeros((1, 3)), (("Yrotation",),))
    with pytest.raises(MotionError, match=r"no pair of bones is named like feet. Accepted: feet=\(left, right\)"):
        footfalls(Clip("snake", skeleton, 0.1, np.zeros((2, 1))))
    with pytest.raises(MotionError, match='there is no bone "Toe"'):
        footfalls(make_clip("idle").clip, feet=("Toe", "Toe"))


# ---- phases


def phase_of(intervals, duration_s, times_s):
    """The left foot's angle over π and the length of its vector; the right foot takes no step."""
    falls = Footfalls(duration_s, {"LeftFoot": np.array(intervals).reshape(-1, 2), "RightFoot": np.zeros((0, 2))})
    found = phases(falls, np.array(times_s))
    assert not found[:, 2:].any()
    return np.arctan2(found[:, 0], found[:, 1]) / math.pi % 2.0, np.hypot(found[:, 0], found[:, 1])


def test_a_foot_s_phase_goes_from_contact_through_lift_to_the_next_contact():
    angles, lengths = phase_of([[1.0, 1.6], [2.0, 2.6]], 3.0, [1.0, 1.3, 1.6, 1.8, 2.0 - 1e-9, 2.3])
    assert angles == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0, 0.5], abs=1e-6)
    assert lengths == pytest.approx(np.ones(6))


def test_a_state_that_the_clip_cuts_is_as_long_as_the_middle_one_or_as_what_is_seen():
    angles, _ = phase_of([[0.0, 0.3], [0.7, 1.3], [1.7, 1.9]], 1.9, [0.0, 0.3, 1.9])
    assert angles == pytest.approx([0.5, 1.0, 1.0 / 3.0])
    angles, _ = phase_of([[0.5, 1.5]], 2.3, [0.125, 0.25, 1.9])
    assert angles == pytest.approx([1.25, 1.5, 1.5])


def test_a_foot_that_stands_long_has_no_phase_but_near_its_steps():
    angles, lengths = phase_of([[1.0, 6.0]], 6.5, [1.0, 1.375, 3.5, 5.625, 6.0])
    assert lengths == pytest.approx([1.0, 0.5, 0.0, 0.5, 1.0])
    assert (angles[0], angles[-1]) == pytest.approx((0.0, 1.0))


@pytest.mark.parametrize("name", ["walk", "start_run", "stop_walk_tired", "walk_turn_left_90"])
def test_phases_have_no_jumps(name):
    falls = footfalls(make_clip(name).clip)
    times_s = np.arange(0.0, falls.duration_s, 0.001)
    assert np.abs(np.diff(phases(falls, times_s), axis=0)).max() < 0.05
