"""What compiled loops share, and the one that tells how many boxes hold each of many contexts. Arrays only.

Compiled by numba where it is installed, else run as they are: the same sums in the same order, so the same bytes.
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return, no-redef"

from __future__ import annotations

from typing import Any

import numpy as np

try:
    from numba import njit as njit

    IS_COMPILED = True
except ImportError:  # pragma: no cover - the same loops, slower
    IS_COMPILED = False

    def njit(**_options: Any) -> Any:
        """Leave the loops as they are."""
        return lambda loop: loop


options: dict[str, Any] = {"cache": True, "nogil": True, "boundscheck": False, "error_model": "numpy"}
NONE, ONE, ALL = np.uint64(0), np.uint64(1), np.uint64(0xFFFFFFFFFFFFFFFF)


@njit(**options)
def mixed(x):
    """The bits of a number, stirred."""
    x = np.uint64(x)
    x ^= x >> np.uint64(33)
    x *= np.uint64(0xFF51AFD7ED558CCD)
    x ^= x >> np.uint64(33)
    x *= np.uint64(0xC4CEB9FE1A85EC53)
    return x ^ (x >> np.uint64(33))


@njit(**options)
def n_bits(x):
    """How many bits of a word are set."""
    x = x - ((x >> ONE) & np.uint64(0x5555555555555555))
    x = (x & np.uint64(0x3333333333333333)) + ((x >> np.uint64(2)) & np.uint64(0x3333333333333333))
    x = (x + (x >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((x * np.uint64(0x0101010101010101)) >> np.uint64(56))


@njit(**options)
def lowest_bit(x):
    """The number of the lowest bit of a word that is set."""
    return n_bits((x & (~x + ONE)) - ONE)


if not IS_COMPILED:  # Python counts bits of its own numbers faster

    def n_bits(x: Any) -> int:
        """How many bits of a word are set."""
        return int(x).bit_count()

    def lowest_bit(x: Any) -> int:
        """The number of the lowest bit of a word that is set."""
        return (int(x) & -int(x)).bit_length() - 1


@njit(**options)
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
