"""Ground and stride: feet on steps and slopes, hips by the lowest foot, steps of another length."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from played import LOOPS, RATE, SCHEMA, bank, clips, decisions, range_of

from contextdb.core import feel_ground
from contextdb.errors import ContextError
from contextdb.motion import PoseBank, PoseSettings, PoseStream
from contextdb.motion.clips import quaternions
from contextdb.motion.output.ground import STEEPEST, below

STEP = 1.0 / RATE
RIG = bank().skeleton
TOES = [RIG.index(name) for name in ("LeftToe", "RightToe")]
HIPS = RIG.index("Hips")
LEGS = [[RIG.index(side + name) for name in ("UpLeg", "Leg", "Foot")] for side in ("Left", "Right")]
UP = (0.0, 1.0, 0.0)


def streamed(ground=None, segments=(("walk", 0.0, 120),), body=None, dt=STEP, **said):
    stream = PoseStream(bank(), PoseSettings(**{"root": "animation", "blend": "none", **said}))
    return [
        stream.update(d, dt if d.tick else 0.0, None if body is None else body(d.tick * dt), ground)
        for d in decisions(segments, dt)
    ]


def stairs(x, z):
    return 0.12 * math.floor(z / 0.5), UP


def slope(x, z):
    return 0.2 * z, (0.0, 1.0, -0.2)


def clip_speed():
    return bank().moment_of(range_of("walk"), 1.0).travel[1]


# ---- ground


@pytest.mark.parametrize("flat", [lambda x, z: None, lambda x, z: (0.0, UP)])
@pytest.mark.parametrize("lock", [True, False])
def test_on_flat_ground_nothing_changes(flat, lock):
    for one, other in zip(streamed(flat, foot_lock=lock), streamed(foot_lock=lock), strict=True):
        np.testing.assert_allclose(one.positions, other.positions, rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(one.rotations, other.rotations, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("height", [-2.0, 0.4, 30.0])
def test_ground_that_is_higher_everywhere_lifts_all_of_the_body(height):
    lifted = streamed(lambda x, z: (height, UP), foot_lock=False)
    for one, other in zip(lifted, streamed(foot_lock=False), strict=True):
        np.testing.assert_allclose(one.positions, np.add(other.positions, (0.0, height, 0.0)), atol=1e-6)


@pytest.mark.parametrize("ground", [stairs, slope])
def test_feet_that_stand_are_on_the_ground(ground):
    flat = streamed(foot_lock=False)
    for ticks, (one, plain) in enumerate(zip(streamed(ground), flat, strict=True)):
        for foot, toe in enumerate(TOES):
            x, y, z = one.positions[toe]
            if ticks > 20 and one.contacts[foot] and all(flat[ticks - i].contacts[foot] for i in range(6)):
                on = below(ground, plain.positions[toe][0], z)[0]
                assert y - plain.positions[toe][1] == pytest.approx(on, abs=0.02), (ticks, foot, x)


@pytest.mark.parametrize("ground", [stairs, slope])
def test_planted_feet_do_not_slide_on_it(ground):
    for one, other in pairwise(streamed(ground)[20:]):
        for foot, toe in enumerate(TOES):
            if one.contacts[foot] and other.contacts[foot]:
                assert math.hypot(*(other.positions[toe] - one.positions[toe])[[0, 2]]) < 0.001


def test_hips_have_no_step_in_height_or_in_its_change_over_stairs():
    dt = 0.002
    poses = streamed(stairs, segments=(("walk", 0.0, 2000),), dt=dt)
    plain = streamed(segments=(("walk", 0.0, 2000),), dt=dt)
    added = np.array([one.positions[HIPS][1] - other.positions[HIPS][1] for one, other in zip(poses, plain, strict=True)])
    speeds = np.diff(added) / dt
    assert np.abs(np.diff(added)).max() < 0.01
    assert np.abs(speeds).max() < 1.5
    assert added[-1] > 0.4


def test_legs_reach_their_feet_and_keep_their_lengths():
    for pose in streamed(stairs):
        for hip, knee, ankle in LEGS:
            upper, lower = (math.dist(pose.positions[a], pose.positions[b]) for a, b in ((hip, knee), (knee, ankle)))
            assert upper == pytest.approx(np.linalg.norm(RIG.offsets[knee]), abs=1e-9)
            assert lower == pytest.approx(np.linalg.norm(RIG.offsets[ankle]), abs=1e-9)


def test_a_foot_on_a_slope_is_as_steep_as_that_and_keeps_its_yaw():
    poses, plain = streamed(slope, (("idle", 0.0, 40),)), streamed(None, (("idle", 0.0, 40),))
    for foot in (leg[2] for leg in LEGS):
        turn = quaternions.multiply(world(poses[-1])[foot], quaternions.inverse(world(plain[-1])[foot]))
        pitch, yaw, roll = quaternions.rotation_vectors(turn)
        assert math.degrees(pitch) == pytest.approx(-math.degrees(math.atan(0.2)), abs=1.0)
        assert abs(yaw) < 0.01
        assert abs(roll) < 0.01


def world(pose):
    """Rotations of all joints in the world."""
    found = np.empty((len(pose.rotations), 4))
    for joint, parent in enumerate(RIG.parents.tolist()):
        above = quaternions.about_axis("y", np.array(pose.root[2])) if parent < 0 else found[parent]
        found[joint] = quaternions.multiply(above, pose.rotations[joint])
    return found


def test_no_foot_is_steeper_than_it_may_be():
    _, along_x, along_z = below(lambda x, z: (0.0, (0.9, 0.1, 0.0)), 0.0, 0.0)
    assert math.hypot(along_x, along_z) == pytest.approx(STEEPEST)


@given(st.lists(st.tuples(st.booleans(), st.floats(-1.0, 1.0), st.floats(0.0, 1.0)), min_size=1, max_size=6), st.floats(0.0, 0.2))
def test_what_is_below_a_foot_comes_to_its_goal_in_any_parts_of_time(changes, dt):
    whole, parts, hips = np.zeros((1, 9)), np.zeros((1, 9)), np.zeros(2)
    for is_down, height, share in changes:
        felt = np.array([[height, 0.1, -0.1]]), np.array([-1.0 if is_down else share])
        feel_ground(whole, hips, *felt, False, dt)
        for _ in range(2):
            feel_ground(parts, hips, *felt, False, dt / 2)
    np.testing.assert_allclose(parts, whole, atol=1e-9)


def test_a_foot_goes_up_early_and_down_late():
    feet = np.zeros((2, 9))
    feel_ground(feet, np.zeros(2), np.array([[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0]]), np.array([0.5, 0.5]), False, 9.0)
    assert feet[:, 0].tolist() == pytest.approx([0.2, 0.0])


def test_a_character_that_leaves_the_ground_function_comes_back_to_flat():
    stream = PoseStream(bank(), PoseSettings(root="animation", blend="none"))
    for d in decisions([("walk", 0.0, 90)], STEP):
        last = stream.update(d, STEP if d.tick else 0.0, None, stairs if d.tick < 30 else None)
    assert last.positions[:, 1].min() == pytest.approx(streamed()[-1].positions[:, 1].min(), abs=0.01)


def test_a_stream_restored_on_stairs_gives_the_same_poses_again():
    ticks, stream = list(decisions([("walk", 0.0, 25), ("run", 0.2, 25)], STEP)), PoseStream(bank())
    states, shown = [], []

    def update(at, d):
        return at.update(d, STEP if d.tick else 0.0, (0.3 * d.tick * STEP, 1.5 * d.tick * STEP, 0.0), stairs)

    for d in ticks:
        states.append(stream.state)
        shown.append(update(stream, d))
    for back in (1, 12, 27):
        other = PoseStream(bank())
        other.restore(states[back])
        for d, was in zip(ticks[back:], shown[back:], strict=True):
            np.testing.assert_array_equal(update(other, d).positions, was.positions)


@pytest.mark.parametrize("wrong", [3.0, lambda x, z: "high", lambda x, z: (1.0, (0.0, -1.0, 0.0)), lambda x, z: (math.nan, UP)])
def test_a_ground_that_is_none_is_told(wrong):
    with pytest.raises(ContextError):
        streamed(wrong)


def test_a_body_without_feet_goes_by_the_ground_below_it():
    footless = PoseBank.build(clips(), SCHEMA, mirror=True, markup=LOOPS)
    object.__setattr__(footless, "feet", ())
    object.__setattr__(footless, "contacts", footless.contacts[:, :0])
    stream = PoseStream(footless, PoseSettings(root="animation", blend="none"))
    for d in decisions([("walk", 0.0, 60)], STEP):
        pose = stream.update(d, STEP if d.tick else 0.0, None, lambda x, z: (1.5, UP))
    assert pose.positions[HIPS][1] == pytest.approx(streamed(segments=(("walk", 0.0, 60),))[-1].positions[HIPS][1] + 1.5, abs=0.01)


# ---- stride


def strode(pace, **said):
    v = pace * clip_speed()
    return streamed(None, (("walk", 0.0, 150),), lambda t: (0.0, v * t, 0.0), **{"root": "code", "foot_lock": False, **said})


def skate(poses):
    found = [
        math.hypot(*(b.positions[toe] - a.positions[toe])[[0, 2]]) / STEP
        for a, b in pairwise(poses[60:])
        for foot, toe in enumerate(TOES)
        if a.contacts[foot] and b.contacts[foot]
    ]
    return float(np.mean(found))


@pytest.mark.parametrize("pace", [0.85, 1.15])
def test_skate_without_stride_is_the_difference_of_speeds_and_with_it_there_is_little(pace):
    even = skate(strode(1.0, min_stride=1.0, max_stride=1.0))
    without = skate(strode(pace, min_stride=1.0, max_stride=1.0))
    assert without == pytest.approx(abs(pace - 1.0) * clip_speed(), abs=even + 0.03)
    assert skate(strode(pace)) < even + 0.03


def test_a_stride_of_one_is_the_clip():
    even = {"min_stride": 1.0, "max_stride": 1.0, "path_alignment": False}
    for one, other in zip(strode(1.0, **even), strode(1.0, root="animation"), strict=True):
        np.testing.assert_array_equal(one.rotations[1:], other.rotations[1:])


def test_steps_become_longer_along_the_way_alone():
    long, plain = strode(1.2), strode(1.2, min_stride=1.0, max_stride=1.0)
    for one, other in zip(long[60:], plain[60:], strict=True):
        for hip, _, ankle in LEGS:
            np.testing.assert_allclose(one.positions[ankle][0], other.positions[ankle][0], atol=0.005)
            ratio = one.positions[ankle][2] - one.positions[hip][2], other.positions[ankle][2] - other.positions[hip][2]
            assert ratio[0] == pytest.approx(1.2 * ratio[1], abs=0.02)


def test_hips_go_down_for_longer_steps_and_never_up():
    long, plain = strode(1.25), strode(1.25, min_stride=1.0, max_stride=1.0)
    down = np.array([other.positions[HIPS][1] - one.positions[HIPS][1] for one, other in zip(long, plain, strict=True)])
    assert down.min() >= -1e-12
    assert 0.002 < down.max() < 0.1
