"""Join columns with few classes, so that one look-up finds the rows of several facts at once.

A group of columns with K1, K2, … classes has K1 x K2 x … leaves, one for each joint class, and the mask of a leaf is the AND of
theirs.

Source: the first phase of recursive flow classification, Gupta and McKeown, SIGCOMM 1999.
"""

from __future__ import annotations

from collections.abc import Sequence

MOST_LEAVES = 128
MOST_BYTES = 256 << 10
"""A group has at most so many leaves, and their masks at most so many bytes: beyond, the caches hold less than the joining
saves."""


def groups_of(n_classes: Sequence[int], n_rows: int) -> list[list[int]]:
    """Which columns to join, as lists of their places; columns with the fewest classes are joined first."""
    groups: list[list[int]] = []
    n_leaves = 0
    for at in sorted(range(len(n_classes)), key=lambda i: n_classes[i]):
        joint = n_leaves * n_classes[at]
        if groups and joint <= MOST_LEAVES and joint * n_rows // 8 <= MOST_BYTES:
            groups[-1].append(at)
            n_leaves = joint
        else:
            groups.append([at])
            n_leaves = n_classes[at]
    return groups
