"""A body of capsules around the bones of a rig, to show poses in engines that make a skeleton of a skinned mesh alone.

The body is in the pose of reference, in which no joint is turned; each capsule hangs on the joint at its beginning. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton

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
