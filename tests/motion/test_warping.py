"""A warp reaches its target whatever the path, follows the animation's movement, and is held to a slow step-by-step oracle."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.errors import QueryError
from contextdb.motion.nodes.warping import Target, Window, warped
from contextdb.motion.selection.root_motion import RootMotion

RATE = 30.0
NEVER = Window(0.0, -1.0)


def times(n_frames):
    return np.arange(n_frames) / RATE


def straight(speeds, heading=0.0):
    """A path through the origin at these speeds, frame by frame, that faces where it goes."""
    lengths = np.concatenate(([0.0], np.cumsum(np.asarray(speeds) / RATE)))
    return np.column_stack((lengths * math.sin(heading), lengths * math.cos(heading), np.full(len(lengths), heading)))


def around(left, right):
    """How far two angles are apart, whole turns not counted."""
    return abs(math.remainder(left - right, math.tau))


METRES = st.floats(-20.0, 20.0)
ANGLES = st.floats(-10.0, 10.0)
TARGETS = st.builds(Target, METRES, METRES, st.none() | ANGLES)


@st.composite
def windows(draw, last_s):
    """A window within the path, often at frames or at its ends, sometimes one without time."""
    moments = st.floats(0.0, last_s) | st.sampled_from([0.0, last_s]) | st.integers(0, round(last_s * RATE)).map(lambda i: i / RATE)
    return Window(*(min(moment, last_s) for moment in (draw(moments), draw(moments))))


@st.composite
def warps(draw):
    """A path that moves, stands and turns, with windows and a target: the arguments of `warped`."""
    n_frames = draw(st.integers(1, 25))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    steps = rng.normal(size=(n_frames, 3)) * [0.1, 0.1, 0.2] * (rng.random((n_frames, 1)) < draw(st.sampled_from([0.0, 0.3, 1.0])))
    path = np.cumsum(steps, axis=0) + rng.normal(size=3) * 10.0
    last_s = (n_frames - 1) / RATE
    return times(n_frames), path, draw(windows(last_s)), draw(windows(last_s)), draw(TARGETS)


def slowly(given, found):
    """The placements at the knots of a warped path, one step after another, from its shares."""
    times_s, path, _, rotation, target = given
    natural = [[float(np.interp(t, times_s, column)) for column in path.T] for t in found.times_s]
    heading0 = natural[0][2]
    turn_at_end = float(np.interp(rotation.to_s, times_s, path[:, 2])) - heading0
    is_turned = found.rotation_s is not None
    missing_turn = math.remainder(target.turn_rad - turn_at_end, math.tau) if is_turned else 0.0
    placed = [(0.0, 0.0)]
    for i in range(1, len(natural)):
        dx, dz = natural[i][0] - natural[i - 1][0], natural[i][1] - natural[i - 1][1]
        length, way = math.hypot(dx, dz), math.atan2(dx, dz) - heading0
        if is_turned:
            way += missing_turn * (found.shares[i][1] + found.shares[i - 1][1]) / 2.0
        placed.append((placed[-1][0] + length * math.sin(way), placed[-1][1] + length * math.cos(way)))
    missing = (0.0, 0.0)
    if found.position_s is not None:
        end = placed[found.times_s.tolist().index(found.position_s)]
        missing = (target.left_m - end[0], target.ahead_m - end[1])
    placements = [
        (
            left + found.shares[i][0] * missing[0],
            ahead + found.shares[i][0] * missing[1],
            natural[i][2] - heading0 + missing_turn * found.shares[i][1] * is_turned,
        )
        for i, (left, ahead) in enumerate(placed)
    ]
    return placements, math.hypot(*missing)


# ---- the warp, whatever is given


@given(warps())
def test_the_body_is_at_the_target_when_the_window_closes(given):
    found = warped(*given)
    _, _, position, rotation, target = given
    assert (found.position_s is not None) == position.is_open
    assert (found.rotation_s is not None) == (rotation.is_open and target.turn_rad is not None)
    if found.position_s is not None:
        there = found.at(found.position_s)
        assert math.hypot(there.left_m - target.left_m, there.ahead_m - target.ahead_m) < 1e-9
    if found.rotation_s is not None:
        assert around(found.at(found.rotation_s).turn_rad, target.turn_rad) < 1e-9


@given(warps())
def test_a_warped_path_is_what_going_it_step_by_step_gives(given):
    found = warped(*given)
    expected, _ = slowly(given, found)
    np.testing.assert_allclose(found.placements, expected, rtol=0.0, atol=1e-9)


@given(warps())
def test_no_step_is_longer_than_its_own_and_its_share_of_what_is_missing(given):
    found = warped(*given)
    _, missing = slowly(given, found)
    natural = np.stack([np.interp(found.times_s, given[0], column) for column in given[1].T[:2]], axis=-1)
    own = np.linalg.norm(np.diff(natural, axis=0), axis=-1)
    steps = np.linalg.norm(np.diff(found.placements[:, :2], axis=0), axis=-1)
    assert np.all(steps <= own + np.diff(found.shares[:, 0]) * missing + 1e-9)


@given(warps())
def test_shares_rise_from_0_where_a_window_opens_to_1_where_it_closes(given):
    found = warped(*given)
    assert np.all(np.diff(found.shares, axis=0) >= 0.0)
    assert np.all((found.shares >= 0.0) & (found.shares <= 1.0))
    for i, window in enumerate(given[2:4]):
        if window.is_open:
            assert found.share_at(window.from_s)[i] == 0.0
            assert found.share_at(window.to_s)[i] == 1.0
        else:
            assert not found.shares[:, i].any()


@given(warps())
def test_a_path_begins_where_the_body_is_and_stays_where_it_ends(given):
    found = warped(*given)
    assert found.at(0.0) == RootMotion(0.0, 0.0, 0.0)
    last_s = float(given[0][-1])
    assert found.at(last_s + 100.0) == found.at(last_s)


@given(warps())
def test_without_a_window_the_path_is_the_animations_own(given):
    times_s, path, _, _, target = given
    found = warped(times_s, path, NEVER, NEVER, target)
    body = RootMotion(*path[0].tolist())
    for time_s, (x, z, heading) in zip(times_s.tolist(), path.tolist(), strict=True):
        there = body.then(found.at(time_s))
        assert math.hypot(there.left_m - x, there.ahead_m - z) < 1e-9
        assert abs(there.turn_rad - heading) < 1e-9


# ---- what the share follows


def test_while_the_animation_stands_nothing_is_warped_so_that_its_feet_do_not_slide():
    path = straight([1.5] * 10 + [0.0] * 10 + [1.5] * 10)
    found = warped(times(31), path, Window(0.0, 1.0), NEVER, Target(0.4, 3.0))
    standing = [found.share_at(i / RATE).position for i in range(10, 21)]
    assert standing == pytest.approx([0.5] * 11, abs=1e-12)
    assert found.at(10 / RATE) == found.at(20 / RATE)


def test_a_slow_drift_of_a_standing_body_does_not_carry_a_warp():
    speeds = [0.02] * 29 + [0.2]  # the last step alone is faster than standing: it would take the whole warp
    found = warped(times(31), straight(speeds), Window(0.0, 1.0), NEVER, Target(1.0, 0.0))
    assert found.share_at(0.5).position == pytest.approx(0.5)


def test_a_short_step_does_not_carry_a_long_way_in_a_blink():
    path = straight([0.0] * 15 + [2.0] * 3 + [0.0] * 12)  # 0.2 m
    near = warped(times(31), path, Window(0.0, 1.0), NEVER, Target(0.5, 0.5))
    far = warped(times(31), path, Window(0.0, 1.0), NEVER, Target(3.0, 3.0))
    assert (near.share_at(0.5).position, near.share_at(0.6).position) == pytest.approx((0.0, 1.0))
    assert (far.share_at(0.5).position, far.share_at(0.6).position) == pytest.approx((0.5, 0.6))


def test_one_that_turns_on_the_spot_is_moved_while_it_turns_and_one_that_walks_straight_is_turned_while_it_walks():
    turning = np.column_stack((np.zeros((21, 2)), np.concatenate((np.zeros(10), np.linspace(0.0, 1.5, 11)))))
    assert warped(times(21), turning, Window(0.0, 20 / RATE), NEVER, Target(0.5, 0.0)).share_at(10 / RATE).position == 0.0
    walking = straight([0.0] * 10 + [1.0] * 10)
    assert warped(times(21), walking, NEVER, Window(0.0, 20 / RATE), Target(0.0, 1.0, 1.0)).share_at(10 / RATE).rotation == 0.0


# ---- targets


@given(METRES, METRES, ANGLES, METRES, METRES, ANGLES)
def test_a_target_in_the_world_comes_back_to_its_place(x, z, heading, to_x, to_z, to_heading):
    body = RootMotion(x, z, heading)
    target = Target.seen_from(body, to_x, to_z, to_heading)
    there = body.then(RootMotion(target.left_m, target.ahead_m, target.turn_rad))
    assert math.hypot(there.left_m - to_x, there.ahead_m - to_z) < 1e-9
    assert around(there.turn_rad, to_heading) < 1e-9


def test_a_target_is_to_the_left_of_a_body_that_faces_ahead_when_its_x_is_greater():
    assert Target.seen_from(RootMotion(1.0, 2.0, 0.0), 4.0, 2.0) == Target(3.0, 0.0, None)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf, "3", None, True, 10**400, 2e6])
def test_a_target_that_is_nowhere_is_refused(wrong):
    for target in (lambda: Target(wrong, 0.0), lambda: Target(0.0, wrong), lambda: Target.seen_from(RootMotion(), wrong, 0.0)):
        with pytest.raises(QueryError, match=r"target's .*Accepted: metres"):
            target()


@pytest.mark.parametrize("wrong", [math.nan, math.inf, "left"])
def test_a_turn_that_is_no_angle_is_refused(wrong):
    with pytest.raises(QueryError, match="turn_rad"):
        Target(0.0, 0.0, wrong)
    with pytest.raises(QueryError, match="heading"):
        Target.seen_from(RootMotion(), 0.0, 0.0, wrong)
    with pytest.raises(QueryError, match="the body's place"):
        Target.seen_from(RootMotion(0.0, 0.0, wrong), 0.0, 0.0)
