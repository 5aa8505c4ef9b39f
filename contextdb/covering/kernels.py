"""Loops over boxes: the measure that none of them holds, and how many boxes hold each of many contexts. Arrays only.

Compiled by numba where it is installed, else run as they stand: the same sums in the same order, so the same bytes.

m boxes are open, F factors, W = ceil(F / 64). A box is one cell number for each factor, -1 where it accepts everything. Cell c is
the classes runs[i, 0] up to, not including, runs[i, 1] of its factor for first[c] <= i < first[c + 1], and has the measure
sizes[c] and the hashes hashes[c, 0:2].

Source: counting by decomposition and caching as in #DPLL (Bacchus, Dalmao and Pitassi, "Algorithms and complexity results for
#SAT and Bayesian inference", FOCS 2003), with boxes of many-valued factors for clauses.
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return, no-redef"

from __future__ import annotations

from typing import Any

import numpy as np

try:
    from numba import njit

    IS_COMPILED = True
except ImportError:  # pragma: no cover - the same loops, slower
    IS_COMPILED = False

    def njit(**_options: Any) -> Any:
        """Leave the loops as they are."""
        return lambda loop: loop


_options: dict[str, Any] = {"cache": True, "nogil": True, "boundscheck": False, "error_model": "numpy"}
WORK, LIMIT, CUT, NODES = 0, 1, 2, 3
"""What stands in `state`: row visits done and allowed (below 0, set meanwhile: stop), nodes that were cut short, nodes opened."""
SMALL = 64
"""Boxes within others are looked for among so many."""
PROBES = 16
PER_NODE = 24
"""Opening a node costs as much as so many row visits."""


@njit(**_options)
def _mix(x):
    x = np.uint64(x)
    x ^= x >> np.uint64(33)
    x *= np.uint64(0xFF51AFD7ED558CCD)
    x ^= x >> np.uint64(33)
    x *= np.uint64(0xC4CEB9FE1A85EC53)
    return x ^ (x >> np.uint64(33))


@njit(**_options)
def _accepts(cell, k, runs, first):
    for i in range(first[cell], first[cell + 1]):  # noqa: SIM110 - numba knows no generators
        if runs[i, 0] <= k < runs[i, 1]:
            return True
    return False


@njit(**_options)
def _cell_within(one, other, runs, first):
    for i in range(first[one], first[one + 1]):
        inside = False
        for j in range(first[other], first[other + 1]):
            if runs[j, 0] <= runs[i, 0] and runs[i, 1] <= runs[j, 1]:
                inside = True
        if not inside:
            return False
    return True


@njit(**_options)
def _within(one, other, mask_one, mask_other, cells, runs, first):
    """Whether what is left of box `one` lies in what is left of box `other`."""
    for w in range(mask_one.shape[0]):
        if mask_other[w] & ~mask_one[w]:
            return False
    for w in range(mask_other.shape[0]):
        rest, f = mask_other[w], w * 64
        while rest:
            if (
                rest & np.uint64(1)
                and cells[one, f] != cells[other, f]
                and not _cell_within(cells[one, f], cells[other, f], runs, first)
            ):
                return False
            rest >>= np.uint64(1)
            f += 1
    return True


@njit(**_options)
def _distinct(hashes):
    """The first of each of the boxes that are left alike."""
    m = hashes.shape[0]
    size = 4
    while size < 2 * m:
        size *= 2
    slots, kept, n = np.full(size, -1, np.int32), np.empty(m, np.int32), 0
    for i in range(m):
        p, is_new = np.int64(hashes[i, 0] & np.uint64(size - 1)), True
        while slots[p] >= 0:
            j = slots[p]
            if hashes[j, 0] == hashes[i, 0] and hashes[j, 1] == hashes[i, 1]:
                is_new = False
                break
            p = (p + 1) & (size - 1)
        if is_new:
            slots[p] = i
            kept[n] = i
            n += 1
    return kept[:n]


@njit(**_options)
def _maximal(kept, boxes, masks, cells, runs, first):
    """Those of a few distinct boxes that lie in no other."""
    out, n = np.empty(kept.shape[0], np.int32), 0
    for a in range(kept.shape[0]):
        i, is_inside = kept[a], False
        for b in range(kept.shape[0]):
            j = kept[b]
            if a != b and _within(boxes[i], boxes[j], masks[i], masks[j], cells, runs, first):
                is_inside = True
                break
        if not is_inside:
            out[n] = i
            n += 1
    return out[:n]


@njit(**_options)
def _components(masks):
    """The number of the component of each box, and how many there are: boxes that share no factor are independent."""
    m, n_words = masks.shape
    joined, n = np.zeros((m, n_words), np.uint64), 0
    for i in range(m):
        own = masks[i].copy()
        j = 0
        while j < n:
            meets = False
            for w in range(n_words):
                if joined[j, w] & own[w]:
                    meets = True
            if meets:
                n -= 1
                for w in range(n_words):
                    own[w] |= joined[j, w]
                    joined[j, w] = joined[n, w]
            else:
                j += 1
        for w in range(n_words):
            joined[n, w] = own[w]
        n += 1
    number = np.empty(m, np.int32)
    for i in range(m):
        for j in range(n):
            for w in range(n_words):
                if joined[j, w] & masks[i, w]:
                    number[i] = j
    return number, n


@njit(**_options)
def _busiest(masks, n_factors):
    """The factor that most boxes restrict."""
    counts = np.zeros(n_factors, np.int64)
    for i in range(masks.shape[0]):
        for w in range(masks.shape[1]):
            rest, f = masks[i, w], w * 64
            while rest:
                if rest & np.uint64(1):
                    counts[f] += 1
                rest >>= np.uint64(1)
                f += 1
    return np.argmax(counts)


@njit(**_options)
def _groups(boxes, factor, cells, runs, first, weights, marks):
    """Classes that the open boxes cannot tell apart: one class of each group, and the group's weight."""
    n_classes = weights.shape[0]
    seen = np.zeros(n_classes + 1, np.uint64)
    for i in range(boxes.shape[0]):
        cell = cells[boxes[i], factor]
        if cell >= 0:
            for r in range(first[cell], first[cell + 1]):
                seen[runs[r, 0]] ^= marks[boxes[i]]
                seen[runs[r, 1]] ^= marks[boxes[i]]
    for k in range(1, n_classes):
        seen[k] ^= seen[k - 1]
    chosen, masses, n = np.empty(n_classes, np.int32), np.zeros(n_classes), 0
    size = 4
    while size < 2 * n_classes:
        size *= 2
    slots = np.full(size, -1, np.int32)
    for k in range(n_classes):
        p = np.int64(seen[k] & np.uint64(size - 1))
        while slots[p] >= 0 and seen[chosen[slots[p]]] != seen[k]:
            p = (p + 1) & (size - 1)
        if slots[p] < 0:
            slots[p] = n
            chosen[n] = k
            n += 1
        masses[slots[p]] += weights[k]
    return chosen[:n], masses[:n]


@njit(**_options)
def _overlap(one, other, factor, tables):
    """The measure that two cells of a factor share."""
    cells, runs, first, _, _, weights, edges, _ = tables
    a, b, share = cells[one, factor], cells[other, factor], 0.0
    for i in range(first[a], first[a + 1]):
        for j in range(first[b], first[b + 1]):
            for k in range(max(runs[i, 0], runs[j, 0]), min(runs[i, 1], runs[j, 1])):
                share += weights[edges[factor] + k]
    return share


@njit(**_options)
def _both_uncovered(boxes, masks, volumes, tables):
    """The share that two boxes, neither within the other, leave uncovered; 0 or less where rounding may have eaten it."""
    cells, sizes = tables[0], tables[3]
    joint, n_used = volumes[0] * volumes[1], 0
    for w in range(masks.shape[1]):
        rest, shared, f = masks[0, w] | masks[1, w], masks[0, w] & masks[1, w], w * 64
        while rest:
            if rest & np.uint64(1):
                n_used += 1
            if shared & np.uint64(1):
                joint *= _overlap(boxes[0], boxes[1], f, tables) / (sizes[cells[boxes[0], f]] * sizes[cells[boxes[1], f]])
            rest >>= np.uint64(1)
            shared >>= np.uint64(1)
            f += 1
    left = 1.0 - volumes[0] - (volumes[1] - joint)
    return left if n_used > 1 and left > 1e-6 else 0.0


@njit(**_options)
def uncovered(boxes, hashes, masks, volumes, mass, slack, tables, known, state):
    """Bounds of the share of contexts that no open box holds; equal when nothing was cut.

    `mass` is the share of the whole that this part is; parts whose bounds differ by less than `slack` of the whole are cut.
    `tables` are (cells, runs, first, sizes, hashes of cells, weights, edges, marks), `known` what was worked out before.
    """
    cells, runs, first, sizes, cell_hashes, weights, edges, marks = tables
    if state[LIMIT] < 0:
        state[CUT] += 1
        return 0.0, 1.0
    if boxes.shape[0] == 0:
        return 1.0, 1.0
    for i in range(boxes.shape[0]):
        is_whole = True
        for w in range(masks.shape[1]):
            if masks[i, w]:
                is_whole = False
        if is_whole:
            return 0.0, 0.0
    kept = _distinct(hashes)
    if 1 < kept.shape[0] <= SMALL:
        state[WORK] += kept.shape[0] * kept.shape[0] // 8
        kept = _maximal(kept, boxes, masks, cells, runs, first)
    if kept.shape[0] < boxes.shape[0]:
        boxes, hashes, masks, volumes = boxes[kept], hashes[kept], masks[kept], volumes[kept]
    m = boxes.shape[0]
    if m == 1:
        return 1.0 - volumes[0], 1.0 - volumes[0]
    if m == 2:
        left = _both_uncovered(boxes, masks, volumes, tables)
        if left > 0.0:
            return left, left
    key1, key2, total, largest = np.uint64(0), np.uint64(0), 0.0, 0.0
    for i in range(m):
        key1 += _mix(hashes[i, 0])
        key2 += _mix(hashes[i, 1] ^ np.uint64(0x9E3779B97F4A7C15))
        total += volumes[i]
        largest = max(largest, volumes[i])
    key1 |= np.uint64(1)
    low, high = max(0.0, 1.0 - total), 1.0 - largest
    keys, bounds = known
    at, is_known = np.int64((key1 >> np.uint64(1)) & np.uint64(keys.shape[0] - 1)), False
    home = at
    for _ in range(PROBES):
        if keys[at, 0] == key1 and keys[at, 1] == key2:
            is_known = True
        if is_known or keys[at, 0] == 0:
            break
        at = (at + 1) & (keys.shape[0] - 1)
    if is_known:
        low, high = max(low, bounds[at, 0]), min(high, bounds[at, 1])
        if high <= low:
            return high, high
    elif keys[at, 0] != 0:
        at = home
    if mass * (high - low) <= slack and high > low and slack > 0.0:
        state[CUT] += 1
        return low, high
    if state[WORK] >= state[LIMIT]:
        state[CUT] += 1
        return low, high
    state[NODES] += 1
    state[WORK] += m + PER_NODE
    cut_before = state[CUT]
    number, n_parts = _components(masks)
    if n_parts > 1:
        found_low, found_high = 1.0, 1.0
        for part in range(n_parts):
            own = np.flatnonzero(number == part)
            a, b = uncovered(boxes[own], hashes[own], masks[own], volumes[own], mass * found_high, slack, tables, known, state)
            found_low *= a
            found_high *= b
            if found_high == 0.0:
                break
    else:
        factor = _busiest(masks, cells.shape[1])
        word, bit = factor >> 6, np.uint64(1) << np.uint64(factor & 63)
        chosen, masses = _groups(boxes, factor, cells, runs, first, weights[edges[factor] : edges[factor + 1]], marks)
        found_low, found_high = 0.0, 0.0
        for g in range(chosen.shape[0]):
            if masses[g] == 0.0 or state[LIMIT] < 0:
                continue
            state[WORK] += m
            b2, n = np.empty(m, np.int32), 0
            h2, m2, v2 = np.empty((m, 2), np.uint64), np.empty((m, masks.shape[1]), np.uint64), np.empty(m)
            for i in range(m):
                cell = cells[boxes[i], factor]
                if cell >= 0 and not _accepts(cell, chosen[g], runs, first):
                    continue
                b2[n], v2[n] = boxes[i], volumes[i]
                h2[n, 0], h2[n, 1] = hashes[i, 0], hashes[i, 1]
                for w in range(masks.shape[1]):  # numbers, not slices: several times faster
                    m2[n, w] = masks[i, w]
                if cell >= 0:
                    h2[n, 0] ^= cell_hashes[cell, 0]
                    h2[n, 1] ^= cell_hashes[cell, 1]
                    m2[n, word] &= ~bit
                    v2[n] = min(1.0, volumes[i] / sizes[cell])
                n += 1
            a, b = uncovered(
                b2[:n].copy(), h2[:n].copy(), m2[:n].copy(), v2[:n].copy(), mass * masses[g], slack, tables, known, state
            )
            found_low += masses[g] * a
            found_high += masses[g] * b
    if state[CUT] == cut_before:
        low = high = found_high
    else:
        low, high = max(low, found_low), min(high, found_high)
    keys[at, 0], keys[at, 1] = key1, key2
    bounds[at, 0], bounds[at, 1] = low, high
    return low, high


@njit(**_options)
def count_rows(codes, starts, masks, counts, hits):
    """How many boxes hold each context: codes int32 [N, F] are classes, mask starts[f] + class holds the boxes that accept it."""
    found = np.empty(masks.shape[1], np.uint64)
    for i in range(codes.shape[0]):
        found[:] = masks[starts[0] + codes[i, 0]]
        for f in range(1, codes.shape[1]):
            own, rest = masks[starts[f] + codes[i, f]], np.uint64(0)
            for w in range(found.shape[0]):
                found[w] &= own[w]
                rest |= found[w]
            if rest == 0:
                break
        n = 0
        for w in range(found.shape[0]):
            word, box = found[w], w * 64
            while word:
                if word & np.uint64(1):
                    hits[box] += 1
                    n += 1
                word >>= np.uint64(1)
                box += 1
        counts[i] = n
