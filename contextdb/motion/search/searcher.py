"""Ask the compiled search, or scan every frame where numba is missing. Both give the same frames at the same costs.

N frames, F features, R ranges.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property
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

MOST_KINDS = 65536
"""With more kinds of frames than this, every frame is scanned."""


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
            scan.least(self.layout, wanted, self.slices, self.weights, chosen, self.kinds, within, totals, frames)
            return self.layout.range_of(int(frames[0])), totals, frames
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

    def least_of_each(self, queries: Floats, filters: Sequence[Filter]) -> tuple[list[int], list[int], list[float]]:
        """For each query [Q, F] and its filter the best frame's range (-1 for none), its number and its total."""
        found = [self.least(query, chosen, np.inf, 1) for query, chosen in zip(queries, filters, strict=True)]
        return [i for i, _, _ in found], [int(frames[0]) for _, _, frames in found], [float(totals[0]) for _, totals, _ in found]

    def normalised(self, query: ArrayLike) -> Floats:
        """A query [F], checked and normalised: float64."""
        raw = arguments.query_of(query, self.feature_names)
        wanted = self.normalisation.apply(raw)
        arguments.refuse_infinite(wanted, raw, self.feature_names)
        return wanted

    @cached_property
    def _compiled(self) -> tuple[ModuleType, Any] | None:
        """The kernels and what they take of the database; None where they cannot be used."""
        kernels = load_kernels()
        if kernels is None or int(self.kinds.max(initial=0)) >= MOST_KINDS:
            return None
        offset, scale = self.normalisation.offset, self.normalisation.scale
        return kernels, kernels.pack(self.layout, self.kinds.astype(np.uint16), offset, scale, self.slices, self.weights)


@cache
def load_kernels() -> ModuleType | None:
    """The compiled search; None where numba is missing, or has no place to keep what it compiles."""
    try:
        from contextdb.motion.search import kernels
    except (ImportError, RuntimeError):
        return None
    announce(kernels.search)
    kernels.search.compile(kernels.SIGNATURE)
    kernels.search.disable_compile()
    return kernels
