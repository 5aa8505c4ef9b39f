"""Pose streams: the clip where nothing is done to it, and no step in pose or velocity where it jumps."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from played import NAMES, RATE, SCHEMA, bank, clips, database, decisions, playing_at

from contextdb.errors import ContextError, MotionError
from contextdb.motion import Action, Decision, PoseBank, PoseSettings, PoseStream, RootMotion
from contextdb.motion.output.stream import PoseState
from contextdb.motion.selection.playhead import Playhead

OFF = PoseSettings(root="animation", blend="none", foot_lock=False)
SPRING = PoseSettings(root="animation", halflife_s=0.1, foot_lock=False)
LOCKED = PoseSettings(root="animation")
STEP = 1.0 / RATE

between_frames = st.integers(0, 120).map(lambda n: n / 100 + 0.0021)
"""Velocities of clips change at their frames: seconds that are 2 ms or more from any."""
moments = st.tuples(st.sampled_from(NAMES), between_frames, st.integers(1, 12), st.booleans())
plays = st.lists(moments, min_size=2, max_size=5)


def streamed(segments, settings, dt=STEP):
    stream = PoseStream(bank(), settings)
    return [stream.update(decision, dt if decision.tick else 0.0) for decision in decisions(segments, dt)]


def branched(segments, settings, then, dt):
    """What is shown dt after some plays, and again dt later: as they play on, and as another clip begins."""
    stream = PoseStream(bank(), settings)
    for last in decisions(segments, STEP):
        stream.update(last, STEP if last.tick else 0.0)
    state, found = stream.state, []
    for jumps in (False, True):
        stream.restore(state)
        now, before = last.playing, []
        for i in range(2):
            move = Playhead.of(database(), now.range, RATE).moved(now.time_s, dt)
            on = playing_at(now.asset, move.time_s, now.mirrored)
            jump = jumps and i == 0
            now = then if jump else on
            action = Action.JUMP if jump else Action.CONTINUE
            decision = Decision(last.tick + 1 + i, 0.0, action, "", jump, now, on, root_motion=move.motion)
            before.append(stream.update(decision, dt))
        found.append(before)
    return found


# ---- seams


@given(segments=plays, then=st.tuples(st.sampled_from(NAMES), between_frames, st.booleans()))
def test_a_jump_changes_neither_the_pose_nor_its_velocity(segments, then):
    short = 1e-5
    on, jumped = branched(segments, SPRING, playing_at(*then), short)
    np.testing.assert_allclose(jumped[0].positions, on[0].positions, atol=1e-9)
    velocities = [(late.positions - early.positions) / short for early, late in (on, jumped)]
    fastest = max(1.0, np.abs(velocities[0]).max())
    np.testing.assert_allclose(velocities[1], velocities[0], atol=0.02 * fastest)


@given(st.floats(0.6, 1.6), st.floats(0.6, 1.6), between_frames, between_frames)
def test_a_jump_between_rates_of_play_changes_no_velocity(rate, to_rate, from_s, to_s):
    short, velocities = 1e-5, []
    for then in ("walk", "run"):
        stream = PoseStream(bank(), SPRING)
        time_s, shown = from_s, []
        for i in range(5):
            name, own = ("walk", rate) if i < 3 else (then, rate if then == "walk" else to_rate)
            before = None if i == 0 else playing_at("walk", from_s + i * rate * short)
            time_s = to_s if i == 3 and then == "run" else from_s if i == 0 else time_s + (own if i != 3 else rate) * short
            action = Action.START if i == 0 else Action.JUMP if i == 3 and then == "run" else Action.CONTINUE
            decision = Decision(i, 0.0, action, "", False, playing_at(name, time_s), before, play_rate=own)
            shown.append(stream.update(decision, short if i else 0.0))
        velocities.append((shown[4].rotations - shown[3].rotations) / short)
    np.testing.assert_allclose(velocities[1], velocities[0], atol=0.06)


# ---- closed forms


def runs_out(decision):
    """Whether a clip comes to its end in an update."""
    before = decision.before
    return before is not None and before.time_s >= bank().last_s(bank().range_of(before.asset, before.mirrored))


@given(segments=plays, parts=st.integers(2, 4))
def test_a_step_of_time_may_be_taken_in_parts(segments, parts):
    whole = streamed(segments, SPRING)
    stream, shown = PoseStream(bank(), SPRING), []
    ticks = list(decisions(segments, STEP))
    assume(not any(runs_out(decision) for decision in ticks))
    for decision in ticks:
        if decision.tick == 0:
            shown.append(stream.update(decision, 0.0))
            continue
        still = Decision(0, 0.0, Action.CONTINUE, "", False, ticks[decision.tick - 1].playing, None)
        for _ in range(parts - 1):
            stream.update(still, STEP / parts)
        shown.append(stream.update(decision, STEP - (parts - 1) * (STEP / parts)))
    for one, many in zip(whole, shown, strict=True):
        np.testing.assert_allclose(many.rotations, one.rotations, atol=1e-9)


# ---- state


@given(segments=plays, data=st.data(), blend=st.sampled_from(["spring", "none"]))
def test_a_stream_restored_at_any_tick_gives_the_same_poses_again(segments, data, blend):
    settings = PoseSettings(root="mixed", blend=blend, foot_lock=blend != "none")
    stream, ticks = PoseStream(bank(), settings), list(decisions(segments, STEP))
    states, shown = [], []

    def update(at, decision):
        return at.update(decision, STEP if decision.tick else 0.0, (0.01 * decision.tick, 0.04 * decision.tick, 0.0))

    for decision in ticks:
        states.append(stream.state)
        shown.append(update(stream, decision))
    back = data.draw(st.integers(0, len(ticks) - 1))
    for other in (stream, PoseStream(bank(), settings)):
        other.restore(states[back])
        for decision, was in zip(ticks[back:], shown[back:], strict=True):
            again = update(other, decision)
            np.testing.assert_array_equal(again.rotations, was.rotations)
            np.testing.assert_array_equal(again.positions, was.positions)
            assert (again.root, again.play_rate, again.is_jump) == (was.root, was.play_rate, was.is_jump)


def test_a_state_may_be_pickled_for_a_saved_game():
    stream, other = PoseStream(bank(), LOCKED), PoseStream(bank(), LOCKED)
    *before, last = decisions([("walk", 0.1, 9), ("run", 0.2, 4)], STEP)
    for decision in before:
        stream.update(decision, STEP if decision.tick else 0.0)
    other.restore(pickle.loads(pickle.dumps(stream.state)))
    np.testing.assert_array_equal(other.update(last, STEP).positions, stream.update(last, STEP).positions)


def test_after_a_very_long_pause_nothing_is_left_of_a_jump():
    segments = [("run", 0.1, 5), ("idle", 0.5, 2)]
    stream, (*before, last) = PoseStream(bank(), SPRING), decisions(segments, STEP)
    for decision in before:
        stream.update(decision, STEP if decision.tick else 0.0)
    pose = stream.update(replace(last, root_motion=RootMotion()), 1e9)
    np.testing.assert_allclose(pose.rotations, bank().sample("idle", last.playing.time_s).rotations, atol=1e-12)


def test_a_jump_is_marked_and_a_start_is_not():
    poses = streamed([("walk", 0.0, 3), ("run", 0.0, 3)], SPRING)
    assert [pose.is_jump for pose in poses] == [False, False, False, True, False, False]


# ---- faults


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: PoseStream({}), "there is no pose bank"),
        (lambda: PoseStream({"jog": bank()}).update(walking(), 0.0, (0, 0, 0)), 'no pose bank of the database "loco"'),
        (lambda: PoseStream(PoseBank.build(clips()[:1], SCHEMA)).update(walking(), 0.0, (0, 0, 0)), 'no poses of "walk"'),
        (lambda: PoseStream(bank()).update(walking(), 0.0), "needs a body"),
        (lambda: PoseSettings(blend="dead"), 'blend = "dead".*"spring"'),
    ],
)
def test_what_a_stream_cannot_do_is_told(wrong, said):
    with pytest.raises(MotionError, match=said):
        wrong()


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: PoseStream("walk"),
        lambda: PoseStream({"loco": "walk"}),
        lambda: PoseStream(bank(), {"root": "code"}),
        lambda: PoseStream(bank(), OFF).update("walk", 0.0),
        lambda: PoseStream(bank(), OFF).update(walking(), -1.0),
        lambda: PoseStream(bank()).update(walking(), 0.0, (0.0, 0.0)),
        lambda: PoseStream(bank()).update(walking(), 0.0, (0.0, "ahead", 0.0)),
        lambda: PoseStream(bank()).restore(None),
        lambda: PoseStream(bank()).restore(PoseStream(bank(), OFF).state),
    ],
)
def test_arguments_of_another_type_are_told(wrong):
    with pytest.raises(ContextError):
        wrong()


def test_a_fault_leaves_the_stream_where_it_stood():
    stream = PoseStream(PoseBank.build(clips()[:2], SCHEMA), SPRING)
    stream.update(walking(), 0.0)
    state = stream.state
    with pytest.raises(MotionError):
        stream.update(Decision(1, 0.0, Action.JUMP, "", True, playing_at("run", 0.0), walking().playing), STEP)
    assert stream.state is state
    assert isinstance(state, PoseState)


def walking():
    return Decision(0, 0.0, Action.START, "", True, playing_at("walk", 0.2), None)
