"""Lines as braille dots: a canvas of 2 x 4 dots a cell, each in a layer; a cell has the colour of its highest layer.

H x W cells. Dots count from the upper left corner, x to the right and y down; a dot is about as wide as it is high. Nothing here
knows of colours or of the terminal.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats

WIDE, HIGH = 2, 4
_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], np.int64)
BLANK = 0x2800
MOST_DOTS = 4
"""Of a line that leaves the canvas so many times its size is drawn at most."""


class Canvas:
    """Dots in layers; a higher layer hides a lower one."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = max(0, width), max(0, height)
        self.layers: NDArray[np.uint8] = np.zeros((HIGH * self.height, WIDE * self.width), np.uint8)

    def dots(self, points: Floats, layer: int) -> None:
        """Set dots [n, 2]; those outside, and those that are no numbers, are not seen."""
        rows, columns = self.layers.shape
        is_seen = np.isfinite(points).all(axis=1)
        at = np.floor(np.clip(points[is_seen], -1.0, 1e6)).astype(np.int64)
        x, y = at[:, 0], at[:, 1]
        is_inside = (x >= 0) & (y >= 0) & (x < columns) & (y < rows)
        x, y = x[is_inside], y[is_inside]
        self.layers[y, x] = np.maximum(self.layers[y, x], layer)

    def lines(self, starts: Floats, stops: Floats, layer: int, *, is_thick: bool = False) -> None:
        """Draw straight lines from points [n, 2] to points [n, 2]."""
        if not len(starts) or not self.layers.size:
            return
        is_known = np.isfinite(starts).all(axis=1) & np.isfinite(stops).all(axis=1)
        starts, stops = starts[is_known], stops[is_known]
        most = MOST_DOTS * max(self.layers.shape)
        n = np.minimum(np.ceil(np.abs(stops - starts).max(axis=1, initial=0.0)), most).astype(np.int64) + 1
        which = np.repeat(np.arange(len(n)), n)
        shares = (np.arange(len(which)) - np.repeat(np.cumsum(n) - n, n)) / np.maximum(n - 1, 1)[which]
        points = starts[which] + shares[:, None] * (stops - starts)[which]
        self.dots(points, layer)
        if is_thick:
            self.dots(points + np.array([1.0, 0.0]), layer)

    def path(self, points: Floats, layer: int, *, is_thick: bool = False) -> None:
        """Draw a line through points [n, 2]."""
        self.lines(points[:-1], points[1:], layer, is_thick=is_thick)

    def cells(self) -> tuple[list[str], NDArray[np.uint8]]:
        """The canvas as lines of braille, and the layer of each cell [H, W]; a cell without dots is a blank in layer 0."""
        cut = self.layers.reshape(self.height, HIGH, self.width, WIDE)
        codes = ((cut > 0) * _BITS[None, :, None, :]).sum(axis=(1, 3))
        layers = cut.max(axis=(1, 3)) if cut.size else np.zeros((self.height, self.width), np.uint8)
        return ["".join(chr(BLANK + code) if code else " " for code in row) for row in codes.tolist()], layers
