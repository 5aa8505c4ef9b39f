"""From metres about a body to dots of a canvas: a view from the side that can be turned, tilted and brought nearer.

Points are in the body's own frame: left, up, ahead. The view has no perspective, so that lengths can be compared.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from contextdb.motion.clips.quaternions import Floats

LEAST_ZOOM, MOST_ZOOM = 0.2, 8.0
MOST_PITCH = math.radians(89.0)
SHOWN_HIGH_M, SHOWN_WIDE_M = 2.1, 2.6
"""So much fits at zoom 1."""
GROUND_SHARE = 0.84
"""How far down on the canvas the body stands."""


@dataclass(frozen=True)
class Camera:
    """Where one looks from: turned about the body and tilted, in radians, and how near."""

    yaw: float = math.radians(65.0)
    pitch: float = math.radians(18.0)
    zoom: float = 1.0

    def turned(self, yaw: float, pitch: float) -> Camera:
        """The same from another side."""
        return replace(self, yaw=(self.yaw + yaw) % math.tau, pitch=min(max(self.pitch + pitch, 0.0), MOST_PITCH))

    def zoomed(self, by: float) -> Camera:
        """The same from nearer, or farther away."""
        return replace(self, zoom=min(max(self.zoom * by, LEAST_ZOOM), MOST_ZOOM))

    def dots(self, points: Floats, columns: int, rows: int) -> Floats:
        """Where points [n, 3] are on a canvas of so many dots: [n, 2]."""
        per_m = self.zoom * min(rows / SHOWN_HIGH_M, columns / SHOWN_WIDE_M)
        left, up, ahead = points[:, 0], points[:, 1], points[:, 2]
        sin, cos = math.sin(self.yaw), math.cos(self.yaw)
        across, depth = sin * ahead - cos * left, sin * left + cos * ahead
        x = 0.5 * columns + per_m * across
        y = GROUND_SHARE * rows - per_m * (math.cos(self.pitch) * up + math.sin(self.pitch) * depth)
        return np.stack((x, y), axis=1)
