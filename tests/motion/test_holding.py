"""The default biases hold a clip: who walks straight on at one speed seldom jumps. On made clips, and on captured ones."""

import csv
import os
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from strategies import some

import contextdb as cdb
from contextdb.motion import (
    Action,
    Controller,
    ControllerSettings,
    Entry,
    FeatureSchema,
    MotionConfig,
    MotionDatabase,
    Selector,
    Steered,
    build,
    load_bvh,
    with_path,
    write_made_clips,
)
from contextdb.motion.clips.steering import steered_path
from contextdb.motion.search.filters import Biases
from contextdb.motion.storage.database_settings import CONTINUING_BIAS, LOOPING_BIAS

ROOT = Path(__file__).parents[2]
MOCAP = Path(os.environ.get("CONTEXTDB_MOCAP", ROOT.parent / "shared" / "data" / "mocap"))
DT_S, SECONDS = 1 / 30, 20
DEFAULTS = Biases(0.0, LOOPING_BIAS, CONTINUING_BIAS)


def jumps_per_s(database: MotionDatabase, speed_mps: float, table: cdb.CompiledTable | None = None) -> float:
    """How often a character jumps who walks straight ahead at one speed."""
    assert database.schema is not None
    settling = {} if database.biases.continuing else {"settle_bias": 0.0}
    player = Controller(Selector([Entry("loco", database)]), ControllerSettings(**settling))
    pose, past, jumps = database.raw(int(database.starts[0])), [Steered()], 0
    for _ in range(round(SECONDS / DT_S)):
        past = [*past, past[-1].moved(DT_S, (0.0, speed_mps))][-30:]
        ahead = player.upcoming(DT_S)
        pose = pose if ahead is None else database.raw(ahead.frame)
        facts = {"gait": "Walk" if speed_mps < 2.0 else "Run", "speed": past[-1].velocity[1], "direction": 0.0, "style": "normal"}
        wanted = with_path(database.schema, pose, steered_path(past, (0.0, speed_mps)))
        decision = player.update(DT_S, wanted, None if table is None else table.query(facts))
        jumps += decision.action is Action.JUMP
    return jumps / SECONDS


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> tuple[Mapping[str, MotionDatabase], cdb.CompiledTable]:
    folder = tmp_path_factory.mktemp("samples") / "tables"
    shutil.copytree(ROOT / "tables", folder)
    write_made_clips(folder / "clips")
    project = cdb.Project.load(folder)
    config = MotionConfig.from_dict(project.schema.motion, tables=project.tables)
    table = project["locomotion"].compile()
    return build(config, folder, {"locomotion": table.leaves}, cache=None), table


@pytest.mark.parametrize("speed_mps", some([0.8, 1.0, 1.3, 1.6, 1.9, 2.2, 2.6, 3.5, 4.5], 3))
def test_on_the_samples_a_character_who_goes_straight_on_stays_in_his_clip(samples, speed_mps: float):
    databases, table = samples
    assert databases["loco"].biases == DEFAULTS
    assert jumps_per_s(databases["loco"], speed_mps, table) < 0.5


def test_without_biases_he_would_not(samples):
    databases, table = samples
    unbiased = replace(databases["loco"], biases=Biases())
    assert jumps_per_s(unbiased, 1.3, table) > 1.0


@pytest.fixture(scope="module")
def captured() -> MotionDatabase:
    if not (MOCAP / "assets.csv").is_file():
        pytest.skip("no captured clips: set CONTEXTDB_MOCAP to their folder")
    channels = [
        *({"type": "position", "bone": bone, "weight": 0.75} for bone in ("Foot_L", "Foot_R")),
        *({"type": "velocity", "bone": bone} for bone in ("Foot_L", "Foot_R", "Hips")),
        {"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0]},
        {"type": "trajectory", "what": "direction", "at": [0.33, 0.67, 1.0], "weight": 1.5},
    ]
    schema = FeatureSchema.from_dict("loco", {"rate": 30.0, "mirror": [["*_L", "*_R"]], "channels": channels})
    with (MOCAP / "assets.csv").open(encoding="utf-8", newline="") as file:
        assets = [row["asset"] for row in csv.DictReader(file) if row["asset"].startswith("bandai")]
    clips = [load_bvh(MOCAP / asset) for asset in assets]
    return MotionDatabase.build(clips, schema, mirror=True, biases=DEFAULTS, end_s=0.3)


@pytest.mark.parametrize("speed_mps", some([1.3, 0.9, 1.0, 1.5], 4))
def test_on_captured_clips_a_character_who_walks_straight_on_jumps_less_than_once_a_second(captured, speed_mps: float):
    assert jumps_per_s(captured, speed_mps) < 1.0


def test_on_captured_clips_he_would_jump_often_without_biases(captured):
    assert jumps_per_s(replace(captured, biases=Biases()), 1.3) > 2.0
