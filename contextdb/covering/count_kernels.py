"""The loop of the count: which share of all contexts no box holds. Arrays only.

A part (`part_kernels`) with some of its boxes open is solved in one of four ways. Boxes that share no factor are independent: their
shares multiply. Where boxes are small, one box after the other is taken, the largest first, and what it alone holds is the share
that the boxes before it leave open within it. Else one factor is fixed, to each group of classes in turn. A part of few boxes is
made again, in fewer words. Parts that are alike, by 128-bit hashes of what is left of their boxes, are worked out once.

`scratch` is (open uint64 [D, W], kept uint64 [D, W], listed int64 [D, F], chosen int64 [D, G], shares float64 [D, G], hashes
uint64 [m, 2], volumes float64 [m], once uint64 [W], twice uint64 [W]): for each depth the open boxes, the factors that some of them
restrict, and the groups to try; the last four are used between two calls only. `state` holds what `WORK` to `SHARED` name.

Source: counting by decomposition and caching as in #DPLL (Bacchus, Dalmao and Pitassi, "Algorithms and complexity results for
#SAT and Bayesian inference", FOCS 2003), with boxes of many-valued factors for clauses; one box after the other is how sums of
disjoint products are formed (Abraham, "An improved algorithm for network reliability", IEEE Transactions on Reliability 28, 1979).
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return"

from __future__ import annotations

import numpy as np

from contextdb.covering.kernels import ALL, NONE, ONE, lowest_bit, mixed, n_bits, njit, options
from contextdb.covering.part_kernels import part_of

WORK, LIMIT, CUT, STOP, SHARED = 0, 1, 2, 3, 4
"""What is in `state`: steps done and allowed here, parts that were cut short, whether to stop (set meanwhile), and whether
every box gets its share of the steps that are left, where else those that come first may take them all."""
PROBES = 4
PER_NODE = 16
FEW, MANY = 6, 16
"""Boxes are taken one after the other from so many on: where they are small, and where they are not."""
SMALL_SUM = 0.9
"""Boxes whose measures sum to no more are small: then no rounding can make the share that is left 0."""
DENSE = 16
"""A part is made again when it has so many boxes a word, or fewer."""
ROOM, LEAST_DEPTH = 4, 160
"""A part that lies less than `ROOM` above the deepest level is cut short. Boxes are taken one after the other down to
`LEAST_DEPTH` at least, and where factors are few further down."""
SAME = 1e-11
"""Bounds that differ by less come from rounding."""
EPSILON = 2.3e-16


@njit(**options)
def uncovered(part, depth, n_listed, weights, salts, table, scratch, known, state):
    """Bounds of the share of contexts that no open box of a part holds; apart by roundings at most when nothing was cut."""
    opened, kept, listed, chosen, shares, _, volumes, _, _ = scratch
    n_words, open_boxes = part[1].shape[1], opened[depth]
    n = list_factors(part, depth, n_listed, scratch)
    state[WORK] += 2 + (n_listed * n_words >> 4)
    if n < 0:
        return 0.0, 0.0
    m = count_bits(open_boxes, n_words)
    if m == 0:
        return 1.0, 1.0
    if m > 1 and drop_inner(part, depth, n, scratch):
        n = list_factors(part, depth, n_listed, scratch)
        m = count_bits(open_boxes, n_words)
    key1, key2, total, largest = _measure(part, depth, n, scratch)
    state[WORK] += m * n_words >> 2
    low, high = max(0.0, 1.0 - total), 1.0 - largest
    if m == 1:
        return high, high
    at, is_known = _slot(key1, key2, known[0])
    if is_known:
        low, high = max(low, known[1][at, 0]), min(high, known[1][at, 1])
        if high - low <= SAME:
            return min(low, high), high
    if state[WORK] >= state[LIMIT] or state[STOP] or depth >= opened.shape[0] - ROOM:
        state[CUT] += 1
        return low, high
    if split(part, depth, n, scratch):
        opened[depth + 1, :n_words] = kept[depth, :n_words]
        first_low, first_high = uncovered(part, depth + 1, n, weights, salts, table, scratch, known, state)
        if first_high == 0.0:
            return 0.0, 0.0
        for w in range(n_words):
            opened[depth + 1, w] = open_boxes[w] & ~kept[depth, w]
        a, b = uncovered(part, depth + 1, n, weights, salts, table, scratch, known, state)
        return first_low * a, first_high * b
    state[WORK] += PER_NODE + (m >> 1)
    found_low, found_high = 0.0, 0.0
    if m >= (FEW if total <= SMALL_SUM else MANY) and depth < max(LEAST_DEPTH, opened.shape[0] - 4 * listed.shape[1]):
        order, own = _largest_first(open_boxes, n_words, m, volumes)
        before, boxes, factors = np.zeros(n_words, np.uint64), np.empty(m, np.int64), part[0][listed[depth + 1, :n]]
        for t in range(m):
            i = order[t]
            is_over = state[WORK] >= state[LIMIT] or state[STOP]
            if is_over or 1.0 - found_low <= m * EPSILON:
                state[CUT] += is_over
                found_high = min(1.0, found_high + _sum(own[t:]))
                break
            n_before = _met_before(part, i, depth, n, before, boxes, scratch)
            before[i >> 6] |= ONE << np.uint64(i & 63)
            state[WORK] += 2 + (m >> 5) + (n * n_words >> 5)
            a, b = 1.0, 1.0
            if n_before:
                inside, marked = _inside(part, i, depth, n, weights, salts, table, scratch)
                less = part_of(boxes[:n_before].copy(), factors, inside, marked, table)
                state[WORK] += n_before * n >> 1
                n_less, limit = open_all(less, depth + 2, scratch), state[LIMIT]
                if state[SHARED]:
                    state[LIMIT] = min(limit, state[WORK] + 2 * (limit - state[WORK]) // (m - t))
                a, b = uncovered(less, depth + 2, n_less, inside, marked, table, scratch, known, state)
                state[LIMIT] = limit
            found_low += own[t] * a
            found_high += own[t] * b
        found_low, found_high = 1.0 - found_high, 1.0 - found_low
        if found_low < 1e-3:
            found_low, found_high = max(0.0, found_low - m * EPSILON), max(0.0, found_high) + m * EPSILON
    elif n_words > 1 and m <= DENSE * n_words:
        less = part_of(numbers_of(part[9], open_boxes, n_words, m), part[0][listed[depth + 1, :n]], weights, salts, table)
        state[WORK] += m * n >> 2
        n_less = open_all(less, depth + 2, scratch)
        found_low, found_high = uncovered(less, depth + 2, n_less, weights, salts, table, scratch, known, state)
    else:
        n_chosen = choose(part, depth, n, 0.0, scratch)
        n, n_zeros = n - 1, 0
        state[WORK] += n_chosen * n_words >> 2
        for t in range(n_chosen):
            group, share = chosen[depth, t], shares[depth, t]
            if holds_one_of(part[2], group, chosen[depth, :n_zeros], open_boxes):
                continue
            for w in range(n_words):
                opened[depth + 1, w] = part[2][group, w] & open_boxes[w]
            a, b = uncovered(part, depth + 1, n, weights, salts, table, scratch, known, state)
            found_low += share * a
            found_high += share * b
            if b == 0.0:
                chosen[depth, n_zeros] = group
                n_zeros += 1
    low, high = max(low, found_low), min(high, found_high)
    known[0][at, 0], known[0][at, 1] = key1, key2
    known[1][at, 0], known[1][at, 1] = min(low, high), high
    return min(low, high), high


@njit(**options)
def _sum(shares):
    """The sum, one after the other: numpy's own takes another order than numba's."""
    total = 0.0
    for share in shares:
        total += share
    return total


@njit(**options)
def count_bits(words, n_words):
    n = 0
    for w in range(n_words):
        n += n_bits(words[w])
    return n


@njit(**options)
def list_factors(part, depth, n_listed, scratch):
    """List the factors that open boxes restrict for the next depth, and which boxes restrict one, and two; -1: one has none."""
    opened, _, listed, _, _, _, _, once, twice = scratch
    limits, n, n_words = part[1], 0, part[1].shape[1]
    for w in range(n_words):
        once[w] = twice[w] = NONE
    for x in range(n_listed):
        factor, some = listed[depth, x], NONE
        for w in range(n_words):
            limited = limits[factor, w] & opened[depth, w]
            some |= limited
            twice[w] |= once[w] & limited
            once[w] |= limited
        if some:
            listed[depth + 1, n] = factor
            n += 1
    for w in range(n_words):
        if opened[depth, w] & ~once[w]:
            return -1
    return n


@njit(**options)
def drop_inner(part, depth, n, scratch):
    """Close the boxes that lie within others; of equal ones the last stays open. Answer whether there were any."""
    opened, _, listed, _, _, _, _, over, _ = scratch
    limits, sides, wider = part[1], part[5], part[6]
    n_words, dropped = limits.shape[1], False
    for own in range(n_words):
        rest = opened[depth, own]
        while rest:
            bit = rest & (~rest + ONE)
            i, rest, some = own * 64 + lowest_bit(rest), rest ^ bit, ALL
            for w in range(n_words):
                over[w] = opened[depth, w]
            over[own] ^= bit
            for x in range(n):
                factor, some = listed[depth + 1, x], NONE
                side = sides[factor, i]
                for w in range(n_words):
                    over[w] &= ~limits[factor, w] if side < 0 else wider[side, w]
                    some |= over[w]
                if some == NONE:
                    break
            if some:
                opened[depth, own] ^= bit
                dropped = True
    return dropped


@njit(**options)
def _measure(part, depth, n, scratch):
    """Hashes of what is left of the open boxes, together; the sum of their measures, and the largest."""
    opened, _, listed, _, _, hashes, volumes, _, _ = scratch
    limits, sides, sizes, marks = part[1], part[5], part[7], part[8]
    n_words = limits.shape[1]
    for w in range(n_words):
        rest = opened[depth, w]
        while rest:
            i = w * 64 + lowest_bit(rest)
            hashes[i, 0], hashes[i, 1], volumes[i] = NONE, NONE, 1.0
            rest &= rest - ONE
    for x in range(n):
        factor = listed[depth + 1, x]
        for w in range(n_words):
            rest = limits[factor, w] & opened[depth, w]
            while rest:
                i = w * 64 + lowest_bit(rest)
                side = sides[factor, i]
                hashes[i, 0] ^= marks[side, 0]
                hashes[i, 1] ^= marks[side, 1]
                volumes[i] *= sizes[side]
                rest &= rest - ONE
    key1, key2, total, largest = NONE, NONE, 0.0, 0.0
    for w in range(n_words):
        rest = opened[depth, w]
        while rest:
            i = w * 64 + lowest_bit(rest)
            key1 += mixed(hashes[i, 0])
            key2 += mixed(hashes[i, 1] ^ np.uint64(0x9E3779B97F4A7C15))
            total += volumes[i]
            largest = max(largest, volumes[i])
            rest &= rest - ONE
    return key1 | ONE, key2, total, largest


@njit(**options)
def split(part, depth, n, scratch):
    """Keep the open boxes that hang together with the first factor's; answer whether there are others."""
    opened, kept, listed = scratch[:3]
    limits, n_words, grows = part[1], part[1].shape[1], True
    for w in range(n_words):
        kept[depth, w] = limits[listed[depth + 1, 0], w] & opened[depth, w]
    while grows:
        grows = False
        for x in range(1, n):
            factor, inside, outside = listed[depth + 1, x], NONE, NONE
            for w in range(n_words):
                limited = limits[factor, w] & opened[depth, w]
                inside |= limited & kept[depth, w]
                outside |= limited & ~kept[depth, w]
            if inside and outside:
                grows = True
                for w in range(n_words):
                    kept[depth, w] |= limits[factor, w] & opened[depth, w]
    for w in range(n_words):  # noqa: SIM110 - numba knows no generators
        if kept[depth, w] != opened[depth, w]:
            return True
    return False


@njit(**options)
def _slot(key1, key2, keys):
    """Where a part is remembered, or may be, and whether it is."""
    home = np.int64((key1 >> ONE) & np.uint64(keys.shape[0] - 1))
    at = home
    for _ in range(PROBES):
        if keys[at, 0] == key1 and keys[at, 1] == key2:
            return at, True
        if keys[at, 0] == NONE:
            return at, False
        at = (at + 1) & (keys.shape[0] - 1)
    return home, False


@njit(**options)
def numbers_of(boxes, words, n_words, m):
    """The m boxes of some bits."""
    found, n = np.empty(m, np.int64), 0
    for w in range(n_words):
        rest = words[w]
        while rest:
            found[n] = boxes[w * 64 + lowest_bit(rest)]
            rest &= rest - ONE
            n += 1
    return found


@njit(**options)
def _largest_first(words, n_words, m, volumes):
    """The bits of the open boxes, and their measures; of equal ones the first comes first."""
    bits, own, n = np.empty(m, np.int64), np.empty(m), 0
    for w in range(n_words):
        rest = words[w]
        while rest:
            bits[n] = w * 64 + lowest_bit(rest)
            own[n] = volumes[bits[n]]
            rest &= rest - ONE
            n += 1
    order = np.argsort(-own, kind="mergesort")
    return bits[order], own[order]


@njit(**options)
def _met_before(part, i, depth, n, before, boxes, scratch):
    """Write the boxes before box i that share a context with it; answer how many they are."""
    listed, met = scratch[2], scratch[8]
    _, _, groups, _, starts, sides, _, _, _, numbers = part
    n_words, n_met = groups.shape[1], 0
    for w in range(n_words):
        met[w] = before[w]
    for x in range(n):
        factor = listed[depth + 1, x]
        if sides[factor, i] < 0:
            continue
        for w in range(n_words):
            either = NONE
            for g in range(starts[factor], starts[factor + 1]):
                if (groups[g, i >> 6] >> np.uint64(i & 63)) & ONE:
                    either |= groups[g, w]
            met[w] &= either
    for w in range(n_words):
        rest = met[w]
        while rest:
            boxes[n_met] = numbers[w * 64 + lowest_bit(rest)]
            rest &= rest - ONE
            n_met += 1
    return n_met


@njit(**options)
def _inside(part, i, depth, n, weights, salts, table, scratch):
    """The weights of classes within box i, and the salts of its factors."""
    listed, (cells, runs, first, hashes, edges) = scratch[2], table
    inside, marked = weights.copy(), salts.copy()
    for x in range(n):
        number = listed[depth + 1, x]
        if part[5][number, i] < 0:
            continue
        factor, k = part[0][number], 0
        cell, start = cells[part[9][i], factor], edges[factor]
        for r in range(first[cell], first[cell + 1]):
            inside[start + k : start + runs[r, 0]] = 0.0
            k = runs[r, 1]
        inside[start + k : edges[factor + 1]] = 0.0
        marked[factor] += mixed(hashes[cell, 0])
    return inside, marked


@njit(**options)
def open_all(part, depth, scratch):
    """Open every box of a part at a depth; answer how many factors it has."""
    opened, listed, m, n_words = scratch[0], scratch[2], part[9].shape[0], part[1].shape[1]
    for w in range(n_words):
        opened[depth, w] = ALL
    if m & 63:
        opened[depth, n_words - 1] = (ONE << np.uint64(m & 63)) - ONE
    for x in range(part[0].shape[0]):
        listed[depth, x] = x
    return part[0].shape[0]


@njit(**options)
def choose(part, depth, n, first, scratch):
    """Choose the factor that most boxes restrict, fewer where it has more groups, and strike it off; one that is the last of a box
    counts `first` more. Write its groups as the open boxes tell them apart, those that fewest accept first, but for those that
    leave nothing open. Answer how many they are."""
    opened, _, listed, chosen, shares, _, _, once, twice = scratch
    _, limits, groups, masses, starts = part[:5]
    n_words, best, most, total = limits.shape[1], 0, -1.0, 0.0
    for x in range(n):
        factor, n_limited, last = listed[depth + 1, x], 0, NONE
        for w in range(n_words):
            limited = limits[factor, w] & opened[depth, w]
            n_limited += n_bits(limited)
            last |= limited & ~twice[w]
        score = n_limited / np.log2(1.0 + min(starts[factor + 1] - starts[factor], n_limited + 1))
        score += first if last else 0.0
        if score > most:
            best, most = x, score
    factor, found = listed[depth + 1, best], 0
    for x in range(best, n - 1):  # they stay in their order, in which sizes are multiplied
        listed[depth + 1, x] = listed[depth + 1, x + 1]
    for w in range(n_words):  # boxes that restrict only this factor
        once[w] = limits[factor, w] & opened[depth, w] & ~twice[w]
    for g in range(starts[factor], starts[factor + 1]):
        covered, t, differs, total = NONE, found, ALL, total + masses[g]
        for w in range(n_words):
            covered |= groups[g, w] & once[w]
        if covered:
            continue
        while t > 0 and differs:
            t, differs = t - 1, NONE
            for w in range(n_words):
                differs |= (groups[g, w] ^ groups[chosen[depth, t], w]) & opened[depth, w]
        if differs:
            chosen[depth, found], shares[depth, found] = g, masses[g]
            found += 1
        else:
            shares[depth, t] += masses[g]
    for t in range(found):
        shares[depth, t] /= total
    _sort_by_boxes(groups, opened[depth], chosen[depth], shares[depth], found)
    return found


@njit(**options)
def _sort_by_boxes(groups, open_boxes, chosen, shares, n):
    """Sort groups by how many open boxes accept them; equal ones stay in their order."""
    counts = np.zeros(n, np.int64)
    for t in range(n):
        for w in range(groups.shape[1]):
            counts[t] += n_bits(groups[chosen[t], w] & open_boxes[w])
    order = np.argsort(counts, kind="mergesort")
    chosen[:n], shares[:n] = chosen[order], shares[order]


@njit(**options)
def holds_one_of(groups, group, others, open_boxes):
    """Whether the boxes that accept a group are all that accept one of some others, and more."""
    for other in others:
        missing = NONE
        for w in range(groups.shape[1]):
            missing |= groups[other, w] & ~groups[group, w] & open_boxes[w]
        if missing == NONE:
            return True
    return False
