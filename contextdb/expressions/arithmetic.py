"""The operators and functions, each for a double and for an array of doubles with the same last bit.

NaN is a missing number. What is not finite counts as missing, so every result is finite or NaN, and never -0.0; `settled` sees to
both. Every step is an operation that IEEE 754 rounds one way (+ - * / sqrt) or that is exact (fmod, floor, rint, comparison), in
the same order for one and for many. numpy divides with remainder by the steps that Python takes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from contextdb.cells.intervals import wrap_angle, wrap_angles
from contextdb.expressions import trigonometry
from contextdb.expressions.trigonometry import Doubles, Value

SCALE_UP, SCALE_DOWN = 2.0**600, 2.0**-600
_FAR, _NEAR = 1e150, 1e-150


def settled(value: Value) -> Value:
    """The value where it is finite, NaN elsewhere; -0.0 as 0.0."""
    return value + (value - value)


def divided(a: float, b: float) -> float:
    """a / b; missing where b is 0."""
    return a / b if b != 0.0 else math.nan


def remainder(a: float, b: float) -> float:
    """What is left of a after whole steps of b, with the sign of b, as in Python; missing where b is 0."""
    return a % b if b != 0.0 else math.nan


def floor_divided(a: float, b: float) -> float:
    """The whole number of steps of b in a, rounded down, as in Python; missing where b is 0."""
    return a // b if b != 0.0 else math.nan


def powered(exponent: int) -> Callable[[Any], Any]:
    """A function that multiplies a number, or an array, with itself so many times: x ** exponent."""

    def power(base: Any) -> Any:
        result = base - base + 1.0
        rest, factor = exponent, base
        while rest:
            result = result * factor if rest & 1 else result
            rest >>= 1
            factor = factor * factor if rest else factor
        return result

    return power


def floored(value: float) -> float:
    """The whole number at or below."""
    return float(math.floor(value)) if math.isfinite(value) else math.nan


def ceiled(value: float) -> float:
    """The whole number at or above."""
    return float(math.ceil(value)) if math.isfinite(value) else math.nan


def rounded(value: float) -> float:
    """The nearest whole number, of two equally near ones the even one."""
    return float(round(value)) if math.isfinite(value) else math.nan


def rooted(value: float) -> float:
    """The square root; missing below 0."""
    return math.sqrt(value) if value >= 0.0 else math.nan


def lowest(*values: float) -> float:
    """The least of the values; missing when one is."""
    return math.nan if any(map(math.isnan, values)) else min(values)


def highest(*values: float) -> float:
    """The greatest of the values; missing when one is."""
    return math.nan if any(map(math.isnan, values)) else max(values)


def all_lowest(*values: Doubles) -> Doubles:
    """The least of some columns, context by context; NaN where one is."""
    least = values[0]
    for other in values[1:]:
        least = np.minimum(least, other)
    return least


def all_highest(*values: Doubles) -> Doubles:
    """The greatest of some columns, context by context; NaN where one is."""
    most = values[0]
    for other in values[1:]:
        most = np.maximum(most, other)
    return most


def clamped(value: float, low: float, high: float) -> float:
    """The value, raised to `low` and then lowered to `high`."""
    return lowest(highest(value, low), high)


def all_clamped(value: Doubles, low: Doubles, high: Doubles) -> Doubles:
    return np.minimum(np.maximum(value, low), high)


def length(x: float, y: float) -> float:
    """The length of a vector; scaled by a power of two where squares would overflow or vanish."""
    most = highest(abs(x), abs(y))
    scale = SCALE_DOWN if most > _FAR else SCALE_UP if most < _NEAR else 1.0
    a, b = x * scale, y * scale
    return rooted(a * a + b * b) / scale


def lengths(x: Doubles, y: Doubles) -> Doubles:
    """What `length` gives, for columns: float64 [N]."""
    most = np.maximum(np.abs(x), np.abs(y))
    scale = np.where(most > _FAR, SCALE_DOWN, np.where(most < _NEAR, SCALE_UP, 1.0))
    a, b = x * scale, y * scale
    return np.sqrt(a * a + b * b) / scale


def wrapped(degrees: float) -> float:
    """The same angle in [-180, 180)."""
    return wrap_angle(degrees) if math.isfinite(degrees) else math.nan


def heading(y: float, x: float) -> float:
    """The direction of the vector (x, y), in [-180, 180)."""
    return wrapped(trigonometry.direction(y, x))


def headings(y: Doubles, x: Doubles) -> Doubles:
    """Angles of vectors in degrees, -180 to 180: float64 [N]."""
    return wrap_angles(trigonometry.directions(y, x))
