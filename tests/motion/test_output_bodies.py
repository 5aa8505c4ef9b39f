"""Poses as glTF with a body of capsules, and as USD: read back, they are the poses; tools of others find nothing wrong."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from played import RATE, bank
from test_output_glb import made, numbers

from contextdb import motion
from contextdb.errors import FileError
from contextdb.motion import poses_of, write_poses
from contextdb.motion.storage.glb import capsules_of
from contextdb.motion.storage.written_poses import _paths, glb_of_poses

VALIDATE = """
const validator = require('gltf-validator'), fs = require('fs');
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1]))).then(report => console.log(JSON.stringify(report)));
"""


def places(clip: motion.Clip, names: tuple[str, ...]) -> np.ndarray:
    poses = poses_of(clip)
    return poses.positions[:, [poses.skeleton.index(name) for name in names]]


@pytest.mark.parametrize("ending", [".glb", ".usda"])
def test_a_file_that_was_written_is_a_clip_again(ending: str, tmp_path: Path):
    pytest.importorskip({".glb": "pygltflib", ".usda": "pxr"}[ending], reason="needs the extra gltf or usd")
    poses, path = made(), tmp_path / f"walk{ending}"
    write_poses(poses, bank(), path, RATE, has_body=ending == ".glb")
    (clip,) = motion.load_clips([path])
    assert clip.rate == pytest.approx(RATE, rel=1e-5)
    np.testing.assert_allclose(places(clip, bank().skeleton.names), [pose.positions for pose in poses], atol=1e-4)


def test_names_that_usd_cannot_have_are_written_with_others():
    turns, offsets = np.tile([1.0, 0.0, 0.0, 0.0], (2, 4, 1)), np.zeros((4, 3))
    names = ["mixamorig:Hips", "2 links", "2_links", "é"]
    clip = motion.Clip.from_arrays(names, [-1, 0, 0, 0], offsets, turns, np.zeros((2, 3)), 30.0)
    assert _paths(clip.skeleton) == [f"mixamorig_Hips{below}" for below in ("", "/_2_links", "/_2_links_", "/_")]


def test_a_body_is_one_skin_of_closed_capsules_on_the_joints():
    pygltflib = pytest.importorskip("pygltflib", reason="needs the extra gltf")
    gltf = pygltflib.GLTF2().load_from_bytes(glb_of_poses(made(3), bank(), RATE, has_body=True))
    (skin,), (mesh,) = gltf.skins, gltf.meshes
    assert skin.joints == list(range(bank().n_joints))
    assert gltf.nodes[-1].mesh == gltf.nodes[-1].skin == 0
    assert gltf.scenes[0].nodes[-1] == len(gltf.nodes) - 1
    (part,) = mesh.primitives
    assert numbers(gltf, part.attributes.WEIGHTS_0).sum() == len(numbers(gltf, part.attributes.POSITION))
    body = capsules_of(bank().skeleton)
    corners = body.places[body.triangles].astype(np.float64)
    outwards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((outwards * body.normals[body.triangles].mean(axis=1)).sum(axis=1) > 0.0).all()
    edges = np.sort(np.round(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), 6), axis=1)
    assert (np.unique(edges.reshape(len(edges), -1), axis=0, return_counts=True)[1] % 2 == 0).all()  # no hole


def test_a_body_is_in_a_file_of_gltf_alone(tmp_path: Path):
    with pytest.raises(FileError, match=r"no body of capsules.*\.glb"):
        write_poses(made(2), bank(), tmp_path / "walk.bvh", RATE, has_body=True)


@pytest.mark.parametrize("has_body", [True, False])
def test_the_validator_of_khronos_finds_no_error(has_body: bool, tmp_path: Path):
    """Where node finds gltf-validator, as with NODE_PATH=folder/node_modules after `npm install gltf-validator`."""
    pytest.importorskip("pygltflib", reason="needs the extra gltf")
    node = shutil.which("node")
    if node is None or subprocess.run([node, "-e", "require('gltf-validator')"], capture_output=True, check=False).returncode:
        pytest.skip("node does not find gltf-validator")
    path = tmp_path / "walk.glb"
    write_poses(made(), bank(), path, RATE, has_body=has_body)
    report = json.loads(subprocess.run([node, "-e", VALIDATE, str(path)], capture_output=True, check=True).stdout)
    counts = {name: report["issues"][name] for name in ("numErrors", "numWarnings", "numInfos")}
    expected = {"numErrors": 0, "numWarnings": 0, "numInfos": 0 if has_body else 1}  # a skin that no mesh uses
    assert counts == expected, report["issues"]["messages"]
