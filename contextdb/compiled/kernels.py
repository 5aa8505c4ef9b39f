"""Numba kernels: codes to rows, and many contexts to counts and hits with their encoding. Arrays only.

M masks, W words a mask, P plain codes, N contexts. `masks`, `wide` and codes are those of `contextdb.compiled.stack`.

The loops run over columns first and words inside, four columns a pass: that order vectorises, where a loop over words first,
leaving at zero, does not. Contexts are encoded in blocks, number columns by a bisection that takes the same steps for all of a
block, so that it vectorises too; the codes stay in the nearest cache until the masks are intersected.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

BLOCK = 128
_options: dict[str, Any] = {"cache": True, "nogil": True, "boundscheck": False, "error_model": "numpy"}


@njit(inline="always", **_options)
def _lowest(word):  # type: ignore[no-untyped-def]
    """The number of the lowest bit of a word that is not 0."""
    below = (word - np.uint64(1)) & ~word
    below = below - ((below >> np.uint64(1)) & np.uint64(0x5555555555555555))
    below = (below & np.uint64(0x3333333333333333)) + ((below >> np.uint64(2)) & np.uint64(0x3333333333333333))
    below = (below + (below >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((below * np.uint64(0x0101010101010101)) >> np.uint64(56))


@njit(**_options)
def intersect(masks, codes, n_plain, wide, enabled, found):  # type: ignore[no-untyped-def]
    """AND the masks of one context's codes into `found` uint64 [W]."""
    n_words = found.shape[0]
    for w in range(n_words):
        found[w] = enabled[w]
    j = 0
    while j + 4 <= n_plain:
        a, b, c, d = masks[codes[j]], masks[codes[j + 1]], masks[codes[j + 2]], masks[codes[j + 3]]
        for w in range(n_words):
            found[w] &= (a[w] & b[w]) & (c[w] & d[w])
        j += 4
    while j < n_plain:
        a = masks[codes[j]]
        for w in range(n_words):
            found[w] &= a[w]
        j += 1
    for i in range(wide.shape[0]):
        _intersect_wide(masks, codes[n_plain + i], wide[i], found)


@njit(**_options)
def _intersect_wide(masks, code, column, found):  # type: ignore[no-untyped-def]
    """AND one wide column's mask of a class, put together from its digits; -1 is a fact that is ignored, K one that is missing."""
    first, n_layers, n_coarse, shift, n_classes = column[1], column[2], column[3], column[4], column[5]
    n_words = found.shape[0]
    size = 2 * n_coarse + (1 << shift)
    if code < 0:
        return
    if code >= n_classes:
        rest = masks[first + 2 * size * n_layers]
        for w in range(n_words):
            found[w] &= rest[w]
        return
    g, f = code >> shift, code & ((1 << shift) - 1)
    any_layer = np.zeros(n_words, np.uint64)
    for layer in range(n_layers):
        low = first + 2 * size * layer
        high = low + size
        la, lb, lc = masks[low + g], masks[low + n_coarse + g], masks[low + 2 * n_coarse + f]
        ha, hb, hc = masks[high + g], masks[high + n_coarse + g], masks[high + 2 * n_coarse + f]
        for w in range(n_words):
            any_layer[w] |= (la[w] | (lb[w] & lc[w])) & (ha[w] | (hb[w] & hc[w]))
    for w in range(n_words):
        found[w] &= any_layer[w]


@njit(**_options)
def query(masks, codes, n_plain, wide, enabled, found):  # type: ignore[no-untyped-def]
    """The mask of one context's codes into `found` uint64 [W]; False when a code is out of range."""
    for j in range(codes.shape[0]):
        if j < n_plain:
            if codes[j] < 0 or codes[j] >= masks.shape[0]:
                return False
        elif codes[j] < -1 or codes[j] > wide[j - n_plain, 5]:
            return False
    intersect(masks, codes, n_plain, wide, enabled, found)
    return True


@njit(**_options)
def _encode_numbers(numbers, start, count, bounds, edges, firsts, missing, codes, slots):  # type: ignore[no-untyped-def]
    """Codes of the number columns for `count` contexts from `start` on, into `codes` [slot, context in block].

    numbers float64 [columns, N]; column j bisects bounds[edges[j]:edges[j + 1]] and its class k has code firsts[j] + k; NaN
    missing[j].
    """
    at = np.empty(BLOCK, np.int32)
    for j in range(numbers.shape[0]):
        low, n = edges[j], edges[j + 1] - edges[j]
        facts = numbers[j, start : start + count]
        own = bounds[low : low + n]
        for k in range(count):
            at[k] = 0
        while n > 0:
            half = (n + 1) >> 1
            for k in range(count):
                at[k] += half if own[at[k] + half - 1] <= facts[k] else 0
            n -= half
        out = codes[slots[j]]
        for k in range(count):
            out[k] = firsts[j] + at[k] if facts[k] == facts[k] else missing[j]


@njit(**_options)
def _encode_groups(values, start, count, members, edges, firsts, strides, codes):  # type: ignore[no-untyped-def]
    """Codes of the groups for `count` contexts from `start` on, into `codes` [group, context in block]; -1 where a fact is
    missing."""
    for g in range(firsts.shape[0]):
        out = codes[g]
        for k in range(count):
            out[k] = firsts[g]
        for i in range(edges[g], edges[g + 1]):
            facts, stride = values[members[i], start : start + count], np.int32(strides[i])
            for k in range(count):
                out[k] = -1 if facts[k] < 0 or out[k] < 0 else out[k] + stride * facts[k]


@njit(**_options)
def batch(values, starts, absent, groups, numbers, slots, bounds, masks, wide, enabled, start, stop, counts, hits):  # type: ignore[no-untyped-def]
    """Counts int64 [N] and hits int64 [rows] of the contexts start … stop - 1, encoded on the way.

    values int32 [value slots, N] are classes, -1 where missing: then mask absent[slot] is in; class v is mask starts[slot] + v.
    groups are the arrays of `stack.Groups`; numbers, slots and bounds (bounds, edges, firsts, missing) as in `_encode_numbers`.
    """
    members, edges, group_firsts, strides = groups
    n_groups, n_wide = group_firsts.shape[0], wide.shape[0]
    codes = np.empty((n_groups, BLOCK), np.int32)
    number_codes = np.empty((numbers.shape[0], BLOCK), np.int32)
    own = np.empty(values.shape[0] + numbers.shape[0], np.int32)
    found = np.empty(masks.shape[1], np.uint64)
    for first in range(start, stop, BLOCK):
        count = min(BLOCK, stop - first)
        _encode_groups(values, first, count, members, edges, group_firsts, strides, codes)
        _encode_numbers(numbers, first, count, bounds[0], bounds[1], bounds[2], bounds[3], number_codes, slots)
        for k in range(count):
            n = 0
            for g in range(n_groups):
                if codes[g, k] >= 0:
                    own[n] = codes[g, k]
                    n += 1
                else:
                    for i in range(edges[g], edges[g + 1]):
                        fact = values[members[i], first + k]
                        own[n] = starts[members[i]] + fact if fact >= 0 else absent[members[i]]
                        n += 1
            for j in range(numbers.shape[0] - n_wide):
                own[n] = number_codes[j, k]
                n += 1
            for j in range(n_wide):
                own[n + j] = number_codes[numbers.shape[0] - n_wide + j, k]
            intersect(masks, own, n, wide, enabled, found)
            n_found = 0
            for w in range(found.shape[0]):
                word = found[w]
                while word:
                    hits[w * 64 + _lowest(word)] += 1
                    n_found += 1
                    word &= word - np.uint64(1)
            counts[first + k] = n_found


@njit(**_options)
def batch_masks(codes, masks, n_plain, wide, enabled, out):  # type: ignore[no-untyped-def]
    """The mask of each context, from codes int32 [N, slots], into `out` uint64 [N, W].

    Places are counted, and no rows cut out: for a table of few words that took longer than the work itself.
    """
    n_words = out.shape[1]
    for k in range(codes.shape[0]):
        for w in range(n_words):
            out[k, w] = enabled[w]
        for j in range(n_plain):
            code = codes[k, j]
            for w in range(n_words):
                out[k, w] &= masks[code, w]
        for i in range(wide.shape[0]):
            _intersect_wide(masks, codes[k, n_plain + i], wide[i], out[k])


@njit(**_options)
def encode(numbers, bounds, edges, firsts, missing, slots, out):  # type: ignore[no-untyped-def]
    """Codes of the number columns for every context, into `out` int32 [slots, N]."""
    codes = np.empty((out.shape[0], BLOCK), np.int32)
    for first in range(0, out.shape[1], BLOCK):
        count = min(BLOCK, out.shape[1] - first)
        _encode_numbers(numbers, first, count, bounds, edges, firsts, missing, codes, slots)
        for j in range(slots.shape[0]):
            out[slots[j], first : first + count] = codes[slots[j], :count]
