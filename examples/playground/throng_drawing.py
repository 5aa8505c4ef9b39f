"""Draws very many figures as one mesh: a block for each bone, whose points numpy places in each frame."""

import colorsys

import numpy as np
from panda3d import core
from panda3d.core import NodePath

from contextdb import motion

from .crowd import Throng
from .meshes import Floats, mesh
from .scenery import SUN, THICK

CORNERS = np.array([(u, v, end) for end in (0.0, 1.0) for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))], float)
FACES = [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7), (3, 2, 1, 0)]
TRIANGLES = np.array([corner for a, b, c, d in FACES for corner in (a, b, c, a, c, d)])
SLIM, HEAD = 0.75, 2.2
"""Of the radii by which shadows are thrown; and how much longer the last bone of a head is drawn."""


class ThrongView:
    """The mesh of a throng."""

    def __init__(self, root: NodePath, throng: Throng, skeleton: motion.Skeleton) -> None:
        self.throng = throng
        names, parents = [name.lower() for name in skeleton.names], skeleton.parents.tolist()
        pairs = [(parent, joint) for joint, parent in enumerate(parents) if parent >= 0]
        self.from_, self.to = (np.array(each) for each in zip(*pairs, strict=True))
        self.radii = SLIM * np.array([next((r for word, r in THICK.items() if word in names[joint]), 0.06) for _, joint in pairs])
        self.long = np.array([HEAD if "head" in names[joint] else 1.0 for _, joint in pairs])
        n = len(throng.crowd) * len(pairs)
        self.node = mesh(np.zeros((12 * n, 3, 3)), np.tile((0.0, 0.0, 1.0), (36 * n, 1)))
        self.node.reparentTo(root)
        self.node.setLightOff(1)
        self.node.setTextureOff(1)
        self.node.node().setBounds(core.OmniBoundingVolume())
        self.data = self.node.node().modifyGeom(0).modifyVertexData()
        self.raw = np.frombuffer(bytearray(self.data.getArray(0).getHandle().getData()), np.uint8).reshape(-1, 36).copy()
        self.shades = np.array([colorsys.hsv_to_rgb((0.07 + 0.381966 * row) % 1.0, 0.62, 0.95) for row in range(256)])
        self._displayed: Floats | None = None

    def show(self) -> None:
        """The poses as they are now."""
        positions = self.throng.positions
        if positions is self._displayed:
            return
        self._displayed = positions
        places = np.stack((-positions[..., 0], positions[..., 2], positions[..., 1]), axis=-1)
        a, b = places[:, self.from_], places[:, self.to]
        along = (b - a) * self.long[None, :, None]
        side = np.cross(along, (0.15, 1.0, 0.1))
        side /= np.maximum(np.linalg.norm(side, axis=-1, keepdims=True), 1e-9)
        deep = np.cross(side, along)
        deep /= np.maximum(np.linalg.norm(deep, axis=-1, keepdims=True), 1e-9)
        u, v, end = (CORNERS[:, i, None] for i in range(3))
        out = u * side[..., None, :] + v * deep[..., None, :]
        corners = a[..., None, :] + end * along[..., None, :] + self.radii[None, :, None, None] * 0.75 * out
        light = 0.62 + 0.38 * np.clip(out @ np.array((-SUN[0], -SUN[1], -SUN[2])) / 1.8, -0.6, 1.0)
        shades = light[..., None] * self.shades[self.throng.rows % 256][:, None, None]
        self.raw[:, :12] = corners[:, :, TRIANGLES].reshape(-1, 3).astype("<f4").view(np.uint8)
        self.raw[:, 24:27] = np.clip(255.0 * shades[:, :, TRIANGLES], 0.0, 255.0).astype(np.uint8).reshape(-1, 3)
        self.data.modifyArrayHandle(0).copyDataFrom(self.raw.tobytes())
