"""Clips of a walker are loops at their speeds and turns, and a database of them plays beside captured ones."""

import functools

import numpy as np
import pytest
from made_once import make_clip

from contextdb import motion
from contextdb.errors import ContextDBError, ContextError, MotionError
from contextdb.motion.walking.blending import Gait
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.walked import walked_clips

CYCLES = {name: Cycle.of(make_clip(name).clip) for name in ("walk", "walk_fast", "jog", "run")}
GAITS = [
    Gait("walk", [CYCLES["walk"], CYCLES["walk_fast"]]),
    Gait("run", [CYCLES["jog"], CYCLES["run"]]),
]
NAMES = ["walk_1.30", "walk_1.30_left_60", "walk_1.60", "walk_1.60_left_60", "run_3.00", "run_3.00_left_60"]
SCHEMA = motion.FeatureSchema.from_dict(
    "loco",
    {
        "rate": 30.0,
        "channels": [
            {"type": "position", "bone": "LeftFoot"},
            {"type": "position", "bone": "RightFoot"},
            {"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0]},
        ],
    },
)


@functools.cache
def clips() -> dict[str, motion.Clip]:
    """Clips of a walker at three speeds, straight on and to the left."""
    return {clip.name: clip for clip in walked_clips(GAITS, [1.3, 1.6, 3.0], [0.0, 60.0])}


def test_names_say_gait_speed_and_turn():
    assert list(clips()) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_clip_ends_in_the_pose_that_it_began_with_at_its_speed_and_turn(name: str):
    clip = clips()[name]
    values = clip.values[:, 6:]  # all joints but the first, whose turn is that of the body too
    apart = (values[-1] - values[0] + 180.0) % 360.0 - 180.0
    assert np.abs(apart).max() < 0.5  # degrees
    path = motion.root_trajectory(motion.poses_of(clip))
    speed = path.lengths[-1] / clip.duration_s
    assert speed == pytest.approx(float(name.split("_")[1]), rel=0.1)
    turned = np.rad2deg(path.headings[-1] - path.headings[0]) / clip.duration_s
    assert turned == pytest.approx(60.0 if "left" in name else 0.0, abs=0.5)


@pytest.mark.parametrize("name", NAMES)
def test_feet_that_are_down_stand(name: str):
    poses = motion.poses_of(clips()[name])
    for bone in ("LeftToe", "RightToe"):
        toe = poses.positions[:, poses.skeleton.index(bone)]
        speeds = np.linalg.norm(np.diff(toe, axis=0), axis=-1) * poses.rate
        low = np.minimum(toe[1:, 1], toe[:-1, 1]) < toe[:, 1].min() + 0.002
        assert np.quantile(speeds[low], 0.5) < 0.02


def test_a_walker_is_a_database_of_a_selector_beside_others_and_its_poses_come_from_the_same_stream():
    loops = motion.Markup.parse("asset,tag,from,to,value\n*,Looping,,,\n")
    made = [make_clip(name).clip for name in ("run", "sprint")]
    parts = {"captured": made, "walked": list(clips().values())}
    built = motion.MotionDatabase.build([*made, *clips().values()], SCHEMA, markup=loops).normalisation
    databases = {
        name: motion.MotionDatabase.build(clips, SCHEMA, markup=loops, normalisation=built) for name, clips in parts.items()
    }
    banks = {name: motion.PoseBank.build(clips, SCHEMA, markup=loops) for name, clips in parts.items()}
    selector = motion.Selector([motion.Entry("captured", databases["captured"], 0.5), motion.Entry("walked", databases["walked"])])
    character = motion.Character(motion.Controller(selector), SCHEMA, None, motion.PoseStream(banks))
    seen = []
    for tick in range(240):
        updated = character.update(1.0 / 30.0, (0.0, 1.3 if tick < 120 else 3.6))
        assert updated.pose is not None
        assert np.isfinite(updated.pose.positions).all()
        playing = updated.decision.playing
        seen.append((playing.database, playing.asset))
    assert seen[100][0] == "walked"
    assert seen[100][1].startswith("walk_1.30")
    assert seen[-1] == ("captured", "run")


@pytest.mark.parametrize(
    ("speeds", "turns"), [([0.0], [0.0]), ([1.3, 1.3], [0.0]), (["fast"], [0.0]), ([1.3], [1e9]), (1.3, [0.0]), ([np.nan], [0.0])]
)
def test_other_speeds_and_turns_are_refused(speeds, turns):
    with pytest.raises(ContextDBError) as caught:
        walked_clips(GAITS, speeds, turns)
    assert isinstance(caught.value, (MotionError, ContextError))
