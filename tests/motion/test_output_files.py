"""Pose banks on disk: the same to the bit, memory-mapped, and refused when they were altered."""

from dataclasses import replace

import numpy as np
import pytest
from played import RATE, SCHEMA, bank, clips, decisions

from contextdb.errors import ArtefactError, ClipError, ContextError, FileError
from contextdb.motion import (
    MotionConfig,
    PoseBank,
    PoseSettings,
    PoseStream,
    load_bvh,
    open_or_build_poses,
    poses_of,
    write_bvh,
    write_poses,
)
from contextdb.motion.features.schema import schema_to_dict
from contextdb.motion.output.track import pose_arrays
from contextdb.motion.storage.building import build_all
from contextdb.motion.storage.pose_files import ARRAYS, open_poses, poses_path, save_poses

CONFIG = MotionConfig.from_dict(
    {
        "features": {"loco": schema_to_dict(SCHEMA)},
        "databases": {"jog": {"clips": "clips/*.bvh", "features": "loco", "mirror": True}},
    }
)


@pytest.fixture
def project(tmp_path):
    (tmp_path / "clips").mkdir()
    for clip in clips()[:2]:
        write_bvh(clip, tmp_path / "clips" / f"{clip.name}.bvh")
    return tmp_path


def same(one, other):
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert (one.rate, one.feet, one.assets, one.skeleton.names) == (other.rate, other.feet, other.assets, other.skeleton.names)
    assert one.skeleton.end_sites == other.skeleton.end_sites


def test_a_saved_bank_is_opened_as_it_was_and_saved_again_as_the_same_bytes(tmp_path):
    first, second = tmp_path / "one.poses.safetensors", tmp_path / "two.poses.safetensors"
    save_poses(bank(), first, inputs="abc")
    opened = open_poses(first, verify=True)
    same(opened, bank())
    save_poses(opened, second, inputs="abc")
    assert first.read_bytes() == second.read_bytes()
    np.testing.assert_array_equal(opened.sample("walk", 0.31, True).rotations, bank().sample("walk", 0.31, True).rotations)


def test_an_altered_bank_is_refused(tmp_path):
    file = tmp_path / "one.poses.safetensors"
    save_poses(bank(), file)
    whole = bytearray(file.read_bytes())
    whole[-1] ^= 1
    file.write_bytes(whole)
    with pytest.raises(ArtefactError, match="was altered"):
        open_poses(file, verify=True)
    file.write_bytes(whole[:-1])
    with pytest.raises(ArtefactError):
        open_poses(file)


def test_a_project_gives_the_banks_of_its_databases_saved_or_not(project):
    built = open_or_build_poses(CONFIG, project)["jog"]
    database = build_all(CONFIG, project)["jog"]
    np.testing.assert_array_equal(built.root, database.database.root)
    assert built.assets == database.database.assets
    save_poses(built, poses_path(project, "jog"), inputs=database.digest)
    same(open_or_build_poses(CONFIG, project)["jog"], built)


def test_a_bank_is_built_anew_when_a_clip_has_changed(project):
    built = open_or_build_poses(CONFIG, project)["jog"]
    save_poses(built, poses_path(project, "jog"), inputs=build_all(CONFIG, project)["jog"].digest)
    write_bvh(clips()[2], project / "clips" / "walk.bvh")
    again = open_or_build_poses(CONFIG, project)["jog"]
    assert again.n_frames != built.n_frames


def test_clips_that_cannot_be_read_are_told(project):
    (project / "clips" / "walk.bvh").write_text("HIERARCHY\n")
    with pytest.raises(ClipError, match="walk"):
        open_or_build_poses(CONFIG, project)


@pytest.mark.parametrize(
    "wrong", [lambda: save_poses("walk", "x"), lambda: save_poses(bank(), 3), lambda: open_poses(3), lambda: poses_path("x", 3)]
)
def test_arguments_of_another_type_are_told(wrong):
    with pytest.raises(ContextError):
        wrong()


def test_a_bank_of_one_clip_is_a_bank():
    one = PoseBank.build(clips()[:1], SCHEMA)
    assert (one.n_joints, len(one.assets)) == (bank().n_joints, 1)


# ---- poses in files of others


@pytest.fixture
def poses():
    stream = PoseStream(bank(), PoseSettings(root="animation"))
    segments = [("walk_turn_left_90", 0.3, 20), ("run", 0.2, 20, True)]
    return [stream.update(each, 1.0 / RATE if each.tick else 0.0) for each in decisions(segments, 1.0 / RATE)]


def test_poses_written_as_bvh_are_read_again_where_they_were(tmp_path, poses):
    write_poses(poses, bank(), tmp_path / "shown.bvh", RATE)
    read = poses_of(load_bvh(tmp_path / "shown.bvh"))
    np.testing.assert_allclose(read.positions, [pose.positions for pose in poses], atol=1e-6)
    assert read.rate == pytest.approx(RATE, rel=1e-4)


def test_poses_written_as_arrays_are_what_was_shown(tmp_path, poses):
    write_poses(poses, bank(), tmp_path / "shown.npz", RATE)
    with np.load(tmp_path / "shown.npz") as found:
        wanted = pose_arrays(poses, bank(), RATE)
        assert set(found) == set(wanted)
        for name in wanted:
            np.testing.assert_array_equal(found[name], wanted[name])
        assert found["jumped"].tolist() == [i == 20 for i in range(40)]
        assert found["forced"].tolist() == [i == 20 for i in range(40)]


def test_no_poses_are_written_as_none(tmp_path):
    write_poses([], bank(), tmp_path / "none.npz", RATE)
    write_poses([], bank(), tmp_path / "none.bvh", RATE)
    assert load_bvh(tmp_path / "none.bvh").n_frames == 0


def test_another_ending_is_refused(tmp_path, poses):
    with pytest.raises(FileError, match="ends in"):
        write_poses(poses, bank(), tmp_path / "shown.fbx", RATE)
    with pytest.raises(ContextError):
        write_poses(["walk"], bank(), tmp_path / "shown.npz", RATE)


def test_banks_of_one_rig_of_which_one_alone_moves_a_joint_are_played_together(tmp_path):
    """A take moves the root, another the hips below it: the second has no positions of the root of its own."""
    clip = clips()[0]
    spine, start = clip.skeleton.index("Spine"), int(clip.skeleton.channel_starts[clip.skeleton.index("Spine")])
    channels = list(clip.skeleton.channels)
    channels[spine] = ("Xposition", "Yposition", "Zposition", *channels[spine])
    rig = replace(clip.skeleton, channels=tuple(channels))
    for name, sway in (("still", 0.0), ("swaying", 5.0)):
        moved = clip.skeleton.offsets[spine] + sway * np.sin(np.arange(clip.n_frames))[:, None]
        values = np.hstack((clip.values[:, :start], moved, clip.values[:, start:]))
        (tmp_path / name).mkdir()
        write_bvh(replace(clip, name=name, skeleton=rig, values=values), tmp_path / name / f"{name}.bvh")
    sections = {name: {"clips": f"{name}/*.bvh", "features": "loco"} for name in ("still", "swaying")}
    config = MotionConfig.from_dict({"features": {"loco": schema_to_dict(SCHEMA)}, "databases": sections})
    banks = open_or_build_poses(config, tmp_path)
    assert spine in banks["still"].moving
    alone = open_or_build_poses(config, tmp_path, names=["still"])["still"]
    assert spine not in alone.moving
    hips, at = banks["still"].sample("still", 0.4).positions
    np.testing.assert_array_equal(hips, alone.sample("still", 0.4).positions[0])
    np.testing.assert_allclose(at, alone.skeleton.offsets[spine], atol=1e-6)
    PoseStream(banks)
