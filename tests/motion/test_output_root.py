"""Where a pose stream puts the body: by the animation, by the game, or by both."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from played import RATE, bank, decisions, playing_at

from contextdb.motion import Action, Decision, PoseSettings, PoseStream, Steered

STEP = 1.0 / RATE


def roots(segments, settings, bodies=None, dt=STEP):
    stream = PoseStream(bank(), settings)
    return np.array(
        [
            stream.update(d, dt if d.tick else 0.0, None if bodies is None else bodies(d.tick * dt)).root
            for d in decisions(segments, dt)
        ]
    )


def test_a_steered_body_may_be_given_as_it_is():
    stream = PoseStream(bank(), PoseSettings(root="code"))
    decision = Decision(0, 0.0, Action.START, "", True, playing_at("walk", 0.0), None)
    assert stream.update(decision, 0.0, Steered(position=(1.0, 2.0), heading=0.5)).root == (1.0, 2.0, 0.5)


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


def test_the_velocity_of_the_root_has_no_step_where_a_run_becomes_an_idle():
    segments = [("run", 0.0, 600), ("idle", 0.5, 400)]
    dt = 0.001
    smooth, cut = (roots(segments, PoseSettings(root="animation", blend=blend), dt=dt) for blend in ("spring", "none"))
    steps = [np.linalg.norm(np.diff(found[:, :2], axis=0), axis=1) / dt for found in (smooth, cut)]
    assert abs(steps[1][600] - steps[1][598]) > 2.0
    assert abs(steps[0][600] - steps[0][598]) < 0.3
    np.testing.assert_allclose(smooth[-1], cut[-1], atol=0.02)
