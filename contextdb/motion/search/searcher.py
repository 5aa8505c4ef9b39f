"""Put a search to the core, in numbers that it can read; see `contextdb/core/search.h`.

N frames, F features, R ranges.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.cells.arguments import require_kind, require_many, require_text
from contextdb.core import Frames
from contextdb.disk.engines import n_cores
from contextdb.errors import Fault, MotionError, in_quotes
from contextdb.motion import arguments
from contextdb.motion.arguments import Flags
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.feet import NO_MARKS
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.features.extraction import ClipFeatures, clip_permutations
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.markup.markup import Markup
from contextdb.motion.search import cost
from contextdb.motion.search.filters import Filter, ManyFilters
from contextdb.motion.search.layout import Features, Layout

REFUSED = -2
"""The range of a query that cannot be compared."""
BLOCK_QUERIES = 512
"""So many queries at most are given to a thread together."""
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
        is_plain = type(query) is np.ndarray and query.dtype == np.float64 and query.flags.c_contiguous
        raw = cast("Floats", query) if is_plain else np.ascontiguousarray(arguments.numbers_of(query, "the query"))
        best_range = REFUSED
        if raw.shape == self._shape:
            own = (chosen.skip_spans, chosen.current, chosen.continuing, within, totals, frames)
            best_range = self.frames.search(raw, chosen.ranges, chosen.range_biases, *shared_parts(chosen), *own)
        if best_range == REFUSED:
            self.normalised(query)  # says what is wrong
        return best_range, totals, frames

    def least_of_many(self, queries: Floats, filters: ManyFilters) -> tuple[Ints, Ints, Floats]:
        """For each query [Q, F] and its filter the best frame's range (-1 for none), its number and its total: arrays [Q]."""
        n = len(queries)
        totals, frames, ranges = np.empty(n), np.empty(n, np.int64), np.full(n, REFUSED, np.int64)
        if queries.shape[1:] == self._shape:
            of_ranges, of_frames = (filters.ranges, filters.range_biases), shared_parts(filters.shared)
            own = (*filters.skip_spans, filters.currents, filters.shared.continuing)
            search = partial(self.frames.search_many, np.ascontiguousarray(queries), *of_ranges, *of_frames, *own)
            in_blocks(n, lambda start, stop: search(start, stop, totals, frames, ranges))
        for i in np.flatnonzero(ranges == REFUSED)[:1]:
            self.normalised(queries[i])  # says what is wrong
        return ranges, frames, totals

    def normalised(self, query: ArrayLike) -> Floats:
        """A query [F], checked and normalised: float64."""
        raw = arguments.query_of(query, self.feature_names)
        wanted = self.normalisation.apply(raw)
        arguments.refuse_infinite(wanted, raw, self.feature_names)
        return wanted

    @cached_property
    def frames(self) -> Frames:
        """What the core searches; it is handed over once, as that takes longer than some searches."""
        return Frames(*self.frame_parts)

    @property
    def frame_parts(self) -> tuple[Any, ...]:
        """What the core makes that of."""
        lay, kinds = self.layout, self.kinds.astype(np.int32)
        most = int(kinds.max(initial=0))
        own = (lay.blocks, lay.order, lay.rank, lay.box_starts, lay.box_sizes, lay.box_ranges, lay.kinds_of_boxes(kinds))
        channels = np.array([0, *(columns.stop for columns in self.slices)], np.int64)
        roots = np.sqrt(cost.weights_of_features(self.slices, self.weights))
        scaling = (self.normalisation.offset, self.normalisation.scale)
        return (
            *map(np.ascontiguousarray, (*own, lay.range_boxes)),
            kinds if most else None,
            len(kinds),
            most + 1,
            *map(np.ascontiguousarray, (*scaling, channels, self.weights, roots)),
        )


def shared_parts(chosen: Filter) -> tuple[NDArray[np.bool_] | Floats | None, ...]:
    """What the core is told of frames and their kinds."""
    kinds, flags, biases = chosen.kinds, chosen.frames, chosen.frame_biases
    return kinds.allowed, kinds.biases, kinds.playable, flags if len(flags) else None, biases if len(biases) else None


def in_blocks(n: int, work: Callable[[int, int], object]) -> None:
    """Do some work for 0 … n - 1 in blocks, on as many cores as this process may use."""
    n_threads = max(1, min(n_cores(), n // THREAD_QUERIES))
    n_blocks = n_threads * max(1, -(-n // (n_threads * BLOCK_QUERIES)))
    cuts = [n * i // n_blocks for i in range(n_blocks + 1)]
    if n_threads == 1:
        for start, stop in pairwise(cuts):
            work(start, stop)
        return
    with ThreadPoolExecutor(n_threads) as pool:
        list(pool.map(work, cuts[:-1], cuts[1:]))


# ---- what a motion database is made of, checked: the features of clips, or features as they are


def parts_of(
    clips: Iterable[Clip], schema: FeatureSchema, mirror: bool | Collection[str] = False, markup: Markup | None = None
) -> list[ClipFeatures]:
    """The features of each clip in all its permutations, and of those to be mirrored once more; the faults of all clips together.

    Clips that loop by the markup go on at their ends, and feet that it marks are down just then.
    """
    parts = []
    faults: list[Fault] = []
    seen: set[str] = set()
    for name in () if isinstance(mirror, bool) else require_many(mirror, "mirror", "True, False, or the names of clips"):
        require_text(name, "one of mirror")
    for clip in require_many(clips, "clips", "a list of Clip"):
        require_kind(clip, Clip, "one of clips", "a Clip")
        if clip.name in seen:
            faults.append(
                Fault(f"two clips are named {in_quotes(clip.name)}.", "a different name for each asset", rule="duplicate")
            )
        seen.add(clip.name)
        is_mirrored = mirror if isinstance(mirror, bool) else clip.name in mirror
        try:
            looping = markup is not None and markup.is_looping(clip.name)
            ways = (False, True) if is_mirrored else (False,)
            marks = NO_MARKS if markup is None else markup.contacts_of(clip.name)
            for way in ways:
                parts += clip_permutations(clip, schema, mirrored=way, looping=looping, contacts=marks)
        except MotionError as error:
            faults.extend(error.faults)
    if faults:
        raise MotionError(*faults)
    return parts


def as_features(features: ArrayLike) -> Features:
    """Features as they are given: float32, frames x features."""
    array = arguments.array_of(features, "the features", MotionError)
    if array.ndim != 2:
        raise MotionError(Fault(f"the features have shape {array.shape}.", "frames x features"))
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(array, np.float32)


def check_permutations(parts: Sequence[ClipFeatures], schema: FeatureSchema) -> None:
    """Refuse parts that are not all permutations of a clip, then all of the next."""
    n = len(schema.permutation_s)
    for first in range(0, len(parts), n):
        same = {(part.asset, part.mirrored, len(part.features)) for part in parts[first : first + n]}
        if len(same) > 1 or len(parts) - first < n:
            problem = f"the features of {in_quotes(parts[first].asset)} are not those of its {n} permutations."
            raise MotionError(Fault(problem, "all that `clip_permutations` gives of a clip, in order"))


def check_finite(features: Features, starts: Ints, stops: Ints, assets: Sequence[str]) -> None:
    """Refuse features that are not finite inside a range; what lies between ranges is never looked at."""
    is_wrong: Flags = np.logical_not(np.isfinite(features).all(axis=1))
    for i, (start, stop) in enumerate(zip(starts.tolist(), stops.tolist(), strict=True)):
        if is_wrong[start:stop].any():
            frame = start + int(np.argmax(is_wrong[start:stop]))
            feature = int(np.argmin(np.isfinite(features[frame])))
            problem = f"feature {feature} of frame {frame} is {features[frame, feature]} (range {i}, asset {in_quotes(assets[i])})."
            raise MotionError(Fault(problem, "finite numbers within every range"))
