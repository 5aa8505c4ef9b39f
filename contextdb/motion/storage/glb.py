"""Poses as glTF: a skeleton of nodes and one animation of them, in one `.glb` file.

A node a joint, as the rig has them; rotations of every joint, and translations of those with positions of their own; with a body
one skin on these joints, and a mesh of capsules. Metres, y up, z ahead, as glTF has it. Needs pygltflib, from the extra `gltf`.

Source: Khronos Group, glTF 2.0 Specification.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import Fault, MotionError
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.stream import Pose
from contextdb.motion.output.track import local_tracks
from contextdb.motion.storage.capsules import Capsules, capsules_of

if TYPE_CHECKING:
    import pygltflib

FLOAT32 = 5126
COMPONENTS: dict[type, int] = {np.uint16: 5123, np.uint32: 5125}
"""The numbers that glTF has for types of numbers."""
VERTICES, TRIANGLES = 34962, 34963
"""Those that it has for what numbers are of."""


def require_gltf() -> None:
    """Raise MotionError where pygltflib is not installed."""
    try:
        import pygltflib  # noqa: F401
    except ImportError:
        problem = "poses cannot be written as glTF: pygltflib is not installed."
        raise MotionError(
            Fault(problem, ".bvh and .npz, which need nothing more", 'to install it: pip install "contextdb[gltf]"')
        ) from None


def glb_of(poses: Sequence[Pose], bank: PoseBank, rate: float, name: str, *, has_body: bool = False) -> bytes:
    """The bytes of a `.glb` file, for at least one pose; with a body of capsules, which some engines want to see a skeleton."""
    require_gltf()
    import pygltflib

    rig = bank.skeleton
    rotations, translations = local_tracks(list(poses), rig)
    file = _File(pygltflib.GLTF2(asset=pygltflib.Asset(version="2.0", generator="contextdb")))
    file.gltf.nodes = _nodes(rig, translations[0], rotations[0])
    roots = [joint for joint in range(rig.n_joints) if rig.parents[joint] < 0]
    file.gltf.skins = [pygltflib.Skin(name=name, joints=list(range(rig.n_joints)), skeleton=roots[0])]
    if has_body:
        roots.append(_add_body(file, capsules_of(rig)))
    file.gltf.scenes, file.gltf.scene = [pygltflib.Scene(name=name, nodes=roots)], 0
    times = file.add(np.arange(len(poses)) / rate, "SCALAR")
    animation = pygltflib.Animation(name=name)
    for joint in range(rig.n_joints):
        _animate(file, animation, times, joint, "rotation", _even(rotations[:, joint])[:, [1, 2, 3, 0]])
        if joint == 0 or joint in bank.moving:
            _animate(file, animation, times, joint, "translation", translations[:, joint])
    file.gltf.animations = [animation]
    return file.bytes()


class _File:
    """A glTF file in the making, and the numbers in it."""

    def __init__(self, gltf: pygltflib.GLTF2) -> None:
        self.gltf = gltf
        self.parts: list[bytes] = []

    def add(self, values: NDArray[Any], kind: str, target: int | None = None) -> int:
        """Put numbers into the file; which accessor they are."""
        import pygltflib

        number = COMPONENTS.get(values.dtype.type, FLOAT32)
        columns = np.ascontiguousarray(values, None if number != FLOAT32 else np.float32).reshape(len(values), -1)
        start = sum(map(len, self.parts))
        self.parts.append(columns.tobytes())
        view = pygltflib.BufferView(buffer=0, byteOffset=start, byteLength=len(self.parts[-1]), target=target)
        self.gltf.bufferViews.append(view)
        self.parts.append(b"\0" * (-len(self.parts[-1]) % 4))
        least, most = columns.min(axis=0).tolist(), columns.max(axis=0).tolist()
        at = len(self.gltf.bufferViews) - 1
        accessor = pygltflib.Accessor(bufferView=at, componentType=number, count=len(columns), type=kind, min=least, max=most)
        self.gltf.accessors.append(accessor)
        return len(self.gltf.accessors) - 1

    def bytes(self) -> bytes:
        import pygltflib

        data = b"".join(self.parts)
        self.gltf.buffers = [pygltflib.Buffer(byteLength=len(data))]
        self.gltf.set_binary_blob(data)
        return b"".join(self.gltf.save_to_bytes())


def _nodes(rig: Skeleton, translations: Floats, rotations: Floats) -> list[pygltflib.Node]:
    """A node for each joint, in its first pose."""
    import pygltflib

    children: list[list[int]] = [[] for _ in rig.names]
    for joint, parent in enumerate(rig.parents.tolist()):
        if parent >= 0:
            children[parent].append(joint)
    return [
        pygltflib.Node(name=name, children=below, translation=place.tolist(), rotation=turn[[1, 2, 3, 0]].tolist())
        for name, below, place, turn in zip(rig.names, children, translations, rotations, strict=True)
    ]


def _add_body(file: _File, body: Capsules) -> int:
    """Add a mesh of capsules on the skin; which node it is."""
    import pygltflib

    n = len(body.places)
    joints, weights = np.zeros((n, 4), np.uint16), np.zeros((n, 4), np.float32)
    joints[:, 0], weights[:, 0] = body.joints, 1.0
    back = np.tile(np.eye(4), (len(body.rest), 1, 1))
    back[:, 3, :3] = -body.rest  # columns one after another, as glTF has matrices
    file.gltf.skins[0].inverseBindMatrices = file.add(back, "MAT4")
    attributes = pygltflib.Attributes(
        POSITION=file.add(body.places, "VEC3", VERTICES),
        NORMAL=file.add(body.normals, "VEC3", VERTICES),
        JOINTS_0=file.add(joints, "VEC4", VERTICES),
        WEIGHTS_0=file.add(weights, "VEC4", VERTICES),
    )
    triangles = file.add(body.triangles.reshape(-1), "SCALAR", TRIANGLES)
    grey = pygltflib.PbrMetallicRoughness(baseColorFactor=[0.6, 0.6, 0.6, 1.0], metallicFactor=0.0, roughnessFactor=0.8)
    file.gltf.materials = [pygltflib.Material(name="Body", pbrMetallicRoughness=grey)]
    file.gltf.meshes = [
        pygltflib.Mesh(name="Body", primitives=[pygltflib.Primitive(attributes=attributes, indices=triangles, material=0)])
    ]
    file.gltf.nodes.append(pygltflib.Node(name="Body", mesh=0, skin=0))
    return len(file.gltf.nodes) - 1


def _animate(file: _File, animation: pygltflib.Animation, times: int, joint: int, path: str, values: Floats) -> None:
    """Let a joint's rotation or translation follow some values [T, ...]."""
    import pygltflib

    values_at = file.add(values, "VEC4" if path == "rotation" else "VEC3")
    animation.samplers.append(pygltflib.AnimationSampler(input=times, output=values_at, interpolation="LINEAR"))
    target = pygltflib.AnimationChannelTarget(node=joint, path=path)
    animation.channels.append(pygltflib.AnimationChannel(sampler=len(animation.samplers) - 1, target=target))


def _even(rotations: Floats) -> Floats:
    """Rotations [T, 4] of which each is on the side of the one before it: between two a viewer then goes the shorter way."""
    signs = np.sign(np.einsum("ti,ti->t", rotations[1:], rotations[:-1]))
    return np.asarray(rotations * np.concatenate(([1.0], np.cumprod(np.where(signs < 0.0, -1.0, 1.0))))[:, None])
