"""Clips of any format: what a file holds is asked of its bytes, and the same motion is the same clip."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clip_files import SMPL_OFFSETS, Moving, amass, binary_fbx, fbx, gltf, skinned, usda, usdc
from made_once import make_clip
from running import run
from strategies import some

from contextdb import motion
from contextdb.errors import ContextDBError
from contextdb.motion.clips.feet import footfalls_of
from contextdb.motion.clips.joint_worlds import unique_names
from contextdb.motion.clips.poses import poses_of
from contextdb.motion.features.extraction import clip_features
from contextdb.motion.made.recipes import RECIPES
from contextdb.motion.storage.building import build_all
from contextdb.motion.storage.written_poses import write_arrays

OTHERS: dict[str, Callable[[Moving, str, float], bytes]] = {
    ".glb": lambda body, up, _: gltf(body, up=up),
    ".gltf": lambda body, up, _: gltf(body, up=up, binary=False),
    ".fbx": lambda body, up, unit: fbx(body, up=up, metres_per_unit=unit),
    ".FBX": lambda body, up, unit: binary_fbx(fbx(body, up=up, metres_per_unit=unit)),
    ".usda": lambda body, up, unit: usda(body, up=up, metres_per_unit=unit),
    ".usdc": lambda body, up, unit: usdc(usda(body, up=up, metres_per_unit=unit)),
}
"""Writers of other formats than BVH, in a unit; glTF is in metres, or in centimetres below a node that scales them."""
CHANNELS = [
    {"type": "position", "bone": "LeftFoot"},
    {"type": "velocity", "bone": "Hips"},
    {"type": "orientation", "bone": "Chest"},
    {"type": "trajectory", "what": "position", "at": [0.3, 0.6]},
]
NAMES = ["Hips", "LeftFoot", "RightFoot"]
STILL = np.array([[0.0, 0.9, 0.0], [0.1, -0.9, 0.0], [-0.1, -0.9, 0.0]])


@pytest.fixture(scope="module")
def walk() -> motion.Clip:
    """A made walk without the ends of chains, which other formats have not."""
    body = Moving.of(make_clip("walk").clip)
    return motion.Clip.from_arrays(body.names, body.parents, body.offsets, body.rotations, body.root, body.rate, name="walk")


def same_joints(one: motion.Clip, other: motion.Clip, within_m: float = 1e-4) -> None:
    first, second = poses_of(one), poses_of(other)
    joints = [other.skeleton.index(name) for name in one.skeleton.names]
    assert first.positions.shape == second.positions[:, joints].shape
    assert np.abs(first.positions - second.positions[:, joints]).max() < within_m


def arrays_of(clip: motion.Clip) -> dict[str, object]:
    body, poses = Moving.of(clip), poses_of(clip)
    return {"body": body, "positions": poses.positions, "bones": np.array(body.names), "parents": np.array(body.parents)}


def test_a_clip_of_arrays_is_the_clip_that_they_were_taken_from(walk: motion.Clip):
    plain = make_clip("walk").clip
    same_joints(plain, walk, 1e-9)
    assert walk.rate == pytest.approx(plain.rate)
    assert walk.metres_per_unit == 0.01


def test_joints_of_arrays_may_come_in_any_order():
    order = [2, 0, 1]
    still = np.tile(np.array([1.0, 0.0, 0.0, 0.0]), (2, 3, 1))
    clip = motion.Clip.from_arrays([NAMES[i] for i in order], [1, -1, 1], STILL[order], still[:, order], np.ones((2, 3)), 30.0)
    assert clip.skeleton.names == ("Hips", "RightFoot", "LeftFoot")
    assert poses_of(clip).positions[0, 1].tolist() == pytest.approx([0.9, 0.1, 1.0])


def test_poses_that_were_written_as_arrays_are_read_as_a_clip(walk: motion.Clip, tmp_path: Path):
    arrays = arrays_of(walk)
    del arrays["body"]
    write_arrays({**arrays, "rate": np.array(walk.rate)}, tmp_path / "walk.npz")
    (clip,) = motion.load_clips([tmp_path / "walk.npz"])
    same_joints(walk, clip, 1e-9)
    assert (clip.name, clip.rate) == ("walk", pytest.approx(walk.rate))
    hands = [poses_of(each).rotations[:, each.skeleton.index("Hips")] for each in (walk, clip)]
    turned = np.abs((hands[0] * hands[1]).sum(axis=-1) / np.abs((hands[0][0] * hands[1][0]).sum()))
    assert turned.min() > 0.9  # bones turn, and not the joints alone move


def test_arrays_say_their_unit_and_axis(walk: motion.Clip, tmp_path: Path):
    arrays = arrays_of(walk)
    body = arrays.pop("body")
    assert isinstance(body, Moving)
    places = poses_of(walk).positions[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0]) * 100.0
    units = {"metres_per_unit": np.array(0.01), "up": np.array("z"), "rate": np.array(walk.rate)}
    write_arrays({**arrays, "positions": places, **units}, tmp_path / "walk.npz")
    same_joints(walk, motion.load_clips([tmp_path / "walk.npz"])[0], 1e-9)


def test_the_arrays_of_from_arrays_are_a_clip(walk: motion.Clip, tmp_path: Path):
    body = Moving.of(walk)
    arrays = {"names": np.array(body.names), "parents": np.array(body.parents), "offsets": body.offsets}
    arrays |= {"rotations": body.rotations, "positions": body.root, "rate": np.array(body.rate)}
    write_arrays(arrays, tmp_path / "a.npz")
    (clip,) = motion.load_clips([tmp_path / "a.npz"])
    same_joints(clip, walk, 1e-9)


def test_joints_of_humanml3d_have_the_names_of_smpl(tmp_path: Path):
    places = np.cumsum(np.ones((5, 22, 3)), axis=1) + np.arange(5)[:, None, None]
    write_arrays({"joints": places}, tmp_path / "a.npz")
    (clip,) = motion.load_clips([tmp_path / "a.npz"])
    assert clip.rate == pytest.approx(20.0)
    joints = [clip.skeleton.index(name) for name in ("Pelvis", "Head", "R_Wrist")]
    assert np.abs(poses_of(clip).positions[:, joints] - places[:, [0, 15, 21]]).max() < 1e-9


def test_amass_is_read_with_the_offsets_that_its_user_brings(tmp_path: Path):
    """A body turned by 90° about the axis that points up, 1 m along x, with a bent left knee."""
    (tmp_path / "amass.npz").write_bytes(amass(offsets=SMPL_OFFSETS))
    (clip,) = motion.load_clips([tmp_path / "amass.npz"])
    poses = poses_of(clip)
    at = {name: poses.positions[0, clip.skeleton.index(name)] for name in clip.skeleton.names}
    assert clip.rate == pytest.approx(60.0)
    assert at["Pelvis"].tolist() == pytest.approx([1.0, 0.9, 0.0])
    assert at["L_Hip"].tolist() == pytest.approx([1.0, 0.8, -0.1])  # the left of a body that faces +x is at -z
    assert at["L_Knee"].tolist() == pytest.approx([1.0, 0.4, -0.1])
    assert at["L_Ankle"].tolist() == pytest.approx([0.6, 0.4, -0.1])  # bent backwards


def test_what_a_file_holds_is_asked_of_its_bytes_and_not_of_its_ending(walk: motion.Clip, tmp_path: Path):
    body = arrays_of(walk)
    del body["body"]
    write_arrays({**body, "rate": np.array(walk.rate)}, tmp_path / "walk.npz")
    (tmp_path / "walk.npz").rename(tmp_path / "walk.bvh")
    same_joints(walk, motion.load_clips([tmp_path / "walk.bvh"])[0])


def test_a_pattern_may_name_several_endings(walk: motion.Clip, tmp_path: Path):
    body = arrays_of(walk)
    del body["body"]
    (tmp_path / "clips").mkdir()
    write_arrays({**body, "rate": np.array(walk.rate)}, tmp_path / "clips/run.npz")
    motion.write_bvh(walk, tmp_path / "clips/walk.bvh")
    (tmp_path / "clips/other.txt").write_text("", encoding="utf-8")
    features = {"jog": {"rate": 30.0, "channels": [{"type": "position", "bone": "LeftFoot"}]}}
    databases = {"jog": {"clips": "clips/*.{bvh,npz}", "features": "jog"}}
    config = motion.MotionConfig.from_dict({"features": features, "databases": databases})
    run, again = config.load_clips("jog", tmp_path)
    same_joints(run, again)
    built = build_all(config, tmp_path, {})["jog"]
    assert (built.computed, tuple(built.database.assets)) == (("run", "walk"), ("run", "walk"))
    assert build_all(config, tmp_path, {})["jog"].computed == ()


def test_every_made_clip_is_the_same_by_its_joints_alone(tmp_path: Path):
    for name in RECIPES:
        clip = make_clip(name).clip
        arrays = arrays_of(clip)
        del arrays["body"]
        write_arrays({**arrays, "rate": np.array(clip.rate)}, tmp_path / f"{name}.npz")
        same_joints(clip, motion.load_clips([tmp_path / f"{name}.npz"])[0], 1e-6)


# ---- glTF


@pytest.mark.parametrize(("up", "how"), [("y", "LINEAR"), ("z", "LINEAR"), ("y", "STEP"), ("y", "CUBICSPLINE")])
@pytest.mark.parametrize("ending", [".glb", ".gltf"])
def test_a_walk_as_gltf_has_the_joints_that_it_has_as_bvh(walk: motion.Clip, up: str, how: str, ending: str, tmp_path: Path):
    (tmp_path / f"walk{ending}").write_bytes(gltf(Moving.of(walk), up=up, how=how, binary=ending == ".glb"))
    (clip,) = motion.load_clips([tmp_path / f"walk{ending}"])
    same_joints(walk, clip)
    assert clip.rate == pytest.approx(walk.rate, rel=1e-5)
    assert clip.skeleton.names == walk.skeleton.names
    assert np.abs(clip.skeleton.offsets[1:] - walk.skeleton.offsets[1:]).max() < 1e-2


def test_a_gltf_reads_the_buffers_beside_it_and_none_elsewhere(walk: motion.Clip, tmp_path: Path):
    document = json.loads(gltf(Moving.of(walk), binary=False))
    data = base64.b64decode(document["buffers"][0]["uri"].partition(",")[2])
    (tmp_path / "clips").mkdir()
    for place in ("walk data.bin", "../outside.bin"):
        (tmp_path / "clips" / place).write_bytes(data)
        document["buffers"][0]["uri"] = place.replace(" ", "%20")
        (tmp_path / "clips/walk.gltf").write_text(json.dumps(document), encoding="utf-8")
        if ".." in place:
            with pytest.raises(ContextDBError, match=r'walk\.gltf: the buffer "\.\./outside\.bin": a link leads to'):
                motion.load_clips([tmp_path / "clips/walk.gltf"])
        else:
            same_joints(walk, motion.load_clips([tmp_path / "clips/walk.gltf"])[0])


def test_takes_of_one_file_are_clips_of_their_own(walk: motion.Clip, tmp_path: Path):
    (tmp_path / "clips").mkdir()
    (tmp_path / "clips/all.glb").write_bytes(gltf(Moving.of(walk), takes=("Walk", "Run", "Run")))
    names = [clip.name for clip in motion.load_clips([tmp_path / "clips/all.glb"])]
    assert names == ["all:Walk", "all:Run 2", "all:Run 3"]
    features = {"jog": {"rate": 30.0, "channels": [{"type": "position", "bone": "LeftFoot"}]}}
    config = motion.MotionConfig.from_dict(
        {"features": features, "databases": {"jog": {"clips": "clips/*.{bvh,glb}", "features": "jog"}}}
    )
    assert build_all(config, tmp_path, {})["jog"].computed == ("all:Walk", "all:Run 2", "all:Run 3")
    assert build_all(config, tmp_path, {})["jog"].computed == ()


def test_a_take_is_read_by_its_name_where_a_file_is_wanted(walk: motion.Clip, tmp_path: Path):
    path, plain = tmp_path / "all.glb", tmp_path / "one.glb"
    path.write_bytes(gltf(Moving.of(walk), takes=("Walk", "Run")))
    plain.write_bytes(gltf(Moving.of(walk)))
    assert [clip.name for clip in motion.load_clips([f"{path}:Run", f"{path}:Walk"])] == ["all:Run", "all:Walk"]
    assert run("motion", "bones", f"{path}:Run").out == run("motion", "bones", path).out.replace("all.glb", "all.glb:Run")
    with pytest.raises(ContextDBError, match=r'none is named "Ru"\. Accepted: "Walk", "Run"\. Did you mean "Run"'):
        motion.load_clips([f"{path}:Ru"])
    with pytest.raises(
        ContextDBError, match=r'one\.glb: the file has one clip, and no take "walk"\. Accepted: the file without a take'
    ):
        motion.load_clips([f"{plain}:walk"])
    with pytest.raises(ContextDBError, match=r"al\.glb: .*no such file"):
        motion.load_clips([f"{tmp_path / 'al.glb'}:Run"])


def test_nodes_beside_the_body_are_left_out_and_reported(walk: motion.Clip, tmp_path: Path):
    document = json.loads(gltf(Moving.of(walk), binary=False))
    document["nodes"].append({"name": "LeftFootCtrl"})
    document["animations"][0]["channels"].append({"sampler": 0, "target": {"node": len(document["nodes"]) - 1, "path": "rotation"}})
    document["skins"][0]["joints"].append(len(document["nodes"]) - 1)
    (tmp_path / "walk.gltf").write_text(json.dumps(document), encoding="utf-8")
    (clip,) = motion.load_clips([tmp_path / "walk.gltf"])
    assert clip.notes == ('1 node beside the body left out: "LeftFootCtrl".',)
    same_joints(walk, clip)


# ---- the oracle


RATES = (24.0, 30.0, 60.0, 120.0)


@pytest.mark.parametrize("rate", some(RATES))
@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("ending", sorted(OTHERS))
def test_one_motion_in_any_format_is_one_clip(walk: motion.Clip, ending: str, up: str, rate: float, tmp_path: Path):
    """The same joints, contacts, features and description as BVH, each axis in metres at two rates, and in centimetres."""
    body = replace(Moving.of(walk), rate=rate)
    plain = motion.Clip.from_arrays(body.names, body.parents, body.offsets, body.rotations, body.root, rate, name="walk")
    motion.write_bvh(plain, tmp_path / "walk.bvh", digits=9)
    unit = 0.01 if (up == "z") == (rate in RATES[::2]) else 1.0
    (tmp_path / f"walk{ending}").write_bytes(OTHERS[ending](body, up, unit))
    bvh, other = (motion.load_clips([tmp_path / f"walk{each}"])[0] for each in (".bvh", ending))
    same_joints(bvh, other)
    assert other.rate == pytest.approx(rate, rel=1e-6)
    schema = motion.FeatureSchema.from_dict("jog", {"rate": 30.0, "channels": CHANNELS})
    features = [clip_features(clip, schema).features for clip in (bvh, other)]
    assert np.abs(features[0] - features[1]).max() < 5e-3
    down = [footfalls_of(poses_of(clip)).down for clip in (bvh, other)]
    assert {foot: np.round(times, 3).tolist() for foot, times in down[0].items()} == {
        foot: np.round(times, 3).tolist() for foot, times in down[1].items()
    }
    one, another = (motion.describe([clip])[0].cells for clip in (bvh, other))
    assert one == another


# ---- FBX and USD


def test_takes_of_an_fbx_are_clips_and_helpers_are_left_out(walk: motion.Clip, tmp_path: Path):
    comment = b'; AnimationStack: 1, "AnimStack::None", ""'
    whole = fbx(Moving.of(walk), takes=("Walk", "Run &amp; jump"), helper="LeftFootCtrl")
    (tmp_path / "all.fbx").write_bytes(whole.replace(b"Objects:", comment + b"\nObjects:"))
    clips = motion.load_clips([tmp_path / "all.fbx"])
    assert [clip.name for clip in clips] == ["all:Walk", "all:Run & jump"]
    assert clips[0].notes == ('1 node beside the body left out: "LeftFootCtrl".',)
    for clip in clips:
        same_joints(walk, clip)


def test_an_fbx_with_a_skin_is_the_clip_without(walk: motion.Clip, tmp_path: Path):
    body = Moving.of(walk)
    for name in "abc":
        (tmp_path / f"{name}.fbx").write_bytes(skinned(fbx(body, helper="LeftFootCtrl"), body))
    for clip in motion.load_clips([tmp_path / f"{name}.fbx" for name in "abc"]):
        same_joints(walk, clip)
        assert clip.notes == ('1 node beside the body left out: "LeftFootCtrl".',)


def test_many_joints_of_one_name_get_their_own():
    names = unique_names(["a", "a_2", *["a"] * 9998])
    assert (len(set(names)), names[:4]) == (10_000, ["a", "a_2", "a_3", "a_4"])


@pytest.mark.parametrize("ending", sorted(OTHERS))
def test_a_file_that_was_cut_off_is_one_fault_with_its_name(walk: motion.Clip, ending: str, tmp_path: Path):
    whole = OTHERS[ending](Moving.of(walk), "y", 1.0)
    path = tmp_path / f"walk{ending}"
    for n in (0, 30, len(whole) // 3):
        path.write_bytes(whole[:n])
        with pytest.raises(motion.ClipError) as error:
            motion.load_clips([path])
        assert str(error.value).startswith(f"{path}")
