"""`rig` of a database: clips of another body come to the rig when they are built; others stay as they are, to the last bit."""

from dataclasses import replace

import numpy as np
import pytest
from clip_files import Moving, gltf
from made_once import make_clip
from test_retargeting import ARMS_UP, resting, standing

from contextdb import motion
from contextdb.errors import FileError, MotionError, SchemaError
from contextdb.motion.storage.building import build_all
from contextdb.motion.storage.checking import check_motion
from contextdb.motion.storage.pose_files import open_or_build_poses

MADE = {name: make_clip(name) for name in ("walk", "idle")}
WALK = MADE["walk"].clip
FEET = ("LeftFoot", "RightFoot")
OTHER_NAMES = {"Hips": "Pelvis", "LeftUpLeg": "LeftThigh", "RightUpLeg": "RightThigh"}


def of_another_body(clip: motion.Clip) -> motion.Clip:
    """The same movement of a body a quarter larger, with much longer arms, and other names of hips and thighs."""
    skeleton = clip.skeleton
    offsets = 1.25 * skeleton.offsets
    offsets[[joint for joint, name in enumerate(skeleton.names) if "Arm" in name or "Hand" in name]] *= 1.8
    values = clip.values.copy()
    values[:, :3] *= 1.25  # where the root is
    names = tuple(OTHER_NAMES.get(name, name) for name in skeleton.names)
    return replace(clip, skeleton=replace(skeleton, names=names, offsets=offsets), values=values)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Clips of two bodies."""
    folder = tmp_path_factory.mktemp("bodies")
    (folder / "clips").mkdir()
    for name in MADE:
        motion.write_bvh(MADE[name].clip, folder / "clips" / f"{name}.bvh")
        motion.write_bvh(MADE[name].clip, folder / "clips" / f"{name}_again.bvh")
    motion.write_bvh(of_another_body(WALK), folder / "clips" / "walk_other.bvh")
    return folder


def config_of(**keys):
    channels = [{"type": "position", "bone": bone} for bone in FEET] + [{"type": "velocity", "bone": "Spine"}]
    database = {"clips": "clips/*.bvh", "features": "loco", **keys}
    return motion.MotionConfig.from_dict(
        {"features": {"loco": {"rate": 30.0, "channels": channels}}, "databases": {"all": database}}, file="contextdb.toml"
    )


RIGGED = config_of(rig="clips/idle.bvh", rig_bones=OTHER_NAMES)


@pytest.fixture(scope="module")
def bank(folder):
    """The poses of all clips on the rig."""
    return open_or_build_poses(RIGGED, folder)["all"]


def test_feet_of_another_body_keep_the_heights_and_places_of_their_contacts(folder):
    clips = {clip.name: clip for clip in RIGGED.load_clips("all", folder)}
    own, other = (motion.poses_of(clips[name]) for name in ("walk", "walk_other"))
    assert own.skeleton.names == other.skeleton.names
    for bone in (*FEET, "LeftToe", "RightToe"):
        joint = own.skeleton.index(bone)
        for begin, end in MADE["walk"].footfalls.down[bone.replace("Toe", "Foot")]:
            frames = slice(int(np.ceil(begin * 30.0)), int(end * 30.0) + 1)
            np.testing.assert_allclose(other.positions[frames, joint], own.positions[frames, joint], atol=0.01)


def test_clips_of_another_body_are_searched_and_played_as_those_of_the_rig(folder, bank):
    database = motion.build(RIGGED, folder, cache=None)["all"]
    spans = [slice(int(database.starts[i]), int(database.stops[i])) for i in map(database.assets.index, ("walk", "walk_other"))]
    places = [np.stack([database.raw(frame) for frame in range(span.start, span.stop)])[:, :6] for span in spans]
    np.testing.assert_allclose(places[1], places[0], atol=0.01)
    assert bank.moving.tolist() == [0]  # every bone of every clip has the rig's length


def test_clips_of_the_rig_are_the_same_with_and_without_it_to_the_last_bit(folder):
    plain = build_all(config_of(clips="clips/*_again.bvh"), folder, cache=None)["all"].database
    rigged = build_all(config_of(clips="clips/*_again.bvh", rig="clips/idle.bvh"), folder, cache=None)["all"].database
    assert rigged.layout.blocks.tobytes() == plain.layout.blocks.tobytes()


def test_another_rig_computes_its_clips_again_and_the_same_rig_none(folder, tmp_path):
    different = ("idle", "walk", "walk_other")  # of clips with the same bytes one is computed
    assert build_all(RIGGED, folder, cache=tmp_path)["all"].computed == different
    assert build_all(RIGGED, folder, cache=tmp_path)["all"].computed == ()
    others = config_of(rig="clips/walk.bvh", rig_bones=OTHER_NAMES)
    assert build_all(others, folder, cache=tmp_path)["all"].computed == different


def test_a_check_tells_of_other_proportions_and_names_the_setting(folder):
    named = config_of()
    motion.write_bvh(
        replace(of_another_body(WALK), skeleton=replace(of_another_body(WALK).skeleton, names=WALK.skeleton.names)),
        folder / "clips" / "walk_other.bvh",
    )
    try:
        (finding,) = check_motion(named, folder, {}, cache=None).findings
        assert finding.rule == "odd-proportions"
        assert 'Try rig = "a clip of the usual body" in [databases.NAME]' in finding.message
        assert not check_motion(config_of(rig="clips/idle.bvh"), folder, {}, cache=None).findings
    finally:
        motion.write_bvh(of_another_body(WALK), folder / "clips" / "walk_other.bvh")


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"rig": "clips/idle.bvh", "rig_bones": {"Hip": "Pelvis"}}, r'rig_bones: there is no bone "Hip"\..*Did you mean "Hips"'),
        ({"rig": "clips/idle.bvh", "rig_bones": {**OTHER_NAMES, "LeftUpLeg": "LeftThigg"}}, r'Did you mean "LeftThigh"'),
    ],
)
def test_a_bone_without_a_counterpart_is_told_with_the_nearest(folder, keys, told):
    with pytest.raises(MotionError, match=told):
        motion.build(config_of(**keys), folder, cache=None)


def test_a_rig_that_is_no_file_is_told_with_its_place(folder):
    with pytest.raises(FileError, match=r"gone\.bvh"):
        motion.build(config_of(rig="clips/gone.bvh"), folder, cache=None)


def test_rigs_formats_and_units_meet_in_one_database(tmp_path):
    """Clips in centimetres, in metres, of Mixamo's names as FBX-like GLB, of another body, and one that rests with its arms up."""
    (tmp_path / "clips").mkdir()
    (tmp_path / "poses").mkdir()
    motion.write_bvh(MADE["idle"].clip, tmp_path / "clips/idle.bvh")
    metres = replace(WALK.skeleton, offsets=WALK.skeleton.offsets * 0.01)
    values = WALK.values.copy()
    values[:, :3] *= 0.01
    motion.write_bvh(replace(WALK, skeleton=metres, values=values), tmp_path / "clips/walk_metres.bvh", digits=9)
    motion.write_bvh(of_another_body(WALK), tmp_path / "clips/walk_other.bvh")
    body = Moving.of(WALK)
    (tmp_path / "clips/walk_mixamo.glb").write_bytes(gltf(replace(body, names=tuple(f"mixamorig:{each}" for each in body.names))))
    motion.write_bvh(resting(WALK, ARMS_UP), tmp_path / "clips/walk_t.bvh")
    motion.write_bvh(standing(WALK, ARMS_UP), tmp_path / "poses/t.bvh")
    keys = {"clips": "clips/*.{bvh,glb}", "rig": "clips/idle.bvh", "metres_per_unit": "size"}
    with pytest.raises(MotionError, match='"LeftForeArm" of the rig points another way'):
        motion.build(config_of(**{**keys, "clips": "clips/walk_t.bvh"}), tmp_path, cache=None)
    config = config_of(**keys, rig_pose="poses/*.bvh")
    poses = [motion.poses_of(clip) for clip in config.load_clips("all", tmp_path) if clip.name != "idle"]
    assert [each.skeleton.names for each in poses] == [WALK.skeleton.names] * 4
    for each in poses:
        joints = [each.skeleton.index(bone) for bone in (*FEET, "Head")]
        np.testing.assert_allclose(each.positions[:, joints], poses[0].positions[:, joints], atol=0.02)
    (tmp_path / "poses/t.bvh").unlink()
    with pytest.raises(MotionError, match=r"no file matches rig_pose"):
        motion.build(config, tmp_path, cache=None)


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"rig": "clips/idle.c3d"}, "its ending is that of no file of clips"),
        ({"rig": "../idle.bvh"}, "it leaves the folder"),
        ({"rig_bones": {"Hips": "Pelvis"}}, "there is no rig that it could be about"),
        ({"rig": "clips/idle.bvh", "rig_bones": {"Hips": 3}}, "these are not names of bones"),
        ({"rigg": "clips/idle.bvh"}, 'Did you mean "rig"'),
    ],
)
def test_settings_that_cannot_be_meant_are_refused(keys, told):
    with pytest.raises(SchemaError, match=told):
        config_of(**keys)
