"""Ask the compiled search, or the one of numpy where numba is missing. Both give the same frames at the same costs.

N frames, F features, R ranges.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache, cached_property
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.console import announce
from contextdb.motion import arguments
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.search import scan
from contextdb.motion.search.filters import Filter
from contextdb.motion.search.layout import Layout
from contextdb.motion.search.many_filters import ManyFilters

MOST_KINDS = 65536
"""With more kinds of frames than this, numpy searches."""
BLOCK_QUERIES = 512
"""So many queries at most go through the frames together."""
THREAD_QUERIES = 32
"""Fewer queries than this are not worth a second thread."""


class Searcher:
    """Finds the cheapest frames of one database."""

    def __init__(
        self,
        layout: Layout,
        kinds: NDArray[np.integer],
        normalisation: Normalisation,
        slices: tuple[slice, ...],
        weights: Floats,
        feature_names: tuple[str, ...],
    ) -> None:
        self.layout, self.kinds, self.normalisation = layout, kinds, normalisation
        self.slices, self.weights, self.feature_names = slices, weights, feature_names
        self._shape = (layout.n_features,)

    def least(self, query: ArrayLike, chosen: Filter, within: float, n: int) -> tuple[int, Floats, Ints]:
        """The lowest totals not above `within` and their frames: one of all frames (n = 1), or one for each range (n = R).

        Gives the range of the best frame too, -1 for none; it means nothing where there is one for each range.
        """
        totals, frames = np.empty(n), np.empty(n, np.int64)
        if self._compiled is None:
            wanted = self.normalised(query)
            totals[:], frames[:] = within, -1
            if n == 1:
                own_range, frames[0], totals[0] = self._scan.best(wanted, chosen)
                return own_range, totals, frames
            at, found, own = self._scan.least(wanted, chosen, within)
            totals[at], frames[at] = own, found
            return 0, totals, frames
        kernels, pack = self._compiled
        is_plain = type(query) is np.ndarray and query.dtype == np.float64 and query.flags.c_contiguous
        raw = query if is_plain else np.ascontiguousarray(arguments.numbers_of(query, "the query"))
        found = kernels.REFUSED
        if raw.shape == self._shape:  # type: ignore[union-attr]
            of_kinds = (chosen.kinds.allowed, chosen.kinds.biases, chosen.kinds.playable)
            of_frames = (chosen.frames, chosen.frame_biases, chosen.skip_spans, chosen.current, chosen.continuing)
            given = (chosen.ranges, chosen.is_whole, chosen.range_biases, chosen.least_of_ranges, *of_kinds, *of_frames)
            found = kernels.search(pack.numbers, raw, *given, within, totals, frames)
        if found == kernels.REFUSED:
            self.normalised(query)  # says what is wrong
        return found, totals, frames

    def least_of_many(self, queries: Floats, filters: ManyFilters) -> tuple[Ints, Ints, Floats]:
        """For each query [Q, F] and its filter the best frame's range (-1 for none), its number and its total: arrays [Q]."""
        n = len(queries)
        totals, frames, ranges = np.empty(n), np.empty(n, np.int64), np.empty(n, np.int64)
        if self._compiled_for_many is None or queries.shape[1:] != self._shape:
            wanted = np.array([self.normalised(query) for query in queries]).reshape(n, *self._shape)
            return self._scan.least_of_many(wanted, filters)
        kernels, arrays = self._compiled_for_many
        shared = filters.shared
        of_kinds = (shared.kinds.allowed, shared.kinds.biases, shared.kinds.playable)
        of_ranges = (filters.ranges, filters.range_biases, filters.least_of_ranges)
        of_frames = (shared.frames, shared.frame_biases, *filters.skip_spans, filters.currents, shared.continuing)
        given = (*arrays, queries, *of_ranges, *of_kinds, *of_frames, totals, frames, ranges)
        in_blocks(n, lambda start, stop: kernels.search_block(start, stop, *given))
        for i in np.flatnonzero(ranges == kernels.REFUSED)[:1]:
            self.normalised(queries[i])  # says what is wrong
        return ranges, frames, totals

    def normalised(self, query: ArrayLike) -> Floats:
        """A query [F], checked and normalised: float64."""
        raw = arguments.query_of(query, self.feature_names)
        wanted = self.normalisation.apply(raw)
        arguments.refuse_infinite(wanted, raw, self.feature_names)
        return wanted

    @cached_property
    def _scan(self) -> scan.Scan:
        """The search by numpy."""
        return scan.Scan(self.layout, self.kinds, self.slices, self.weights)

    @cached_property
    def _compiled(self) -> tuple[ModuleType, Any] | None:
        """The kernels and what they take of the database; None where they cannot be used."""
        kernels = load_kernels()
        if kernels is None or int(self.kinds.max(initial=0)) >= MOST_KINDS:
            return None
        offset, scale = self.normalisation.offset, self.normalisation.scale
        return kernels, kernels.pack(self.layout, self.kinds.astype(np.uint16), offset, scale, self.slices, self.weights)

    @property
    def _compiled_for_many(self) -> tuple[ModuleType, tuple[NDArray[Any], ...]] | None:
        """The kernels for many queries and the database's arrays; None where they cannot be used."""
        if self._compiled is None or (kernels := load_many_kernels()) is None:
            return None
        return kernels, self._compiled[1].arrays


@cache
def load_kernels() -> ModuleType | None:
    """The compiled search; None where numba is missing, or has no place to keep what it compiles."""
    try:
        from contextdb.motion.search import kernels
    except (ImportError, RuntimeError):
        return None
    compile_loop(kernels.search, kernels.SIGNATURE)
    return kernels


@cache
def load_many_kernels() -> ModuleType | None:
    """The compiled search for many queries; None where `load_kernels` gives none."""
    if load_kernels() is None:
        return None
    from contextdb.motion.search import many_kernels

    compile_loop(many_kernels.search_block, many_kernels.SIGNATURE)
    return many_kernels


def compile_loop(loop: Any, signature: str) -> None:
    """Compile a loop for the one signature that it is called with, and for no other."""
    announce(loop)
    loop.compile(signature)
    loop.disable_compile()


def in_blocks(n: int, work: Callable[[int, int], object]) -> None:
    """Do some work for 0 … n - 1 in blocks, on as many cores as this process may use."""
    n_threads = max(1, min(_n_cores(), n // THREAD_QUERIES))
    n_blocks = n_threads * max(1, -(-n // (n_threads * BLOCK_QUERIES)))
    cuts = [n * i // n_blocks for i in range(n_blocks + 1)]
    if n_threads == 1:
        for start, stop in pairwise(cuts):
            work(start, stop)
        return
    with ThreadPoolExecutor(n_threads) as pool:
        list(pool.map(work, cuts[:-1], cuts[1:]))


def _n_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
