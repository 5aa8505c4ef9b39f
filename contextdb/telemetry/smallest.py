"""The contexts of the smallest hashes, as many as are retained, with their moments: gathered chunk by chunk.

Once more were seen, only what is not above the largest retained can still be among the smallest; so what is retained has all
its moments, however the contexts come.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contextdb.telemetry.keys import Counts, Hashes, KeyWords, begins


class Smallest:
    """At most `most` hashes, the smallest of all that were added."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.is_full = False
        """Whether there were more than are retained."""
        self._limit: np.uint64 | None = None
        self._parts: list[Hashes] = []
        self._n_waiting = 0

    def add(self, hashes: Hashes) -> NDArray[np.int64] | None:
        """Add some hashes; gives the places of those that may be among the smallest, None for all."""
        near = None if self._limit is None else np.flatnonzero(hashes <= self._limit)
        self._parts.append(hashes if near is None else hashes[near])
        self._n_waiting += len(self._parts[-1])
        return near

    @property
    def wants_sorting(self) -> bool:
        """Whether so many wait that the largest should go."""
        return self._n_waiting > 2 * self.most

    def settle(self) -> tuple[Hashes, NDArray[np.int64], NDArray[np.bool_]]:
        """Keep the smallest alone: they, ascending; the order of all that waited; and which of that order begin a new hash."""
        waiting = np.concatenate([np.zeros(0, np.uint64), *self._parts])
        order = np.argsort(waiting, kind="stable")
        ordered = waiting[order]
        is_new = begins(ordered)
        retained = ordered[is_new]
        self.is_full = self.is_full or len(retained) > self.most
        retained = retained[: self.most]
        self._limit = retained[-1] if self.is_full else None
        self._parts, self._n_waiting = [retained], len(retained)
        return retained, order, is_new


class SmallestHashes:
    """The smallest hashes alone."""

    def __init__(self, most: int) -> None:
        self._smallest = Smallest(most)

    def add(self, hashes: Hashes) -> None:
        self._smallest.add(hashes)
        if self._smallest.wants_sorting:
            self._smallest.settle()

    def settled(self) -> tuple[Hashes, bool]:
        """The smallest, ascending, and whether there were more."""
        hashes, _, _ = self._smallest.settle()
        return hashes, self._smallest.is_full


class SmallestKeys:
    """The contexts of the smallest hashes with their keys and moments."""

    def __init__(self, most: int, n_words: int) -> None:
        self._smallest = Smallest(most)
        self._words: list[KeyWords] = [np.zeros((n_words, 0), np.uint64)]
        self._moments: list[Counts] = [np.zeros(0, np.int64)]

    def add(self, hashes: Hashes, words: KeyWords, at: NDArray[np.int32], moments: Counts) -> None:
        """Add contexts: key i is column at[i] of `words`."""
        near = self._smallest.add(hashes)
        self._words.append(words[:, at if near is None else at[near]])
        self._moments.append(moments if near is None else moments[near])
        if self._smallest.wants_sorting:
            self.settled()

    def settled(self) -> tuple[Hashes, KeyWords, Counts, bool]:
        """Hashes ascending, keys and moments, and whether these are all."""
        hashes, order, is_new = self._smallest.settle()
        words, moments = np.concatenate(self._words, axis=1)[:, order], np.concatenate(self._moments)[order]
        sums = np.add.reduceat(moments, np.flatnonzero(is_new)) if len(moments) else moments
        self._words, self._moments = [words[:, is_new][:, : len(hashes)]], [sums[: len(hashes)]]
        return hashes, self._words[0], self._moments[0], not self._smallest.is_full
