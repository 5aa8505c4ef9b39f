"""Feet that are down stay where they came down, and legs bend to them without growing."""

import math
from itertools import pairwise

import numpy as np
import pose_oracle
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from played import RATE, bank, decisions

from contextdb.core import bend_legs, lower_hips
from contextdb.motion import PoseSettings, PoseStream, measure
from contextdb.motion.output.bank import placed as placed_joints
from contextdb.motion.output.legs import hinges_of, legs_of

STEP = 1.0 / RATE
RIG = bank().skeleton
TOES = [RIG.index(name) for name in ("LeftToe", "RightToe")]
LEG = np.array([RIG.index(name) for name in ("LeftUpLeg", "LeftLeg", "LeftFoot")])


def streamed(segments, body=None, **said):
    stream = PoseStream(bank(), PoseSettings(**{"root": "animation", **said}))
    return [
        stream.update(d, STEP if d.tick else 0.0, None if body is None else body(d.tick * STEP)) for d in decisions(segments, STEP)
    ]


def slides(poses):
    """How far each toe moves over the ground while its foot stays down in the clip: metres a tick, and how high it moves."""
    over, up = [], []
    for one, other in pairwise(poses):
        for foot, toe in enumerate(TOES):
            if one.contacts[foot] and other.contacts[foot]:
                moved = other.positions[toe] - one.positions[toe]
                over.append(math.hypot(moved[0], moved[2]))
                up.append(abs(moved[1]))
    return np.array(over), np.array(up)


def test_a_foot_that_is_down_does_not_move_at_a_body_that_goes_another_way_than_its_clip():
    def body(t):
        return (0.06 * math.sin(3.0 * t), 1.25 * t, 0.05 * math.sin(2.0 * t))

    free, locked = (streamed([("walk", 0.0, 90)], body, root="code", foot_lock=lock) for lock in (False, True))
    assert slides(free)[0].mean() > 0.004
    assert slides(locked)[0].max() < 0.001


def test_a_foot_that_is_down_does_not_move_through_jumps():
    segments = [("walk", 0.1, 25), ("walk_turn_left_90", 0.9333, 20), ("walk", 1.6, 30)]
    free, locked = (streamed(segments, foot_lock=lock) for lock in (False, True))
    assert slides(free)[0].max() > 0.03
    assert slides(locked)[0].max() < 0.001


@pytest.mark.parametrize(("name", "near_m"), [("idle", 1e-6), ("run", 1e-6), ("walk", 0.04), ("jog", 0.025)])
def test_a_locked_clip_is_the_clip_but_for_what_its_own_feet_slide(name, near_m):
    plain, locked = (streamed([(name, 0.3, 60)], blend="none", foot_lock=lock) for lock in (False, True))
    for one, other in zip(plain, locked, strict=True):
        np.testing.assert_allclose(other.positions, one.positions, atol=near_m)


def test_a_foot_is_let_go_without_a_step_and_comes_to_its_clip():
    def body(t):
        return (0.15 * min(t, 1.0), 1.2 * t, 0.0)

    free, locked = (streamed([("walk", 0.0, 120)], body, root="code", foot_lock=lock) for lock in (False, True))
    for toe in TOES:
        steps, own = (np.linalg.norm(np.diff([pose.positions[toe] for pose in each], axis=0), axis=1) for each in (locked, free))
        assert steps.max() < own.max() + 0.06


def test_a_foot_is_never_farther_from_its_clip_than_the_radius_when_it_is_locked():
    def body(t):
        return (0.0, 3.0 * t, 0.0)

    free, locked = (streamed([("idle", 0.0, 60)], body, root="code", foot_lock=lock, foot_radius_m=0.1) for lock in (False, True))
    for one, other in zip(free[40:], locked[40:], strict=True):
        assert np.linalg.norm((one.positions - other.positions)[TOES][:, [0, 2]], axis=1).max() < 0.1 + 3.0 * STEP


def test_a_character_that_is_put_elsewhere_stands_there_at_once():
    poses = streamed([("idle", 0.0, 20)], lambda t: (0.0 if t < 0.3 else 50.0, 0.0, 0.0), root="code")
    free = streamed([("idle", 0.0, 20)], lambda t: (0.0 if t < 0.3 else 50.0, 0.0, 0.0), root="code", foot_lock=False)
    np.testing.assert_allclose(poses[-1].positions, free[-1].positions, atol=0.01)


# ---- the leg


STRAIGHT = math.radians(170.0)


def bent(rotations, target, straight=STRAIGHT, ahead=(0.0, 0.0, 1.0)):
    """The leg's joints before and after it is bent to a target, and its rotations."""
    positions, world = placed(rotations)
    after = rotations.copy()
    bend_legs(RIG.parents, positions[None], world[None], LEG, np.array([target]), np.array([ahead]), straight, after[None])
    return positions, placed(after)[0], after


def placed(rotations):
    translations = bank().translations(np.array([[0.0, 1.0, 0.0]]))
    return placed_joints(RIG, translations, rotations, (0.0, 0.0, 0.0))


def turned(turns):
    return pose_oracle.rotation(np.asarray(turns))


poses = st.lists(st.floats(-0.5, 0.5), min_size=3 * RIG.n_joints, max_size=3 * RIG.n_joints).map(
    lambda numbers: turned(np.array(numbers).reshape(-1, 3))
)
vectors = st.tuples(*[st.floats(-0.6, 0.6)] * 3).map(np.array)


@given(poses, vectors)
def test_an_ankle_comes_to_any_place_in_reach_and_bones_keep_their_lengths(rotations, way):
    before = placed(rotations)[0]
    hip, knee, ankle = before[LEG]
    upper, lower = np.linalg.norm(knee - hip), np.linalg.norm(ankle - knee)
    target = hip + way
    before, after, _ = bent(rotations, target, straight=math.pi)
    lengths = [np.linalg.norm(each[LEG[1:]] - each[LEG[:2]], axis=1) for each in (before, after)]
    np.testing.assert_allclose(lengths[1], lengths[0], atol=1e-9)
    far = np.linalg.norm(way)
    assert np.isfinite(after).all()
    current = ankle - hip
    assume(abs(upper - lower) + 1e-6 < far < upper + lower - 1e-6)
    assume(current @ way > -0.999 * far * np.linalg.norm(current))
    np.testing.assert_allclose(after[LEG[2]], target, atol=1e-6)


@given(poses)
def test_an_ankle_that_is_where_it_should_be_changes_nothing(rotations):
    before, after, _ = bent(rotations, placed(rotations)[0][LEG[2]])
    np.testing.assert_allclose(after, before, atol=1e-6)


@given(poses, vectors)
def test_the_foot_keeps_its_rotation(rotations, way):
    hip = placed(rotations)[0][LEG[0]]
    _, _, after = bent(rotations, hip + way)
    one, other = (placed(each)[1][LEG[2]] for each in (rotations, after))
    assert abs(one @ other) == pytest.approx(1.0, abs=1e-9)


def test_a_stretched_leg_bends_its_knee_ahead():
    still = turned(np.zeros((RIG.n_joints, 3)))
    hip = placed(still)[0][LEG[0]]
    _, after, _ = bent(still, hip - np.array([0.0, 0.6, 0.0]), straight=math.pi)
    assert (after[LEG[1]] - hip)[2] > 0.2
    np.testing.assert_allclose(after[LEG[2]], hip - np.array([0.0, 0.6, 0.0]), atol=1e-9)


def test_a_place_out_of_reach_stretches_the_leg_toward_it_and_the_knee_never_slams():
    rotations = turned(np.zeros((RIG.n_joints, 3)))
    rotations[LEG[1]] = [math.cos(0.3), math.sin(0.3), 0.0, 0.0]
    hip = placed(rotations)[0][LEG[0]]
    angles = []
    for far in np.linspace(0.85, 1.2, 200):
        _, after, _ = bent(rotations, hip - np.array([0.0, far, 0.0]))
        a, b, c = after[LEG]
        np.testing.assert_allclose((c - a)[[0, 2]], 0.0, atol=1e-9)
        angles.append(math.degrees(math.acos((a - b) @ (c - b) / np.linalg.norm(a - b) / np.linalg.norm(c - b))))
    assert max(angles) < 173.0
    assert np.diff(angles).min() > -1e-9
    assert np.linalg.norm(c - a) > 0.997 * (0.46 + 0.45)


@given(st.floats(-math.pi, math.pi))
def test_a_leg_that_is_nearly_stretched_bends_its_knee_ahead_wherever_it_is_bent_to(side):
    turns = np.zeros((RIG.n_joints, 3))
    turns[LEG[1]] = [0.02 * math.cos(side), 0.0, 0.02 * math.sin(side)]
    rotations = turned(turns)
    hip = placed(rotations)[0][LEG[0]]
    before, after, _ = bent(rotations, hip - np.array([0.0, 0.88, 0.0]))
    assert (after[LEG[1]] - hip)[2] > 0.08
    near = bent(rotations, before[LEG[2]] + np.array([0.0, 1e-6, 0.0]))[1]
    np.testing.assert_allclose(near, before, atol=1e-3)


def lowered(positions, place):
    """How much lower hips are at once, so that the ankle comes to a place."""
    lower = np.zeros(2)
    lower_hips(positions, np.array([[*LEG, LEG[2]]]), place[None], np.zeros((1, 9)), 0.0, lower, 0.0)
    return lower[0]


def test_hips_go_down_for_a_leg_without_a_step_in_their_speed():
    rotations = turned(np.zeros((RIG.n_joints, 3)))
    rotations[LEG[1]] = [math.cos(0.3), math.sin(0.3), 0.0, 0.0]
    positions = placed(rotations)[0]
    hip, ankle = positions[LEG[0]], positions[LEG[2]]
    ways = np.arange(0.0, 0.2, 0.001)
    places = ankle + ways[:, None] * (ankle - hip) / np.linalg.norm(ankle - hip)
    down = np.array([lowered(positions, place) for place in places])
    assert down[0] == 0.0
    speeds = np.diff(down) / 0.001
    assert speeds[0] < 0.01
    assert speeds[-1] > 0.95
    assert np.diff(speeds).min() >= 0.0
    assert np.diff(speeds).max() < 0.05
    reach = math.sqrt(0.46**2 + 0.45**2 - 2.0 * 0.46 * 0.45 * math.cos(STRAIGHT))
    assert np.linalg.norm(places - hip + down[:, None] * [0.0, 1.0, 0.0], axis=1).max() < reach


def test_a_knee_bends_about_the_axis_to_the_left_of_its_clips():
    legs = legs_of(RIG, bank().feet)
    np.testing.assert_allclose(hinges_of(RIG, legs, bank().rotations), [[1.0, 0.0, 0.0]] * 2, atol=0.05)


def run_and_stop(metres=0.9):
    """A body that a game moves ahead for 0.3 s while its clip stands, and then stands too."""
    poses = streamed([("idle", 0.0, 90)], lambda t: (0.0, metres * min(t / 0.3, 1.0), 0.0), root="code", foot_radius_m=0.3)
    return poses, np.array([pose.positions[TOES] for pose in poses])


@pytest.mark.parametrize("metres", [0.1, 0.25, 0.9])
def test_a_body_that_comes_to_rest_steps_until_its_feet_are_where_its_clip_has_them(metres):
    poses, toes = run_and_stop(metres)
    assert slides(poses[75:])[0].max() < 1e-6
    assert np.abs(toes[-1, :, 2] - metres - toes[0, :, 2]).max() < 0.025


def test_a_body_at_rest_steps_with_one_foot_at_a_time_and_lifts_it():
    _, toes = run_and_stop(0.2)
    moves = np.linalg.norm(np.diff(toes[12:, :, [0, 2]], axis=0), axis=-1) > 1e-4
    assert moves.any(axis=0).all()
    assert not moves.all(axis=1).any()
    assert ((toes[12:, :, 1].max(axis=0) - toes[0, :, 1]) > 0.04).all()
    assert toes[..., 1].max() - toes[0, :, 1].min() < 0.06


def test_toes_that_stand_in_the_clip_slide_no_more_than_half_as_much_as_there():
    for name in ("walk", "jog"):
        found = measure(streamed([(name, 0.0, 150)]), bank(), rate=RATE)
        assert found.skate_toe_cm_s <= found.skate_toe_raw_cm_s / 2.0
        assert found.skate_cm_s < 0.5


def test_legs_pull_the_hips_down_no_more_than_they_may():
    found = measure(streamed([("walk", 0.0, 120)], lambda t: (0.0, 0.4 * t, 0.0), root="code"), bank(), rate=RATE)
    assert found.hip_dip_cm < 12.0


@pytest.mark.parametrize("root", ["mixed", "code"])
def test_a_body_that_stands_while_its_clip_walks_steps_on_the_spot_with_its_hips_over_its_feet(root):
    poses = streamed([("walk", 0.0, 210)], lambda t: (0.0, 1.3 * min(t, 1.0), 0.0), root=root)
    legs = legs_of(RIG, bank().feet)
    ways = [pose.positions[RIG.hips] - pose.positions[legs[:, 2:].ravel()].mean(axis=0) for pose in poses[120:]]
    assert np.abs(np.array(ways)[:, [0, 2]]).mean(axis=0).max() < 0.03
    assert math.dist(poses[-1].root[:2], (0.0, 1.3)) < 0.1
    assert slides(poses[120:])[0].max() < 1e-6
