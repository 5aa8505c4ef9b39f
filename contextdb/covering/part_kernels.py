"""A part of a count: some boxes, over the factors that are still free, as bits. Arrays only.

m boxes are in W = ceil(m / 64) words each: bit i % 64 of word i // 64 is box i. A part is the tuple

    factors   int64 [L]       the number of each factor that some box restricts
    limits    uint64 [L, W]   the boxes that restrict it
    groups    uint64 [G, W]   for each group of classes that the boxes cannot distinguish those that accept it
    masses    float64 [G]     what the group weighs
    starts    int64 [L + 1]   where the groups of each factor begin
    sides     int32 [L, m]    the number of the side of each box, -1 where it accepts everything
    wider     uint64 [C, W]   for each side the boxes that accept all that it accepts
    sizes     float64 [C]     the share of the factor that it accepts
    marks     uint64 [C, 2]   its hashes
    boxes     int64 [m]       the number of each box in the table

The table is (cells, runs, first, hashes, edges): cell c, number cells[box, factor] or -1, accepts the classes runs[i, 0] up to, not
including, runs[i, 1] of its factor for first[c] <= i < first[c + 1]; edges[f] is where the weights of factor f begin. Classes of
weight 0 do not count. `salts` tell factors apart whose classes were weighed otherwise. Where weights are whole numbers (`count`
makes them so) sums of them are exact, in whatever order.
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return"

from __future__ import annotations

import numpy as np

from contextdb.covering.kernels import ALL, IS_COMPILED, NONE, ONE, mixed, njit, options


@njit(**options)
def part_of(boxes, factors, weights, salts, table):
    cells, edges = table[0], table[4]
    n_words, n_classes = (boxes.shape[0] + 63) >> 6, 0
    for x in range(factors.shape[0]):
        n_classes += edges[factors[x] + 1] - edges[factors[x]]
    free, limits = np.empty(factors.shape[0], np.int64), np.zeros((factors.shape[0], n_words), np.uint64)
    groups, masses = np.empty((n_classes, n_words), np.uint64), np.empty(n_classes)
    starts, sides = np.zeros(factors.shape[0] + 1, np.int64), np.full((factors.shape[0], boxes.shape[0]), -1, np.int32)
    wider, sizes, marks = np.empty((64, n_words), np.uint64), np.empty(64), np.empty((64, 2), np.uint64)
    n, n_sides = 0, 0
    for x in range(factors.shape[0]):
        factor = factors[x]
        start = starts[n]
        stop = _add_groups(boxes, factor, weights, table, groups, masses, start)
        if not _set_limits(limits[n], groups, start, stop, boxes.shape[0]):
            continue
        if n_sides + boxes.shape[0] > sizes.shape[0]:
            size = 2 * (n_sides + boxes.shape[0])
            old = wider, sizes, marks
            wider, sizes, marks = np.empty((size, n_words), np.uint64), np.empty(size), np.empty((size, 2), np.uint64)
            wider[:n_sides], sizes[:n_sides], marks[:n_sides] = old[0][:n_sides], old[1][:n_sides], old[2][:n_sides]
        known = n_sides
        n_sides = _number_sides(boxes, cells[:, factor], limits[n], sides[n], n_sides)
        for i in range(boxes.shape[0]):
            if sides[n, i] == known:
                _add_side(i, known, groups, masses, start, stop, wider, sizes)
                cell = cells[boxes[i], factor]
                marks[known, 0] = mixed(table[3][cell, 0] ^ salts[factor])
                marks[known, 1] = mixed(table[3][cell, 1] + salts[factor])
                known += 1
        free[n] = factor
        n += 1
        starts[n] = stop
    n_groups = starts[n]
    return (
        free[:n],
        limits[:n],
        groups[:n_groups],
        masses[:n_groups],
        starts[: n + 1],
        sides[:n],
        wider[:n_sides],
        sizes[:n_sides],
        marks[:n_sides],
        boxes,
    )


@njit(**options)
def _add_groups(boxes, factor, weights, table, groups, masses, start):
    """Write the groups of classes of a factor from `start` on; answer where they end."""
    cells, runs, first, _, edges = table
    n_words, n_classes, stop = groups.shape[1], edges[factor + 1] - edges[factor], start
    turns, present = np.zeros((n_classes + 1, n_words), np.uint64), np.zeros(n_words, np.uint64)
    for i in range(boxes.shape[0]):
        cell, bit = cells[boxes[i], factor], ONE << np.uint64(i & 63)
        if cell < 0:
            present[i >> 6] |= bit
        else:
            for r in range(first[cell], first[cell + 1]):
                turns[runs[r, 0], i >> 6] ^= bit
                turns[runs[r, 1], i >> 6] ^= bit
    for k in range(n_classes):
        for w in range(n_words):
            present[w] ^= turns[k, w]
        weight = weights[edges[factor] + k]
        if weight == 0.0:
            continue
        at = start
        while at < stop and not _are_equal(groups[at], present):
            at += 1
        if at == stop:
            groups[at], masses[at] = present, 0.0
            stop += 1
        masses[at] += weight
    return stop


@njit(**options)
def _are_equal(one, other):
    for w in range(one.shape[0]):  # noqa: SIM110 - numba knows no generators
        if one[w] != other[w]:
            return False
    return True


@njit(**options)
def _set_limits(limits, groups, start, stop, n_boxes):
    """Write which boxes do not accept every group; answer whether there are any."""
    found = NONE
    for w in range(limits.shape[0]):
        everywhere = ALL
        for g in range(start, stop):
            everywhere &= groups[g, w]
        limits[w] = ~everywhere
        if w == limits.shape[0] - 1 and n_boxes & 63:
            limits[w] &= (ONE << np.uint64(n_boxes & 63)) - ONE
        found |= limits[w]
    return found != NONE


@njit(**options)
def _number_sides(boxes, cells, limits, sides, n):
    """Number the different cells of the boxes that restrict a factor, from n on; answer how many there are by then."""
    size = 4
    while size < 2 * boxes.shape[0]:
        size *= 2
    slots, first = np.full(size, -1, np.int32), n
    seen = np.empty(boxes.shape[0], np.int32)
    for i in range(boxes.shape[0]):
        if not (limits[i >> 6] >> np.uint64(i & 63)) & ONE:
            continue
        cell = cells[boxes[i]]
        at = cell & (size - 1)
        while slots[at] >= 0 and seen[slots[at] - first] != cell:
            at = (at + 1) & (size - 1)
        if slots[at] < 0:
            slots[at] = n
            seen[n - first] = cell
            n += 1
        sides[i] = slots[at]
    return n


@njit(**options)
def _add_side(i, side, groups, masses, start, stop, wider, sizes):
    """Write the size of a side, which is that of box i, and the boxes that accept all of it."""
    wider[side], sizes[side], total = ALL, 0.0, 0.0
    for g in range(start, stop):
        total += masses[g]
        if (groups[g, i >> 6] >> np.uint64(i & 63)) & ONE:
            sizes[side] += masses[g]
            for w in range(groups.shape[1]):
                wider[side, w] &= groups[g, w]
    sizes[side] /= total


if not IS_COMPILED:
    from contextdb.covering.part_arrays import part_of as part_of
