"""Meshes made of numbers: capsules, boxes, discs. Nothing is loaded from a file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from panda3d import core
from panda3d.core import LVector3, NodePath

Point = tuple[float, float, float]
N_ROUND, N_CAP = 14, 5


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
    points: list[Point] = []
    normals: list[Point] = []
    rings = list(_rings())
    for along, around in rings:
        for i in range(N_ROUND + 1):
            turn = math.tau * i / N_ROUND
            normal = (around * math.cos(turn), along, around * math.sin(turn))
            normals.append(normal)
            points.append((radius * normal[0], radius * along + (length if along > 0.0 else 0.0), radius * normal[2]))
    wide = N_ROUND + 1
    quads = [(row * wide + i, row * wide + i + 1) for row in range(len(rings) - 1) for i in range(N_ROUND)]
    triangles = [each for a, b in quads for each in ((a, a + wide, b), (b, a + wide, b + wide))]
    return mesh(points, normals, triangles)


def _rings() -> Iterator[tuple[float, float]]:
    """The rings of a ball, in two halves: how far along, and how wide."""
    for end in (-1.0, 1.0):
        for i in range(N_CAP + 1):
            share = i / N_CAP if end > 0.0 else 1.0 - i / N_CAP
            angle = 0.5 * math.pi * max(share, 1e-3)
            yield end * math.sin(angle), math.cos(angle)


def prism(corners: Sequence[Point], height_of_floor: float = 0.0) -> NodePath:
    """What stands on the floor below four corners, given as Panda has them and anticlockwise seen from above."""
    points: list[Point] = []
    normals: list[Point] = []
    triangles: list[tuple[int, int, int]] = []
    low = [(x, y, height_of_floor) for x, y, _ in corners]
    sides = [(low[i], low[(i + 1) % 4], corners[(i + 1) % 4], corners[i]) for i in range(4)]
    for face in (tuple(corners), *sides):
        a, b, d = (LVector3(*face[i]) for i in (0, 1, 3))
        normal = (b - a).cross(d - a)
        if normal.lengthSquared() < 1e-12:  # a side that is a line, such as the foot of a ramp
            normal = (b - a).cross(LVector3(*face[2]) - a)
        normal.normalize()
        first = len(points)
        points += face
        normals += [tuple(normal)] * 4
        triangles += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return mesh(points, normals, triangles)


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
