"""Contexts as keys: which are the same, how many there are, and a sample of them that can be summed over files.

A key is what the table can tell of a context: int32 codes. The smallest hashes seen are a uniform sample of the distinct contexts
that is the same in whichever order files come; as long as it is not full it is all of them.

Source: Bar-Yossef et al., "Counting distinct elements in a data stream", RANDOM 2002 (the k-th smallest hash as an estimator).
"""

from __future__ import annotations

from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Words

Keys = NDArray[np.int32]
Hashes = NDArray[np.uint64]
Counts = NDArray[np.int64]

MOST_HASHES = 1 << 16


def row_hashes(keys: Keys) -> Hashes:
    """A 64-bit number for each key, the same on every machine."""
    out = np.zeros(len(keys), np.uint64)
    if kernels := _kernels():
        kernels.hash_rows(keys, out)
        return out
    for column in keys.T.astype(np.int64):
        out = (out ^ column.view(np.uint64)) + np.uint64(0x9E3779B97F4A7C15)
        out = (out ^ (out >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        out = (out ^ (out >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        out = out ^ (out >> np.uint64(31))
    return out


def grouped(keys: Keys, moments: Counts) -> tuple[Hashes, NDArray[np.int64], Counts]:
    """The distinct keys: their hashes, the first row of each, and the sum of their moments."""
    hashes = row_hashes(keys)
    distinct, first, inverse = np.unique(hashes, return_index=True, return_inverse=True)
    if not np.array_equal(keys[first][inverse], keys):  # two keys of one hash: once in 2^28 chunks
        _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        distinct = hashes[first]
    sums = np.zeros(len(first), np.int64)
    np.add.at(sums, inverse.reshape(-1), moments)
    return distinct, first, sums


def add_hits(masks: Words, moments: Counts, hits: Counts) -> None:
    """Add the moments of each context to the rows that its mask holds; `hits` is int64 [64 W]."""
    if kernels := _kernels():
        kernels.add_hits(masks, moments, hits)
    else:
        hits += moments @ bitmask.unpack(masks, len(hits)).astype(np.int64)


def smallest(hashes: Hashes, most: int = MOST_HASHES) -> Hashes:
    """The smallest of some hashes, each once, ascending."""
    return np.unique(hashes)[:most]


def estimated(hashes: Hashes, is_full: bool) -> int:
    """How many distinct contexts there are, by the smallest of their hashes."""
    if not is_full:
        return len(hashes)
    return round((len(hashes) - 1) / ((float(hashes[-1]) + 1.0) / 2.0**64))


def _kernels() -> ModuleType | None:
    try:
        from contextdb.telemetry import kernels
    except ImportError:
        return None
    return kernels
