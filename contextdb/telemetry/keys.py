"""Contexts as keys: which are the same, how many there are, and a sample of them that can be summed over files.

N contexts, K words a key. The smallest hashes seen are a uniform sample of the distinct contexts that is the same in
whichever order files come; as long as it is not full it is all of them. Where numba is missing numpy does the same, slower.

Source: Bar-Yossef et al., "Counting distinct elements in a data stream", RANDOM 2002 (the k-th smallest hash as an estimator).
"""

from __future__ import annotations

import sys
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Words
from contextdb.console import announce, has_numba
from contextdb.telemetry.number_classes import NumberClasses

KeyWords = NDArray[np.uint64]
"""uint64 [K, N]"""
Hashes = NDArray[np.uint64]
Counts = NDArray[np.int64]
NUMPY_BLOCK = 2048


def add_numbers(facts: NDArray[np.float64], among: NumberClasses, shift: int, word: NDArray[np.uint64]) -> None:
    """Put the class of each number into `word` uint64 [N] at bit `shift`."""
    if kernels := load_kernels():
        kernels.add_numbers(facts, among.ended, among.low, among.scale, among.before, shift, word)
    else:
        classes = np.where(np.isnan(facts), len(among.bounds) + 1, np.searchsorted(among.bounds, facts, "right"))
        word |= classes.astype(np.uint64) << np.uint64(shift)


def add_classes(classes: NDArray[np.int32] | NDArray[np.uint8], shift: int, word: NDArray[np.uint64]) -> None:
    """Put each class into `word` uint64 [N] at bit `shift`."""
    if kernels := load_kernels():
        kernels.add_classes(classes, shift, word)
    else:
        word |= classes.astype(np.uint64) << np.uint64(shift)


def hashes_of(words: KeyWords) -> Hashes:
    """A 64-bit number for each key, the same on every machine."""
    out = np.zeros(words.shape[1], np.uint64)
    if kernels := load_kernels():
        kernels.hash_words(words, out)
        return out
    for word in words:
        out = (out ^ word) + np.uint64(0x9E3779B97F4A7C15)
        out = (out ^ (out >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        out = (out ^ (out >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        out = out ^ (out >> np.uint64(31))
    return out


def grouped(words: KeyWords, moments: Counts) -> tuple[Hashes, NDArray[np.int32], Counts]:
    """The distinct keys that have moments: their hashes, the first context of each, and the sum of their moments."""
    hashes = hashes_of(words)
    if kernels := load_kernels():
        table = np.zeros(2 << max(1, len(hashes)).bit_length(), np.int32)
        first, sums = np.empty(len(hashes), np.int32), np.empty(len(hashes), np.int64)
        n = kernels.group(words, hashes, moments, table, first, sums)
        first, sums = first[:n], sums[:n]
    else:
        first, sums = _grouped_with_numpy(words, hashes, moments)
    return hashes[first], first, sums


def _grouped_with_numpy(words: KeyWords, hashes: Hashes, moments: Counts) -> tuple[NDArray[np.int32], Counts]:
    """The first context of each distinct key that has moments, ascending, and the sum of its moments."""
    counted = np.flatnonzero(moments)
    order = counted[np.argsort(hashes[counted], kind="stable")]
    if not _tells_apart(words[:, order], hashes[order]):
        order = counted[np.lexsort(words[:, counted])]
    starts = np.flatnonzero(np.append(True, _differ(words[:, order]))[: len(order)])
    first, sums = order[starts], np.add.reduceat(moments[order], starts) if len(starts) else np.zeros(0, np.int64)
    by_first = np.argsort(first)
    return first[by_first].astype(np.int32), sums[by_first]


def _tells_apart(words: KeyWords, hashes: Hashes) -> bool:
    """Whether keys that lie beside each other, and differ, differ in their hashes too."""
    return not (_differ(words) & (hashes[1:] == hashes[:-1])).any()


def _differ(words: KeyWords) -> NDArray[np.bool_]:
    """Which keys differ from the one before, from the second on."""
    return np.asarray((words[:, 1:] != words[:, :-1]).any(axis=0))


def begins(ordered: Hashes) -> NDArray[np.bool_]:
    """Which of some ascending hashes differ from the one before."""
    found = np.ones(len(ordered), np.bool_)
    found[1:] = ordered[1:] != ordered[:-1]
    return found


def estimated(hashes: Hashes, is_full: bool) -> int:
    """How many distinct contexts there are, by the smallest of their hashes."""
    if not is_full:
        return len(hashes)
    return round((len(hashes) - 1) / ((float(hashes[-1]) + 1.0) / 2.0**64))


def rows_of(masks: Words) -> NDArray[np.int64]:
    """The rows that masks uint64 [N, W] hold, one mask after the other."""
    if kernels := load_kernels():
        found = np.empty(int(bitmask.count(masks).sum()), np.int64)
        kernels.list_rows(masks, found)
        return found
    blocks = (masks[start : start + NUMPY_BLOCK] for start in range(0, len(masks), NUMPY_BLOCK))
    return np.concatenate([np.zeros(0, np.int64), *(bitmask.places(b)[1] for b in blocks)])


def load_kernels() -> ModuleType | None:
    """The compiled kernels; None where numba is not installed."""
    is_loaded = "contextdb.telemetry.kernels" in sys.modules
    if not is_loaded and not has_numba():
        return None
    try:
        from contextdb.telemetry import kernels
    except ImportError:
        return None
    if not is_loaded:
        announce(kernels.evaluate)
    return kernels
