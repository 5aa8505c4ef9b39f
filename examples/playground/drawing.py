"""What the window shows of the game: the ground, the figures, paths, contacts and the ball. It changes nothing.

Colours are few: orange is the player, blue the rival, white the wish, yellow the clip, green what holds. No file is read.
"""

import math

import numpy as np
from direct.showbase.ShowBase import ShowBase
from panda3d.core import LColor, NodePath

from contextdb.motion.characters.paths import path_ahead

from . import scenery
from .actor import Actor
from .game import Game
from .mannequin import Mannequin
from .meshes import ball, coloured, disc, here, mark, put, solid
from .scenery import STONE, Shadow
from .throng_drawing import ThrongView

PLAYER, RIVAL, WISH, CLIP, HOLDS, BALL = (
    LColor(*bytes.fromhex(code), 255) / 255.0 for code in ["ee7f2d", "2f6fc0", "ffffff", "ffd84d", "4fd17c", "e8413c"]
)
N_DOTS, DOT_EVERY_S = 10, 0.1
SWING_PER_S, RESTS_S = 1.1, 1.5
"""How fast the camera swings behind who walks, and for how long it stays where somebody turned it."""


class Body:
    """A character: its figure and shadow, rings below feet that hold, dots along two paths."""

    def __init__(self, root: NodePath, actor: Actor, own: LColor) -> None:
        self.actor, rig = actor, next(iter(actor.stock.banks.values()))
        names = [name.lower() for name in rig.skeleton.names]
        self.hips = names.index("hips") if "hips" in names else 0
        self.feet = [rig.skeleton.names.index(foot) for foot in rig.feet]
        self.shadow = Shadow(root, rig.skeleton)
        self.figure = Mannequin(root.attachNewNode(actor.name), rig, own)
        self.contacts = [mark(root, disc(0.16, 0.1), HOLDS) for _ in self.feet]
        self.wish, self.clip = ([mark(root, disc(0.055), own) for _ in range(N_DOTS)] for own in (WISH, CLIP))

    def show(self) -> None:
        """The pose as it is now."""
        pose, playing = self.actor.pose, self.actor.pose.playing
        assert playing is not None
        led = path_ahead(self.actor.stock.databases[playing.database], playing, pose.root, N_DOTS * DOT_EVERY_S)
        self.figure.show(pose)
        self.shadow.show(pose.positions)
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
        base.setBackgroundColor(scenery.HORIZON)
        base.camLens.setFov(55.0)
        base.camLens.setNearFar(0.3, 120.0)
        scenery.light(base)
        self.sky = scenery.sky(base)
        self.wall = scenery.ground(root)
        self.bodies = [Body(root, actor, own) for actor, own in zip(game.actors, (PLAYER, RIVAL), strict=False)]
        skeleton = next(iter(game.player.stock.banks.values())).skeleton
        self.throng = None if game.throng is None else ThrongView(root, game.throng, skeleton)
        if game.ball is not None:
            self.ball = solid(root, coloured([(ball(np.zeros(3), 0.13, 0.13, 0.13), BALL)]))
            self.ring = mark(root, disc(0.5, 0.42), BALL)
        self.turn, self.tilt, self.away, self._turned_s = 0.0, 14.0, 5.0, 0.0

    def look(self, turn: float, tilt: float = 0.0) -> None:
        """Somebody turns the camera, degrees: it stays so for a while."""
        self.turn += turn
        self.tilt = min(60.0, max(4.0, self.tilt + tilt))
        self._turned_s = RESTS_S

    def swing(self, dt: float) -> None:
        """Swing behind who walks, but for one who comes towards the camera or keeps facing ahead."""
        self._turned_s = max(0.0, self._turned_s - dt)
        stick, heading = self.game.player.stick, math.degrees(self.game.player.pose.root[2])
        off = math.remainder(heading - self.turn, 360.0)
        if stick.gait != "Idle" and not stick.strafe and self._turned_s == 0.0 and abs(off) < 120.0:
            self.turn += off * min(1.0, SWING_PER_S * dt)

    def show(self) -> None:
        """The game as it is now, from behind the player."""
        for body in self.bodies:
            body.show()
        if self.throng is not None:
            self.throng.show()
        gate, player, thing = self.game.gate, self.game.player, self.game.ball
        may_vault = gate is not None and gate.seen is not None and bool(gate.seen.hit)
        tint = HOLDS if player.playing.startswith("vault") else CLIP if may_vault else STONE
        self.wall.setColorScale(LColor(0.5) + tint * 0.5)
        if thing is not None:
            self.ball.setPos(*here(thing.place))
            put(self.ring, *thing.spot, thing.holder is None)
        x, y, z = here(player.pose.positions[self.bodies[0].hips])
        turn, tilt = math.radians(self.turn), math.radians(self.tilt)
        back = self.away * math.cos(tilt)
        self.base.camera.setPos(x + back * math.sin(turn), y - back * math.cos(turn), z + self.away * math.sin(tilt))
        self.base.camera.lookAt(x, y, z + 0.15)
        self.sky.setPos(self.base.camera.getPos(self.base.render))
