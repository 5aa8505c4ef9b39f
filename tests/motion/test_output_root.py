"""Where a pose stream puts the body: by the animation, by the game, or by both."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from played import RATE, bank, decisions, playing_at, range_of

from contextdb.motion import Action, Decision, PoseSettings, PoseStream, Steered

STEP = 1.0 / RATE
WALK_MPS = 1.3


def roots(segments, settings, bodies=None, dt=STEP):
    stream = PoseStream(bank(), settings)
    return np.array(
        [
            stream.update(d, dt if d.tick else 0.0, None if bodies is None else bodies(d.tick * dt)).root
            for d in decisions(segments, dt)
        ]
    )


def test_in_the_mode_animation_the_clip_moves_the_body_from_where_it_was():
    settings = PoseSettings(root="animation")
    at_home, elsewhere = (roots([("walk", 0.0, 50)], settings, lambda t, b=b: b) for b in ((0.0, 0.0, 0.0), (5.0, -2.0, 1.0)))
    clip = bank().root[bank().starts[range_of("walk")] :][:50].astype(float)
    way = clip - clip[0]
    np.testing.assert_allclose(elsewhere[:, 2] - 1.0, at_home[:, 2], atol=1e-9)
    np.testing.assert_allclose(
        np.linalg.norm(elsewhere[:, :2] - [5.0, -2.0], axis=1), np.linalg.norm(way[:, :2], axis=1), atol=1e-6
    )


def test_in_the_mode_code_the_body_is_the_games_whatever_plays():
    def body(t):
        return (t, 0.5 * t, -t)

    found = roots([("run", 0.1, 20), ("idle", 0.3, 20)], PoseSettings(root="code"), body)
    np.testing.assert_allclose(found, [body(i * STEP) for i in range(40)], atol=1e-12)


def test_a_steered_body_may_be_given_as_it_is():
    stream = PoseStream(bank(), PoseSettings(root="code"))
    decision = Decision(0, 0.0, Action.START, "", True, playing_at("walk", 0.0), None)
    assert stream.update(decision, 0.0, Steered(position=(1.0, 2.0), heading=0.5)).root == (1.0, 2.0, 0.5)


@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0])
def test_weights_share_the_movement_between_animation_and_game(weight):
    free = {"position_pull_s": 0.0, "rotation_pull_s": 0.0, "position_clamp_m": 1000.0, "rotation_clamp_deg": 180.0}
    free |= {"path_alignment": False, "min_stride": 1.0, "max_stride": 1.0}
    settings = PoseSettings(position_weight=weight, rotation_weight=0.0, blend="none", **free)
    found = roots([("walk", 0.0, 61)], settings, lambda t: (3.0 * t, 0.0, 0.0))
    clip = bank().root[bank().starts[range_of("walk")] :][[0, 60]].astype(float)
    ahead = math.hypot(*(clip[1] - clip[0])[:2])
    assert found[-1][0] == pytest.approx((1.0 - weight) * 6.0, abs=0.05)
    assert found[-1][1] == pytest.approx(weight * ahead, abs=0.05)


def test_the_root_weight_of_the_markup_counts_too():
    stream = PoseStream(bank(), PoseSettings(position_pull_s=0.0, position_clamp_m=1000.0))
    for decision in decisions([("run", 0.0, 31)], STEP):
        held = Decision(
            decision.tick,
            0.0,
            decision.action,
            "",
            False,
            decision.playing,
            decision.before,
            root_motion=decision.root_motion,
            root_weight=0.0,
        )
        pose = stream.update(held, STEP if decision.tick else 0.0, (0.0, 0.0, 0.0))
    assert pose.root == (0.0, 0.0, 0.0)


bodies = st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.floats(-2.0, 2.0))
segments = st.lists(
    st.tuples(st.sampled_from(["idle", "walk", "run"]), st.floats(0.0, 1.0), st.integers(1, 20)), min_size=1, max_size=4
)


@given(segments, bodies, st.sampled_from(["spring", "none"]))
def test_mixed_is_never_farther_from_the_game_than_the_clamp(segments, speed, blend):
    def body(t):
        return (speed[0] * t, speed[1] * t, speed[2] * t)

    found = roots(segments, PoseSettings(blend=blend, position_clamp_m=0.15, rotation_clamp_deg=40.0), body)
    wanted = np.array([body(i * STEP) for i in range(len(found))])
    assert np.hypot(*(found - wanted)[:, :2].T).max() <= 0.15 + 1e-9
    turned = [abs(math.remainder(turn, math.tau)) for turn in (found - wanted)[:, 2]]
    assert max(turned) <= math.radians(40.0) + 1e-9


def test_mixed_comes_to_a_game_that_moves_as_the_animation_does():
    clip = bank().root[bank().starts[range_of("walk")] :].astype(float)
    speed = math.hypot(*(clip[60] - clip[0])[:2]) / 2.0
    found = roots([("walk", 0.0, 90)], PoseSettings(), lambda t: (0.1, 0.05 + speed * t, 0.0))
    assert abs(found[-1][0] - 0.1) < 0.03
    assert abs(found[-1][1] - (0.05 + speed * 89 * STEP)) < 0.05


def test_who_stands_is_not_pulled():
    idle = Decision(1, 0.0, Action.CONTINUE, "", False, playing_at("idle", 0.5), None)
    stream = PoseStream(bank(), PoseSettings())
    stream.update(Decision(0, 0.0, Action.START, "", True, playing_at("idle", 0.5), None), 0.0, (0.0, 0.0, 0.0))
    roots = [stream.update(idle, STEP, (0.1, 0.0, 0.2)).root for _ in range(30)]
    assert roots[-1] == (0.0, 0.0, 0.0)


def test_the_velocity_of_the_root_has_no_step_where_a_run_becomes_an_idle():
    segments = [("run", 0.0, 600), ("idle", 0.5, 400)]
    dt = 0.001
    smooth, cut = (roots(segments, PoseSettings(root="animation", blend=blend), dt=dt) for blend in ("spring", "none"))
    steps = [np.linalg.norm(np.diff(found[:, :2], axis=0), axis=1) / dt for found in (smooth, cut)]
    assert abs(steps[1][600] - steps[1][598]) > 2.0
    assert abs(steps[0][600] - steps[0][598]) < 0.3
    np.testing.assert_allclose(smooth[-1], cut[-1], atol=0.02)


def test_in_the_mode_path_the_clip_says_how_fast_and_the_game_where_to():
    settings = PoseSettings(root="path", blend="none")
    found = roots([("walk", 0.0, 90)], settings, lambda t: (0.3 * t, 0.4 * t, 0.0))
    away = np.abs(found[:, 0] * 0.8 - found[:, 1] * 0.6)
    assert away.max() < 1e-6
    clip = bank().root[bank().starts[range_of("walk")] :][:90].astype(float)
    far = np.linalg.norm(np.diff(clip[:, :2], axis=0), axis=1)[1:].sum()
    assert math.hypot(*(found[-1] - found[1])[:2]) == pytest.approx(far, rel=0.01)


def test_in_the_mode_path_what_lies_to_the_side_of_the_way_is_made_up_for():
    stream = PoseStream(bank(), PoseSettings(root="path"))
    poses = [
        stream.update(d, STEP if d.tick else 0.0, (0.1 if d.tick else 0.0, 0.04 * d.tick, 0.3 if d.tick else 0.0))
        for d in decisions([("walk", 0.0, 60)], STEP)
    ]
    assert poses[-1].root[0] == pytest.approx(0.1, abs=0.01)
    assert poses[-1].root[2] == pytest.approx(0.3, abs=0.01)


def test_in_the_mode_path_who_is_told_to_stand_is_left_where_the_clip_puts_it():
    found = roots(
        [("walk", 0.0, 30)], PoseSettings(root="path", position_pull_s=0.0, position_clamp_m=1000.0), lambda t: (0.0, 0.0, 0.0)
    )
    assert found[-1][1] > 0.8
