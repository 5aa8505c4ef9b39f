"""Made clips keep the promises of their recipes."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from strategies import for_each

from contextdb.errors import MotionError
from contextdb.motion import load_bvh, poses_of, root_trajectory, write_made_clips
from contextdb.motion.clips.quaternions import rotate
from contextdb.motion.made.recipes import ABOUT_TURNS, RECIPES, descriptions, made_clips, make_clip
from contextdb.motion.walking.cycle import Cycle

MADE = {made.name: made for made in (*made_clips(), *map(make_clip, ABOUT_TURNS))}
STEADY = [name for name, made in MADE.items() if made.recipe.change == "steady" and made.recipe.gait != "Idle"]
FEET = ("LeftFoot", "RightFoot")
EVERY = pytest.mark.parametrize("name", MADE)


def places(name, bone):
    poses = poses_of(MADE[name].clip)
    return poses.positions[:, poses.skeleton.index(bone)]


def frames_down(name, foot):
    """The frames of each interval in which the foot is down."""
    n_frames = MADE[name].clip.n_frames
    return [[i for i in range(n_frames) if down <= i / 30.0 <= up] for down, up in MADE[name].footfalls.down[foot]]


@EVERY
def test_a_planted_foot_stays_at_one_place_in_the_world(name):
    for foot in FEET:
        for bone in (foot, foot.replace("Foot", "Toe")):
            for frames in frames_down(name, foot):
                moved = np.abs(places(name, bone)[frames] - places(name, bone)[frames[:1]])
                assert moved.max(initial=0.0) < 1e-4  # metres


@EVERY
def test_no_joint_is_below_the_ground_and_no_bone_is_stretched(name):
    poses = poses_of(MADE[name].clip)
    assert poses.positions[..., 1].min() > 0.0
    lengths = np.linalg.norm(poses.positions[:, 1:] - poses.positions[:, poses.skeleton.parents[1:]], axis=-1)
    assert np.allclose(lengths, lengths[0], atol=1e-9)


@EVERY
def test_no_joint_jumps_between_two_frames(name):
    poses = poses_of(MADE[name].clip)
    speeds = np.linalg.norm(np.diff(poses.positions, axis=0), axis=-1) * 30.0
    assert speeds.max() < 3.5 * MADE[name].recipe.pace.speed_mps + 1.0


@EVERY
def test_a_cycle_begins_with_the_left_foot_down_in_mid_stride_under_the_body(name):
    made = MADE[name]
    assert made.footfalls.is_down("LeftFoot", 0.0)
    if made.recipe.change != "start" and made.recipe.gait != "Idle":
        assert not made.footfalls.is_down("RightFoot", 0.0)
    ahead = places(name, "LeftFoot")[0] - places(name, "Hips")[0]
    assert abs(ahead[2]) < 0.02


@for_each(STEADY)
def test_each_foot_comes_down_once_in_a_cycle_half_a_cycle_after_the_other(name):
    made = MADE[name]
    cycle_s = 1.0 / made.recipe.pace.cycles_per_s
    left, right = (made.footfalls.down[foot] for foot in FEET)
    assert np.allclose(np.diff(left[1:, 0]), cycle_s, atol=1e-3)
    assert np.allclose(right[:, 0] - left[:-1, 1], cycle_s / 2.0 - cycle_s * made.recipe.pace.duty, atol=2e-3)
    assert np.allclose(right[:, 1] - right[:, 0], cycle_s * made.recipe.pace.duty, atol=2e-3)


@for_each(STEADY)
def test_a_steady_clip_ends_in_the_pose_it_began_with(name):
    values = MADE[name].clip.values[:, 4:]
    turned = MADE[name].recipe.turn_dps * MADE[name].clip.duration_s
    assert MADE[name].clip.values[-1, 3] - MADE[name].clip.values[0, 3] == pytest.approx(turned, abs=0.01)
    assert np.allclose(values[0], values[-1], atol=0.01)  # degrees


@for_each(STEADY)
def test_a_walk_always_has_a_foot_down_and_a_run_has_moments_without(name):
    falls = MADE[name].footfalls
    times = np.linspace(0.0, falls.duration_s, 1000)
    n_down = [sum(falls.is_down(foot, time_s) for foot in FEET) for time_s in times]
    assert (min(n_down) == 0) == (MADE[name].recipe.gait == "Run")
    assert (max(n_down) == 2) == (MADE[name].recipe.gait == "Walk")


def test_speed_comes_from_longer_strides_more_than_from_faster_ones():
    for slow, fast in (("walk_slow", "walk_fast"), ("jog", "sprint")):
        a, b = RECIPES[slow].pace, RECIPES[fast].pace
        assert b.stride_m / a.stride_m > 1.3 * b.cycles_per_s / a.cycles_per_s > 1.3


@pytest.mark.parametrize("change", ["start", "stop"])
def test_starts_and_stops_stand_still_with_both_feet_down(change):
    for name in (f"{change}_walk", f"{change}_run", f"{change}_walk_tired"):
        made = MADE[name]
        still = slice(0, 12) if change == "start" else slice(-12, None)
        hips = places(name, "Hips")[still]
        assert np.ptp(hips[:, [0, 2]], axis=0).max() < 0.005
        time_s = 0.1 if change == "start" else made.clip.duration_s - 0.1
        assert all(made.footfalls.is_down(foot, time_s) for foot in FEET)


@for_each(STEADY)
def test_each_cycle_of_a_steady_clip_ends_as_it_began(name):
    assert Cycle.of(MADE[name].clip, most_m=0.01, most_deg=2.0).speed_mps > 0.0


@pytest.mark.parametrize("name", ABOUT_TURNS)
def test_a_turn_about_goes_off_the_other_way_at_the_pace_it_came(name):
    hips, pace = places(name, "Hips")[:, [0, 2]], RECIPES[name.split("_")[0]].pace
    cycle = round(30.0 / pace.cycles_per_s)
    came, went = (hips[cycle] - hips[0]) * 30.0 / cycle, (hips[-1] - hips[-1 - cycle]) * 30.0 / cycle
    assert np.linalg.norm(came) == pytest.approx(pace.speed_mps, abs=0.05)
    assert went == pytest.approx(-came, abs=0.03)
    assert MADE[name].clip.values[-1, 3] - MADE[name].clip.values[0, 3] == pytest.approx(
        180.0 if "left" in name else -180.0, abs=0.5
    )


@pytest.mark.parametrize("name", ABOUT_TURNS)
def test_no_foot_stands_twisted_far_from_its_body_in_a_turn_about(name):
    poses = poses_of(MADE[name].clip)
    headings = root_trajectory(poses).headings
    for foot in FEET:
        ahead = rotate(poses.rotations[:, poses.skeleton.index(foot)], np.array([0.0, 0.0, 1.0]))
        twisted = np.rad2deg(np.abs((np.arctan2(ahead[:, 0], ahead[:, 2]) - headings + np.pi) % (2.0 * np.pi) - np.pi))
        assert twisted.max() < 60.0


# ---- what a table says of them


@cache
def described():
    return {description.asset: description for description in descriptions()}


def test_descriptions_are_plain_data_one_for_each_clip():
    rows = [dataclasses.asdict(description) for description in descriptions()]
    assert [row["asset"] for row in rows] == list(RECIPES)
    assert 20 <= len(rows) <= 30
    assert {type(value) for row in rows for value in row.values()} == {str, float}
    assert {row["gait"] for row in rows} == {"Idle", "Walk", "Run"}
    assert {row["style"] for row in rows} == {"normal", "tired"}


@pytest.mark.parametrize("name", [name for name in STEADY if not RECIPES[name].turn_dps])
def test_a_described_speed_is_the_distance_that_the_hips_cover_over_the_time(name):
    hips = places(name, "Hips")
    covered = float(np.linalg.norm((hips[-1] - hips[0])[[0, 2]]))
    assert described()[name].speed_mps == pytest.approx(covered / MADE[name].clip.duration_s, abs=0.006)
    assert described()[name].speed_mps == pytest.approx(RECIPES[name].pace.speed_mps, abs=0.006)
    assert (described()[name].direction_deg, described()[name].heading_change_deg) == (0.0, 0.0)


@pytest.mark.parametrize("name", [name for name in STEADY if RECIPES[name].turn_dps])
def test_a_described_turn_bends_the_path_to_its_side(name):
    found, recipe = described()[name], RECIPES[name]
    hips = places(name, "Hips")[:, [0, 2]]
    steps = np.diff(hips, axis=0)
    assert np.linalg.norm(steps, axis=1).sum() / found.duration_s == pytest.approx(found.speed_mps, rel=0.03)
    course = np.unwrap(np.arctan2(steps[:, 0], steps[:, 1]))
    cycle = round(30.0 / recipe.pace.cycles_per_s)
    turned = np.rad2deg(course[cycle] - course[0]) / (cycle / 30.0)
    assert turned == pytest.approx(recipe.turn_dps, rel=0.05)
    assert found.turn_dps == pytest.approx(recipe.turn_dps, abs=0.2)
    assert ("left" in name) == (found.turn_dps > 0.0)


def test_a_start_is_described_from_rest_to_its_pace_and_a_stop_the_other_way():
    assert (described()["start_walk"].start_mps, described()["start_walk"].end_mps) == pytest.approx((0.0, 1.3), abs=0.02)
    assert (described()["stop_run"].start_mps, described()["stop_run"].end_mps) == pytest.approx((3.6, 0.0), abs=0.02)


# ---- files


def test_clips_are_the_same_every_time():
    assert np.array_equal(make_clip("run").clip.values, MADE["run"].clip.values)


def test_written_clips_read_as_the_same_motion(tmp_path):
    paths = write_made_clips(tmp_path)
    assert [path.stem for path in paths] == list(RECIPES)
    for path in paths[::5]:
        again, made = load_bvh(path), MADE[path.stem]
        assert again.name == made.name
        assert np.abs(poses_of(again).positions - poses_of(made.clip).positions).max() < 1e-6


def test_the_clips_of_a_contest_end_face_to_face(tmp_path):
    written = {path.stem: path for path in write_made_clips(tmp_path, of_game=True)}
    assert {"walk_about_left", "jog_strafe", "walk_back", "vault_run", "catch_high"} < set(written)
    one, other = (root_trajectory(poses_of(load_bvh(written[f"catch_contested.{role}"]))) for role in ("Catcher", "Other"))
    assert other.positions[-1] - one.positions[-1] == pytest.approx((0.0, 0.8), abs=0.05)
    assert np.cos(other.headings[-1] - one.headings[-1]) == pytest.approx(-1.0, abs=0.01)


def test_an_unknown_clip_is_refused_with_the_nearest():
    with pytest.raises(MotionError, match=r'there is no made clip "wakl_fast".*Did you mean "walk_fast"\?'):
        make_clip("wakl_fast")
