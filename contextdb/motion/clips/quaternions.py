"""Rotations as unit quaternions: float64 arrays whose last axis is (w, x, y, z).

Chosen over 3x3 matrices because they take less than half the memory, blend between frames by one weighted sum, and mirror or give
an angular velocity without a decomposition. Functions work on arrays of any leading shape, which broadcast. Angles are radians.
A product applies its right factor first, as with matrices: `rotate(multiply(a, b), v)` is `rotate(a, rotate(b, v))`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

AXES = "xyz"


def about_axis(axis: str, angles: Floats) -> Floats:
    """Rotations by `angles` [...] about one of the axes "x", "y", "z": [..., 4]."""
    rotations = np.zeros((*np.shape(angles), 4))
    rotations[..., 0] = np.cos(angles / 2)
    rotations[..., 1 + AXES.index(axis)] = np.sin(angles / 2)
    return rotations


def multiply(first: Floats, second: Floats) -> Floats:
    """The product of two rotations: `second` is applied first."""
    w, x, y, z = (first[..., i] for i in range(4))
    a, b, c, d = (second[..., i] for i in range(4))
    parts = (
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    )
    return np.stack(parts, axis=-1)


def inverse(rotations: Floats) -> Floats:
    """The rotations that undo the given ones."""
    return np.asarray(rotations * np.array([1.0, -1.0, -1.0, -1.0]))


def cross(first: Floats, second: Floats) -> Floats:
    """Cross products of vectors [..., 3]; several times faster than numpy.cross on short arrays."""
    a, b, c = (first[..., i] for i in range(3))
    x, y, z = (second[..., i] for i in range(3))
    return np.stack((b * z - c * y, c * x - a * z, a * y - b * x), axis=-1)


def rotate(rotations: Floats, vectors: Floats) -> Floats:
    """Vectors [..., 3] turned by rotations [..., 4]."""
    axes = rotations[..., 1:]
    twice = 2.0 * cross(axes, vectors)
    return vectors + rotations[..., :1] * twice + cross(axes, twice)


def from_euler(axes: Sequence[str], angles: Floats) -> Floats:
    """Rotations from angles [..., len(axes)] about the axes in order, the last applied first, as BVH lists them."""
    rotations = (
        about_axis(axes[0], angles[..., 0]) if axes else np.broadcast_to([1.0, 0.0, 0.0, 0.0], (*angles.shape[:-1], 4)).copy()
    )
    for i, axis in enumerate(axes[1:], start=1):
        rotations = multiply(rotations, about_axis(axis, angles[..., i]))
    return rotations


def matrices(rotations: Floats) -> Floats:
    """The same rotations as matrices [..., 3, 3] whose columns are the turned axes."""
    return np.stack([rotate(rotations, axis) for axis in np.eye(3)], axis=-1)


def to_euler(axes: str, rotations: Floats) -> Floats:
    """Angles [..., 3] about three different axes, such as "yxz", that make the rotations; the middle one within ±π/2."""
    i, j, k = (AXES.index(axis) for axis in axes)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    m = matrices(rotations)
    first = np.arctan2(-sign * m[..., j, k], m[..., k, k])
    middle = np.arcsin(np.clip(sign * m[..., i, k], -1.0, 1.0))
    last = np.arctan2(-sign * m[..., i, j], m[..., i, i])
    return np.stack((first, middle, last), axis=-1)


def blend(first: Floats, second: Floats, shares: Floats) -> Floats:
    """Rotations on the shorter way from `first` to `second`: share 0 is the first, 1 the second. Linear blending, made unit again:
    on the same arc as at constant speed, and between neighbours nearly at the same place."""
    signs = np.where((first * second).sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    mixed = first * (1.0 - shares) + second * (signs * shares)
    return np.asarray(mixed / np.linalg.norm(mixed, axis=-1, keepdims=True))


def rotation_vectors(rotations: Floats) -> Floats:
    """The axis times the angle [..., 3] of rotations, the shorter way round: at most π long."""
    axes = rotations[..., 1:] * np.where(rotations[..., :1] < 0.0, -1.0, 1.0)
    sines = np.linalg.norm(axes, axis=-1, keepdims=True)
    angles = 2.0 * np.arctan2(sines, np.abs(rotations[..., :1]))
    return np.asarray(axes * np.where(sines > 1e-12, angles / np.maximum(sines, 1e-12), 2.0))


def from_matrices(turned: Floats) -> Floats:
    """Rotations from matrices [..., 3, 3] whose columns are the turned axes."""
    m = turned
    # Four times each component, with its sign against w, x, y and z in turn: the row of the largest is free of cancellation.
    trace = m[..., 0, 0] + m[..., 1, 1] + m[..., 2, 2]
    wx, wy, wz = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    xy, xz, yz = m[..., 1, 0] + m[..., 0, 1], m[..., 2, 0] + m[..., 0, 2], m[..., 2, 1] + m[..., 1, 2]
    xx, yy, zz = (1.0 + 2.0 * m[..., i, i] - trace for i in range(3))
    rows = ((1.0 + trace, wx, wy, wz), (wx, xx, xy, xz), (wy, xy, yy, yz), (wz, xz, yz, zz))
    all_rows = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    largest = np.argmax(np.stack((1.0 + trace, xx, yy, zz), axis=-1), axis=-1)
    chosen = np.take_along_axis(all_rows, largest[..., None, None], axis=-2)[..., 0, :]
    return np.asarray(chosen / np.linalg.norm(chosen, axis=-1, keepdims=True))
