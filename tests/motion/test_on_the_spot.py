"""Clips on the spot: the speed of a body is that of the ground under its standing feet."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_once import make_clip
from running import run
from strategies import for_each, some

from contextdb import motion
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.on_the_spot import by_feet, ground_motion
from contextdb.motion.clips.poses import local_poses, poses_of
from contextdb.motion.clips.trajectory import root_trajectory
from contextdb.motion.made.recipes import ABOUT_TURNS, RECIPES
from contextdb.motion.storage.checking import check_motion

MOCAP = Path(os.environ.get("CONTEXTDB_MOCAP", Path(__file__).parents[3] / "shared" / "data" / "mocap"))
MOVING = [name for name in (*RECIPES, *ABOUT_TURNS) if not name.startswith("idle")]


def taken_out(clip: motion.Clip) -> tuple[motion.Clip, motion.Trajectory]:
    """A clip without the motion of its root, and this motion."""
    path, local = root_trajectory(poses_of(clip)), local_poses(clip)
    back = quaternions.about_axis("y", -path.headings)
    places, turns = local.positions.copy(), local.rotations.copy()
    places[:, 0] -= np.stack((path.positions[:, 0], np.zeros(clip.n_frames), path.positions[:, 1]), axis=-1)
    places[:, 0] = quaternions.rotate(back, places[:, 0])
    turns[:, 0] = quaternions.multiply(back, turns[:, 0])
    body = clip.skeleton
    offsets = body.offsets * clip.metres_per_unit
    return motion.Clip.from_arrays(body.names, body.parents, offsets, turns, places, clip.rate, name=clip.name), path


@for_each(MOVING)
def test_feet_give_back_the_motion_that_was_taken_out(name: str):
    clip = make_clip(name).clip
    spot, path = taken_out(clip)
    assert ground_motion(clip) is None
    found = ground_motion(spot)
    assert found is not None
    steps = np.diff(path.positions, axis=0) * clip.rate
    steps = quaternions.rotate(quaternions.about_axis("y", -path.headings[:-1]), np.insert(steps, 1, 0.0, axis=1))
    x, _, z = steps.mean(axis=0)
    assert found.speed_mps == pytest.approx(np.linalg.norm(steps, axis=1).mean(), rel=0.05)
    found_x, found_z = found.velocities.mean(axis=0)
    assert np.rad2deg(np.arctan2(found_x, found_z) - np.arctan2(x, z)) == pytest.approx(0.0, abs=5.0)
    turn = (path.headings[-1] - path.headings[0]) / clip.duration_s
    assert np.rad2deg(found.turns_radps.mean() - turn) == pytest.approx(0.0, abs=5.0)
    again = root_trajectory(poses_of(by_feet(spot)))
    assert again.lengths[-1] == pytest.approx(path.lengths[-1], rel=0.06)
    assert again.headings[-1] - again.headings[0] == pytest.approx(path.headings[-1] - path.headings[0], abs=0.4)
    apart = np.linalg.norm(again.positions - again.positions[0] - path.positions + path.positions[0], axis=1)
    assert apart.max() < (0.2 if name in ABOUT_TURNS else 0.08) * path.lengths[-1]


@pytest.mark.parametrize("name", ["start_walk", "stop_walk", "start_run", "stop_run"])
def test_a_change_of_speed_comes_when_it_came(name: str):
    clip = make_clip(name).clip
    spot, path = taken_out(clip)
    found = ground_motion(spot)
    assert found is not None
    speeds, real = np.linalg.norm(found.velocities, axis=1), np.linalg.norm(path.velocities, axis=1)
    assert np.abs(speeds - real).mean() < 0.08 * real.max()
    still = real < 0.05
    assert speeds[still].mean() < 0.15 * real.max()


@for_each(RECIPES)
def test_clips_that_stand_or_move_along_are_not_on_the_spot(name: str):
    clip = make_clip(name).clip
    assert ground_motion(clip) is None
    assert by_feet(clip) is clip
    assert motion.describe([clip])[0].facts.on_the_spot_mps == 0.0


def test_a_walk_on_the_spot_is_reported_and_described_as_a_walk_with_root_feet(tmp_path: Path):
    spot, _ = taken_out(make_clip("walk").clip)
    (tmp_path / "clips").mkdir()
    motion.write_bvh(spot, tmp_path / "clips/walk.bvh")
    assert "the clip runs on the spot" in " ".join(run("motion", "check", tmp_path / "clips").out.split())
    described = run("motion", "describe", tmp_path / "clips")
    assert "walk runs on the spot: its standing feet are those of 1.2" in described.err
    (idle,) = motion.describe([spot])
    assert (idle.cells["gait"], idle.facts.on_the_spot_mps) == ("Idle", pytest.approx(1.29, rel=0.05))
    assert motion.describe([by_feet(spot)])[0].cells["gait"] == "Walk"
    features = {"jog": {"rate": 30.0, "channels": [{"type": "trajectory", "what": "velocity", "at": [0.3]}]}}
    speeds = []
    for root in ("clip", "feet"):
        databases = {"jog": {"clips": "clips/*.bvh", "features": "jog", "root": root}}
        config = motion.MotionConfig.from_dict({"features": features, "databases": databases})
        for _ in ("computed", "from the cache"):
            findings = check_motion(config, tmp_path, {}).findings
            assert [finding.rule for finding in findings] == ["on-the-spot"] * (root == "clip")
        database = motion.build(config, tmp_path, {})["jog"]
        speeds.append(float(np.linalg.norm(database.raw(30))))
    assert speeds[0] < 0.2
    assert speeds[1] == pytest.approx(1.29, rel=0.05)


def test_a_folder_of_walks_on_the_spot_is_described_by_their_feet_and_its_project_says_so(tmp_path: Path):
    spot, _ = taken_out(make_clip("walk").clip)
    (tmp_path / "clips").mkdir()
    scaled = replace(spot, skeleton=replace(spot.skeleton, offsets=0.01 * spot.skeleton.offsets), values=_in_metres(spot))
    motion.write_bvh(scaled, tmp_path / "clips/walk.bvh", digits=9)
    result = run("motion", "describe", tmp_path / "clips", "--root-from", "feet", "--out", tmp_path / "moves.csv")
    assert "walk runs on the spot: its standing feet are those of 1.2" in result.err  # in metres, as is guessed from its size
    assert "walk,Walk," in (tmp_path / "moves.csv").read_text("utf-8")
    assert 'root = "feet"' in (tmp_path / "contextdb.toml").read_text("utf-8")
    assert "runs on the spot" not in run("motion", "check", tmp_path).out


def _in_metres(clip: motion.Clip) -> np.ndarray:
    values = clip.values.copy()
    values[:, :3] *= 0.01
    return values


@pytest.mark.skipif(not (MOCAP / "assets.csv").is_file(), reason="no captured clips: set CONTEXTDB_MOCAP to their folder")
def test_captured_clips_give_no_false_alarm():
    files = some(sorted(MOCAP.rglob("*.bvh")), 4)
    units = [0.056444 if "cmu" in str(file) else 0.01 for file in files]
    clips = (motion.load_bvh(file, metres_per_unit=unit) for file, unit in zip(files, units, strict=True))
    assert [clip.name for clip in clips if ground_motion(clip) is not None] == []
