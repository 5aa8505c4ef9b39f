"""Contexts as keys: which are the same, how many there are, and a sample of them that can be summed over files.

N contexts, K words a key. The smallest hashes seen are a uniform sample of the distinct contexts that is the same in
whichever order files come; as long as it is not full it is all of them.

Source: Bar-Yossef et al., "Counting distinct elements in a data stream", RANDOM 2002 (the k-th smallest hash as an estimator).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contextdb.core import group_keys, hash_keys

Field = tuple[int, int, int, int]
"""Where a code is in a key: its word, its first bit, how many bits it has, and the code that is 0 there."""
KeyWords = NDArray[np.uint64]
"""uint64 [K, N]"""
Hashes = NDArray[np.uint64]
Counts = NDArray[np.int64]


def hashes_of(words: KeyWords) -> Hashes:
    """A 64-bit number for each key, the same on every machine."""
    hashes = np.empty(words.shape[1], np.uint64)
    hash_keys(words, hashes)
    return hashes


def grouped(words: KeyWords, moments: Counts) -> tuple[Hashes, NDArray[np.int32], Counts]:
    """The distinct keys that have moments: their hashes, the first context of each, and the sum of their moments."""
    hashes = hashes_of(words)
    first, sums = np.empty(len(hashes), np.int32), np.empty(len(hashes), np.int64)
    n = group_keys(words, hashes, moments, first, sums)
    return hashes[first[:n]], first[:n], sums[:n]


def begins(ordered: Hashes) -> NDArray[np.bool_]:
    """Which of some ascending hashes differ from the one before."""
    flags = np.ones(len(ordered), np.bool_)
    flags[1:] = ordered[1:] != ordered[:-1]
    return flags


def estimated(hashes: Hashes, is_full: bool) -> int:
    """How many distinct contexts there are, by the smallest of their hashes."""
    if not is_full:
        return len(hashes)
    return round((len(hashes) - 1) / ((float(hashes[-1]) + 1.0) / 2.0**64))
