"""Numba kernels of telemetry: a number for each context, and sums over the rows that masks hold. Arrays only.

N contexts, P codes each, W words a mask. `contextdb.telemetry.keys` does the same with numpy where numba is not there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

_options: dict[str, Any] = {"cache": True, "nogil": True, "boundscheck": False, "error_model": "numpy"}


@njit(**_options)
def hash_rows(keys, out):  # type: ignore[no-untyped-def]
    """Mix the codes int32 [N, P] of each context into `out` uint64 [N]."""
    for i in range(keys.shape[0]):
        h = np.uint64(0)
        for j in range(keys.shape[1]):
            h = (h ^ np.uint64(np.int64(keys[i, j]))) + np.uint64(0x9E3779B97F4A7C15)
            h = (h ^ (h >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            h = (h ^ (h >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            h = h ^ (h >> np.uint64(31))
        out[i] = h


@njit(**_options)
def add_hits(masks, moments, hits):  # type: ignore[no-untyped-def]
    """Add the moments of each context to the rows that its mask uint64 [N, W] holds; `hits` is int64 [64 W]."""
    for i in range(masks.shape[0]):
        for w in range(masks.shape[1]):
            word = masks[i, w]
            base = 64 * w
            while word != np.uint64(0):
                if word & np.uint64(0xFF) == np.uint64(0):
                    word >>= np.uint64(8)
                    base += 8
                    continue
                if word & np.uint64(1):
                    hits[base] += moments[i]
                word >>= np.uint64(1)
                base += 1
