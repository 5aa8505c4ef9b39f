"""Oracles for motion, too simple to be wrong: one frame and one joint at a time, plain matrices, plain loops."""

from __future__ import annotations

import math

import numpy as np

AXES = {"X": 0, "Y": 1, "Z": 2}
UP = {
    "y": np.eye(3),
    "z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),  # (x, y, z) becomes (x, z, -y)
    "x": np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]),  # (x, y, z) becomes (-y, x, z)
}


def rotation_about(axis, degrees):
    a, b = [(1, 2), (2, 0), (0, 1)][AXES[axis]]
    matrix = np.eye(3)
    matrix[a, a] = matrix[b, b] = math.cos(math.radians(degrees))
    matrix[b, a] = math.sin(math.radians(degrees))
    matrix[a, b] = -matrix[b, a]
    return matrix


def place_joint(clip, frame, joint):
    """The position in metres and the rotation matrix of one joint in one frame, by asking its parent."""
    skeleton = clip.skeleton
    offset = skeleton.offsets[joint].copy()
    turn = np.eye(3)
    first = sum(len(channels) for channels in skeleton.channels[:joint])
    for i, channel in enumerate(skeleton.channels[joint]):
        value = clip.values[frame, first + i]
        if channel.endswith("position"):
            offset[AXES[channel[0]]] = value
        else:
            turn = turn @ rotation_about(channel[0], value)
    parent = skeleton.parents[joint]
    above, above_turn = place_joint(clip, frame, parent) if parent >= 0 else (np.zeros(3), UP[clip.up])
    return above + above_turn @ offset * clip.metres_per_unit, above_turn @ turn


def best_frame(features, starts, stops, query, weights=None, range_flags=None, tags=None, current=None, bias=None):
    """The frame of least cost in float64, its cost, or (None, inf): every frame of every range, one by one."""
    weights = np.ones(features.shape[1]) if weights is None else weights
    found, least = None, math.inf
    for i in sorted(range(len(starts)), key=lambda i: starts[i]):
        if range_flags is not None and not range_flags[i]:
            continue
        for frame in range(starts[i], stops[i]):
            if tags is not None and not tags[frame]:
                continue
            cost = sum(w * (float(x) - float(q)) ** 2 for w, x, q in zip(weights, features[frame], query, strict=True))
            cost += 0.0 if bias is None else float(bias[frame])
            if cost < least or (cost == least < math.inf and frame == current):
                found, least = frame, cost
    return found, least
