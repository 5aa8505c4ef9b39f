"""Each measure against a body whose motion is worked out by hand; and measures do not change with rate, place and direction."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lines import line
from played import bank, database, decisions
from strategies import examples

from contextdb.errors import ArtefactError, ContextError, MotionError
from contextdb.motion import Action, Decision, Pose, PoseBank, PoseSettings, PoseStream, Skeleton, Trace, measure, write_poses
from contextdb.motion.measuring import formulas
from contextdb.motion.measuring.usage import usable
from contextdb.motion.output.track import pose_arrays
from contextdb.motion.selection.decision import Playing

RATE = 30.0
BONES = ("Hips", "LeftFoot", "RightFoot")
RIG = Skeleton(BONES, np.array([-1, 0, 0]), np.array([[0.0, 1.0, 0.0], [0.1, -1.0, 0.0], [-0.1, -1.0, 0.0]]), ((), (), ()))


def a_bank(rate=RATE, **assets):
    """A bank of rigid bodies that stand in their clips; an asset is (frames, speed ahead in m/s, height in m, contact)."""
    roots, hips, contacts, starts = [], [], [], [0]
    for n, speed, height, contact in assets.values():
        z = speed * np.arange(n) / rate
        roots.append(np.stack((np.zeros(n), z, np.zeros(n)), axis=-1))
        hips.append(np.tile([0.0, 1.0 + height, 0.0], (n, 1, 1)))
        contacts.append(np.full((n, 2), contact))
        starts.append(starts[-1] + n)
    n_frames = starts[-1]
    still = np.zeros((n_frames, 3, 4), np.float32)
    still[..., 0] = 1.0
    return PoseBank(
        RIG,
        rate,
        np.array(starts[:-1]),
        np.array(starts[1:]),
        tuple(assets),
        np.zeros(len(assets), np.bool_),
        np.zeros(len(assets), np.bool_),
        np.array([0]),
        still,
        np.concatenate(hips).astype(np.float32),
        np.concatenate(roots).astype(np.float32),
        ("LeftFoot", "RightFoot"),
        np.concatenate(contacts),
    )


def a_pose(playing, root, contacts=(True, True), *, jump=False, forced=False, lift=0.0):
    """The rigid body at a place; its hips a metre up, and more by `lift`."""
    x, z, heading = root
    sin, cos = math.sin(heading), math.cos(heading)
    places = [(0.0, 1.0, 0.0), (0.1, 0.0, 0.0), (-0.1, 0.0, 0.0)]
    positions = np.array([(x + cos * a + sin * c, b + lift, z - sin * a + cos * c) for a, b, c in places])
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    return Pose(playing, jump, forced, root, rotations, RIG.offsets, positions, np.array(contacts), 1.0)


def playing(asset="slide", time_s=0.0):
    return Playing("db", asset, 0, 0, time_s, False)


def sliding(speed, seconds=2.0, rate=RATE, lift=lambda t: 0.0):
    """Poses of the body that slides ahead at a speed, both feet planted."""
    times_s = np.arange(round(seconds * rate) + 1) / rate
    return [a_pose(playing(time_s=t), (0.0, speed * t, 0.0), lift=lift(t)) for t in times_s.tolist()]


BANK = a_bank(slide=(61, 0.0, 0.0, True))


# ---- skating


@pytest.mark.parametrize("rate", [15.0, 30.0, 60.0, 144.0])
def test_planted_feet_that_slide_at_half_a_metre_a_second_skate_50_cm_s_at_any_rate(rate):
    found = measure(sliding(0.5, rate=rate), BANK, rate=rate)
    assert found.skate_cm_s == pytest.approx(50.0)
    assert found.skate_m_min == pytest.approx(2 * 30.0)  # both feet
    assert found.skate_weighted_cm_s == pytest.approx(50.0)  # on the floor the weight is 2 - 2^0 = 1
    assert found.skate_raw_cm_s == found.skate_played_cm_s == 0.0
    assert found.skate_ratio == 0.0  # not faster than 0.5 m/s


def test_the_ratio_counts_the_time_in_which_a_low_foot_is_fast():
    times_s = np.arange(91) / RATE
    z = np.where(times_s < 2.0, 0.0, (times_s - 2.0) * 0.8)
    found = measure([a_pose(playing(time_s=t), (0.0, at, 0.0)) for t, at in zip(times_s, z, strict=True)], BANK, rate=RATE)
    assert found.skate_ratio == pytest.approx(29 / 90)  # 30 intervals of 90, but the mean over 5 is above 0.5 from the second on
    high = [a_pose(playing(time_s=t), (0.0, 0.8 * t, 0.0), lift=0.0 if i < 5 else 0.06) for i, t in enumerate(times_s)]
    assert measure(high, BANK, rate=RATE).skate_ratio == pytest.approx(4 / 90)


def test_the_weight_of_a_foot_falls_with_its_height():
    times_s = np.arange(61) / RATE
    lifted = [a_pose(playing(time_s=t), (0.0, 0.5 * t, 0.0), lift=0.0 if i < 30 else 0.0125) for i, t in enumerate(times_s)]
    found = measure(lifted, BANK, rate=RATE)
    expected = (29 * 50.0 + 31 * 50.0 * (2.0 - 2.0**0.5)) / 60
    assert found.skate_weighted_cm_s == pytest.approx(expected)


@given(st.integers(0, 2**32 - 1))
def test_a_foot_stands_where_it_was_not_lower_before_and_after_within_half_a_second(seed):
    rng = np.random.default_rng(seed)
    rate, n = float(rng.choice([15.0, 30.0, 60.0])), int(rng.integers(1, 50))
    feet, contacts = rng.uniform(0.0, 0.05, (n, 2, 3)), rng.random((n, 2)) < 0.8
    stands = formulas.standing(contacts, feet, np.arange(n) / rate)
    reach = round(0.5 * rate)
    for i in range(n):
        for k in range(2):
            least = max(feet[max(0, i - reach) : i + 1, k, 1].min(), feet[i : i + reach + 1, k, 1].min())
            assert stands[i, k] == (contacts[i, k] and feet[i, k, 1] <= least + 0.02)


@pytest.mark.parametrize("stair_m", [0.0, 0.16, -0.16])
def test_a_foot_that_steps_to_another_place_does_not_skate_and_one_on_a_stair_does(stair_m):
    """The last third of a second is on the next stair; while it slides there, it is not in a step."""
    lifts = [0.05 * math.sin(math.pi * min(i / 10, 1.0)) + (stair_m if i > 10 else 0.0) for i in range(21)]
    step = [a_pose(playing(time_s=i / RATE), (0.0, 0.03 * min(i, 10), 0.0), lift=lift) for i, lift in enumerate(lifts)]
    stands = measure(step, BANK, rate=RATE).skate_m_min
    slides = [a_pose(playing(time_s=i / RATE), (0.0, 0.03 * i, 0.0), lift=lift) for i, lift in enumerate(lifts)]
    assert measure(slides, BANK, rate=RATE).skate_m_min > 40.0 > 15.0 > stands


def test_feet_that_the_clip_has_up_do_not_skate():
    some = a_bank(slide=(61, 0.0, 0.0, True))
    some.contacts[31:], some.contacts[:, 1] = False, False
    poses = [replace(pose, playing=playing(time_s=i / RATE)) for i, pose in enumerate(sliding(0.5))]
    found = measure(poses, some, rate=RATE)
    assert found.skate_cm_s == pytest.approx(50.0)
    assert found.skate_m_min == pytest.approx(15.0)  # one foot, half of the time
    none = measure(poses, a_bank(slide=(61, 0.0, 0.0, False)), rate=RATE)
    assert (none.skate_cm_s, none.missing["skate_cm_s"]) == (None, "no foot is ever down")


def test_a_toe_is_down_where_its_source_is_low_and_slow_whatever_the_contacts_say():
    found = measure(sliding(0.3), a_bank(slide=(61, 0.0, 0.0, False)), rate=RATE)
    assert (found.skate_cm_s, found.skate_toe_cm_s) == (None, pytest.approx(30.0))
    fast = measure(sliding(0.3), a_bank(slide=(61, 0.6, 0.0, True)), rate=RATE)
    assert (fast.skate_toe_cm_s, fast.missing["skate_toe_cm_s"]) == (None, "no foot is ever down")
    hopping = a_bank(slide=(61, 0.0, 0.0, True))
    hopping.positions[31:, 0, 1] += 0.04
    poses = [replace(pose, playing=playing(time_s=i / RATE)) for i, pose in enumerate(sliding(0.0)[:31] + sliding(0.3)[31:])]
    assert measure(poses, hopping, rate=RATE).skate_toe_cm_s == 0.0


def test_the_worst_second_of_sliding_is_beside_the_mean():
    z = np.concatenate((np.zeros(60), 0.3 * np.arange(31) / RATE, np.full(60, 0.3)))
    poses = [a_pose(playing(time_s=min(i / RATE, 2.0)), (0.0, at, 0.0)) for i, at in enumerate(z.tolist())]
    found = measure(poses, BANK, rate=RATE)
    assert found.skate_cm_s == found.skate_toe_cm_s == pytest.approx(30.0 * 30 / 150)
    assert found.skate_worst_cm_s == found.skate_toe_worst_cm_s == pytest.approx(30.0)


def test_hips_and_feet_that_are_lower_than_in_the_clip_show_as_dip_and_below_the_floor():
    found = measure(sliding(0.0, lift=lambda t: -0.07 if t > 1.0 else 0.0), BANK, rate=RATE)
    assert (found.hip_dip_cm, found.penetration_cm, found.penetration_raw_cm) == (pytest.approx(7.0), pytest.approx(7.0), 0.0)


def test_hips_over_the_feet_and_lean_are_those_two_seconds_after_a_stop():
    stream, rig = PoseStream(bank(), PoseSettings(root="animation", foot_lock=False)), bank().skeleton
    poses = [stream.update(decision, 1.0 / RATE) for decision in decisions([("idle", 0.0, 151)], 1.0 / RATE)]
    wanted = [(0.0, 1.3 if i < 30 else 0.0) for i in range(151)]
    own = measure(poses, bank(), rate=RATE, wanted=wanted)
    assert own.hips_off_feet_cm == pytest.approx(0.0, abs=0.2)
    assert own.lean_deg == pytest.approx(own.lean_raw_deg, abs=0.2)
    ahead = np.array([0.0, 0.0, 0.15])
    for pose in poses:
        pose.positions[
            [i for i, name in enumerate(rig.names) if "Leg" not in name and "Foot" not in name and "Toe" not in name]
        ] += ahead
    off = measure(poses, bank(), rate=RATE, wanted=wanted)
    assert off.hips_off_feet_cm == pytest.approx(15.0, abs=0.2)
    assert off.lean_deg == pytest.approx(own.lean_deg)
    none = measure(poses[:80], bank(), rate=RATE, wanted=wanted[:80])
    assert none.missing["hips_off_feet_cm"] == "nothing comes to rest for two seconds"


def test_a_leg_that_is_straight_is_at_its_limit():
    stream = PoseStream(bank(), PoseSettings(root="animation", foot_lock=False))
    poses = [stream.update(decision, 1.0 / RATE) for decision in decisions([("idle", 0.0, 40)], 1.0 / RATE)]
    hip, knee, ankle = (bank().skeleton.index(name) for name in ("LeftUpLeg", "LeftLeg", "LeftFoot"))
    for pose in poses[:10]:
        pose.positions[knee] = (pose.positions[hip] + pose.positions[ankle]) / 2.0
    assert measure(poses, bank(), rate=RATE).knee_limit_share == pytest.approx(10 / 40)


@pytest.mark.parametrize("degrees", [0.0, 10.0, 22.5, 90.0])
def test_a_body_that_goes_another_way_than_its_clip_skates_twice_its_speed_by_the_sine_of_half_the_angle(degrees):
    speed, angle = 1.3, math.radians(degrees)
    steps = np.arange(61) / RATE * speed  # feet that stand in a clip that goes ahead, but the body goes `degrees` to the side
    poses = []
    for t, way in zip(np.arange(61) / RATE, steps, strict=True):
        x, z = way * math.sin(angle), way * math.cos(angle) - way
        pose = a_pose(playing(time_s=t), (0.0, 0.0, 0.0))
        poses.append(replace(pose, positions=pose.positions + np.array([x, 0.0, z])))
    found = measure(poses, BANK, rate=RATE)
    assert found.skate_cm_s == pytest.approx(100.0 * 2.0 * speed * math.sin(angle / 2.0), abs=1e-9)


def test_the_skating_of_raw_clips_is_told_and_that_of_the_frames_that_played():
    both = a_bank(still=(61, 0.0, 0.0, True), slide=(61, 0.3, 0.0, True))
    poses = [replace(pose, playing=playing("slide", i / RATE)) for i, pose in enumerate(sliding(0.0))]
    found = measure(poses, both, rate=RATE)
    assert found.skate_cm_s == 0.0
    assert found.skate_raw_cm_s == pytest.approx(15.0, abs=1e-4)  # half of all frames slide at 30 cm/s
    assert found.skate_played_cm_s == pytest.approx(30.0, abs=1e-4)
    assert found.skate_raw_m_min == pytest.approx(2 * 9.0, abs=1e-4)


# ---- accelerations


@pytest.mark.parametrize("rate", [30.0, 60.0, 120.0])
def test_the_acceleration_of_a_sine_is_that_of_its_crests(rate):
    a, w = 0.2, 3.0
    poses = sliding(0.0, seconds=20.0, rate=rate, lift=lambda t: a * math.sin(w * t))
    found = measure(poses, BANK, rate=rate)
    step = 1.0 / 30.0
    crest = a * (2.0 * math.sin(w * step / 2.0) / step) ** 2  # a w² less what the step of 1/30 s takes
    assert found.accel_p99 == pytest.approx(crest, rel=2e-3)
    assert found.accel_p99 == pytest.approx(a * w * w, rel=1e-2)
    assert found.accel_raw_p99 == 0.0


def test_a_step_of_10_cm_shows_as_90_m_s2_at_any_rate():
    for rate in (30.0, 60.0):
        n = round(rate)
        poses = [a_pose(playing(time_s=i / rate), (0.0, 0.0, 0.0), lift=0.1 if i >= n // 2 else 0.0) for i in range(n)]
        assert formulas.accelerations(
            np.array([pose.positions for pose in poses]), np.arange(n) / rate, round(rate / 30.0)
        ).max() == pytest.approx(90.0)


def test_snaps_are_the_moments_beyond_what_the_clips_have():
    raw = a_bank(slide=(2000, 0.0, 0.0, True))
    raw.positions[::2, 0, 1] += 0.001  # shakes by 1 mm: 1.8 m/s² in every frame
    poses = [a_pose(playing(), (0.0, 0.0, 0.0), lift=0.001 * (i % 2) + 0.1 * (i == 50)) for i in range(100)]
    found = measure(poses, raw, rate=RATE)
    assert found.snap_share == pytest.approx(3 / 98)
    assert found.accel_raw_p99 == pytest.approx(1.8 * 1.0, rel=1e-2)


# ---- jumps


def session(*segments, dt=1.0 / RATE, **more):
    """Decisions, a segment an asset and its number of moments; each but the first is entered by a jump from 0 s."""
    found, last = [], None
    for k, (asset, n) in enumerate(segments):
        for i in range(n):
            now = Playing("db", asset, 0, i, i * dt, False)
            before = None if last is None else replace(last, time_s=last.time_s + dt)
            action = Action.CONTINUE if i else Action.JUMP if k else Action.START
            found.append(Decision(len(found), len(found) * dt, action, "", i == 0, now if i == 0 else before, before, **more))
            last = found[-1].playing
    return found


def traced(decided):
    trace = Trace(0)
    for decision in decided:
        trace.record(decision)
    return trace


TWO = a_bank(low=(61, 1.0, 0.0, True), high=(61, 1.5, 0.25, True))


def test_a_jump_is_as_long_as_its_joints_are_apart():
    decided = session(("low", 30), ("high", 31), ("low", 30))
    found = measure(traced(decided), TWO, settings=PoseSettings(root="animation", blend="none"))
    assert (found.jumps, found.updates, found.seconds) == (2, 91, pytest.approx(3.0))
    assert found.jumps_per_s == pytest.approx(2 / 3)
    assert found.jump_cm == pytest.approx(25.0, abs=1e-4)
    assert found.jump_worst_cm == pytest.approx(25.0, abs=1e-4)
    assert found.jump_mps == pytest.approx(0.5, abs=1e-4)
    assert found.stay_s == pytest.approx(1.0)


def test_a_session_has_one_figure_for_how_long_a_clip_stays_and_one_for_the_frames_that_play():
    decided = decisions([("walk", 0.0, 30), ("walk", 0.4, 20), ("jog", 0.2, 140)], 1.0 / 20.0)
    trace = Trace(0, databases={"loco": database()})
    for decision in decided:
        trace.record(decision)
    found, stats = measure(trace, databases={"loco": database()}), trace.stats()
    assert (found.jumps, found.stay_s) == (2, pytest.approx(189 / 20 / 3))
    assert stats.stay_s == pytest.approx(found.stay_s)
    assert stats.frames_used_share == pytest.approx(found.frames_used_share)


def test_the_frame_that_would_have_played_on_is_no_jump():
    decided = session(("low", 20), ("low", 20))
    at = replace(decided[20].before, frame=20)
    decided[20] = replace(decided[20], playing=at)
    found = measure(traced(decided[:21]), TWO)
    assert (found.jump_cm, found.jump_mps) == (pytest.approx(0.0, abs=1e-5), pytest.approx(0.0, abs=1e-4))


def test_forced_jumps_are_counted_with_the_cost_of_the_dearest():
    decided = session(("low", 10), ("high", 10), ("low", 10), ("high", 10), ("low", 10))
    for i, cost, going_on in ((10, 3.0, 4.0), (20, 7.5, None), (30, 2.0, None), (40, 9.0, 10.0)):
        decided[i] = replace(decided[i], cost=cost, continuing_cost=going_on)
    found = measure(traced(decided), TWO)
    assert (found.jumps, found.forced_jumps, found.forced_cost) == (4, 2, 7.5)
    calm = measure(traced(session(("low", 10))), TWO)
    assert (calm.forced_cost, calm.missing["forced_cost"]) == (None, "no jump is forced")


def test_poses_tell_their_jumps_without_a_session():
    decided = session(("low", 30), ("high", 31))
    stream = PoseStream(TWO, PoseSettings(root="animation", blend="none", foot_lock=False))
    poses = [stream.update(decision, 1.0 / RATE) for decision in decided]
    alone, with_session = measure(poses, TWO), measure(traced(decided), TWO, poses=poses)
    assert alone == measure(poses, TWO, rate=RATE)
    again = measure(traced(decided), TWO, settings=PoseSettings(root="animation", blend="none", foot_lock=False))
    assert with_session == again
    for name in ("jumps", "jump_cm", "jump_mps", "forced_jumps", "stay_s", "skate_cm_s", "accel_p99", "frames_used_share"):
        assert getattr(alone, name) == pytest.approx(getattr(again, name)), name


# ---- the path


def along(bodies, roots, dt=1.0 / RATE):
    decided = [replace(each, body=body) for each, body in zip(session(("low", len(bodies)), dt=dt), bodies, strict=True)]
    return traced(decided), [a_pose(d.playing, root) for d, root in zip(decided, roots, strict=True)]


def test_the_error_of_the_path_is_how_far_the_root_is_from_the_game_s_body():
    bodies = [(0.0, 0.02 * i, 0.0) for i in range(60)]
    roots = [(0.03, 0.02 * i + 0.04 * (-1) ** i, math.radians(4.0 * (i % 2) + 360.0)) for i in range(60)]
    trace, poses = along(bodies, roots)
    found = measure(trace, TWO, poses=poses)
    assert (found.path_rms_m, found.path_p95_m) == (pytest.approx(0.05), pytest.approx(0.05))
    assert found.heading_rms_deg == pytest.approx(4.0 / math.sqrt(2.0))
    assert found.heading_p95_deg == pytest.approx(4.0)
    assert measure(trace, TWO, poses=poses, bodies=roots).path_rms_m == 0.0


def path_of(velocities, dt=1.0 / RATE):
    places = np.concatenate((np.zeros((1, 2)), np.cumsum(np.asarray(velocities) * dt, axis=0)))[:-1]
    return [(x, z, 0.0) for x, z in places.tolist()]


@pytest.mark.parametrize("rate", [30.0, 60.0])
@pytest.mark.parametrize(
    ("before", "after", "kind"),
    [((0.0, 1.0), (1.0, 0.0), "direction"), ((0.0, 1.0), (0.0, 2.0), "speed"), ((0.0, 1.5), (0.0, 0.0), "stop")],
)
def test_the_time_to_reach_what_is_wanted_is_how_long_the_root_is_behind(before, after, kind, rate):
    n, late = round(4 * rate), round(0.5 * rate)
    wanted = np.array([before if i < n // 2 else after for i in range(n)])
    shown = np.array([before if i < n // 2 + late else after for i in range(n)])
    trace, poses = along(path_of(wanted, 1 / rate), path_of(shown, 1 / rate), dt=1 / rate)
    for more in ({"wanted": wanted}, {}):  # what the stick says, or the body
        found = measure(trace, a_bank(low=(200, 1.0, 0.0, True)), poses=poses, **more)
        assert (found.n_changes, found.n_missed) == (1, 0)
        assert getattr(found, f"reach_{kind}_s") == found.reach_s
        assert found.reach_s == pytest.approx(0.5, abs=0.1 + 1.5 / rate)  # the velocity is the mean over 0.2 s
        assert found.missing.keys() & {"reach_direction_s", "reach_speed_s", "reach_stop_s"} == {
            f"reach_{each}_s" for each in ("direction", "speed", "stop") if each != kind
        }


def test_what_is_never_reached_counts_until_the_next_change():
    wanted = np.array([(0.0, 1.0) if i < 60 else (1.0, 0.0) if i < 120 else (0.0, 1.0) for i in range(180)])
    trace, poses = along(path_of(wanted), path_of(np.tile([0.0, 1.0], (180, 1))))
    found = measure(trace, TWO, poses=poses)
    assert (found.n_changes, found.n_missed) == (2, 1)
    assert found.reach_direction_s == pytest.approx((2.0 + 0.0) / 2.0, abs=0.05)


def test_a_circle_has_no_moment_at_which_something_new_is_wanted():
    angles = np.arange(180) / 30.0
    wanted = 1.3 * np.stack((np.sin(angles), np.cos(angles)), axis=-1)
    trace, poses = along(path_of(wanted), path_of(wanted))
    found = measure(trace, TWO, poses=poses)
    assert (found.n_changes, found.reach_s, found.missing["reach_s"]) == (0, None, "the wanted velocity never changes")


# ---- what is used


@pytest.mark.parametrize("dt", [1.0 / 30.0, 1.0 / 60.0, 1.0 / 10.0])
def test_the_frames_passed_are_used_whatever_the_rate_of_updates(dt):
    n = round(1.0 / dt)
    found = measure(traced(session(("low", n + 1), dt=dt)), TWO)
    assert found.frames_used_share == pytest.approx(31 / 122)
    assert (found.assets_used_share, found.assets_never_used) == (0.5, ("high",))


def test_a_loop_uses_its_frames_once():
    decided = list(decisions([("walk", 0.0, 900)], 1.0 / RATE))
    assert any(decision.action is Action.LOOP for decision in decided)
    at = bank().range_of("walk")
    found = measure(traced(decided), bank(), databases={"loco": database()})
    assert found.frames_used_share == pytest.approx((bank().stops[at] - bank().starts[at]) / bank().n_frames)
    assert found.assets_never_used == ("idle", "run", "walk_turn_left_90", "start_walk", "jog")


def marked(markup, n=10):
    return line(markup, walk=range(n))


@pytest.mark.parametrize(
    ("markup", "expected"),
    [
        ("", [1] * 10),
        ("walk,Excluded,,,\n", [0] * 10),
        ("walk,DoNotChoose,,,\n", [0] * 10),
        ("walk,DoNotChoose,0,0.35,\n", [0] * 4 + [1] * 6),
        ("walk,Excluded,0.3,0.45,\nwalk,DoNotChoose,0.5,,\n", [1] * 3 + [0] * 7),
        ("walk,DoNotChoose,0,0.35,\nwalk,Looping,,,\n", [1] * 10),
    ],
)
def test_frames_that_can_neither_be_entered_nor_played_on_to_never_play(markup, expected):
    assert usable(marked(markup)).astype(int).tolist() == expected


def test_the_share_of_frames_that_never_play_is_told_of_databases():
    found = measure(traced(session(("walk", 5))), databases={"db": marked("walk,DoNotChoose,0,0.35,\n")})
    assert found.frames_unusable_share == pytest.approx(0.4)


# ---- what changes nothing


@examples(0.3)
@given(
    st.floats(-50.0, 50.0),
    st.floats(-50.0, 50.0),
    st.floats(-math.pi, math.pi),
    st.sampled_from(["animation", "code", "mixed"]),
)
def test_measures_do_not_change_with_the_place_and_the_direction_of_the_world(x, z, turn, root):
    decided = list(decisions([("walk", 0.0, 40), ("run", 0.3, 40), ("walk", 0.5, 30, True)], 1.0 / RATE))
    bodies = [(0.02 * i, 0.04 * i, 0.01 * i) for i in range(len(decided))]
    sin, cos = math.sin(turn), math.cos(turn)
    moved = [(x + cos * a + sin * b, z - sin * a + cos * b, c + turn) for a, b, c in bodies]
    settings = PoseSettings(root=root)
    one, other = (
        measure(traced([replace(d, body=b) for d, b in zip(decided, places, strict=True)]), bank(), settings=settings).to_json()
        for places in (bodies, moved)
    )
    assert one["missing"] == other["missing"]
    for name, value in one.items():
        if isinstance(value, float):
            assert other[name] == pytest.approx(value, rel=1e-5, abs=1e-6), name


def test_the_poses_of_a_clip_measure_as_the_clip_at_any_rate():
    for rate in (30.0, 60.0):
        decided = list(decisions([("walk_turn_left_90", 0.0, round(3.0 * rate))], 1.0 / rate))
        settings = PoseSettings(root="animation", blend="none", foot_lock=False)
        found = measure(traced(decided), bank(), settings=settings)
        assert found.skate_cm_s == pytest.approx(found.skate_played_cm_s, abs=0.6)  # between two frames a foot is not quite still
        assert (found.jumps, found.snap_share) == (0, pytest.approx(0.0, abs=0.02))


# ---- what is given


def test_a_file_of_poses_measures_as_its_poses(tmp_path):
    stream = PoseStream(bank(), PoseSettings(root="animation"))
    poses = [stream.update(decision, 1.0 / RATE) for decision in decisions([("walk", 0.0, 60), ("run", 0.2, 40)], 1.0 / RATE)]
    write_poses(poses, bank(), tmp_path / "walk.npz", RATE)
    of_file, of_poses = measure(tmp_path / "walk.npz", bank()), measure(poses, bank(), rate=RATE)
    assert measure(pose_arrays(poses, bank(), RATE), bank()) == of_file
    for name, value in of_poses.to_json().items():
        if isinstance(value, float):
            assert getattr(of_file, name) == pytest.approx(value, rel=1e-3, abs=1e-3), name


def test_without_clips_a_file_of_poses_tells_what_it_can(tmp_path):
    stream = PoseStream(bank(), PoseSettings(root="animation"))
    poses = [stream.update(decision, 1.0 / RATE) for decision in decisions([("walk", 0.0, 60)], 1.0 / RATE)]
    write_poses(poses, bank(), tmp_path / "walk.npz", RATE)
    found = measure(tmp_path / "walk.npz")
    assert None not in (found.accel_p99, found.skate_ratio, found.skate_weighted_cm_s)
    assert found.missing["skate_cm_s"] == "it is not known when the feet of the clips are down"
    assert found.missing["accel_raw_p99"] == found.missing["jump_cm"] == "there are no pose banks to compare with"
    assert found.missing["path_rms_m"] == "the session does not say where the game had the body"


def test_a_session_alone_tells_its_jumps(tmp_path):
    traced(session(("low", 30), ("high", 31))).save(tmp_path / "session.parquet")
    found = measure(tmp_path / "session.parquet")
    assert (found.jumps, found.stay_s) == (1, pytest.approx(1.0))
    assert found.missing["accel_p99"].startswith("there are no poses")
    assert found.missing["frames_used_share"] == "the databases are not there"
    assert all(found.to_json()[name] is None for name in found.missing)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: measure([]), MotionError, "poses do not say how many of them a second has"),
        (lambda: measure([], rate=30.0), MotionError, "there is nothing to measure: no moment"),
        (lambda: measure(Trace()), MotionError, "there is nothing to measure: no moment"),
        (lambda: measure(7), ContextError, "session_or_poses"),
        (lambda: measure(sliding(0.5), rate=30.0, poses=sliding(0.5)), ContextError, "poses go with a session"),
        (lambda: measure(traced(session(("low", 9))), TWO, poses=sliding(0.5)), MotionError, "there are 61 poses for 9 decisions"),
        (
            lambda: measure(traced(session(("low", 61))), TWO, poses=sliding(0.5)),
            MotionError,
            "pose 0 is of 'slide', but the session plays 'low'",
        ),
        (lambda: measure(sliding(0.5), rate=30.0, bodies=[[0.0, 1.0]]), MotionError, r"bodies have shape \(1, 2\)"),
        (lambda: measure(sliding(0.5), rate=30.0, wanted=[[0.0] * 3] * 61), MotionError, r"wanted have shape \(61, 3\)"),
        (lambda: measure(traced(session(("jog", 9))), TWO), MotionError, 'there are no poses of "jog"'),
    ],
)
def test_what_cannot_be_measured_is_refused_in_a_sentence(call, error, message):
    with pytest.raises(error, match=message):
        call()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda arrays: arrays.pop("root"), 'is no array "root"'),
        (lambda arrays: arrays.update(root=arrays["root"][:-1]), r'"root" has shape \(59, 3\), not \[T, 3\]'),
        (lambda arrays: arrays.update(asset=np.arange(60)), '"asset" is of int64'),
        (lambda arrays: arrays.update(rate=np.array(0.0)), "the rate is not above 0"),
        (lambda arrays: arrays.update(positions=arrays["positions"] * np.nan), "not finite"),
    ],
)
def test_a_file_that_holds_no_poses_is_refused_with_the_reason(change, message, tmp_path):
    stream = PoseStream(bank(), PoseSettings(root="animation"))
    poses = [stream.update(decision, 1.0 / RATE) for decision in decisions([("walk", 0.0, 60)], 1.0 / RATE)]
    arrays = dict(pose_arrays(poses, bank(), RATE))
    change(arrays)
    np.savez(tmp_path / "poses.npz", **arrays)
    with pytest.raises(ArtefactError, match=message):
        measure(tmp_path / "poses.npz")
    (tmp_path / "none.npz").write_bytes(b"nothing")
    with pytest.raises(ArtefactError, match=r"damaged, or no \.npz file"):
        measure(tmp_path / "none.npz")
