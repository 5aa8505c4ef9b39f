"""Loops that answer yes or no about boxes: is a context open, and which boxes lie within which. Arrays only.

Parts, tables and `scratch` are those of `part_kernels` and `count_kernels`; a class counts here when its weight is above 0,
whatever it weighs.
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return"

from __future__ import annotations

import numpy as np

from contextdb.covering import count_kernels
from contextdb.covering.kernels import ALL, IS_COMPILED, NONE, ONE, lowest_bit, njit, options
from contextdb.covering.part_kernels import part_of

FIRST = 1e9
"""A factor that is the last one of some box is fixed first."""


@njit(**options)
def leaves_open(part, depth, n_listed, weights, salts, table, scratch, state):
    """Whether some context is in no open box of a part; "no" where that was cut short, which state[CUT] tells."""
    opened, kept, listed, chosen = scratch[:4]
    n_words, open_boxes = part[1].shape[1], opened[depth]
    n = count_kernels.list_factors(part, depth, n_listed, scratch)
    state[count_kernels.WORK] += 2 + (n_listed * n_words >> 4)
    if n < 0:
        return False
    m = count_kernels.count_bits(open_boxes, n_words)
    if m <= 1:
        return True
    if state[count_kernels.WORK] >= state[count_kernels.LIMIT] or depth >= opened.shape[0] - count_kernels.ROOM:
        state[count_kernels.CUT] += 1
        return False
    if n_words > 1 and m <= count_kernels.DENSE * n_words:
        less = part_of(
            count_kernels.numbers_of(part[9], open_boxes, n_words, m), part[0][listed[depth + 1, :n]], weights, salts, table
        )
        state[count_kernels.WORK] += m * n >> 3
        return leaves_open(less, depth + 2, count_kernels.open_all(less, depth + 2, scratch), weights, salts, table, scratch, state)
    if n_words <= 2:
        state[count_kernels.WORK] += m * n_words >> 2
        if count_kernels.drop_inner(part, depth, n, scratch):
            n = count_kernels.list_factors(part, depth, n_listed, scratch)
    if count_kernels.split(part, depth, n, scratch):
        opened[depth + 1, :n_words] = kept[depth, :n_words]
        if not leaves_open(part, depth + 1, n, weights, salts, table, scratch, state):
            return False
        for w in range(n_words):
            opened[depth + 1, w] = open_boxes[w] & ~kept[depth, w]
        return leaves_open(part, depth + 1, n, weights, salts, table, scratch, state)
    n_chosen, n_tried = count_kernels.choose(part, depth, n, FIRST, scratch), 0
    state[count_kernels.WORK] += n_chosen * n_words >> 2
    for t in range(n_chosen):
        group = chosen[depth, t]
        if count_kernels.holds_one_of(part[2], group, chosen[depth, :n_tried], open_boxes):
            continue
        for w in range(n_words):
            opened[depth + 1, w] = part[2][group, w] & open_boxes[w]
        if leaves_open(part, depth + 1, n - 1, weights, salts, table, scratch, state):
            return True
        if state[count_kernels.CUT]:
            return False
        chosen[depth, n_tried] = group
        n_tried += 1
    return False


@njit(**options)
def first_holders(part, alike, found, start, stop):
    """Write for boxes from `start` to `stop` the first one that holds each whole and is not like it, else -1; `alike` names the
    first box like each."""
    _, limits, _, _, _, sides, wider, _, _, boxes = part
    n_words, m = limits.shape[1], boxes.shape[0]
    over = np.empty(n_words, np.uint64)
    for i in range(start, stop):
        found[i] = -1
        over[:] = ALL
        if m & 63:
            over[n_words - 1] = (ONE << np.uint64(m & 63)) - ONE
        some = ALL
        for factor in range(limits.shape[0]):
            side, some = sides[factor, i], NONE
            for w in range(n_words):
                over[w] &= ~limits[factor, w] if side < 0 else wider[side, w]
                some |= over[w] if w != i >> 6 else over[w] & ~(ONE << np.uint64(i & 63))
            if some == NONE:
                break
        for w in range(n_words):
            rest = over[w]
            while rest and some and found[i] < 0:
                j = w * 64 + lowest_bit(rest)
                rest &= rest - ONE
                if alike[j] != alike[i]:
                    found[i] = j


if not IS_COMPILED:
    from contextdb.covering.part_arrays import first_holders as first_holders
