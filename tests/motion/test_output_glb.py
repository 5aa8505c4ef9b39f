"""Poses as glTF, read back with the library and placed joint by joint."""

import sys

import numpy as np
import pytest
from played import RATE, bank, decisions

from contextdb.errors import ContextError, FileError, MotionError
from contextdb.motion import PoseSettings, PoseStream, write_poses
from contextdb.motion.clips import quaternions
from contextdb.motion.storage.written_poses import glb_of_poses

STEP = 1.0 / RATE


def made(n=20):
    stream = PoseStream(bank(), PoseSettings())
    ticks = decisions([("walk", 0.1, n), ("run", 0.2, n)], STEP)
    return [stream.update(d, STEP if d.tick else 0.0, (0.2 * d.tick * STEP, 1.4 * d.tick * STEP, 0.01 * d.tick)) for d in ticks]


def numbers(gltf, at):
    """The values of an accessor."""
    accessor = gltf.accessors[at]
    view, width = gltf.bufferViews[accessor.bufferView], {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor.type]
    raw = gltf.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    return np.frombuffer(raw, np.float32).reshape(accessor.count, width)


def test_a_file_read_back_places_every_joint_where_the_poses_have_it(tmp_path):
    pygltflib = pytest.importorskip("pygltflib", reason="needs the extra gltf")
    poses, path = made(), tmp_path / "walk.glb"
    write_poses(poses, bank(), path, RATE)
    gltf = pygltflib.GLTF2().load(str(path))
    assert [node.name for node in gltf.nodes] == list(bank().skeleton.names)
    (animation,) = gltf.animations
    turns = np.tile([node.rotation for node in gltf.nodes], (len(poses), 1, 1))
    shifts = np.tile([node.translation for node in gltf.nodes], (len(poses), 1, 1))
    for channel in animation.channels:
        sampler = animation.samplers[channel.sampler]
        np.testing.assert_allclose(numbers(gltf, sampler.input)[:, 0], np.arange(len(poses)) / RATE, atol=1e-5)
        (turns if channel.target.path == "rotation" else shifts)[:, channel.target.node] = numbers(gltf, sampler.output)
    parents = {child: i for i, node in enumerate(gltf.nodes) for child in node.children}
    world, places = np.empty((len(poses), bank().n_joints, 4)), np.empty((len(poses), bank().n_joints, 3))
    for joint in range(bank().n_joints):
        local, above = turns[:, joint][:, [3, 0, 1, 2]], parents.get(joint)
        world[:, joint] = local if above is None else quaternions.multiply(world[:, above], local)
        shift = shifts[:, joint]
        places[:, joint] = shift if above is None else places[:, above] + quaternions.rotate(world[:, above], shift)
    np.testing.assert_allclose(places, [pose.positions for pose in poses], atol=1e-5)


def test_rotations_go_the_shorter_way_from_pose_to_pose():
    pygltflib = pytest.importorskip("pygltflib", reason="needs the extra gltf")
    gltf = pygltflib.GLTF2().load_from_bytes(glb_of_poses(made(), bank(), RATE))
    for channel in gltf.animations[0].channels:
        if channel.target.path == "rotation":
            values = numbers(gltf, gltf.animations[0].samplers[channel.sampler].output)
            assert (np.einsum("ti,ti->t", values[1:], values[:-1]) > 0.0).all()


def test_the_same_poses_give_the_same_bytes():
    pytest.importorskip("pygltflib", reason="needs the extra gltf")
    assert glb_of_poses(made(5), bank(), RATE) == glb_of_poses(made(5), bank(), RATE)


def test_what_cannot_be_written_is_told(tmp_path, monkeypatch):
    with pytest.raises(MotionError, match="no pose to write"):
        glb_of_poses([], bank(), RATE)
    with pytest.raises(ContextError):
        glb_of_poses(["walk"], bank(), RATE)
    with pytest.raises(FileError, match=r"\.bvh, \.npz, \.glb or \.usda"):
        write_poses(made(2), bank(), tmp_path / "walk.fbx", RATE)
    monkeypatch.setitem(sys.modules, "pygltflib", None)
    with pytest.raises(MotionError, match=r"pygltflib is not installed.*contextdb\[gltf\]"):
        write_poses(made(2), bank(), tmp_path / "walk.glb", RATE)
    assert not (tmp_path / "walk.glb").exists()
