"""The operators and functions over arrays of doubles; the core's, `arithmetic.h`, give the same last bit for one.

NaN is a missing number. What is not finite counts as missing, so every result is finite or NaN, and never -0.0; `settled` sees to
both. Every step is an operation that IEEE 754 rounds one way (+ - * / sqrt) or that is exact (fmod, floor, rint, comparison), in
the same order for one and for many. numpy divides with remainder by the steps that Python takes.

A library's arctangent may differ between one number and many, and from machine to machine. So a direction is sums and products in
one fixed order, which IEEE 754 rounds the same everywhere; it errs by less than 3 units in the last place, and by nothing at
eighths of a turn.

Source: the coefficients of fdlibm (Sun Microsystems, 1993: s_atan.c).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.intervals import wrap_angles

Doubles = NDArray[np.float64]

SCALE_UP, SCALE_DOWN = 2.0**600, 2.0**-600
_FAR, _NEAR = 1e150, 1e-150
_DEGREES = 57.29577951308232
_EIGHTH_TURN = 0.41421356237309503
"""The tangent of 22.5 degrees."""


def settled(value: Doubles) -> Doubles:
    """The values where they are finite, NaN elsewhere; -0.0 as 0.0."""
    return value + (value - value)


def powered(exponent: int) -> Callable[[Doubles], Doubles]:
    """A function that multiplies numbers with themselves so many times: x ** exponent."""

    def power(base: Doubles) -> Doubles:
        result = base - base + 1.0
        rest, factor = exponent, base
        while rest:
            result = result * factor if rest & 1 else result
            rest >>= 1
            factor = factor * factor if rest else factor
        return result

    return power


def lowest(*values: Doubles) -> Doubles:
    """The least of some columns, context by context; NaN where one is."""
    return reduce(np.minimum, values)


def highest(*values: Doubles) -> Doubles:
    """The greatest of some columns, context by context; NaN where one is."""
    return reduce(np.maximum, values)


def clamped(value: Doubles, low: Doubles, high: Doubles) -> Doubles:
    """The values, raised to `low` and then lowered to `high`."""
    return np.minimum(np.maximum(value, low), high)


def lengths(x: Doubles, y: Doubles) -> Doubles:
    """The lengths of vectors; scaled by a power of two where squares would overflow or vanish."""
    most = np.maximum(np.abs(x), np.abs(y))
    scale = np.where(most > _FAR, SCALE_DOWN, np.where(most < _NEAR, SCALE_UP, 1.0))
    a, b = x * scale, y * scale
    return np.sqrt(a * a + b * b) / scale


def headings(y: Doubles, x: Doubles) -> Doubles:
    """The directions of vectors (x, y), in [-180, 180)."""
    return wrap_angles(directions(y, x))


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


def _arc(x: Doubles) -> Doubles:
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
