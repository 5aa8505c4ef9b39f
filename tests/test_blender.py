"""The add-on for Blender: what it asks the command, and the add-on itself in a Blender without a screen where there is one.

`CONTEXTDB_BLENDER` names a Python that has `bpy` from PyPI; without it this one is tried.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from clip_files import Moving, fbx
from made_once import make_clip
from running import run

from contextdb import motion
from examples.blender import contextdb_blender as addon

ROOT = Path(__file__).parent.parent
COMMAND = "\n".join([sys.executable, "-m", "contextdb"])
STICK = "time_s,speed_mps,gait,style\n0,0,Idle,normal\n1,1.3,Walk,normal\n2,1.3,Walk,normal\n"
BLENDER = os.environ.get("CONTEXTDB_BLENDER", sys.executable)


@pytest.fixture
def game(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Clips of a game, and its table; commands find this checkout."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    for name in ("idle", "walk", "run"):
        (tmp_path / "game/clips").mkdir(parents=True, exist_ok=True)
        motion.write_bvh(make_clip(name).clip, tmp_path / f"game/clips/{name}.bvh")
    assert run("motion", "describe", tmp_path / "game/clips", "--out", tmp_path / "game/moves.csv").code == 0
    return tmp_path / "game"


def test_custom_properties_are_facts():
    properties = {"gait": "Walk", "speed": 1.5, "ok": True, "n": 3, "_RNA_UI": {}, "_hidden": 1, "place": [1.0, 2.0]}
    assert addon.facts_of(properties) == {"gait": "Walk", "speed": "1.5", "ok": "True", "n": "3"}


def test_an_answer_says_what_may_play_and_why_the_others_may_not(game: Path):
    valid, others = addon.answer(COMMAND, str(game / "moves.csv"), {"gait": "Walk", "speed": "1.3"})
    assert valid == ["walk"]
    assert others == ["idle: gait is Walk, not Idle", "run: gait is Walk, not Run"]
    with pytest.raises(addon.CommandError, match='Did you mean "gait"'):
        addon.answer(COMMAND, str(game / "moves.csv"), {"gaitt": "Walk"})
    with pytest.raises(addon.CommandError, match="preferences say where contextdb is"):
        addon.answer("no-such-command", str(game / "moves.csv"), {})


def test_files_of_clips_come_into_the_project_and_its_table(game: Path, tmp_path: Path):
    pytest.importorskip("ufbx", reason="needs the extra fbx")
    (tmp_path / "Walk Fast.fbx").write_bytes(fbx(Moving.of(make_clip("walk_fast").clip)))
    toml = game / "contextdb.toml"
    toml.write_text(toml.read_text("utf-8").replace("clips/*.bvh", "clips/*.{bvh,fbx}"), "utf-8")
    said = addon.import_files(COMMAND, str(game), str(game / "moves.csv"), [str(tmp_path / "Walk Fast.fbx")])
    assert "1 row added" in said
    assert "\nWalk Fast,Walk," in (game / "moves.csv").read_text("utf-8")
    (tmp_path / "notes.fbx").write_text("no clip", "utf-8")
    with pytest.raises(addon.CommandError, match=r"notes\.fbx"):
        addon.import_files(COMMAND, str(game), str(game / "moves.csv"), [str(tmp_path / "notes.fbx")])
    assert not (game / "clips/notes.fbx").exists()


def test_a_name_of_an_action_becomes_that_of_a_file(tmp_path: Path):
    assert addon.clip_file(str(tmp_path), "Armature|walk").name == "Armature_walk.glb"
    assert addon.clip_file(str(tmp_path), " ..").name == "clip.glb"


IN_BLENDER = """
import json, sys
import bpy
from examples.blender import contextdb_blender as addon
game = sys.argv[1]
addon.register()
scene = bpy.context.scene
scene.contextdb.folder, scene.contextdb.table = game, game + "/moves.csv"
assert bpy.ops.contextdb.play_session(filepath=game + "/walk.parquet") == {"FINISHED"}
body = bpy.context.object
markers = [(marker.frame, marker.name) for marker in scene.timeline_markers]
body["gait"], body["speed"] = "Walk", 0.0
body.keyframe_insert('["speed"]', frame=1)
body["speed"] = 1.3
body.keyframe_insert('["speed"]', frame=31)
scene.frame_set(31)
assert bpy.ops.contextdb.ask() == {"FINISHED"}
valid, others = json.loads(scene.contextdb.valid), json.loads(scene.contextdb.others)
body.animation_data.action.name = "sent"
assert bpy.ops.contextdb.send_action() == {"FINISHED"}
said, frames = scene.contextdb.said, list(body.animation_data.action.frame_range)
addon.unregister()
fps = scene.render.fps
print("ANSWER", json.dumps([markers, valid, others, said, frames, fps, len(body.data.bones)]))
"""


def test_the_add_on_works_in_a_blender_without_a_screen(game: Path):
    has_bpy = subprocess.run([BLENDER, "-c", "import bpy"], capture_output=True, check=False)
    if has_bpy.returncode:
        pytest.skip(
            "no bpy: CONTEXTDB_BLENDER names a Python that has it (pip install bpy, for the one version of Python it wants)"
        )
    pytest.importorskip("pygltflib", reason="needs the extra gltf")
    toml = game / "contextdb.toml"
    toml.write_text(toml.read_text("utf-8").replace("clips/*.bvh", "clips/*.{bvh,glb}"), "utf-8")
    (game / "stick.csv").write_text(STICK, "utf-8")
    out = ("--out", game / "walk.parquet", "--poses", game / "walk.bvh")
    assert run("motion", "run", game, "player", game / "stick.csv", *out).code == 0
    environment = {**os.environ, "CONTEXTDB": COMMAND, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [BLENDER, "-c", IN_BLENDER, str(game)], capture_output=True, encoding="utf-8", env=environment, cwd=ROOT, check=False
    )
    assert done.returncode == 0, done.stderr
    line = next(line for line in done.stdout.splitlines() if line.startswith("ANSWER "))
    markers, valid, others, said, frames, fps, n_bones = json.loads(line.removeprefix("ANSWER "))
    assert [name for _, name in markers][:2] == ["idle", "walk"]
    assert markers[0][0] == 1
    assert valid == ["walk"]
    assert others[0] == "idle: gait is Walk, not Idle"
    assert (fps, frames) == (30, [1.0, 61.0])
    assert n_bones == 19
    assert "moves" in said
    (clip,) = motion.load_clips([game / "clips/sent.glb"])
    assert clip.n_frames == 61
    walked = motion.load_bvh(game / "walk.bvh")
    feet = [motion.poses_of(each).positions[:, each.skeleton.index("LeftFoot")] for each in (clip, walked)]
    assert abs(feet[0] - feet[1]).max() < 0.005
