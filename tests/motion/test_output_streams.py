"""The streams of a crowd give what each gives alone, to the last bit, whatever happens to each."""

import math
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from played import NAMES, RATE, bank, decisions, playing_at

from contextdb.errors import ContextError, MotionError
from contextdb.motion import Action, Decision, PoseSettings, PoseStream, PoseStreams, Steered

STEP = 1.0 / RATE
N_TICKS = 12
ARRAYS = ("rotations", "translations", "positions", "contacts")
SETTINGS = st.builds(
    PoseSettings,
    root=st.sampled_from(["animation", "code", "mixed", "path"]),
    blend=st.sampled_from(["spring", "none"]),
    path_alignment=st.booleans(),
    max_stride=st.sampled_from([1.0, 1.25]),
    foot_lock=st.booleans(),
)
SEGMENTS = st.lists(
    st.tuples(st.sampled_from(NAMES), st.floats(0.0, 1.2), st.integers(1, 9), st.booleans()), min_size=4, max_size=5
)
NOTHING = Decision(0, 0.0, Action.NOTHING, "", True, None, None)


def stairs(x, z):
    return 0.12 * math.floor(z / 0.2), (0.1, 1.0, 0.05)


def many_stairs(x, z):
    return 0.12 * np.floor(z / 0.2), np.tile([0.1, 1.0, 0.05], (len(x), 1))


@st.composite
def plays(draw):
    """Ticks of one character: what is decided, now and then by another one, or nothing; and where its body is."""
    ticks = list(decisions(draw(SEGMENTS), STEP)) * 5
    cut = draw(st.integers(1, 6))
    ticks = [*ticks[:cut], *[NOTHING] * draw(st.integers(0, 1)), *ticks[cut + draw(st.integers(0, 5)) :]][:N_TICKS]
    weight, speed, turn = draw(st.sampled_from([1.0, 0.3])), draw(st.floats(0.0, 3.0)), draw(st.floats(-3.0, 3.0))
    ticks = [replace(each, root_weight=weight, play_rate=1.0 + 0.02 * i) for i, each in enumerate(ticks)]
    return ticks, [(speed * math.sin(turn) * i * STEP, speed * i * STEP, turn * i * STEP) for i in range(N_TICKS)]


def same(one, other):
    assert (one.playing, one.is_jump, one.is_forced, one.root, one.play_rate) == (
        other.playing,
        other.is_jump,
        other.is_forced,
        other.root,
        other.play_rate,
    )
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@given(st.lists(plays(), min_size=1, max_size=4), SETTINGS, st.data())
def test_each_of_a_crowd_shows_what_it_shows_alone(crowd, settings, data):
    """Some of it without a ground, and on a ground of its own; bodies come and go between updates, and stand alone meanwhile."""
    grounds = [data.draw(st.sampled_from([None, stairs])) for _ in crowd]
    first = PoseStream({"loco": bank(), "other": copy(bank())}, settings)
    alone, together = ([copy(first) for _ in crowd] for _ in range(2))
    away = data.draw(st.integers(0, N_TICKS - 1))
    for i in range(N_TICKS):
        dt, decided, bodies = STEP if i else 0.0, [ticks[i] for ticks, _ in crowd], [places[i] for _, places in crowd]
        each = zip(alone, decided, bodies, grounds, strict=True)
        wanted = [stream.update(decision, dt, body, ground) for stream, decision, body, ground in each]
        if i == away:
            shown = [stream.update(*given, grounds[0]) for stream, *given in zip(together[:1], decided, [dt], bodies, strict=False)]
            rest = together[1:]
            shown += PoseStreams(rest).update(decided[1:], dt, bodies[1:], grounds[1:]) if rest else []
        else:
            shown = PoseStreams(together).update(decided, dt, bodies, grounds)
        for one, other in zip(shown, wanted, strict=True):
            same(one, other)


@given(st.lists(plays(), min_size=2, max_size=3), st.integers(1, N_TICKS - 1))
def test_a_crowd_restored_at_any_tick_shows_the_same_again(crowd, back):
    streams = PoseStreams([PoseStream(bank()) for _ in crowd])
    states, shown = [], []
    for i in range(N_TICKS):
        states.append(streams.states)
        shown.append(streams.update([t[i] for t, _ in crowd], STEP if i else 0.0, np.array([p[i] for _, p in crowd]), many_stairs))
    streams.restore(states[back])
    for i in range(back, N_TICKS):
        again = streams.update([t[i] for t, _ in crowd], STEP, np.array([p[i] for _, p in crowd]), many_stairs)
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(again, name), getattr(shown[i], name))


def test_crowds_that_threads_update_at_once_show_what_they_show_one_by_one():
    """Of so many characters that the core lets other threads run meanwhile."""
    first = PoseStream(bank())

    def updated(_):
        streams = PoseStreams([copy(first) for _ in range(24)])
        return [streams.update(each, STEP, np.zeros((24, 3))).positions for each in zip(*walks(24), strict=True)]

    expected = updated(0)
    with ThreadPoolExecutor(4) as threads:
        for given in threads.map(updated, range(4)):
            np.testing.assert_array_equal(given, expected)


def walks(n):
    return [list(decisions([("walk", 0.1 * i, 20), ("run", 0.3, 10)], STEP)) for i in range(n)]


def test_a_ground_of_arrays_is_that_of_its_places():
    one, each = (PoseStreams([PoseStream(bank()) for _ in range(3)]) for _ in range(2))
    for i, decided in enumerate(zip(*walks(3), strict=True)):
        bodies = [Steered(position=(k, 1.2 * i * STEP)) for k in range(3)]
        arrays = one.update(decided, STEP if i else 0.0, bodies, many_stairs)
        functions = each.update(decided, STEP if i else 0.0, bodies, [stairs] * 3)
        np.testing.assert_allclose(arrays.positions, functions.positions, atol=1e-12)


def test_poses_are_views_of_arrays_with_a_row_a_character():
    poses = PoseStreams([PoseStream(bank()) for _ in range(2)]).update(
        [Decision(0, 0.0, Action.START, "", True, playing_at("walk", 0.2), None)] * 2, 0.0, np.zeros((2, 3))
    )
    assert poses.positions.shape == (2, bank().n_joints, 3)
    assert poses[1].positions.base is not None
    assert [pose.root for pose in poses[:]] == [tuple(root) for root in poses.roots.tolist()]


def test_a_fault_of_one_leaves_all_where_they_stood():
    streams = PoseStreams([PoseStream(bank()) for _ in range(2)])
    states = streams.states
    start = Decision(0, 0.0, Action.START, "", True, playing_at("walk", 0.2), None)
    unknown = replace(start, playing=replace(start.playing, asset="flight"))
    with pytest.raises(MotionError, match='no poses of "flight"'):
        streams.update([start, unknown], 0.0, np.zeros((2, 3)))
    assert all(stream.state is state for stream, state in zip(streams, states, strict=True))


ONE = PoseStream(bank(), PoseSettings(root="animation"))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: PoseStreams([]), "no stream"),
        (lambda: PoseStreams([ONE, ONE]), "twice"),
        (lambda: PoseStreams([ONE, PoseStream(bank())]), "different banks or settings"),
        (lambda: PoseStreams([PoseStream(bank())]).update([NOTHING], 0.0), "needs a body"),
        (lambda: PoseStreams([PoseStream(bank())]).update([NOTHING], 0.0, [None]), "character 0.*needs a body"),
        (lambda: PoseStreams([ONE]).update([], 0.0), "0 decisions for 1 character"),
        (lambda: PoseStreams([ONE]).update([NOTHING], 0.0, [(0.0, math.nan, 0.0)]), "character 0"),
        (lambda: PoseStreams([ONE]).update([NOTHING], 0.0, None, [3.0]), "character 0"),
        (lambda: PoseStreams([ONE]).update([NOTHING], 0.0, None, lambda x, z: x), "the ground at"),
        (lambda: PoseStreams([ONE]).update([NOTHING], 0.0, None, lambda x, z: (x, np.zeros((len(x), 3)))), "y above 0"),
        (lambda: PoseStreams([ONE]).update([NOTHING], 0.0, None, lambda x, z: (x, 1.0, z)), "the ground at"),
        (lambda: PoseStreams([ONE]).update([NOTHING], 0.0, None, lambda x, z: (x, np.zeros((9, 3)))), "the ground at"),
        (lambda: PoseStreams([ONE]).restore([]), "0 states for 1 character"),
    ],
)
def test_what_a_crowd_cannot_do_is_told(wrong, said):
    with pytest.raises((MotionError, ContextError), match=said):
        wrong()


def test_a_crowd_of_banks_of_different_rigs_is_refused():
    other = copy(bank())
    object.__setattr__(other, "skeleton", replace(bank().skeleton, names=tuple(f"my{name}" for name in bank().skeleton.names)))
    first = bank().assets[0]
    said = f'the banks "one" .with "{first}". and "other" .with "{first}". are of different rigs: the second has no joint "Hips". '
    with pytest.raises(MotionError, match=f"{said}Accepted: banks of one rig. Try to put the clips on one rig: rig ="):
        PoseStream({"one": bank(), "other": other})


def test_a_ground_that_says_nothing_is_level():
    level, unsaid = (PoseStreams([PoseStream(bank(), PoseSettings(root="animation"))]) for _ in range(2))
    start = Decision(0, 0.0, Action.START, "", True, playing_at("walk", 0.2), None)
    shown = [each.update([start], 0.0, None, ground).positions for each, ground in ((level, None), (unsaid, lambda x, z: None))]
    np.testing.assert_array_equal(*shown)
