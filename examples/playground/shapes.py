"""Meshes made of numbers: capsules, boxes, discs. Nothing is loaded from a file."""

from __future__ import annotations

import math
from collections.abc import Sequence

from panda3d import core
from panda3d.core import LVector3, NodePath

from examples.playground.world import Box

Point = tuple[float, float, float]
N_ROUND, N_CAP = 14, 5
LOWEST_M = -0.5


def here(place: Sequence[float]) -> Point:
    """A place of the game (x to the left, y up, z ahead) as Panda has it (x to the right, y ahead, z up)."""
    return -float(place[0]), float(place[2]), float(place[1])


def mesh(points: Sequence[Point], normals: Sequence[Point], triangles: Sequence[tuple[int, int, int]]) -> NodePath:
    """A node with some triangles."""
    data = core.GeomVertexData("", core.GeomVertexFormat.getV3n3(), core.Geom.UHStatic)
    place, normal = core.GeomVertexWriter(data, "vertex"), core.GeomVertexWriter(data, "normal")
    for point, up in zip(points, normals, strict=True):
        place.addData3(*point)
        normal.addData3(*up)
    primitive = core.GeomTriangles(core.Geom.UHStatic)
    for triangle in triangles:
        primitive.addVertices(*triangle)
    geom = core.Geom(data)
    geom.addPrimitive(primitive)
    node = core.GeomNode("")
    node.addGeom(geom)
    return NodePath(node)


def capsule(length: float, radius: float) -> NodePath:
    """A capsule along y, from 0 to its length; a ball where that is 0."""
    angles = [0.5 * math.pi * max(i / N_CAP, 1e-3) for i in range(N_CAP + 1)]
    rings = [(-math.sin(a), math.cos(a)) for a in reversed(angles)] + [(math.sin(a), math.cos(a)) for a in angles]
    turns = [math.tau * i / N_ROUND for i in range(N_ROUND + 1)]
    normals = [(wide * math.cos(turn), along, wide * math.sin(turn)) for along, wide in rings for turn in turns]
    points = [(radius * x, radius * y + (length if y > 0.0 else 0.0), radius * z) for x, y, z in normals]
    n = N_ROUND + 1
    quads = [(row * n + i, row * n + i + 1) for row in range(len(rings) - 1) for i in range(N_ROUND)]
    triangles = [each for a, b in quads for each in ((a, a + n, b), (b, a + n, b + n))]
    return mesh(points, normals, triangles)


def block(box: Box) -> NodePath:
    """A part of the ground, with its sides."""
    (left, right), (near, far) = box.x, box.z
    high = [here((x, box.height(z), z)) for x, z in ((right, near), (left, near), (left, far), (right, far))]
    low = [(x, y, LOWEST_M) for x, y, _ in high]
    faces = [high, *([low[i], low[(i + 1) % 4], high[(i + 1) % 4], high[i]] for i in range(4))]
    normals: list[Point] = []
    for a, b, c, d in ([LVector3(*corner) for corner in face] for face in faces):
        x, y, z = (c - a).cross(d - b).normalized()
        normals += [(x, y, z)] * 4
    triangles = [each for i in range(0, 20, 4) for each in ((i, i + 1, i + 2), (i, i + 2, i + 3))]
    return mesh([corner for face in faces for corner in face], normals, triangles)


def disc(radius: float, hole: float = 0.0, n: int = 24) -> NodePath:
    """A flat ring or disc on the ground."""
    turns = [math.tau * i / n for i in range(n)]
    points = [(r * math.cos(turn), r * math.sin(turn), 0.0) for r in (hole, radius) for turn in turns]
    quads = [(i, (i + 1) % n) for i in range(n)]
    triangles = [each for a, b in quads for each in ((a, n + a, n + b), (a, n + b, b))]
    return mesh(points, [(0.0, 0.0, 1.0)] * len(points), triangles)


def grid(edge: int, shade: tuple[float, float, float, float]) -> NodePath:
    """Lines on the ground, a metre apart."""
    lines = core.LineSegs()
    lines.setColor(*shade)
    for i in range(-edge, edge + 1):
        for a, b in (((i, -edge), (i, edge)), ((-edge, i), (edge, i))):
            lines.moveTo(*a, 0.004)
            lines.drawTo(*b, 0.004)
    return NodePath(lines.create())
