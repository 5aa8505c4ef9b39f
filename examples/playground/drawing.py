"""What the window shows of the game: the ground, characters as capsules, paths, contacts and the ball. It changes nothing.

Colours are flat and few: warm is the player, blue the rival, white the wish, yellow the clip, green what holds. No file is read.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from direct.showbase.ShowBase import ShowBase
from numpy.typing import NDArray
from panda3d import core
from panda3d.core import LColor, LMatrix4, LVector3, NodePath

from contextdb import motion
from contextdb.motion.characters.paths import path_ahead
from examples.playground import world
from examples.playground.actor import Actor
from examples.playground.game import Game

Floats = NDArray[np.float64]
SKY, FLOOR, GRID, STONE, SHADOW, PLAYER, RIVAL, WISH, CLIP, HOLDS, BALL = (
    LColor(*bytes.fromhex(code), 255) / 255.0
    for code in ["20242e", "39404f", "4b5466", "76809a", "2a303c", "f2a65a", "6cb4ee", "ffffff", "ffd84d", "7ee08a", "f25f5c"]
)
SUN = LVector3(0.45, 0.35, -1.0)
N_DOTS, DOT_EVERY_S, N_ROUND, N_CAP = 10, 0.1, 14, 5
EDGE, FLAT = 20, world.Box((-20.0, 20.0), (-20.0, 20.0), 0.0, 0.0)
THICK = {"hip": 0.12, "spine": 0.12, "chest": 0.12, "head": 0.1, "upleg": 0.085, "leg": 0.062, "arm": 0.055, "": 0.045}
HEAD = 1.6
"""Words in the names of joints and the radius of a bone in metres; how many times the neck's length away a head has its middle."""


class Body:
    """A character: a capsule for each bone, its shadow, rings below feet that hold, dots along two paths."""

    def __init__(self, root: NodePath, actor: Actor, own: LColor) -> None:
        self.actor, rig = actor, next(iter(actor.stock.banks.values()))
        names = [name.lower() for name in rig.skeleton.names]
        self.hips = names.index("hips") if "hips" in names else 0
        self.feet = [rig.skeleton.names.index(foot) for foot in rig.feet]
        node, left = root.attachNewNode(actor.name), own * 0.8 + SHADOW * 0.2
        self.bones = [
            (parent, joint, solid(node, capsule(*shape), left if names[joint].startswith("left") else own))
            for parent, joint, *shape in _bones(rig.skeleton)
        ]
        self.shadow = mark(root, root.attachNewNode("shadow"), SHADOW)
        node.instanceTo(self.shadow)
        self.contacts = [mark(root, disc(0.16, 0.1), HOLDS) for _ in self.feet]
        self.wish, self.clip = ([mark(root, disc(0.055), own) for _ in range(N_DOTS)] for own in (WISH, CLIP))

    def show(self) -> None:
        """The pose as it is now."""
        pose, playing = self.actor.pose, self.actor.pose.playing
        assert playing is not None
        led = path_ahead(self.actor.stock.databases[playing.database], playing, pose.root, N_DOTS * DOT_EVERY_S)
        for parent, joint, node in self.bones:
            node.setPos(*here(pose.positions[parent]))
            node.lookAt(node.getParent(), *here(pose.positions[joint]))
        self.shadow.setMat(_onto(*pose.root[:2]))
        for joint, down, node in zip(self.feet, pose.contacts, self.contacts, strict=True):
            put(node, pose.positions[joint][0], pose.positions[joint][2], bool(down))
        for nodes, path, over_m in ((self.wish, self.actor.moved.path, 0.025), (self.clip, led, 0.03)):
            for i, node in enumerate(nodes, 1):
                frame = path.now + round(i * DOT_EVERY_S * path.rate)
                place = path.positions[min(frame, len(path.positions) - 1)]
                put(node, place[0], place[1], frame < len(path.positions), over_m)


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
        lines = core.LineSegs()
        for i in range(-EDGE, EDGE + 1):
            for a, b in (((i, -EDGE), (i, EDGE)), ((-EDGE, i), (EDGE, i))):
                lines.moveTo(*a, 0.004)
                lines.drawTo(*b, 0.004)
        mark(root, NodePath(lines.create()), GRID)
        for box in (FLAT, *world.FLOORS):
            solid(root, block(box), FLOOR if box is FLAT else STONE).setDepthOffset(-1)
        self.wall = solid(root, block(world.WALL), STONE)
        self.bodies = [Body(root, actor, own) for actor, own in zip(game.actors, (PLAYER, RIVAL), strict=False)]
        if game.ball is not None:
            self.ball, self.ring = solid(root, capsule(0.0, 0.0, 0.13), BALL), mark(root, disc(0.5, 0.42), BALL)
        self.turn, self.tilt, self.away = 0.0, 18.0, 5.5

    def show(self) -> None:
        """The game as it is now, from behind the player."""
        for body in self.bodies:
            body.show()
        gate, player, ball = self.game.gate, self.game.player, self.game.ball
        may_vault = gate is not None and gate.seen is not None and bool(gate.seen.hit)
        tint = HOLDS if player.playing.startswith("vault") else CLIP if may_vault else STONE
        solid(self.base.render, self.wall, STONE * 0.6 + tint * 0.4)
        if ball is not None:
            self.ball.setPos(*here(ball.place))
            put(self.ring, *ball.spot, ball.holder is None)
        x, y, z = here(player.pose.positions[self.bodies[0].hips])
        turn, tilt = math.radians(self.turn), math.radians(self.tilt)
        back = self.away * math.cos(tilt)
        self.base.camera.setPos(x + back * math.sin(turn), y - back * math.cos(turn), z + self.away * math.sin(tilt))
        self.base.camera.lookAt(x, y, z + 0.15)


def _bones(skeleton: motion.Skeleton) -> Iterator[tuple[int, int, float, float, float]]:
    """From which joint towards which each capsule lies, from where to where in metres, and how thick it is; a ball for a head."""
    names, parents = [name.lower() for name in skeleton.names], skeleton.parents.tolist()
    thick = [next(radius for word, radius in THICK.items() if word in name) for name in names]
    for joint, parent in enumerate(parents):
        length = float(np.linalg.norm(skeleton.offsets[joint]))
        if parent > 0 or (parent == 0 and "spine" in names[joint]) or "upleg" in names[joint]:
            yield parent, joint, 0.0, length, thick[joint if not parent or "arm" in names[joint] else parent]
        if "head" in names[joint] and joint not in parents:
            yield parent, joint, HEAD * length, HEAD * length, thick[joint]


def solid(root: NodePath, node: NodePath, own: LColor) -> NodePath:
    """A thing that the sun shines on."""
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
    node.setMaterialOff(1)
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


def capsule(from_m: float, to_m: float, radius: float) -> NodePath:
    """A capsule along y; a ball where it ends at its beginning."""
    angles = 0.5 * math.pi * np.maximum(np.arange(N_CAP + 1) / N_CAP, 1e-3)
    wide, along = np.cos([*angles[::-1], *angles])[:, None], np.sin([*-angles[::-1], *angles])[:, None]
    turns = np.linspace(0.0, math.tau, N_ROUND + 1)
    normals = np.stack(np.broadcast_arrays(wide * np.cos(turns), along, wide * np.sin(turns)), axis=-1)
    middles = np.where(normals[..., 1:2] > 0.0, to_m, from_m) * (0.0, 1.0, 0.0)
    return mesh(quads(radius * normals + middles), quads(normals))


def block(box: world.Box) -> NodePath:
    """A part of the ground, with its sides."""
    (left, right), (near, far) = box.x, box.z
    high = np.array([here((x, box.height(z), z)) for x, z in ((right, near), (left, near), (left, far), (right, far))])
    sides = np.stack((high, high * (1.0, 1.0, 0.0) - (0.0, 0.0, 0.5)))[:, [0, 1, 2, 3, 0]]
    return mesh(np.concatenate((quads(high[[[3, 2], [0, 1]]]), quads(sides))))


def disc(radius: float, hole: float = 1e-4) -> NodePath:
    """A flat ring or disc on the ground."""
    turns = np.linspace(0.0, math.tau, 37)
    ring = np.stack((np.cos(turns), np.sin(turns), 0.0 * turns), axis=1)
    return mesh(quads(np.stack((hole * ring, radius * ring))))
