"""A figure with hands, a face and shoes, made by formulas for any rig: one mesh a joint, in the frame of its rest pose.

Sizes are those of a body of 1.8 m, and scaled with the legs of the rig. Joints are known by words in their names.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np
from panda3d.core import LColor, LQuaternion, NodePath

from contextdb import motion

from .meshes import Floats, Part, ball, coloured, here, solid, tube

SKIN, HAIR, EYES, TROUSERS, SHOES, SOLES = (
    LColor(*bytes.fromhex(code), 255) / 255.0 for code in ["dca786", "3b2a22", "1d1a1a", "2b3444", "eef0f2", "b9483d"]
)
LEG_M = 0.91
Shade = tuple[Part, LColor]
TRUNK = {
    "hip": [(-0.5, 0.115, 0.09), (0.0, 0.158, 0.112), (0.6, 0.15, 0.108), (1.15, 0.128, 0.095)],
    "spine": [(-0.1, 0.134, 0.096), (0.5, 0.132, 0.098), (1.1, 0.142, 0.106)],
    "chest": [(-0.1, 0.142, 0.106), (0.35, 0.165, 0.122), (0.7, 0.182, 0.115), (0.9, 0.15, 0.09), (1.0, 0.07, 0.06)],
}
SLEEVE = [(-0.02, 0.066, 0.07), (0.2, 0.064, 0.068), (0.62, 0.058, 0.06)]
ARM, FOREARM = [(0.5, 0.046, 0.048), (1.0, 0.04, 0.042)], [(0.0, 0.041, 0.042), (0.25, 0.045, 0.046), (1.0, 0.028, 0.033)]
THIGH = [(-0.06, 0.09, 0.098), (0.2, 0.092, 0.098), (0.7, 0.072, 0.078), (1.0, 0.06, 0.064)]
SHIN = [(0.0, 0.06, 0.064), (0.25, 0.06, 0.068), (0.7, 0.05, 0.053), (0.96, 0.047, 0.05)]
PLAIN = [(0.0, 0.05, 0.05), (1.0, 0.045, 0.045)]


class Mannequin:
    """The nodes of a figure; `show` brings them to a pose."""

    def __init__(self, root: NodePath, rig: motion.PoseBank, shirt: LColor) -> None:
        self.parents = rig.skeleton.parents.tolist()
        self.nodes = dict[int, NodePath]()
        for joint, parts in shapes(rig.skeleton, shirt).items():
            self.nodes[joint] = solid(root, coloured(parts))

    def show(self, pose: motion.Pose) -> None:
        """The pose as it is now."""
        heading = 0.5 * pose.root[2]
        turns: list[tuple[float, float, float, float]] = []
        for joint, turn in enumerate(pose.rotations.tolist()):
            parent = self.parents[joint]
            turns.append(_after(turns[parent] if parent >= 0 else (math.cos(heading), 0.0, math.sin(heading), 0.0), turn))
        for joint, node in self.nodes.items():
            w, x, y, z = turns[joint]
            node.setPosQuat(here(pose.positions[joint]), LQuaternion(w, -x, z, y))


def shapes(skeleton: motion.Skeleton, shirt: LColor) -> dict[int, list[Shade]]:
    """What hangs on each joint."""
    names = [name.lower() for name in skeleton.names]
    parents, offsets = skeleton.parents.tolist(), np.asarray(skeleton.offsets, float)
    size, front = _size(names, offsets), _front(names, offsets)
    parts: dict[int, list[Shade]] = {}
    for joint, name in enumerate(names):
        children = [child for child, parent in enumerate(parents) if parent == joint]
        end = offsets[_main(names, children)] if children else offsets[joint]
        made = [*_shape(name, end, not children, size, front, shirt)]
        if made:
            parts[joint] = made
    return parts


def _main(names: list[str], children: list[int]) -> int:
    """The child that a joint's own shape leads to."""
    return next((child for word in ("spine", "neck", "chest", "toe") for child in children if word in names[child]), children[0])


def _shape(name: str, end: Floats, is_last: bool, size: float, front: Floats, shirt: LColor) -> Iterator[Shade]:
    """The shapes of one joint, in the frame of the rest pose, from the joint to `end`."""
    origin = np.zeros(3)

    def limb(profile: list[tuple[float, float, float]]) -> Part:
        return tube(origin, end, front, [(share, size * wide, size * deep) for share, wide, deep in profile])

    trunk = next((word for word in TRUNK if word in name), "")
    if "head" in name:
        yield from _head(size, front)
    elif "hand" in name or "wrist" in name:
        yield from _hand(end, size, front, is_left="left" in name or name.startswith("l"))
    elif "toe" in name:
        yield from _toe(size, front)
    elif "foot" in name or "ankle" in name:
        yield from _shoe(size, front)
    elif is_last:
        return
    elif trunk:
        yield limb(TRUNK[trunk]), TROUSERS if trunk == "hip" else shirt
    elif "neck" in name:
        yield limb([(-0.3, 0.052, 0.056), (1.1, 0.05, 0.054)]), SKIN
    elif "fore" in name:
        yield limb(FOREARM), SKIN
    elif "arm" in name:
        yield limb(ARM), SKIN
        yield limb(SLEEVE), shirt
        yield ball(origin, 0.07 * size, 0.068 * size, 0.074 * size), shirt
    elif "up" in name or "thigh" in name:
        yield limb(THIGH), TROUSERS
    elif "leg" in name or "shin" in name or "knee" in name:
        yield limb(SHIN), TROUSERS
    else:
        yield limb(PLAIN), shirt


def _head(size: float, front: Floats) -> Iterator[Shade]:
    """A head with hair, eyes, a nose and ears, above its joint."""
    side, up = np.cross(np.array((0.0, 1.0, 0.0)), front), np.array((0.0, 1.0, 0.0))

    def at(left: float, high: float, ahead: float) -> Floats:
        return size * (left * side + high * up + ahead * front)

    def egg(middle: Floats, wide: float, high: float, deep: float) -> Part:
        return ball(middle, size * wide, size * high, size * deep)

    yield egg(at(0.0, 0.09, 0.0), 0.078, 0.118, 0.094), SKIN
    yield egg(at(0.0, 0.04, 0.035), 0.052, 0.055, 0.056), SKIN
    yield egg(at(0.0, 0.122, -0.018), 0.084, 0.1, 0.093), HAIR
    yield egg(at(0.0, 0.085, 0.094), 0.013, 0.022, 0.02), SKIN
    for left in (1.0, -1.0):
        yield egg(at(0.032 * left, 0.105, 0.08), 0.011, 0.011, 0.012), EYES
        yield egg(at(0.079 * left, 0.085, -0.005), 0.012, 0.028, 0.018), SKIN
    yield egg(at(0.0, 0.038, 0.086), 0.022, 0.004, 0.008), SOLES


def _hand(along: Floats, size: float, front: Floats, is_left: bool) -> Iterator[Shade]:
    """A palm, four fingers that are a little bent, and a thumb; it goes on as the forearm does."""
    out = along / (np.linalg.norm(along) or 1.0)
    ahead = front - out * (front @ out)
    ahead /= np.linalg.norm(ahead) or 1.0
    inward = np.cross(out, ahead) * (1.0 if is_left else -1.0)
    place: Callable[[float, float, float], Floats] = lambda o, a, i: size * (o * out + a * ahead + i * inward)  # noqa: E731
    flat = [(0.0, 0.015 * size, 0.026 * size), (0.5, 0.017 * size, 0.04 * size), (1.0, 0.013 * size, 0.038 * size)]
    yield tube(place(-0.01, 0.0, 0.0), place(0.085, 0.0, 0.004), ahead, flat), SKIN
    for finger, long in zip((0.028, 0.0095, -0.0095, -0.028), (0.066, 0.075, 0.07, 0.055), strict=True):
        middle = place(0.085 + 0.55 * long, finger, 0.012)
        yield (
            tube(
                place(0.082, finger, 0.004), middle, ahead, [(0.0, 0.0095 * size, 0.0095 * size), (1.0, 0.009 * size, 0.009 * size)]
            ),
            SKIN,
        )
        tip = place(0.085 + long, finger, 0.034)
        yield tube(middle, tip, ahead, [(0.0, 0.009 * size, 0.009 * size), (1.0, 0.007 * size, 0.007 * size)]), SKIN
    yield (
        tube(
            place(0.02, 0.03, 0.006),
            place(0.085, 0.058, 0.02),
            inward,
            [(0.0, 0.013 * size, 0.013 * size), (1.0, 0.009 * size, 0.009 * size)],
        ),
        SKIN,
    )


def _shoe(size: float, front: Floats) -> Iterator[Shade]:
    """A shoe around an ankle, and its sole."""
    yield from _sole(size * np.array((0.0, -0.045, 0.0)) - 0.06 * size * front, 0.185 * size, 0.047 * size, 0.05 * size, front)
    up = size * np.array((0.0, 0.035, 0.0))
    yield (
        tube(
            -up - 0.012 * size * front,
            up - 0.012 * size * front,
            front,
            [(0.0, 0.046 * size, 0.06 * size), (1.0, 0.05 * size, 0.056 * size)],
        ),
        SHOES,
    )


def _toe(size: float, front: Floats) -> Iterator[Shade]:
    """The front of a shoe."""
    yield from _sole(size * np.array((0.0, 0.006, 0.0)) - 0.01 * size * front, 0.075 * size, 0.046 * size, 0.036 * size, front)


def _sole(start: Floats, length: float, wide: float, high: float, front: Floats) -> Iterator[Shade]:
    """A flat part of a shoe, from `start` on, with a sole below it."""
    up = np.array((0.0, 1.0, 0.0))
    profile = [(0.0, 0.8 * wide, 0.85 * high), (0.5, wide, high), (1.0, 0.92 * wide, 0.85 * high)]
    for low, own in ((0.0, SHOES), (-0.55 * high, SOLES)):
        points, normals = tube(start, start + length * front, up, profile)
        height = points[..., 1] - start[1]
        floor = -0.62 * high if own is SHOES else -0.95 * high
        points[..., 1] = start[1] + np.clip(height * (1.0 if own is SHOES else 0.35) + low, floor, None)
        if own is SOLES:
            points += 0.06 * (points - points.mean(axis=(0, 1))) * (1.0, 0.0, 1.0)
        yield (points, normals), own


def _after(first: tuple[float, float, float, float], second: list[float]) -> tuple[float, float, float, float]:
    """Two turns in one: the second is applied first."""
    (w, x, y, z), (a, b, c, d) = first, second
    return (
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    )


def _size(names: list[str], offsets: Floats) -> float:
    """How large a rig is against a body of 1.8 m, by its legs."""
    lower = [
        float(np.linalg.norm(offsets[i])) for i, name in enumerate(names) if "left" in name and ("leg" in name or "foot" in name)
    ]
    return sum(sorted(lower)[-2:]) / LEG_M if len(lower) > 1 else 1.0


def _front(names: list[str], offsets: Floats) -> Floats:
    """Where the rest pose faces: where its toes point."""
    toes = sum((offsets[i] * (1.0, 0.0, 1.0) for i, name in enumerate(names) if "toe" in name), np.zeros(3))
    length = np.linalg.norm(toes)
    return toes / length if length > 1e-6 else np.array((0.0, 0.0, 1.0))
