"""Clips that loop: at their ends features see the next round, and not a path that runs out straight."""

import numpy as np
import pytest
from made_once import make_clip

from contextdb.motion import FeatureSchema, Markup, MotionDatabase, poses_of, root_trajectory
from contextdb.motion.clips.contacts import three_rounds
from contextdb.motion.features.extraction import clip_features

SCHEMA = FeatureSchema.from_dict(
    "loco",
    {
        "rate": 30.0,
        "channels": [
            {"type": "velocity", "bone": "LeftFoot"},
            {"type": "trajectory", "what": "position", "at": [-1.0, 1.0]},
            {"type": "trajectory", "what": "direction", "along": [1.0]},
        ],
    },
)


@pytest.mark.parametrize("name", ["walk", "walk_turn_left_90", "jog_turn_right_60"])
def test_the_features_of_a_steady_loop_are_the_same_in_every_cycle(name):
    made = make_clip(name)
    features = clip_features(made.clip, SCHEMA, looping=True).features
    cycle, odd = divmod(made.clip.n_frames - 1, made.recipe.n_cycles)
    assert odd == 0
    assert features[:cycle] == pytest.approx(features[cycle : 2 * cycle], abs=1e-3)
    assert features[-cycle - 1 : -1] == pytest.approx(features[cycle : 2 * cycle], abs=1e-3)


def test_a_round_begins_where_the_one_before_it_ended_and_as_it_faced():
    poses = poses_of(make_clip("walk_turn_left_45").clip)
    rounds, middle = three_rounds(poses, root_trajectory(poses))
    assert rounds.positions[middle] == pytest.approx(poses.positions)
    assert rounds.rotations[middle] == pytest.approx(poses.rotations)
    path = root_trajectory(rounds)
    assert rounds.n_frames == 3 * (poses.n_frames - 1) + 1
    assert np.linalg.norm(np.diff(path.positions, axis=0), axis=1).max() < 0.1
    assert np.abs(np.diff(path.headings)).max() < 0.2
    assert np.rad2deg(path.headings[-1] - path.headings[0]) == pytest.approx(3 * 45 * (poses.n_frames - 1) / 30, abs=0.5)


@pytest.mark.parametrize("name", ["idle", "walk"])
def test_a_clip_of_one_frame_loops_into_itself(name):
    clip = make_clip(name).clip
    one = type(clip)(clip.name, clip.skeleton, clip.frame_time_s, clip.values[:1])
    alone = clip_features(one, SCHEMA)
    assert clip_features(one, SCHEMA, looping=True).features == pytest.approx(alone.features)


def test_a_database_takes_from_its_markup_which_clips_loop():
    clips = [make_clip("walk_turn_left_90").clip, make_clip("jog").clip]
    markup = Markup.parse("asset,tag,from,to\nwalk*,Looping,,\n")
    database = MotionDatabase.build(clips, SCHEMA, markup=markup)
    raw = database.normalisation.undo(database.features)
    assert raw[:125] == pytest.approx(clip_features(clips[0], SCHEMA, looping=True).features, abs=1e-4)
    assert raw[125:] == pytest.approx(clip_features(clips[1], SCHEMA).features, abs=1e-4)
