"""Shapes made of triangles: tubes, balls, blocks, discs. Places are those of Panda (x to the right, y ahead, z up), in metres."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from panda3d import core
from panda3d.core import LColor, NodePath

from . import world

Floats = NDArray[np.float64]
Part = tuple[Floats, Floats]
"""Triangles [n, 3, 3] and the normals of their points."""
N_ROUND, N_CAP = 16, 5


def here(place: Sequence[float] | Floats) -> tuple[float, float, float]:
    """A place of the game (x to the left, y up, z ahead) as Panda has it (x to the right, y ahead, z up)."""
    return -float(place[0]), float(place[2]), float(place[1])


def quads(grid: Floats) -> Floats:
    """The triangles between the points of a grid, [rows, columns, 3]: [n, 3, 3]."""
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    return np.stack((a, d, b, b, d, c), axis=2).reshape(-1, 3, 3)


def tube(start: Floats, end: Floats, front: Floats, profile: Sequence[tuple[float, float, float]]) -> Part:
    """A round body from a place to another, closed at both ends: at each share of the way half its width, and half its depth
    towards `front`."""
    along = end - start
    length = float(np.linalg.norm(along)) or 1.0
    along = along / length
    depth = front - along * (front @ along)
    depth /= np.linalg.norm(depth)
    side = np.cross(depth, along)
    rings = _closed(np.array(profile), length)
    turns = np.linspace(0.0, math.tau, N_ROUND + 1)
    grid = (
        start
        + rings[:, None, :1] * length * along
        + rings[:, None, 1:2] * np.cos(turns)[None, :, None] * side
        + rings[:, None, 2:] * np.sin(turns)[None, :, None] * depth
    )
    around = np.gradient(np.concatenate((grid[:, -2:-1], grid, grid[:, 1:2]), axis=1), axis=1)[:, 1:-1]
    normals = np.cross(around, np.gradient(grid, axis=0))
    normals[0], normals[-1] = -along, along
    sizes = np.linalg.norm(normals, axis=-1, keepdims=True)
    return quads(grid[:, ::-1]), quads((normals / np.maximum(sizes, 1e-12))[:, ::-1])


def _closed(profile: Floats, length: float) -> Floats:
    """A profile with round ends: [share, width, depth], which may begin before 0 and end after 1."""
    angles = np.linspace(0.0, 0.5 * math.pi, N_CAP)
    first, last = profile[0], profile[-1]
    begin = np.stack(
        [first[0] - 0.7 * min(first[1:]) / length * np.cos(angles), *(first[i] * np.sin(angles) for i in (1, 2))], axis=1
    )
    end = np.stack([last[0] + 0.7 * min(last[1:]) / length * np.sin(angles), *(last[i] * np.cos(angles) for i in (1, 2))], axis=1)
    rings = np.concatenate((begin, profile[1:-1], end))
    rings[[0, -1], 1:] = np.maximum(rings[[0, -1], 1:], 1e-5)
    return rings


def ball(middle: Floats, wide: float, high: float, deep: float) -> Part:
    """An egg around a place of the game."""
    angles = np.linspace(-0.5 * math.pi + 0.02, 0.5 * math.pi - 0.02, 2 * N_CAP + 1)
    turns = np.linspace(0.0, math.tau, N_ROUND + 1)
    around = np.cos(angles)[:, None]
    unit = np.stack(np.broadcast_arrays(around * np.cos(turns), np.sin(angles)[:, None], -around * np.sin(turns)), axis=-1)
    size = np.array((wide, high, deep))
    normals = unit / size
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return quads((middle + unit * size)[:, ::-1]), quads(normals[:, ::-1])


def coloured(parts: Sequence[tuple[Part, LColor]]) -> NodePath:
    """A node of shapes of the game, each with its colour."""
    turn = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])  # as `here` does
    shades: dict[tuple[float, ...], list[Part]] = {}
    for part, own in parts:
        shades.setdefault(tuple(own), []).append(part)
    root = NodePath("")
    for own, same in shades.items():
        triangles, normals = (np.concatenate([part[i] for part in same]) for i in (0, 1))
        solid(root, mesh((triangles.reshape(-1, 3) @ turn).reshape(-1, 3, 3), normals @ turn), LColor(*own))
    return root


def mesh(triangles: Floats, normals: Floats | None = None, shades: Floats | None = None, places: Floats | None = None) -> NodePath:
    """A node with some triangles, which are flat where no normals are given, white where no shades are; `places` in a texture."""
    if normals is None:
        across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normals = np.repeat(across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12), 3, axis=0)
    n = triangles.size // 3
    points = np.zeros(n, [("xyz", "<f4", 3), ("normal", "<f4", 3), ("rgba", "u1", 4), ("uv", "<f4", 2)])
    points["xyz"], points["normal"] = triangles.reshape(-1, 3), normals.reshape(-1, 3)
    points["rgba"] = 255 if shades is None else np.clip(np.round(255.0 * shades), 0, 255)
    if places is not None:
        points["uv"] = places.reshape(-1, 2)
    layout = core.GeomVertexArrayFormat()
    layout.addColumn("vertex", 3, core.Geom.NTFloat32, core.Geom.CPoint)
    layout.addColumn("normal", 3, core.Geom.NTFloat32, core.Geom.CNormal)
    layout.addColumn("color", 4, core.Geom.NTUint8, core.Geom.CColor)
    layout.addColumn("texcoord", 2, core.Geom.NTFloat32, core.Geom.CTexcoord)
    data = core.GeomVertexData("", core.GeomVertexFormat.registerFormat(core.GeomVertexFormat(layout)), core.Geom.UHStatic)
    data.setNumRows(n)
    data.modifyArrayHandle(0).copyDataFrom(points.tobytes())
    primitive = core.GeomTriangles(core.Geom.UHStatic)
    primitive.addNextVertices(n)
    geom, node = core.Geom(data), core.GeomNode("")
    geom.addPrimitive(primitive)
    node.addGeom(geom)
    return NodePath(node)


def block(box: world.Box) -> NodePath:
    """A part of the ground, with its sides."""
    (left, right), (near, far) = box.x, box.z
    high = np.array([here((x, box.height(z), z)) for x, z in ((right, near), (left, near), (left, far), (right, far))])
    sides = np.stack((high, high * (1.0, 1.0, 0.0) - (0.0, 0.0, 0.5)))[:, [0, 1, 2, 3, 0]]
    triangles = np.concatenate((quads(high[[[3, 2], [0, 1]]]), quads(sides)))
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    flat = np.abs(across).argmax(axis=1)
    axes = np.array([[1, 2], [0, 2], [0, 1]])[flat]
    places = np.take_along_axis(triangles, np.repeat(axes[:, None], 3, axis=1), axis=2)
    return mesh(triangles, places=places)


def disc(radius: float, hole: float = 1e-4) -> NodePath:
    """A flat ring or disc on the ground."""
    turns = np.linspace(0.0, math.tau, 37)
    ring = np.stack((np.cos(turns), np.sin(turns), 0.0 * turns), axis=1)
    return mesh(quads(np.stack((hole * ring, radius * ring))))


def solid(root: NodePath, node: NodePath, own: LColor | None = None) -> NodePath:
    """A thing that the sun shines on, of one colour or of those of its points."""
    if own is not None:
        material = core.Material()
        material.setAmbient(own)
        material.setDiffuse(own)
        node.setMaterial(material)
    node.reparentTo(root)
    return node


def mark(root: NodePath, node: NodePath, own: LColor) -> NodePath:
    """A mark on the ground, which no light changes."""
    node.reparentTo(root)
    node.setColor(own, 1)
    node.setLightOff(1)
    node.setTextureOff(1)
    return node


def put(node: NodePath, x: float, z: float, is_shown: bool = True, over_m: float = 0.025) -> None:
    """Lay a mark on the ground, or take it away."""
    height, normal = world.ground(x, z)
    node.setPos(*here((x, height + over_m, z)))
    node.setP(math.degrees(math.atan2(-normal[2], normal[1])))
    (node.show if is_shown else node.hide)()
