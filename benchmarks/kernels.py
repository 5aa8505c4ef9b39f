"""The batch yardsticks' kernel: AND the masks of each context, column outer, four columns a pass, and count.

It takes ready codes. contextdb's own kernel encodes as it goes; the difference between the two is what fusing brings.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange


@njit(cache=True, inline="always")
def _place(bit):  # type: ignore[no-untyped-def]
    """The number of the only bit that is set: the bits below it, counted."""
    below = bit - np.uint64(1)
    below -= (below >> np.uint64(1)) & np.uint64(0x5555555555555555)
    below = (below & np.uint64(0x3333333333333333)) + ((below >> np.uint64(2)) & np.uint64(0x3333333333333333))
    below = (below + (below >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((below * np.uint64(0x0101010101010101)) >> np.uint64(56))


@njit(cache=True, boundscheck=False, parallel=True)
def counts_and_hits(masks, codes, counts, hits):  # type: ignore[no-untyped-def]
    """Fill counts int64 [N], and hits int64 [threads, R rounded up to 64], from masks uint64 [M, W] and codes int32 [N, C]."""
    n_contexts, n_columns = codes.shape
    n_words = masks.shape[1]
    n_threads = hits.shape[0]
    for t in prange(n_threads):
        found = np.empty(n_words, np.uint64)
        for k in range(t * n_contexts // n_threads, (t + 1) * n_contexts // n_threads):
            found[:] = masks[codes[k, 0]]
            j = 1
            while j + 4 <= n_columns:
                a, b, c, d = masks[codes[k, j]], masks[codes[k, j + 1]], masks[codes[k, j + 2]], masks[codes[k, j + 3]]
                for w in range(n_words):
                    found[w] &= (a[w] & b[w]) & (c[w] & d[w])
                j += 4
            while j < n_columns:
                a = masks[codes[k, j]]
                for w in range(n_words):
                    found[w] &= a[w]
                j += 1
            n_found = 0
            for w in range(n_words):
                word = found[w]
                while word:
                    low = word & (~word + np.uint64(1))
                    hits[t, w * 64 + _place(low)] += 1
                    n_found += 1
                    word ^= low
            counts[k] = n_found
