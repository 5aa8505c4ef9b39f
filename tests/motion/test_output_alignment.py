"""Path alignment: legs go where the game goes, the chest faces where it did, and planted feet stand."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from played import RATE, bank, decisions, range_of

from contextdb.motion import FeatureSchema, PoseBank, PoseSettings, PoseStream, Steered
from contextdb.motion.clips import quaternions
from contextdb.motion.output.pipeline import spine_of

STEP = 1.0 / RATE
RIG = bank().skeleton
TOES = [RIG.index(name) for name in ("LeftToe", "RightToe")]
EVEN = {"min_stride": 1.0, "max_stride": 1.0}
SKEW = math.radians(22.5)


def speed():
    return bank().moment_of(range_of("walk"), 1.0).travel[1]


def strafed(skew=SKEW, n=120, pace=1.0, segments=None, **said):
    """Poses of a walk whose game goes to one side of where it faces."""
    v = pace * speed()
    stream = PoseStream(bank(), PoseSettings(**{"root": "code", "foot_lock": False, **EVEN, **said}))
    body = (v * math.sin(skew), v * math.cos(skew))
    return [
        stream.update(d, STEP if d.tick else 0.0, (body[0] * d.tick * STEP, body[1] * d.tick * STEP, 0.0))
        for d in decisions(segments or [("walk", 0.0, n)], STEP)
    ]


def skate(poses):
    """Metres a second over the ground of toes that are down in the clip."""
    found = [
        math.hypot(*(b.positions[toe] - a.positions[toe])[[0, 2]]) / STEP
        for a, b in pairwise(poses)
        for foot, toe in enumerate(TOES)
        if a.contacts[foot] and b.contacts[foot]
    ]
    return float(np.mean(found))


def test_a_made_walk_goes_ahead_at_its_speed_at_every_frame_over_its_loop_too():
    number = range_of("walk")
    found = np.array([bank().moment_of(number, t).travel for t in np.linspace(0.0, bank().last_s(number), 50)])
    clip = bank().root[bank().starts[number] : bank().stops[number]].astype(float)
    mean = math.hypot(*(clip[-1] - clip[0])[:2]) / bank().last_s(number)
    np.testing.assert_allclose(found[:, 1], mean, rtol=0.02)
    np.testing.assert_allclose(found[:, 0], 0.0, atol=0.04)


def test_skate_without_alignment_is_that_of_the_angle_and_with_it_there_is_almost_none():
    off, on = strafed(path_alignment=False), strafed()
    sway = skate(strafed(0.0, path_alignment=False)[60:])
    assert skate(off[60:]) == pytest.approx(2.0 * speed() * math.sin(SKEW / 2.0), abs=0.05)
    assert skate(on[60:]) < sway + 0.03


def test_planted_feet_stand_with_the_lock():
    assert skate(strafed(foot_lock=True)[60:]) < 1e-3


@pytest.mark.parametrize("root", ["mixed", "path"])
def test_the_root_goes_within_a_degree_of_where_the_game_goes(root):
    loop = round(bank().last_s(range_of("walk")) * RATE)
    poses = strafed(n=60 + loop, root=root, position_pull_s=0.0, position_clamp_m=1000.0)
    way = np.subtract(poses[-1].root[:2], poses[-1 - loop].root[:2])
    assert math.degrees(abs(math.atan2(*way) - SKEW)) < 1.0


@given(st.floats(-1.5, 1.5))
def test_head_and_chest_face_as_they_did(skew):
    on, off = strafed(skew, 40), strafed(skew, 40, path_alignment=False)
    for name in (RIG.names[spine_of(bank()).joints[-1]], "Neck", "Head"):
        joint = RIG.index(name)
        for one, other in zip(on, off, strict=True):
            np.testing.assert_allclose(world(one)[joint], world(other)[joint], atol=1e-6)


def world(pose):
    """Rotations of all joints in the world."""
    found = np.empty((len(pose.rotations), 4))
    for joint, parent in enumerate(RIG.parents.tolist()):
        above = quaternions.about_axis("y", np.array(pose.root[2])) if parent < 0 else found[parent]
        found[joint] = quaternions.multiply(above, pose.rotations[joint])
    return found


@given(st.floats(-3.1, 3.1), st.floats(0.0, 90.0))
def test_the_turn_is_never_beyond_the_limit_and_none_where_the_clip_goes_elsewhere(skew, limit):
    poses = strafed(skew, 60, alignment_limit_deg=limit)
    plain = strafed(skew, 60, path_alignment=False)
    apart = [
        quaternions.rotation_vectors(quaternions.multiply(a.rotations[0], quaternions.inverse(b.rotations[0])))
        for a, b in zip(poses, plain, strict=True)
    ]
    turns = np.linalg.norm(apart, axis=-1)
    assert turns.max() <= math.radians(limit) + 1e-9
    if abs(skew) > 1.7:
        assert turns.max() < 1e-9


@pytest.mark.parametrize("given_as", ["place", "steered"])
def test_the_way_is_the_bodys_velocity_or_its_change_between_updates(given_as):
    stream = PoseStream(bank(), PoseSettings(root="code", foot_lock=False, **EVEN))
    for d in decisions([("walk", 0.0, 60)], STEP):
        t, v = d.tick * STEP, (0.5, 1.2)
        place = (v[0] * t, v[1] * t)
        body = (*place, 0.0) if given_as == "place" else Steered(position=place, velocity=v)
        stream.update(d, STEP if d.tick else 0.0, body)
    assert stream.state.warp[1] == pytest.approx(math.atan2(0.5, 1.2), abs=0.02)


def test_a_spine_is_found_from_where_the_legs_part_to_where_the_arms_do():
    spine = spine_of(bank())
    names = [RIG.names[joint] for joint in spine.joints]
    assert names[0] == "Spine"
    assert all("Neck" not in name and "Arm" not in name for name in names)
    assert spine.left[-1] == 0.0


def test_a_rig_without_feet_is_left_as_it_is():
    schema = FeatureSchema.from_dict("loco", {"rate": RATE, "channels": [{"type": "position", "bone": "Hips"}]})
    clip = make_clip("walk").clip
    footless = PoseBank.build([clip], schema)
    object.__setattr__(footless, "feet", ())
    assert spine_of(footless) is None
