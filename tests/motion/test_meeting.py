"""Clips of several rigs in one folder: which meet on one rig, and what a description makes of them."""

from dataclasses import replace
from pathlib import Path

import pytest
from clip_files import Moving, fbx, gltf, usda
from made_once import make_clip
from running import run

from contextdb import motion
from contextdb.motion.preparing.look import Meeting, meetings, notes_of

UNREAL = {"Hips": "pelvis", "Spine": "spine_01", "Chest": "spine_02", "Neck": "neck_01", "Head": "head"}


def body(name: str, named: dict[str, str] | None = None, scale: float = 1.0) -> Moving:
    """A made clip of a body of another size, whose bones have other names."""
    made = Moving.of(make_clip(name).clip)
    named = named or {}
    names = tuple(named.get(bone, bone) for bone in made.names)
    return replace(made, names=names, offsets=made.offsets * scale, root=made.root * scale)


def sided(prefix: dict[str, str]) -> dict[str, str]:
    """The bones of the made body with their sides in another spelling."""
    names = Moving.of(make_clip("walk").clip).names
    return {bone: bone.replace("Left", prefix["Left"]).replace("Right", prefix["Right"]) for bone in names}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Nine clips of three rigs, whose names alternate, in three formats."""
    mixamo = {bone: f"mixamorig:{bone}" for bone in Moving.of(make_clip("walk").clip).names}
    for name in ("walk", "jog", "walk_fast", "idle"):
        (tmp_path / f"{name}.glb").write_bytes(gltf(body(name, mixamo)))
    for name in ("run", "walk_slow", "walk_tired"):
        (tmp_path / f"{name}.fbx").write_bytes(fbx(body(name, UNREAL | sided({"Left": "L_", "Right": "R_"}), 1.1)))
    for name in ("sprint", "walk_turn_left_90"):
        (tmp_path / f"{name}.usda").write_bytes(usda(body(name, sided({"Left": "left_", "Right": "right_"}), 0.9)))
    return tmp_path


def test_clips_of_three_rigs_in_one_folder_are_one_database_on_one_rig(folder: Path):
    made = run("motion", "describe", folder, "--out", folder / "moves.csv")
    assert made.code == 0, made
    assert '3 rigs meet on that of idle; put on it: the clips of "run", "sprint" and their rigs.' in made.err
    toml = (folder / "contextdb.toml").read_text("utf-8")
    assert toml.count("[databases.") == toml.count("[controllers.") == 1
    assert 'rig = "idle.glb"' in toml
    assert run("motion", "build", folder).code == 0
    checked = run("motion", "check", folder)
    assert checked.code == 0, checked
    again = run("motion", "describe", folder, "--into", folder / "moves.csv")
    assert (again.code, again.out.strip()) == (0, f"{folder / 'moves.csv'}: 0 cells filled, 0 rows added.")


def test_a_body_that_rests_otherwise_or_has_other_bones_stays_alone():
    walk = body("walk")
    clips = [clip_of(walk), clip_of(replace(walk, names=tuple(f"mixamorig:{name}" for name in walk.names)))]
    other = replace(walk, names=tuple(f"Bone{i:02}" for i in range(len(walk.names))))
    arms = walk.offsets.copy()
    arms[[walk.names.index("LeftForeArm"), walk.names.index("LeftHand")]] = [[0.3, 0.0, 0.0], [0.3, 0.0, 0.0]]
    clips += [clip_of(other), clip_of(replace(walk, offsets=arms))]
    met = meetings(clips, [[0], [1], [2], [3]])
    assert [each.rigs for each in met] == [((0,), (1,)), ((2,),), ((3,),)]
    assert "most bones have other names than those of walk" in met[1].reason
    assert met[2].reason == '"LeftForeArm" of the rig points another way at rest than that of the clip.'
    assert notes_of(clips, [Meeting(((0,),))]) == []


def clip_of(moving: Moving) -> motion.Clip:
    return motion.Clip.from_arrays(
        moving.names, moving.parents, moving.offsets, moving.rotations, moving.root, moving.rate, name="walk"
    )


def test_rigs_whose_axes_differ_do_not_meet():
    one = clip_of(body("walk"))
    (first, second) = meetings([one, replace(one, up="z")], [[0], [1]])
    assert (first.reason, second.reason) == ("", "another axis points up.")
    assert second.members == [1]
