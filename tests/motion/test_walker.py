"""A walker: the body stays the game's, feet stand on their footsteps, and on flat ground nothing is changed."""

import math
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, some
from test_walking_blends import BOTH, cycle, run, walk

from contextdb.errors import ContextError
from contextdb.motion import MotionError, Steered
from contextdb.motion.clips import quaternions
from contextdb.motion.walking.blending import Gait
from contextdb.motion.walking.footsteps import Footstep, delta, middles, reference
from contextdb.motion.walking.walker import Walker, WalkSettings

DT = 1.0 / 60.0
UP = (0.0, 1.0, 0.0)
RIG = walk().cycles[0].skeleton
TOES = [RIG.index(name) for name in ("LeftToe", "RightToe")]
HIPS = RIG.index("Hips")
LEGS = [[RIG.index(side + name) for name in ("UpLeg", "Leg", "Foot")] for side in ("Left", "Right")]


@cache
def straight(speed):
    return lambda t: (0.0, speed * t, 0.0)


@cache
def circle(speed, turn):
    radius = speed / turn
    return lambda t: (radius * (1.0 - math.cos(turn * t)), radius * math.sin(turn * t), turn * t)


@cache
def strafe(speed):
    return lambda t: (speed * math.sin(0.5) * t, speed * math.cos(0.5) * t, 0.0)


def ramp(t):
    """Faster for five seconds, from 1 to 4 m/s, and slower again."""
    up = min(t, 5.0)
    down = max(t - 5.0, 0.0)
    return 0.0, up + 0.3 * up * up + 4.0 * down - 0.3 * down * down, 0.0


@cache
def walked(way, seconds=3.0, ground=None, adjust=None, gaits=None, dt=DT):
    walker = Walker(gaits or [walk(), run()])
    poses, steps, phases = [], [], []
    for tick in range(round(seconds / dt)):
        poses.append(walker.update(dt, way(tick * dt), ground, adjust))
        steps.append(walker.footsteps)
        phases.append(walker.phase)
    return poses, steps, phases


def knees(poses):
    """The angles of both knees in degrees: [T, 2]."""
    found = []
    for hip, knee, ankle in LEGS:
        a, b, c = (np.array([pose.positions[joint] for pose in poses]) for joint in (hip, knee, ankle))
        thigh, shin = a - b, c - b
        sizes = np.linalg.norm(thigh, axis=-1) * np.linalg.norm(shin, axis=-1)
        found.append(np.degrees(np.arccos(np.clip((thigh * shin).sum(axis=-1) / sizes, -1.0, 1.0))))
    return np.column_stack(found)


def stairs(x, z):
    return 0.12 * math.floor(z / 0.5), UP


def slope(x, z):
    return 0.15 * z, (0.0, 1.0, -0.15)


# ---- the golden rule


@examples(0.25)
@given(
    st.lists(st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-7.0, 7.0)), min_size=1, max_size=12),
    st.sampled_from([None, slope, stairs]),
    st.sampled_from([0.0, DT, 0.3]),
)
def test_nothing_moves_the_body_over_the_ground(places, ground, dt):
    walker = Walker([walk(), run(**BOTH)])
    for place in places:
        pose = walker.update(dt, place, ground)
        assert pose.root == place
        assert np.isfinite(pose.positions).all()
        assert np.isfinite(pose.rotations).all()
        assert 0.0 <= walker.phase < 1.0
        assert sum(walker.weights.values()) == pytest.approx(1.0)


def test_the_body_of_a_steered_one_is_its_place():
    walker = Walker([walk()])
    for tick in range(20):
        body = Steered((0.1 * tick, 0.02 * tick), (0.1 / DT, 0.02 / DT), heading=0.3)
        assert walker.update(DT, body).root == (*body.position, 0.3)


# ---- flat ground


@pytest.mark.parametrize("ground", [None, lambda x, z: None, lambda x, z: (0.0, UP)])
@pytest.mark.parametrize("name", ["walk", "jog"])
def test_on_flat_ground_and_a_straight_way_nothing_is_changed(name, ground):
    own = cycle(name)
    gait = Gait("only", [own])
    dt = own.duration_s / len(own.rotations)  # from moment to moment of the cycle
    poses, _, phases = walked(straight(own.speed_mps), ground=ground, gaits=(gait,), dt=dt)
    for pose, phase in zip(poses, phases, strict=True):
        rotations, positions = own.at(phase)
        turned = quaternions.rotation_vectors(quaternions.multiply(rotations, quaternions.inverse(pose.rotations)))
        assert np.degrees(np.abs(turned)).max() < (1.0 if name == "walk" else 1e-4)  # the walk's feet slip by 3 mm
        np.testing.assert_allclose(pose.translations, positions, atol=5e-4 if name == "walk" else 1e-6)


@pytest.mark.parametrize("speed", [1.3, 1.6, 3.0])
def test_on_a_straight_way_no_footstep_is_anywhere_but_where_the_cycles_have_it(speed):
    walker = Walker([walk(), run()])
    for tick in range(200):
        walker.update(DT, straight(speed)(tick * DT))
        if tick > 150:
            state, mix = walker.state, walker._mix(walker.state)
            for foot, own in enumerate(state.steps):
                behind, ahead = middles(mix, foot, state.phase)
                for step, away in ((own.last, behind), (own.next, ahead)):
                    np.testing.assert_allclose(
                        delta(step, reference(mix, foot, away, state.phase, state.going.place)), 0.0, atol=1e-6
                    )


def test_flat_ground_is_no_ground():
    none, flat = walked(circle(1.4, 0.8))[0], walked(circle(1.4, 0.8), ground=lambda x, z: (0.0, UP))[0]
    for one, other in zip(none, flat, strict=True):
        np.testing.assert_array_equal(one.positions, other.positions)


@pytest.mark.parametrize("speed", some([1.3, 1.55, 1.8, 2.6, 3.2, 4.5]))
def test_feet_that_are_down_stand_still(speed):
    poses, _, _ = walked(straight(speed))
    toes = np.array([pose.positions[TOES] for pose in poses])[30:]
    down = np.array([pose.contacts for pose in poses])[30:]
    speeds = np.linalg.norm(np.diff(toes[:, :, [0, 2]], axis=0), axis=-1) / DT
    both = down[1:] & down[:-1]
    assert both.any()
    assert speeds[both].max() < 0.02


@pytest.mark.parametrize("way", [circle(1.4, 0.8), strafe(1.5), lambda t: (0.0, 1.3 * t + 0.1 * t * t, 0.0)])
def test_a_foot_that_is_down_moves_by_less_than_a_millimetre_whatever_the_way(way):
    poses, _, _ = walked(way)
    toes = np.array([pose.positions[TOES] for pose in poses])
    for side in (0, 1):
        first = None
        for tick in range(30, len(poses)):
            if not poses[tick].contacts[side]:
                first = None
            elif first is None:
                first = toes[tick, side]
            else:
                assert np.hypot(*(toes[tick, side] - first)[[0, 2]]) < 1e-3


# ---- footsteps


def test_a_straight_walk_foretells_the_same_footstep_from_lift_to_touch_down():
    poses, steps, _ = walked(straight(1.4))
    for side in (0, 1):
        seen = None
        for tick in range(30, len(poses)):
            if poses[tick].contacts[side]:
                if seen is not None:
                    assert math.hypot(steps[tick][side].x - seen.x, steps[tick][side].z - seen.z) < 1e-3
                seen = None
                continue
            ahead = steps[tick][2 + side]
            if seen is not None:
                assert math.hypot(ahead.x - seen.x, ahead.z - seen.z) < 1e-3
            seen = ahead


@pytest.mark.parametrize("turn", [0.8, -0.8])
def test_on_a_circle_a_foot_points_where_the_body_does_when_it_is_over_it(turn):
    way = circle(1.4, turn) if turn > 0.0 else lambda t: (-circle(1.4, -turn)(t)[0], circle(1.4, -turn)(t)[1], turn * t)
    walker, headings, middles = Walker([walk()]), [], []
    for tick in range(300):
        before = walker.phase
        pose = walker.update(DT, way(tick * DT))
        if tick > 60 and walker.phase < before:  # the left foot's mid-stance
            middles.append(walker.footsteps[0])
            headings.append(pose.root)
    assert len(middles) > 2
    for step, (x, z, heading) in zip(middles, headings, strict=True):
        assert math.remainder(step.heading - heading, math.tau) == pytest.approx(0.0, abs=math.radians(1.5))
        left = math.cos(heading) * (step.x - x) - math.sin(heading) * (step.z - z)
        assert left == pytest.approx(cycle("walk").toes_at(0.0)[0][0], abs=0.02)


def test_a_strafing_foot_is_below_the_body_in_mid_stance():
    walker, way, found = Walker([walk()]), strafe(1.4), []
    for tick in range(300):
        before = walker.phase
        pose = walker.update(DT, way(tick * DT))
        if tick > 60 and walker.phase < before:
            found.append(walker.footsteps[0].x - pose.root[0])
    np.testing.assert_allclose(found, cycle("walk").toes_at(0.0)[0][0], atol=0.02)


def test_a_footstep_that_the_game_moves_is_where_the_foot_stands():
    def aside(step):
        return Footstep(step.foot, step.x + 0.05, step.z, step.heading) if step.foot == 0 else None

    poses, _, _ = walked(straight(1.4), adjust=aside)
    plain, _, _ = walked(straight(1.4))
    for one, other in zip(poses[90:], plain[90:], strict=True):
        if one.contacts[0]:
            assert one.positions[TOES[0]][0] - other.positions[TOES[0]][0] == pytest.approx(0.05, abs=2e-3)
        if one.contacts[1]:
            assert one.positions[TOES[1]][0] == pytest.approx(other.positions[TOES[1]][0], abs=2e-3)


# ---- ground


def test_ground_that_is_higher_everywhere_lifts_the_body_and_nothing_else():
    plain, _, _ = walked(straight(1.4))
    for height in (-2.0, 0.5, 20.0):
        lifted, _, _ = walked(straight(1.4), ground=lambda x, z, height=height: (height, UP))
        for one, other in zip(lifted, plain, strict=True):
            np.testing.assert_allclose(one.positions - [0.0, height, 0.0], other.positions, atol=1e-6)


@pytest.mark.parametrize(("ground", "apart"), [(slope, 0.02), (stairs, 0.02)])
def test_feet_that_are_down_are_on_the_ground(ground, apart):
    plain, _, _ = walked(straight(1.3), 4.0)
    poses, steps, _ = walked(straight(1.3), 4.0, ground)
    for tick in range(60, len(poses)):
        for side in (0, 1):
            if poses[tick - 1].contacts[side] and poses[tick].contacts[side]:
                step = steps[tick][side]
                over = poses[tick].positions[TOES[side]][1] - plain[tick].positions[TOES[side]][1]
                assert over == pytest.approx(ground(step.x, step.z)[0], abs=apart)


@pytest.mark.parametrize(
    ("way", "ground"),
    some(product([straight(1.4), circle(1.4, 0.8), strafe(1.4), straight(3.0), ramp], [None, slope, stairs]), 15),
)
def test_hips_and_knees_have_no_step_and_bones_keep_their_lengths(way, ground):
    seconds = 2.5
    coarse, fine = (walked(way, seconds, ground, dt=dt)[0] for dt in (DT, DT / 8.0))
    for values in (lambda poses: knees(poses), lambda poses: np.array([pose.positions[HIPS][1:2] for pose in poses])):
        most, least = (np.abs(np.diff(values(poses)[len(poses) // 5 :], axis=0)).max() for poses in (coarse, fine))
        assert least < 0.3 * most + 1e-4  # a step would stay as large as it is
    for a, b in ((a, b) for leg in LEGS for a, b in pairwise(leg)):
        lengths = [np.linalg.norm(pose.positions[a] - pose.positions[b]) for pose in coarse]
        np.testing.assert_allclose(lengths, lengths[0], atol=1e-9)


def test_a_knee_bends_no_more_than_twice_as_fast_as_in_the_animation():
    own = np.abs(np.diff(knees(walked(straight(1.4))[0])[30:], axis=0)).max()
    for way in (circle(1.4, 0.6), strafe(1.4)):
        assert np.abs(np.diff(knees(walked(way)[0])[30:], axis=0)).max() <= 2.0 * own


def test_a_step_in_the_ground_that_no_leg_reaches_gives_no_nan():
    poses, _, _ = walked(straight(1.4), 2.0, lambda x, z: (-30.0 if z > 1.0 else 0.0, UP))
    assert all(np.isfinite(pose.positions).all() for pose in poses)


# ---- speed, gait and state


def test_a_ramp_up_and_down_changes_the_gait_twice_and_the_pose_has_no_step():
    walker, gaits, poses = Walker([walk(), run()]), [], []
    for tick in range(600):
        poses.append(walker.update(DT, ramp(tick * DT)))
        gaits.append(walker.gait)
    assert sum(a != b for a, b in pairwise(gaits)) == 2
    steps = [np.linalg.norm(b.positions - a.positions, axis=-1).max() for a, b in pairwise(poses[10:])]
    assert max(steps) < 0.25


def test_the_phase_goes_on_by_the_metres_over_the_stride():
    walker = Walker([walk()])
    for tick in range(120):
        before = walker.phase
        walker.update(DT, straight(1.3)(tick * DT))
        if tick > 60:
            assert (walker.phase - before) % 1.0 == pytest.approx(1.3 * DT / cycle("walk").stride_m, abs=1e-6)


def test_a_body_that_stands_holds_its_pose():
    walker = Walker([walk()])
    for tick in range(60):
        walker.update(DT, straight(1.3)(tick * DT))
    for _ in range(120):
        last = walker.update(DT, straight(1.3)(1.0))
    np.testing.assert_allclose(walker.update(DT, straight(1.3)(1.0)).rotations, last.rotations, atol=1e-3)


def test_acceleration_and_turn_come_by_and_by():
    gaits = [Gait("run", [cycle("jog"), cycle("run")], speeding_up=cycle("jog_tired"), turning_left=cycle("jog_turn_left_60"))]
    walker = Walker(gaits, WalkSettings(full_turn_dps=60.0))
    for tick in range(60):
        walker.update(DT, Steered((0.0, 3.0 * tick * DT), (0.0, 3.0)))
    turned = []
    for tick in range(60, 120):
        walker.update(DT, Steered((0.0, 3.0 * tick * DT), (0.0, 3.0), turn_rate=math.radians(60.0)))
        turned.append(walker.weights.get("jog_turn_left_60", 0.0))
    assert turned[0] < 0.05
    assert turned[-1] > 0.95
    assert max(abs(b - a) for a, b in pairwise(turned)) < 0.1


def test_a_walker_goes_on_from_a_state_as_if_nothing_had_been():
    walker, way = Walker([walk(), run()]), circle(1.6, 0.7)
    for tick in range(50):
        walker.update(DT, way(tick * DT), slope)
    kept = walker.state
    first = [walker.update(DT, way(tick * DT), slope).positions for tick in range(50, 80)]
    walker.restore(kept)
    second = [walker.update(DT, way(tick * DT), slope).positions for tick in range(50, 80)]
    np.testing.assert_array_equal(first, second)


def test_a_body_that_is_put_elsewhere_stands_there_at_once():
    walker = Walker([walk()])
    for tick in range(60):
        walker.update(DT, straight(1.3)(tick * DT), slope)
    pose = walker.update(DT, (40.0, 10.0, 1.0), slope)
    for toe in TOES:
        assert math.hypot(pose.positions[toe][0] - 40.0, pose.positions[toe][2] - 10.0) < 1.0
    assert pose.positions[HIPS][1] == pytest.approx(1.5 + 0.9, abs=0.15)


def test_what_is_wrong_is_refused_and_the_walker_stays_where_it_was():
    walker = Walker([walk()])
    walker.update(DT, (0.0, 0.0, 0.0))
    before = walker.state
    for wrong in (
        lambda: walker.update(DT, (0.0, 0.0, 0.0), lambda x, z: "high"),
        lambda: walker.update(DT, (0.0, 0.0, 0.0), None, lambda step: 5),
        lambda: walker.update(DT, (0.0, 0.0, 0.0), None, lambda step: Footstep(step.foot, math.nan, 0.0, 0.0)),
        lambda: walker.update(DT, None),
        lambda: walker.update(DT, (0.0, 0.0, 0.0), 5),
    ):
        with pytest.raises(ContextError):
            wrong()
        assert walker.state is before
    with pytest.raises(MotionError, match="not slower"):
        Walker([run(), walk()])
    with pytest.raises(MotionError, match="no gait"):
        Walker([])
