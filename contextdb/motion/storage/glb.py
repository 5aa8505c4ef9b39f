"""Poses as glTF: a skeleton of nodes and one animation of them, in one `.glb` file.

A node a joint, as the rig has them; rotations of every joint, and translations of those with positions of their own. Metres, y up,
z ahead, as glTF has it. Needs pygltflib, from the extra `gltf`.

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

if TYPE_CHECKING:
    import pygltflib

FLOAT32 = 5126
"""The number that glTF has for 32-bit floats."""


def require_gltf() -> None:
    """Raise MotionError where pygltflib is not installed."""
    try:
        import pygltflib  # noqa: F401
    except ImportError:
        problem = "poses cannot be written as glTF: pygltflib is not installed."
        raise MotionError(
            Fault(problem, ".bvh and .npz, which need nothing more", 'to install it: pip install "contextdb[gltf]"')
        ) from None


def glb_of(poses: Sequence[Pose], bank: PoseBank, rate: float, name: str) -> bytes:
    """The bytes of a `.glb` file, for at least one pose."""
    require_gltf()
    import pygltflib

    rig = bank.skeleton
    rotations, translations = local_tracks(list(poses), rig)
    file = _File(pygltflib.GLTF2(asset=pygltflib.Asset(version="2.0", generator="contextdb")))
    file.gltf.nodes = _nodes(rig, translations[0], rotations[0])
    roots = [joint for joint in range(rig.n_joints) if rig.parents[joint] < 0]
    file.gltf.scenes, file.gltf.scene = [pygltflib.Scene(name=name, nodes=roots)], 0
    file.gltf.skins = [pygltflib.Skin(name=name, joints=list(range(rig.n_joints)), skeleton=roots[0])]
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

    def add(self, values: NDArray[Any], kind: str) -> int:
        """Put numbers into the file; which accessor they are."""
        import pygltflib

        columns = np.ascontiguousarray(values, np.float32).reshape(len(values), -1)
        start = sum(map(len, self.parts))
        self.parts.append(columns.tobytes())
        self.gltf.bufferViews.append(pygltflib.BufferView(buffer=0, byteOffset=start, byteLength=len(self.parts[-1])))
        least, most = columns.min(axis=0).tolist(), columns.max(axis=0).tolist()
        view = len(self.gltf.bufferViews) - 1
        accessor = pygltflib.Accessor(bufferView=view, componentType=FLOAT32, count=len(columns), type=kind, min=least, max=most)
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
