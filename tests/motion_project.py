"""A project of made clips and a recorded session of it, made once in a process for tests of the commands and of the debugger."""

import atexit
import shutil
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import pytest
from made_once import make_clip
from running import run

from contextdb.motion import write_bvh

TOML = """
[tables.moves]
policy = "collect"
[conditions.gait]
type = "enum"
values = ["Idle", "Walk", "Run"]
[conditions.speed]
type = "number"
[conditions.style]
type = "enum"
values = ["normal", "tired"]
[features.loco]
rate = 30.0
channels = [
  { type = "position", bone = "LeftFoot" },
  { type = "velocity", bone = "Hips" },
  { type = "trajectory", what = "position", at = [0.33, 1.0] },
  { type = "trajectory", what = "speed", along = [1.0] },
]
[databases.all]
table = "moves"
clips = "clips/*.bvh"
features = "loco"
markup = "clips/marks.csv"
[databases.tired]
table = "moves"
clips = "clips/*_tired.bvh"
features = "loco"
[databases.free]
clips = "clips/jog.bvh"
features = "loco"
[selectors.moves]
order = [{ database = "tired", threshold = 0.05 }, { database = "all" }]
[selectors.free]
order = [{ database = "free" }]
[controllers.player]
selector = "moves"
variation_within = 0.01
"""
TABLE = """Asset,gait,speed,style
idle,Idle,0..0.3,Any
walk,Walk,0.3..2,Any
walk_tired,Walk,0.3..2,tired
jog,Run,1..5,normal ~0.75
swim,Idle,9,Any
"""
MARKS = "asset,tag,from,to,value\nwalk*,Move.Walk,,,\njog,Move.Run,,,\nidle,Looping,,,\nwalk,DoNotChoose,0,0.5,\n"
STICK = """time_s,speed_mps,turn_dps,gait,speed,style
10,0,0,Idle,0,normal
11,1.3,0,Walk,1.2,normal
12.5,2.5,20,Run,2,normal
14,1.2,,Walk,1.2,tired
15,0,,Idle,0,tired
"""
RECIPES = {name: name for name in ("idle", "walk", "walk_tired", "jog")}


def write_project(
    game: Path, toml: str = TOML, table: str = TABLE, marks: str = MARKS, recipes: Mapping[str, str] = RECIPES, stick: str = STICK
) -> None:
    """Write a project, each of its clips by its recipe, and beside its folder what a stick does."""
    (game / "clips").mkdir(parents=True)
    texts = {"contextdb.toml": toml, "moves.csv": table, "clips/marks.csv": marks, "../stick.csv": stick}
    for name, text in texts.items():
        (game / name).write_text(text, encoding="utf-8")
    for name, recipe in recipes.items():
        write_bvh(make_clip(recipe).clip, game / "clips" / f"{name}.bvh", digits=3)


@cache
def session_folder(more: str = "", *options: str) -> Path:
    """A folder with the project in game/, more in its contextdb.toml, and the session that `motion run` records with options."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    write_project(folder / "game", TOML + more)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert run("motion", "run", "game", "player", "stick.csv", "--out", "session.parquet", *options).code == 0
    return folder


def work_in_copy(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, columns: int = 100) -> Path:
    """A working folder with a copy of it all."""
    folder = tmp_path / "here"
    shutil.copytree(made, folder)
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", str(columns))
    return folder
