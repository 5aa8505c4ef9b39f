"""A character steered along a recorded stick for a minute: it is never stuck, enters no barred frame, and does it all again."""

import csv
import math
import os
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from made_once import made_clips
from strategies import in_full_runs

from contextdb.motion import Entry, FeatureSchema, MotionConfig, MotionDatabase, PoseSettings, Selector, load_bvh, with_path
from contextdb.motion.answers import NamedAssets
from contextdb.motion.clips.steering import Steered, steered_path
from contextdb.motion.markup.marks import Mark
from contextdb.motion.markup.markup import Markup
from contextdb.motion.search.filters import Biases
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.decision import Action

TABLES = Path(__file__).parents[2] / "tables"
MOCAP = Path(os.environ.get("CONTEXTDB_MOCAP", Path(__file__).parents[2].parent / "shared" / "data" / "mocap"))
RATE, SECONDS = 30.0, 60.0
BIASES = Biases(base=0.0, looping=-0.005, continuing=-0.01)
ENTERED = (Action.START, Action.JUMP)
BARRED = Mark.DO_NOT_CHOOSE | Mark.EXCLUDED | Mark.PAST_ENTRY | Mark.CLIP_END


def stick(time_s, slow_mps, fast_mps):
    """The velocity that is asked for, (x, z) in m/s. Over and over 20 s of standing, walking, circling to the left, turning sharply
    into a run, circling to the right, and standing again."""
    moment = time_s % 20.0
    speed, direction = 0.0, 0.0
    if 2.0 <= moment < 6.0:
        speed = slow_mps
    elif 6.0 <= moment < 10.0:
        speed, direction = slow_mps, 1.2 * (moment - 6.0)
    elif 10.0 <= moment < 13.0:
        speed, direction = fast_mps, -math.pi / 2.0
    elif 13.0 <= moment < 17.0:
        speed, direction = fast_mps, -math.pi / 2.0 - 0.9 * (moment - 13.0)
    return speed * math.sin(direction), speed * math.cos(direction)


def steer(controller, schema, slow_mps, fast_mps, **asked):
    """The decisions of a minute: at each update the pose that would play on, and the path that the stick asks for."""
    past, decisions = [Steered()], []
    for tick in range(round(SECONDS * RATE)):
        wanted = stick(tick / RATE, slow_mps, fast_mps)
        past = [*past, past[-1].moved(1.0 / RATE, wanted)][-round(RATE) :]
        upcoming = controller.upcoming(1.0 / RATE)
        pose = np.zeros(schema.n_features) if upcoming is None else database_of(controller, upcoming).raw(upcoming.frame)
        query = with_path(schema, pose, steered_path(past, wanted, rate=RATE))
        decisions.append(controller.update(1.0 / RATE, query, **{key: of(tick / RATE) for key, of in asked.items()}))
    return decisions


def database_of(controller, playing):
    return controller.selector.databases[playing.database]


def most_alike(decisions):
    """The fewest different frames in any second of play: all of them while it plays on, a few when it is stuck."""
    frames = [(decision.playing.database, decision.playing.frame) for decision in decisions]
    n = round(RATE)
    return min(len(set(frames[i : i + n])) for i in range(len(frames) - n + 1))


def told(decision):
    playing = decision.playing
    return decision.tick, decision.action, decision.why, playing, decision.cost, decision.continuing_cost, decision.root_motion


def marks_entered(controller, decisions):
    return [
        database_of(controller, decision.playing).marks.mark_of(decision.playing.frame)
        for decision in decisions
        if decision.action in ENTERED
    ]


# ---- made clips


@cache
def made():
    """The sample project's schema, and its databases of made clips."""
    sections = tomllib.loads((TABLES / "contextdb.toml").read_text(encoding="utf-8"))
    schema, markup = MotionConfig.from_dict(sections).features["loco"], Markup.load(TABLES / "clips" / "marks.csv")
    clips = [each.clip for each in made_clips()]
    loco = MotionDatabase.build(clips, schema, markup=markup, biases=BIASES, end_s=0.3)
    worn = [clip for clip in clips if clip.name.endswith("_tired")]
    shared = {"markup": markup, "biases": BIASES, "end_s": 0.3, "normalisation": loco.normalisation}
    return schema, loco, MotionDatabase.build(worn, schema, **shared)


def made_run(**changes):
    schema, loco, tired = made()
    settings = ControllerSettings(**changes)
    controller = Controller(Selector([Entry("loco_tired", tired, 2.75), Entry("loco", loco)]), settings)
    fresh = NamedAssets([asset for asset in loco.assets if not asset.endswith("_tired")])
    asked = {
        "among": lambda time_s: ["loco"] if time_s < 40.0 else None,
        "valid": lambda time_s: {"loco": fresh} if time_s < 40.0 else None,
    }
    return controller, steer(controller, schema, 1.3, 2.5, **asked)


def test_a_steered_character_of_made_clips_is_never_stuck_and_enters_no_barred_frame():
    controller, decisions = made_run()
    assert most_alike(decisions) >= RATE / 2.0
    assert not any(mark & BARRED for mark in marks_entered(controller, decisions))
    played = [database_of(controller, each.playing).marks.mark_of(each.playing.frame) for each in decisions]
    assert any(mark & Mark.DO_NOT_CHOOSE for mark in played)  # the ends of stops do play


def test_it_plays_what_the_stick_asks_for():
    _, decisions = made_run(min_play_rate=1.0, max_play_rate=1.0)
    at = {second: decisions[round(second * RATE)].playing.asset for second in (1.0, 5.5, 8.5, 12.5, 19.5, 25.5, 32.5, 39.5)}
    assert all("walk" in at[second] for second in (5.5, 8.5, 25.5))
    assert all("jog" in at[second] or "run" in at[second] for second in (12.5, 32.5))
    assert all(at[second].startswith(("idle", "stop")) for second in (1.0, 19.5, 39.5))


def test_with_play_rates_what_plays_goes_as_fast_as_asked_but_for_what_longer_steps_make_up_for():
    _, decisions = made_run()
    for second, asked in ((5.5, 1.3), (12.5, 2.5), (25.5, 1.3), (32.5, 2.5)):
        during = decisions[round((second - 0.5) * RATE) : round((second + 0.5) * RATE)]
        speed = np.mean([math.hypot(each.root_motion.left_m, each.root_motion.ahead_m) for each in during]) * RATE
        assert PoseSettings().min_stride <= asked / speed <= PoseSettings().max_stride, (second, speed)
    assert all(decisions[round(second * RATE)].playing.asset.startswith(("idle", "stop")) for second in (1.0, 19.5, 39.5))


def test_no_tired_clip_plays_while_its_database_is_not_among_and_some_do_when_it_is():
    _, decisions = made_run()
    tired = [decision.time_s for decision in decisions if decision.playing.asset.endswith("_tired")]
    assert tired
    assert min(tired) > 40.0
    assert {decision.playing.database for decision in decisions} == {"loco", "loco_tired"}


@in_full_runs  # each rule has a test of its own
def test_without_rules_the_character_jumps_far_more_often():
    jumps = [
        sum(decision.action is Action.JUMP for decision in made_run(**changes)[1])
        for changes in ({}, {"search_every_s": 0.0, "jump_threshold_s": 0.0, "history_s": 0.0, "settle_bias": 0.0})
    ]
    assert jumps[0] < 0.6 * jumps[1]


# ---- captured clips

CHANNELS = [
    {"type": "position", "bone": "Foot_L", "weight": 0.75},
    {"type": "position", "bone": "Foot_R", "weight": 0.75},
    {"type": "velocity", "bone": "Foot_L"},
    {"type": "velocity", "bone": "Foot_R"},
    {"type": "velocity", "bone": "Hips"},
    {"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0]},
    {"type": "trajectory", "what": "direction", "at": [0.33, 0.67, 1.0], "weight": 1.5},
]


@pytest.mark.skipif(not (MOCAP / "assets.csv").is_file(), reason="no captured clips: set CONTEXTDB_MOCAP to their folder")
def test_a_steered_character_of_captured_clips_is_never_stuck_and_does_it_again():
    mirror = [["*_L", "*_R"]]
    schema = FeatureSchema.from_dict("loco", {"rate": RATE, "channels": CHANNELS, "mirror": mirror, "facing_smooth_s": 0.2})
    with (MOCAP / "assets.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["asset"].startswith("bandai") and row["style"] == "normal"]
    clips = [load_bvh(MOCAP / row["asset"]) for row in rows]
    markup = Markup.parse("asset,tag,from,to\n*walk-turn*,DoNotChoose,1.2,2.0\n")
    database = MotionDatabase.build(clips, schema, markup=markup, mirror=True, biases=BIASES, end_s=0.3)
    runs = []
    for _ in range(2):
        controller = Controller(Selector([Entry("loco", database)]))
        runs.append(steer(controller, schema, 1.2, 3.4))
        assert most_alike(runs[-1]) >= RATE / 2.0
        assert not any(mark & BARRED for mark in marks_entered(controller, runs[-1]))
    assert list(map(told, runs[0])) == list(map(told, runs[1]))
    assert {decision.playing.mirrored for decision in runs[0]} == {False, True}
