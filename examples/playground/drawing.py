"""What the window shows of the game: the ground, characters as capsules, paths, contacts and the ball. It changes nothing.

Colours are flat and few: warm is the player, blue the rival, white the wish, yellow the clip, green what holds.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from direct.showbase.ShowBase import ShowBase
from numpy.typing import NDArray
from panda3d.core import AmbientLight, DirectionalLight, LMatrix4, LVector3, Material, NodePath

from contextdb import motion
from examples.playground import shapes, world
from examples.playground.actor import Actor
from examples.playground.game import Game
from examples.playground.shapes import here

Floats = NDArray[np.float64]
Colour = tuple[float, float, float, float]


def colour(code: str) -> Colour:
    """A colour written as in CSS."""
    red, green, blue = (int(code[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return red, green, blue, 1.0


def mixed(one: Colour, other: Colour, share: float) -> Colour:
    """A colour with a share of another."""
    red, green, blue = (a + share * (b - a) for a, b in zip(one[:3], other[:3], strict=True))
    return red, green, blue, 1.0


SKY, FLOOR, GRID, STONE, SHADOW = (colour(code) for code in ("#20242e", "#39404f", "#4b5466", "#76809a", "#2a303c"))
PLAYER, RIVAL, WISH, CLIP, HOLDS, BALL = (
    colour(code) for code in ("#f2a65a", "#6cb4ee", "#ffffff", "#ffd84d", "#7ee08a", "#f25f5c")
)
SUN = LVector3(0.45, 0.35, -1.0)
N_DOTS, DOT_EVERY_S = 10, 0.1
HEAD = 0.6
"""By so much of the neck the head is beyond its joint."""
FLAT = world.Box((-20.0, 20.0), (-20.0, 20.0), 0.0, 0.0)
TRUNK, LEG = ("hip", "spine", "chest"), ("upleg", "thigh")


class Body:
    """A character: a capsule for each bone, its shadow, discs below feet that hold, dots along two paths."""

    def __init__(self, root: NodePath, actor: Actor, own: Colour) -> None:
        self.actor = actor
        rig = actor.stock.banks[next(iter(actor.stock.banks))]
        self.feet = [rig.skeleton.names.index(foot) for foot in rig.feet]
        self.node = root.attachNewNode(actor.name)
        self.bones = list(_bones(rig.skeleton))
        self.head = next((i for i, name in enumerate(rig.skeleton.names) if "head" in name.lower()), -1)
        self.capsules = []
        for _, joint, length, radius in self.bones:
            node = shapes.capsule(length, radius)
            is_left = rig.skeleton.names[joint].lower().startswith("left")
            self.capsules.append(_solid(self.node, node, mixed(own, SHADOW, 0.2) if is_left else own))
        self.shadow = root.attachNewNode("shadow")
        self.node.instanceTo(self.shadow)
        self.shadow.setColor(SHADOW, 1)
        self.shadow.setLightOff(1)
        self.shadow.setMaterialOff(1)
        self.contacts = [_flat(root, shapes.disc(0.16, 0.1), HOLDS) for _ in self.feet]
        self.wish = [_flat(root, shapes.disc(0.055), WISH) for _ in range(N_DOTS)]
        self.clip = [_flat(root, shapes.disc(0.055), CLIP) for _ in range(N_DOTS)]

    def show(self) -> None:
        """The pose as it is now."""
        pose, positions = self.actor.pose, self.actor.pose.positions
        for (parent, joint, length, _), node in zip(self.bones, self.capsules, strict=True):
            if length:
                node.setPos(*here(positions[parent]))
                node.lookAt(self.node, *here(positions[joint]))
            else:
                node.setPos(*here(positions[joint] + HEAD * (joint == self.head) * (positions[joint] - positions[parent])))
        height, normal = world.ground(pose.root[0], pose.root[1])
        self.shadow.setMat(_onto((pose.root[0], height + 0.012, pose.root[1]), normal))
        for joint, down, node in zip(self.feet, pose.contacts, self.contacts, strict=True):
            _put(node, positions[joint][0], positions[joint][2], bool(down))
        path = self.actor.moved.path
        _dots(self.wish, path.positions[path.now :], path.rate, 0.025)
        _dots(self.clip, self._clip_s_path(), path.rate, 0.03)

    def _clip_s_path(self) -> Floats:
        """Where the clip would lead: its own movement from here on."""
        playing, pose = self.actor.pose.playing, self.actor.pose
        if playing is None:
            return np.empty((0, 2))
        database = self.actor.stock.databases[playing.database]
        assert database.root is not None
        x, z, headings = database.root[playing.frame : min(playing.frame + 31, int(database.stops[playing.range]))].T
        way = (z - z[0] + 1j * (x - x[0])) * np.exp(1j * (pose.root[2] - headings[0]))
        return np.stack((pose.root[0] + way.imag, pose.root[1] + way.real), axis=1)


class Scene:
    """All that is drawn in three dimensions."""

    def __init__(self, base: ShowBase, game: Game) -> None:
        self.base, self.game, root = base, game, base.render
        base.setBackgroundColor(*SKY)
        base.camLens.setFov(55.0)
        base.camLens.setNearFar(0.3, 80.0)
        _light(root)
        lines = shapes.grid(int(FLAT.x[1]), GRID)
        lines.reparentTo(root)
        lines.setLightOff()
        for box in (FLAT, *world.FLOORS):
            _solid(root, shapes.block(box), FLOOR if box is FLAT else STONE).setDepthOffset(-1)
        self.wall = _solid(root, shapes.block(world.WALL), STONE)
        self.bodies = [Body(root, actor, own) for actor, own in zip(game.actors, (PLAYER, RIVAL), strict=False)]
        self.ball = _solid(root, shapes.capsule(0.0, 0.13), BALL)
        self.ring = _flat(root, shapes.disc(0.5, 0.42, 40), BALL)
        self.turn, self.tilt, self.away = 0.0, 18.0, 5.5

    def show(self) -> None:
        """The game as it is now, from behind the player."""
        for body in self.bodies:
            body.show()
        gate = self.game.gate
        may_vault = gate is not None and gate.seen is not None and bool(gate.seen.hit)
        tint = HOLDS if self.game.player.once is not None else CLIP if may_vault else STONE
        _paint(self.wall, mixed(STONE, tint, 0.4))
        self._show_ball()
        x, y, z = here(self.game.player.pose.positions[0])
        turn, tilt = math.radians(self.turn), math.radians(self.tilt)
        back = self.away * math.cos(tilt)
        self.base.camera.setPos(x + back * math.sin(turn), y - back * math.cos(turn), z + self.away * math.sin(tilt))
        self.base.camera.lookAt(x, y, z + 0.15)

    def _show_ball(self) -> None:
        ball = self.game.ball
        if ball is None:
            self.ball.hide()
            self.ring.hide()
        elif ball.holder is None:
            self.ball.setPos(*here((ball.spot[0], ball.height_m, ball.spot[1])))
            _put(self.ring, *ball.spot)
        else:
            names = self.game.player.stock.banks["moves"].skeleton.names
            self.ball.setPos(*here(ball.holder.pose.positions[names.index("RightHand")]))
            self.ring.hide()


def _light(root: NodePath) -> None:
    sun, sky = DirectionalLight("sun"), AmbientLight("sky")
    sun.setDirection(SUN)
    sun.setColor((0.8, 0.78, 0.74, 1.0))
    sky.setColor((0.42, 0.44, 0.5, 1.0))
    for light in (sun, sky):
        root.setLight(root.attachNewNode(light))


def _bones(skeleton: motion.Skeleton) -> Iterator[tuple[int, int, float, float]]:
    """From which joint to which each capsule goes, how long it is and how thick; a ball at the ends."""
    for joint, parent in enumerate(skeleton.parents.tolist()):
        name = skeleton.names[joint].lower()
        if parent > 0 or (parent == 0 and "spine" in name) or "upleg" in name:
            own = name if not parent or "arm" in name else skeleton.names[parent].lower()
            yield parent, joint, float(np.linalg.norm(skeleton.offsets[joint])), _thick(own)
        if joint not in skeleton.parents:
            yield parent, joint, 0.0, _thick(name)


def _thick(name: str) -> float:
    """The radius of a bone, in metres."""
    words = {TRUNK: 0.12, ("head",): 0.1, LEG: 0.085, ("leg",): 0.062, ("arm",): 0.055}
    return next((radius for known, radius in words.items() if any(word in name for word in known)), 0.045)


def _solid(root: NodePath, node: NodePath, own: Colour) -> NodePath:
    node.reparentTo(root)
    _paint(node, own)
    return node


def _paint(node: NodePath, own: Colour) -> None:
    material = Material()
    material.setAmbient(own)
    material.setDiffuse(own)
    node.setMaterial(material)


def _flat(root: NodePath, node: NodePath, own: Colour) -> NodePath:
    """A mark on the ground, which no light changes."""
    node.reparentTo(root)
    node.setColor(own)
    node.setLightOff()
    node.hide()
    return node


def _put(node: NodePath, x: float, z: float, is_shown: bool = True, over_m: float = 0.025) -> None:
    """Lay a mark on the ground."""
    if not is_shown:
        node.hide()
        return
    height, normal = world.ground(x, z)
    node.setPos(*here((x, height + over_m, z)))
    node.setP(math.degrees(math.atan2(-normal[2], normal[1])))
    node.show()


def _dots(nodes: list[NodePath], places: Floats, rate: float, over_m: float) -> None:
    for i, node in enumerate(nodes):
        frame = min(round((i + 1) * DOT_EVERY_S * rate), len(places))
        x, z = places[frame] if frame < len(places) else (0.0, 0.0)
        _put(node, float(x), float(z), frame < len(places), over_m)


def _onto(place: tuple[float, float, float], normal: world.Normal) -> LMatrix4:
    """What casts a shadow along the sun onto the plane at a place."""
    n, p, sun = np.array(here(normal)), np.array(here(place)), np.array(SUN)
    along = np.outer(n, sun) / (n @ sun)
    matrix = np.eye(4)
    matrix[:3, :3] -= along
    matrix[3, :3] = p @ along
    return LMatrix4(*matrix.ravel().tolist())
