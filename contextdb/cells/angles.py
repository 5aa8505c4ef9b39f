"""Angles on the circle: degrees in [-180, 180), exactly, one at a time and many at once."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


def wrap_angle(degrees: float) -> float:
    """The same angle in [-180, 180), exactly: both steps lose no bit."""
    rest = math.fmod(degrees, 360.0)
    if rest >= 180.0:
        return rest - 360.0
    return rest + 360.0 if rest < -180.0 else rest + 0.0


def wrap_angles(degrees: NDArray[np.float64]) -> NDArray[np.float64]:
    """As `wrap_angle`, of an array; NaN for what is not finite. Angles that are wrapped already come back as the same array."""
    if not ((degrees < -180.0) | (degrees >= 180.0)).any():
        return degrees
    with np.errstate(invalid="ignore"):
        rest = np.fmod(degrees, 360.0)
    return np.where(rest >= 180.0, rest - 360.0, np.where(rest < -180.0, rest + 360.0, rest + 0.0))
