"""Poses as glTF: a skeleton of nodes and one animation of them, in one `.glb` file.

A node a joint, as the rig has them; rotations of every joint, and translations of those with positions of their own; with a body
one skin on these joints, and a mesh of capsules. Metres, y up, z ahead, as glTF has it. Needs pygltflib, from the extra `gltf`.

Source: Khronos Group, glTF 2.0 Specification.

The body is in the pose of reference, in which no joint is turned; each capsule hangs on the joint at its beginning. Metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
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


# ---- a body of capsules around the bones of a rig, to show poses in engines that make a skeleton of a skinned mesh alone


AROUND = 8
LATITUDES = np.deg2rad([-90.0, -45.0, 0.0, 0.0, 45.0, 90.0])
"""The rings of a capsule: the first half of them about its beginning, the others about its end."""
THICKNESS, LEAST_M, MOST_M = 0.2, 0.012, 0.06
"""The radius of a capsule, by its length."""
SHORTEST_M = 1e-3


@dataclass(frozen=True, eq=False)
class Capsules:
    """Places and normals float32 [V, 3], the joint of each vertex uint16 [V], triangles uint32 [T, 3], and where the joints are at
    rest [J, 3]."""

    places: NDArray[np.float32]
    normals: NDArray[np.float32]
    joints: NDArray[np.uint16]
    triangles: NDArray[np.uint32]
    rest: Floats


def capsules_of(rig: Skeleton) -> Capsules:
    """The body of a rig with offsets in metres: a capsule from each joint to each of those below it, and to the ends of chains; a
    small ball where there is neither."""
    rest = np.zeros((rig.n_joints, 3))
    parents = rig.parents.tolist()
    for joint, parent in enumerate(parents):
        rest[joint] = rig.offsets[joint] + (rest[parent] if parent >= 0 else 0.0)
    bones = [(parent, rest[parent], rest[joint]) for joint, parent in enumerate(parents) if parent >= 0]
    bones += [(joint, rest[joint], rest[joint] + offset) for joint, offset in rig.end_sites]
    bones = [bone for bone in bones if np.linalg.norm(bone[2] - bone[1]) > SHORTEST_M]
    bare = sorted({*range(rig.n_joints)} - {joint for joint, _, _ in bones})
    bones += [(joint, rest[joint], rest[joint]) for joint in bare]
    shapes = [_capsule(start, stop) for _, start, stop in bones]
    n = len(LATITUDES) * AROUND
    triangles = np.concatenate([_triangles() + n * i for i in range(len(bones))])
    places, normals = (np.concatenate(arrays).astype(np.float32) for arrays in zip(*shapes, strict=True))
    owners = np.repeat(np.array([joint for joint, _, _ in bones], np.uint16), n)
    return Capsules(places, normals, owners, triangles.astype(np.uint32), rest)


def _capsule(start: Floats, stop: Floats) -> tuple[Floats, Floats]:
    """Places and normals of a capsule, ring by ring."""
    length = float(np.linalg.norm(stop - start))
    along = (stop - start) / length if length > SHORTEST_M else np.array([0.0, 1.0, 0.0])
    aside = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    aside /= np.linalg.norm(aside)
    third = np.cross(along, aside)
    turns = np.arange(AROUND) * (2.0 * np.pi / AROUND)
    ring = np.cos(turns)[:, None] * aside + np.sin(turns)[:, None] * third
    normals = np.cos(LATITUDES)[:, None, None] * ring + np.sin(LATITUDES)[:, None, None] * along
    centres = np.where(np.arange(len(LATITUDES))[:, None] < len(LATITUDES) // 2, start, stop)
    places = centres[:, None] + np.clip(THICKNESS * length, LEAST_M, MOST_M) * normals
    return places.reshape(-1, 3), normals.reshape(-1, 3)


def _triangles() -> NDArray[np.int64]:
    """The triangles of a capsule, seen from outside against the clock."""
    ring, at = np.meshgrid(np.arange(len(LATITUDES) - 1), np.arange(AROUND), indexing="ij")
    low, high, after = AROUND * ring + at, AROUND * (ring + 1) + at, (at + 1) % AROUND
    low_after, high_after = AROUND * ring + after, AROUND * (ring + 1) + after
    lower = np.stack((low, low_after, high_after), axis=-1)[1:]  # at the poles of a capsule two corners are one
    upper = np.stack((low, high_after, high), axis=-1)[:-1]
    return np.concatenate((lower.reshape(-1, 3), upper.reshape(-1, 3)))
