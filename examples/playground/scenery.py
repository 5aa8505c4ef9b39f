"""What stands round the figures: a sky with hills, a ground whose squares move below the feet, and the soft shadow of a figure."""

import math

import numpy as np
from direct.showbase.ShowBase import ShowBase
from panda3d import core
from panda3d.core import LColor, LVector3, NodePath

from contextdb import motion

from . import world
from .meshes import Floats, block, mesh, quads, solid

ZENITH, HORIZON, HILLS, STONE, SHADOW = (
    LColor(*bytes.fromhex(code), 255) / 255.0 for code in ["3f7fc4", "c3dbea", "7f9bb0", "aab3bd", "10201c"]
)
SUN = LVector3(0.45, 0.35, -1.0)
EDGE_M = 60.0
TILE_M, PIXELS = 4.0, 256
ROUGH = 1.0
"""How wide one picture of the ground is, of how many pixels, and how speckled."""
THICK = {
    "hip": 0.15,
    "spine": 0.15,
    "chest": 0.17,
    "neck": 0.09,
    "head": 0.12,
    "upleg": 0.09,
    "leg": 0.07,
    "foot": 0.07,
    "arm": 0.06,
}
SOFT, DARK = 1.9, 0.42
"""How much wider a shadow is than what casts it, and how dark in its middle."""


def sky(base: ShowBase) -> NodePath:
    """A dome that stays round the camera, with hills at its foot."""
    angles, turns = np.linspace(-0.08, 0.5 * math.pi, 13), np.linspace(0.0, math.tau, 73)
    around = np.cos(angles)[:, None]
    grid = 60.0 * np.stack(np.broadcast_arrays(around * np.cos(turns), around * np.sin(turns), np.sin(angles)[:, None]), axis=-1)
    share = np.clip(np.sin(np.broadcast_to(angles[:, None], grid.shape[:2])) * 1.6, 0.0, 1.0)[..., None] ** 0.6
    shades = np.array(HORIZON) * (1.0 - share) + np.array(ZENITH) * share
    dome = mesh(quads(grid), shades=_corners(shades))
    heights = 2.2 + 1.3 * np.sin(3 * turns) + 0.8 * np.sin(7 * turns + 1.0) + 0.5 * np.sin(17 * turns + 2.0)
    ring = 57.0 * np.stack((np.cos(turns), np.sin(turns), 0.0 * turns), axis=-1)
    hills = mesh(quads(np.stack((ring - (0.0, 0.0, 3.0), ring + np.stack((0.0 * turns, 0.0 * turns, heights), axis=-1)))))
    hills.setColor(HILLS)
    hills.reparentTo(dome)
    dome.reparentTo(base.render)
    dome.setEffect(core.CompassEffect.make(base.render))
    for each, order in ((dome, 0), (hills, 1)):
        each.setBin("background", order)
    dome.setDepthWrite(False)
    dome.setDepthTest(False)
    dome.setTwoSided(True)
    dome.setLightOff(1)
    dome.setFogOff(1)
    dome.setTextureOff(1)
    return dome


def _corners(grid: Floats) -> Floats:
    """A value of each point of a grid, for the corners of its triangles."""
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    return np.stack((a, d, b, b, d, c), axis=2).reshape(-1, grid.shape[-1])


def light(base: ShowBase) -> None:
    """The sun from behind the left, the sky from all sides, and haze far away."""
    sun, around = core.DirectionalLight("sun"), core.AmbientLight("sky")
    sun.setDirection(SUN)
    for each, own in ((sun, (0.78, 0.75, 0.68, 1.0)), (around, (0.46, 0.49, 0.56, 1.0))):
        each.setColor(own)
        base.render.setLight(base.render.attachNewNode(each))
    haze = core.Fog("haze")
    haze.setColor(HORIZON)
    haze.setLinearRange(14.0, 58.0)
    base.render.setFog(haze)
    base.render.setAntialias(core.AntialiasAttrib.MAuto)


def ground(root: NodePath) -> NodePath:
    """The ground, the ramp and the steps; the wall is given back."""
    floor = solid(root, plain())
    floor.setTexture(texture(squares(np.array((0.36, 0.52, 0.40)), 0.025)))
    floor.setTexScale(core.TextureStage.getDefault(), 1.0 / TILE_M, 1.0 / TILE_M)
    stone = texture(squares(np.array((0.80, 0.79, 0.77)), 0.02, line=0.1))
    wall = solid(root, block(world.WALL))
    for each in (*(solid(root, block(box)) for box in world.FLOORS), wall):
        each.setTexture(stone)
        each.setTexScale(core.TextureStage.getDefault(), 1.0 / TILE_M, 1.0 / TILE_M)
        each.setDepthOffset(1)
    return wall


def plain() -> NodePath:
    """A flat ground up to the haze, in pieces: a large triangle has a bent texture in software."""
    at = np.arange(-EDGE_M, EDGE_M + 0.1, TILE_M)
    grid = np.stack((*np.meshgrid(at, at), np.zeros((len(at), len(at)))), axis=-1)
    return mesh(quads(grid[::-1]), places=quads(grid[::-1])[..., :2])


def squares(own: Floats, rough: float, line: float = 0.3, seed: int = 1) -> Floats:
    """A picture of the ground, [pixels, pixels, 3]: squares of a metre in two shades, speckled, with light lines between four."""
    rng = np.random.default_rng(seed)
    at = np.arange(PIXELS) * TILE_M / PIXELS
    check = (np.floor(at)[:, None] + np.floor(at)) % 2.0
    speckle = rng.normal(0.0, ROUGH * rough, (PIXELS, PIXELS))
    blotch = rng.normal(0.0, ROUGH * rough, (16, 16)).repeat(PIXELS // 16, 0).repeat(PIXELS // 16, 1)
    shade = 1.0 + 0.11 * (check - 0.5) + speckle + 0.3 * blotch
    edge = np.minimum(at, TILE_M - at) < 0.035
    shade = np.where(edge[:, None] | edge, shade + line, shade)
    return np.clip(own * shade[..., None], 0.0, 1.0)


def texture(picture: Floats) -> core.Texture:
    """A texture that repeats and stays calm far away."""
    n = len(picture)
    made = core.Texture()
    depth = picture.shape[2]
    made.setup2dTexture(n, n, core.Texture.TUnsignedByte, core.Texture.FRgba if depth == 4 else core.Texture.FRgb)
    order = [2, 1, 0, 3][:depth]
    made.setRamImage(np.round(255.0 * picture[..., order]).astype(np.uint8).tobytes())
    made.setMinfilter(core.SamplerState.FTLinearMipmapLinear)
    made.setMagfilter(core.SamplerState.FTLinear)
    made.setAnisotropicDegree(8)
    return made


class Shadow:
    """The soft shadow of a figure: a dim spot for each bone, stretched along it where the sun throws it."""

    def __init__(self, root: NodePath, skeleton: motion.Skeleton) -> None:
        names = [name.lower() for name in skeleton.names]
        pairs = [(parent, joint) for joint, parent in enumerate(skeleton.parents.tolist()) if parent >= 0]
        self.from_, self.to = (np.array(each) for each in zip(*pairs, strict=True))
        self.radii = np.array([next((thick for word, thick in THICK.items() if word in names[joint]), 0.06) for _, joint in pairs])
        corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        self.corners = 2.0 * corner - 1.0
        places = np.tile(corner, (len(pairs), 1))
        self.node = mesh(np.zeros((2 * len(pairs), 3, 3)), np.tile((0.0, 0.0, 1.0), (6 * len(pairs), 1)), places=places)
        self.node.reparentTo(root)
        self.node.setColor(SHADOW, 1)
        self.node.setLightOff(1)
        self.node.setTexture(texture(_spot()), 1)
        self.node.setTransparency(core.TransparencyAttrib.MAlpha)
        self.node.setDepthWrite(False)
        self.node.setTwoSided(True)
        self.node.setBin("transparent", 0)
        self.node.node().setBounds(core.OmniBoundingVolume())
        self.data = self.node.node().modifyGeom(0).modifyVertexData()

    def show(self, positions: Floats) -> None:
        """The shadow of a pose."""
        sun = np.array((-SUN[0], SUN[2], SUN[1]))  # as the game has it: x to the left, y up, z ahead
        floor, normal = world.ground(float(positions[0, 0]), float(positions[0, 2]))
        point, up = np.array((positions[0, 0], floor, positions[0, 2])), np.array(normal)
        fallen = positions - ((positions - point) @ up / (sun @ up))[:, None] * sun
        a, b = fallen[self.from_], fallen[self.to]
        along = b - a
        long = np.linalg.norm(along, axis=1, keepdims=True)
        along = np.where(long > 1e-6, along / np.maximum(long, 1e-6), np.array((0.0, 0.0, 1.0)))
        across = np.cross(along, up)
        wide = SOFT * self.radii[:, None]
        half = along * (0.5 * long + wide), across * wide
        u, v = self.corners[None, :, :1], self.corners[None, :, 1:]
        points = (0.5 * (a + b))[:, None] + u * half[0][:, None] + v * half[1][:, None] + 0.016 * up
        raw = np.frombuffer(bytearray(self.data.getArray(0).getHandle().getData()), np.uint8).reshape(-1, 36).copy()
        raw[:, :12] = (
            np.stack([-points[..., 0], points[..., 2], points[..., 1]], axis=-1).reshape(-1, 3).astype("<f4").view(np.uint8)
        )
        self.data.modifyArrayHandle(0).copyDataFrom(raw.tobytes())


def _spot(n: int = 64) -> Floats:
    """A white spot that fades out to its edge, with its opacity."""
    at = (np.arange(n) + 0.5) / n * 2.0 - 1.0
    far = np.clip(np.hypot(at[:, None], at), 0.0, 1.0)
    fade = DARK * (0.5 + 0.5 * np.cos(math.pi * far)) ** 1.3
    return np.concatenate((np.ones((n, n, 3)), fade[..., None]), axis=2)
