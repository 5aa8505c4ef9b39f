"""What the window shows of the game: the ground, characters as capsules, paths, contacts and the ball. It changes nothing.

Colours are flat and few: warm is the player, blue the rival, white the wish, yellow the clip, green what holds. All meshes are made
of numbers; nothing is loaded from a file.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from direct.showbase.ShowBase import ShowBase
from numpy.typing import NDArray
from panda3d import core
from panda3d.core import LColor, LMatrix4, LVector3, NodePath

from contextdb import motion
from examples.playground import world
from examples.playground.actor import Actor
from examples.playground.game import Game

Floats = NDArray[np.float64]
SKY, FLOOR, GRID, STONE, SHADOW, PLAYER, RIVAL, WISH, CLIP, HOLDS, BALL = (
    LColor(*bytes.fromhex(code), 255) / 255.0
    for code in ["20242e", "39404f", "4b5466", "76809a", "2a303c", "f2a65a", "6cb4ee", "ffffff", "ffd84d", "7ee08a", "f25f5c"]
)
SUN = LVector3(0.45, 0.35, -1.0)
N_DOTS, DOT_EVERY_S = 10, 0.1
N_ROUND, N_CAP = 14, 5
HEAD = 0.6
"""By so much of the neck the head is beyond its joint."""
FLAT = world.Box((-20.0, 20.0), (-20.0, 20.0), 0.0, 0.0)
THICK = {"hip": 0.12, "spine": 0.12, "chest": 0.12, "head": 0.1, "upleg": 0.085, "leg": 0.062, "arm": 0.055, "": 0.045}
"""Words in the names of joints, and the radius of a bone, in metres."""


class Body:
    """A character: a capsule for each bone, its shadow, rings below feet that hold, dots along two paths."""

    def __init__(self, root: NodePath, actor: Actor, own: LColor) -> None:
        self.actor = actor
        rig = next(iter(actor.stock.banks.values()))
        names = rig.skeleton.names
        self.feet = [names.index(foot) for foot in rig.feet]
        self.node = root.attachNewNode(actor.name)
        self.bones = list(_bones(rig.skeleton))
        self.head = next((i for i, name in enumerate(names) if "head" in name.lower()), -1)
        darker = own * 0.8 + SHADOW * 0.2
        self.capsules = [
            solid(self.node, capsule(length, radius), darker if names[joint].lower().startswith("left") else own)
            for _, joint, length, radius in self.bones
        ]
        self.shadow = _flat(root, root.attachNewNode("shadow"), SHADOW)
        self.node.instanceTo(self.shadow)
        self.contacts = [_flat(root, disc(0.16, 0.1), HOLDS) for _ in self.feet]
        self.wish, self.clip = ([_flat(root, disc(0.055), own) for _ in range(N_DOTS)] for own in (WISH, CLIP))

    def show(self) -> None:
        """The pose as it is now."""
        pose, positions, path = self.actor.pose, self.actor.pose.positions, self.actor.moved.path
        for (parent, joint, length, _), node in zip(self.bones, self.capsules, strict=True):
            if length:
                node.setPos(*here(positions[parent]))
                node.lookAt(self.node, *here(positions[joint]))
            else:
                node.setPos(*here(positions[joint] + HEAD * (joint == self.head) * (positions[joint] - positions[parent])))
        self.shadow.setMat(_onto(*pose.root[:2]))
        self.shadow.show()
        for joint, down, node in zip(self.feet, pose.contacts, self.contacts, strict=True):
            put(node, positions[joint][0], positions[joint][2], bool(down))
        for nodes, places, over_m in ((self.wish, path.positions[path.now :], 0.025), (self.clip, self._clip_s_path(), 0.03)):
            for i, node in enumerate(nodes):
                frame = min(round((i + 1) * DOT_EVERY_S * path.rate), len(places))
                x, z = places[frame] if frame < len(places) else (0.0, 0.0)
                put(node, x, z, frame < len(places), over_m)

    def _clip_s_path(self) -> Floats:
        """Where the clip would lead: its own movement from here on."""
        playing, pose = self.actor.pose.playing, self.actor.pose
        assert playing is not None
        database = self.actor.stock.databases[playing.database]
        assert database.root is not None
        x, z, headings = database.root[playing.frame : min(playing.frame + 31, int(database.stops[playing.range]))].T
        way = (z - z[0] + 1j * (x - x[0])) * np.exp(1j * (pose.root[2] - headings[0]))
        return np.stack((pose.root[0] + way.imag, pose.root[1] + way.real), axis=1)


class Scene:
    """All that is drawn in three dimensions."""

    def __init__(self, base: ShowBase, game: Game) -> None:
        self.base, self.game, root = base, game, base.render
        base.setBackgroundColor(SKY)
        base.camLens.setFov(55.0)
        base.camLens.setNearFar(0.3, 80.0)
        sun, sky = core.DirectionalLight("sun"), core.AmbientLight("sky")
        sun.setDirection(SUN)
        for light, own in ((sun, (0.8, 0.78, 0.74, 1.0)), (sky, (0.42, 0.44, 0.5, 1.0))):
            light.setColor(own)
            root.setLight(root.attachNewNode(light))
        _flat(root, grid(int(FLAT.x[1])), GRID).show()
        for box in (FLAT, *world.FLOORS):
            solid(root, block(box), FLOOR if box is FLAT else STONE).setDepthOffset(-1)
        self.wall = solid(root, block(world.WALL), STONE)
        self.bodies = [Body(root, actor, own) for actor, own in zip(game.actors, (PLAYER, RIVAL), strict=False)]
        self.ball = solid(root, capsule(0.0, 0.13), BALL)
        self.ring = _flat(root, disc(0.5, 0.42), BALL)
        self.turn, self.tilt, self.away = 0.0, 18.0, 5.5

    def show(self) -> None:
        """The game as it is now, from behind the player."""
        for body in self.bodies:
            body.show()
        gate, player = self.game.gate, self.game.player
        may_vault = gate is not None and gate.seen is not None and bool(gate.seen.hit)
        paint(self.wall, STONE * 0.6 + (HOLDS if player.playing.startswith("vault") else CLIP if may_vault else STONE) * 0.4)
        self._show_ball()
        x, y, z = here(player.pose.positions[0])
        turn, tilt = math.radians(self.turn), math.radians(self.tilt)
        back = self.away * math.cos(tilt)
        self.base.camera.setPos(x + back * math.sin(turn), y - back * math.cos(turn), z + self.away * math.sin(tilt))
        self.base.camera.lookAt(x, y, z + 0.15)

    def _show_ball(self) -> None:
        """Over its place, or on its way to a hand, or in it."""
        ball = self.game.ball
        if ball is None:
            self.ball.hide()
            return
        place = np.array((ball.spot[0], ball.height_m, ball.spot[1]))
        if ball.holder is not None:
            hand = ball.holder.pose.positions[ball.holder.stock.banks["moves"].skeleton.names.index("RightHand")]
            place += min(1.0, ball.since_s / max(ball.caught_s, 1e-6)) * (hand - place)
        self.ball.setPos(*here(place))
        put(self.ring, *ball.spot, ball.holder is None)


def _bones(skeleton: motion.Skeleton) -> Iterator[tuple[int, int, float, float]]:
    """From which joint to which each capsule goes, how long it is and how thick; a ball at the ends."""
    for joint, parent in enumerate(skeleton.parents.tolist()):
        name = skeleton.names[joint].lower()
        if parent > 0 or (parent == 0 and "spine" in name) or "upleg" in name:
            own = name if not parent or "arm" in name else skeleton.names[parent].lower()
            yield parent, joint, float(np.linalg.norm(skeleton.offsets[joint])), next(r for word, r in THICK.items() if word in own)
        if joint not in skeleton.parents:
            yield parent, joint, 0.0, next(r for word, r in THICK.items() if word in name)


def solid(root: NodePath, node: NodePath, own: LColor) -> NodePath:
    """A thing that the sun shines on."""
    node.reparentTo(root)
    paint(node, own)
    return node


def paint(node: NodePath, own: LColor) -> None:
    """Give a thing a colour."""
    material = core.Material()
    material.setAmbient(own)
    material.setDiffuse(own)
    node.setMaterial(material)


def _flat(root: NodePath, node: NodePath, own: LColor) -> NodePath:
    """A mark on the ground, which no light changes."""
    node.reparentTo(root)
    node.setColor(own, 1)
    node.setLightOff(1)
    node.setMaterialOff(1)
    node.hide()
    return node


def put(node: NodePath, x: float, z: float, is_shown: bool = True, over_m: float = 0.025) -> None:
    """Lay a mark on the ground, or take it away."""
    height, normal = world.ground(x, z)
    node.setPos(*here((x, height + over_m, z)))
    node.setP(math.degrees(math.atan2(-normal[2], normal[1])))
    (node.show if is_shown else node.hide)()


def _onto(x: float, z: float) -> LMatrix4:
    """What casts a shadow along the sun onto the ground at a place."""
    height, normal = world.ground(x, z)
    n, p, sun = np.array(here(normal)), np.array(here((x, height + 0.012, z))), np.array(SUN)
    along = np.outer(n, sun) / (n @ sun)
    matrix = np.eye(4)
    matrix[:3, :3] -= along
    matrix[3, :3] = p @ along
    return LMatrix4(*matrix.ravel().tolist())


def here(place: Sequence[float] | Floats) -> tuple[float, float, float]:
    """A place of the game (x to the left, y up, z ahead) as Panda has it (x to the right, y ahead, z up)."""
    return -float(place[0]), float(place[2]), float(place[1])


def quads(grid: Floats) -> Floats:
    """The triangles between the points of a grid, [rows, columns, 3]: [n, 3, 3]."""
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    return np.stack((a, d, b, b, d, c), axis=2).reshape(-1, 3, 3)


def mesh(triangles: Floats, normals: Floats | None = None) -> NodePath:
    """A node with some triangles, which are flat where no normals are given."""
    if normals is None:
        across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normals = np.repeat(across / np.linalg.norm(across, axis=1, keepdims=True), 3, axis=0)
    points = np.concatenate((triangles.reshape(-1, 3), normals.reshape(-1, 3)), axis=1)
    data = core.GeomVertexData("", core.GeomVertexFormat.getV3n3(), core.Geom.UHStatic)
    data.setNumRows(len(points))
    data.modifyArrayHandle(0).copyDataFrom(points.astype(np.float32).tobytes())
    primitive = core.GeomTriangles(core.Geom.UHStatic)
    primitive.addNextVertices(len(points))
    geom, node = core.Geom(data), core.GeomNode("")
    geom.addPrimitive(primitive)
    node.addGeom(geom)
    return NodePath(node)


def capsule(length: float, radius: float) -> NodePath:
    """A capsule along y, from 0 to its length; a ball where that is 0."""
    angles = 0.5 * math.pi * np.maximum(np.arange(N_CAP + 1) / N_CAP, 1e-3)
    wide, along = np.cos([*angles[::-1], *angles])[:, None], np.sin([*-angles[::-1], *angles])[:, None]
    turns = np.linspace(0.0, math.tau, N_ROUND + 1)
    normals = np.stack(np.broadcast_arrays(wide * np.cos(turns), along, wide * np.sin(turns)), axis=-1)
    return mesh(quads(radius * normals + (normals[..., 1:2] > 0.0) * np.array((0.0, length, 0.0))), quads(normals))


def block(box: world.Box) -> NodePath:
    """A part of the ground, with its sides."""
    (left, right), (near, far) = box.x, box.z
    high = np.array([here((x, box.height(z), z)) for x, z in ((right, near), (left, near), (left, far), (right, far))])
    sides = np.stack((high, high * (1.0, 1.0, 0.0) - (0.0, 0.0, 0.5)))[:, [0, 1, 2, 3, 0]]
    return mesh(np.concatenate((quads(high[[[3, 2], [0, 1]]]), quads(sides))))


def disc(radius: float, hole: float = 0.0) -> NodePath:
    """A flat ring or disc on the ground."""
    turns = np.linspace(0.0, math.tau, 37)
    ring = np.stack((np.cos(turns), np.sin(turns), 0.0 * turns), axis=1)
    triangles = quads(np.stack((max(hole, 1e-4) * ring, radius * ring)))
    return mesh(triangles, np.tile((0.0, 0.0, 1.0), (triangles.size // 3, 1)))


def grid(edge: int) -> NodePath:
    """Lines on the ground, a metre apart."""
    lines = core.LineSegs()
    for i in range(-edge, edge + 1):
        for a, b in (((i, -edge), (i, edge)), ((-edge, i), (edge, i))):
            lines.moveTo(*a, 0.004)
            lines.drawTo(*b, 0.004)
    return NodePath(lines.create())
