"""The direction of a vector, in degrees, for a double and for an array of doubles with the same last bit.

A library's arctangent may differ between one number and many, and from machine to machine. So this is sums and products in one
fixed order, which IEEE 754 rounds the same everywhere; it errs by less than 3 units in the last place, and by nothing at eighths
of a turn.

Source: the coefficients of fdlibm (Sun Microsystems, 1993: s_atan.c).
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Value = TypeVar("Value", float, Doubles)

_DEGREES = 57.29577951308232
_EIGHTH_TURN = 0.41421356237309503
"""The tangent of 22.5 degrees."""


def direction(y: float, x: float) -> float:
    """The angle from the x axis to the vector (x, y), in [-180, 180]; 0 for the vector without length."""
    wide, high = abs(x), abs(y)
    most, least = (high, wide) if high > wide else (wide, high)
    if not most > 0.0:
        return most + least  # 0, or NaN where one of them is
    angle = _slope(least / most)
    angle = 90.0 - angle if high > wide else angle
    angle = 180.0 - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


def directions(y: Doubles, x: Doubles) -> Doubles:
    """Angles in degrees from the x axis: float64 [N]; the same bits on every machine."""
    wide, high = np.abs(x), np.abs(y)
    is_steep = high > wide
    most, least = np.where(is_steep, high, wide), np.where(is_steep, wide, high)
    ratio = least / most
    is_over = ratio > _EIGHTH_TURN
    angle = np.where(is_over, 45.0 + _arc((ratio - 1.0) / (ratio + 1.0)), _arc(ratio))
    angle = np.where(is_steep, 90.0 - angle, angle)
    angle = np.where(x < 0.0, 180.0 - angle, angle)
    angle = np.where(y < 0.0, -angle, angle)
    return np.where(most > 0.0, angle, most + least)


def _slope(ratio: float) -> float:
    """The angle, in degrees, whose tangent is in [0, 1]."""
    return 45.0 + _arc((ratio - 1.0) / (ratio + 1.0)) if ratio > _EIGHTH_TURN else _arc(ratio)


def _arc(x: Value) -> Value:
    """The angle, in degrees, whose tangent is x, in [-0.4143, 0.4143]."""
    z = x * x
    w = z * z
    even = 4.97687799461593236017e-02 + w * 1.62858201153657823623e-02
    even = 9.09088713343650656196e-02 + w * (6.66107313738753120669e-02 + w * even)
    even = z * (3.33333333333329318027e-01 + w * (1.42857142725034663711e-01 + w * even))
    odd = -5.83357013379057348645e-02 + w * -3.65315727442169155270e-02
    odd = -1.11111104054623557880e-01 + w * (-7.69187620504482999495e-02 + w * odd)
    odd = w * (-1.99999999998764832476e-01 + w * odd)
    return (x - x * (even + odd)) * _DEGREES
