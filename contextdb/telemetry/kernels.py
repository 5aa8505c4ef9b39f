"""Numba kernels of telemetry: contexts as packed keys, the distinct ones of many, and sums over their valid rows. Arrays only.

N contexts, P fields each, K words a key, W words a mask. A field is a few bits of one word of the key. `contextdb.telemetry.keys`
does the same with numpy where numba is missing.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from contextdb.compiled.kernels import _lowest, intersect

BLOCK = 256
_options: dict[str, Any] = {"cache": True, "nogil": True, "boundscheck": False, "error_model": "numpy"}


@njit(**_options)
def add_numbers(facts, bounds, low, scale, before, shift, word):  # type: ignore[no-untyped-def]
    """Put the class of each number, as in `NumberClasses`, into `word` uint64 [N] at bit `shift`; the last of the bounds is NaN."""
    last, n_bounds, n_cells = facts.shape[0], bounds.shape[0] - 1, before.shape[0]
    for k in range(last if n_cells > 0 else 0):
        cell = min(max((facts[k] - low) * scale, 0.0), n_cells - 1.0)
        at = before[np.int32(cell)] if facts[k] == facts[k] else np.int32(0)
        found = at + (bounds[at] <= facts[k]) if facts[k] == facts[k] else n_bounds + 1
        word[k] |= np.uint64(found) << np.uint64(shift)
    bisected = np.empty(BLOCK, np.int32)
    for start in range(0 if n_cells == 0 else last, last, BLOCK):
        own, n = facts[start : start + BLOCK], n_bounds
        for k in range(own.shape[0]):
            bisected[k] = 0
        while n > 0:
            half = (n + 1) >> 1
            for k in range(own.shape[0]):
                bisected[k] += half if bounds[bisected[k] + half - 1] <= own[k] else 0
            n -= half
        for k in range(own.shape[0]):
            found = bisected[k] if own[k] == own[k] else n_bounds + 1
            word[start + k] |= np.uint64(found) << np.uint64(shift)


@njit(**_options)
def add_classes(classes, shift, word):  # type: ignore[no-untyped-def]
    """Put each class into `word` uint64 [N] at bit `shift`."""
    for k in range(classes.shape[0]):
        word[k] |= np.uint64(classes[k]) << np.uint64(shift)


@njit(**_options)
def hash_words(words, out):  # type: ignore[no-untyped-def]
    """Mix the words uint64 [K, N] of each key into `out` uint64 [N], which is 0."""
    for start in range(0, out.shape[0], BLOCK):
        stop = min(start + BLOCK, out.shape[0])
        for i in range(words.shape[0]):
            word = words[i]
            for k in range(start, stop):
                h = (out[k] ^ word[k]) + np.uint64(0x9E3779B97F4A7C15)
                h = (h ^ (h >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
                h = (h ^ (h >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
                out[k] = h ^ (h >> np.uint64(31))


@njit(**_options)
def group(words, hashes, moments, table, first, sums):  # type: ignore[no-untyped-def]
    """The first context of each distinct key, and the sum of its moments; gives how many there are. Contexts without a moment are
    left out.

    `table` int32 [a power of two above N] is 0.
    """
    n_found = 0
    last = np.uint64(table.shape[0] - 1)
    for k in range(hashes.shape[0]):
        if moments[k] == 0:
            continue
        at = hashes[k] & last
        while True:
            i = table[at] - 1
            if i < 0:
                table[at] = n_found + 1
                first[n_found], sums[n_found] = k, moments[k]
                n_found += 1
                break
            is_same = hashes[first[i]] == hashes[k]
            for w in range(words.shape[0]):
                is_same = is_same and words[w, first[i]] == words[w, k]
            if is_same:
                sums[i] += moments[k]
                break
            at = (at + np.uint64(1)) & last
    return n_found


@njit(inline="always", **_options)
def _field(words, place, k):  # type: ignore[no-untyped-def]
    """The class in a field, place (word, shift, bits), of context k."""
    return np.int64((words[place[0], k] >> np.uint64(place[1])) & np.uint64(place[2]))


@njit(**_options)
def evaluate(words, rows, sums, fields, groups, numbers, masks, wide, enabled, hits, is_open):  # type: ignore[no-untyped-def]
    """Add the moments `sums` [M] of contexts `rows` [M] to their valid rows' `hits` int64 [64 W]; is_open [M]: none is valid.

    `fields` int64 [P, 5]: word, shift, bits, first mask, class of a missing fact; those of wide columns last. `groups` as in
    `stack.Groups`, its members being fields; `numbers` are the fields of columns of numbers that are not wide.
    """
    members, edges, firsts, strides = groups
    own = np.empty(fields.shape[0] + 1, np.int32)
    found = np.empty(masks.shape[1], np.uint64)
    n_wide = wide.shape[0]
    for m in range(rows.shape[0]):
        k, n = rows[m], 0
        for g in range(firsts.shape[0]):
            leaf, n_before, is_whole = firsts[g], n, True
            for i in range(edges[g], edges[g + 1]):
                field = fields[members[i]]
                code = _field(words, field, k)
                leaf += strides[i] * code
                is_whole = is_whole and code != field[4]
                own[n] = field[3] + code
                n += 1
            if is_whole:
                own[n_before] = leaf
                n = n_before + 1
        for i in range(numbers.shape[0]):
            field = fields[numbers[i]]
            own[n] = field[3] + _field(words, field, k)
            n += 1
        for i in range(n_wide):
            own[n + i] = _field(words, fields[fields.shape[0] - n_wide + i], k)
        intersect(masks, own, n, wide, enabled, found)
        any_row = np.uint64(0)
        for w in range(found.shape[0]):
            word = found[w]
            any_row |= word
            while word:
                hits[w * 64 + _lowest(word)] += sums[m]
                word &= word - np.uint64(1)
        is_open[m] = any_row == np.uint64(0)


@njit(**_options)
def list_rows(masks, out):  # type: ignore[no-untyped-def]
    """The rows that masks uint64 [N, W] hold, one mask after the other, into `out` int64 of as many."""
    n = 0
    for k in range(masks.shape[0]):
        for w in range(masks.shape[1]):
            word = masks[k, w]
            while word:
                out[n] = w * 64 + _lowest(word)
                n += 1
                word &= word - np.uint64(1)
