"""A motion database: the features of all frames of some assets, and the exact search for the best frame that may play now.

    cost of a frame = Σ over channels of channel_weight × squared difference of normalised features
                      ÷ Σ over channels of channel_weight × number of features, and its biases

So a cost is a weighted mean of squared differences and means the same for every schema: 0 is the same pose and path, and two frames
that have nothing to do with each other cost 2 on average. Of a database made from features it is the plain sum.

N frames, F features, R ranges. A range is the frames [start, stop) of one asset; frames between ranges belong to none and are never
chosen. Which assets may play now comes as a mask next to the cost, so that it can change with every search and rebuilds nothing.
Nothing here reads a file or knows a table.

Source: Büttner and Clavet, "Motion Matching", 2015; orangeduck/Motion-Matching; the filter is the context database's (EA, GDC); the
biases are those of Unreal's PoseSearch.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from numbers import Real
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import (
    require_kind,
    require_mapping,
    require_number,
    require_text,
)
from contextdb.core import Frames
from contextdb.errors import Fault, MotionError, QueryError, in_quotes, no_such, plural
from contextdb.files import scratch
from contextdb.motion import arguments
from contextdb.motion.arguments import Currents, Flags, Valid, ValidForMany, ValidRanges
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.features.extraction import ClipFeatures
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.markup.left_out import Skip
from contextdb.motion.markup.marking import marks_of
from contextdb.motion.markup.marks import Marks
from contextdb.motion.markup.markup import Markup
from contextdb.motion.ranges import check_ranges
from contextdb.motion.search import candidates, cost
from contextdb.motion.search.candidates import Candidates, Searched
from contextdb.motion.search.cost import weights_of_features
from contextdb.motion.search.filtering import FilterMaker, Penalties, SearchOptions, Tags
from contextdb.motion.search.filters import NO_BIAS, Biases, Filter, ManyFilters, together
from contextdb.motion.search.hit import NOTHING, Hit
from contextdb.motion.search.layout import Layout
from contextdb.motion.search.searcher import Searcher, as_features, check_finite, check_permutations, parts_of


@dataclass(frozen=True, eq=False, repr=False)
class MotionDatabase(Searched):
    """Frames to search. Make one with `build` from clips, or with `from_features` from arrays.

    Attributes
    ----------
    layout : Layout
        The features, normalised and not weighted, in the boxes that a search reads.
    starts, stops : int64 arrays, shape (R,)
        Range i is the frames from starts[i] up to, not including, stops[i].
    assets : tuple of str, length R
        The asset of each range.
    mirrored : bool array, shape (R,)
        Whether the range plays its asset mirrored.
    channel_names : tuple of str, length C
    slices : tuple of slice, length C
        Each channel's features.
    weights : float64 array, shape (C,)
        As given; a cost is made with `cost_weights`.
    normalisation : Normalisation
        How a query in the schema's units becomes comparable with `features`.
    marks : Marks
        What the markup says of each frame.
    biases : Biases
    root : float32 array, shape (N, 3), or None
        Where the body is on the ground in its clip, x and z in metres, and its heading in radians.
    schema : FeatureSchema or None
        None for a database made from features.
    """

    @classmethod
    def build(
        cls,
        clips: Iterable[Clip],
        schema: FeatureSchema,
        *,
        normalisation: Normalisation | None = None,
        markup: Markup | None = None,
        mirror: bool | Collection[str] = False,
        biases: Biases = NO_BIAS,
        end_s: float = 0.0,
    ) -> MotionDatabase:
        """Compute the features of some clips; each clip is one range, named like it, or one for each permutation of the schema.

        Parameters
        ----------
        clips : iterable of Clip
            With different names. They may have different skeletons, as long as each has the schema's bones.
        schema : FeatureSchema
        normalisation : Normalisation, optional
            Another database's, so that the costs of both can be compared. Default: the one that fits these clips.
        markup : Markup, optional
            Tags and other marks on frames.
        mirror : bool or collection of str
            Whether every clip, or those of these names, are there mirrored too, as a second range of the same asset.
        biases : Biases
        end_s : float
            Frames in the last so many seconds of a range that does not loop cannot be entered.

        Raises
        ------
        MotionError
            A bone that a skeleton lacks, two clips of one name, or numbers too large to be a body; all faults together.
        """
        parts = parts_of(clips, schema, mirror, markup)
        return cls.from_parts(parts, schema, normalisation=normalisation, markup=markup, biases=biases, end_s=end_s)

    @classmethod
    def from_parts(
        cls,
        parts: Sequence[ClipFeatures],
        schema: FeatureSchema,
        *,
        normalisation: Normalisation | None = None,
        markup: Markup | None = None,
        biases: Biases = NO_BIAS,
        end_s: float = 0.0,
    ) -> MotionDatabase:
        """The database of some clips whose features are known, one range each; those of `clip_permutations` follow one another."""
        require_kind(biases, Biases, "biases", "Biases")
        require_kind(markup, (Markup, type(None)), "markup", "a Markup, or None")
        require_number(end_s, "end_s")
        check_permutations(parts, schema)
        shared = Normalisation.of([part.features for part in parts], schema) if normalisation is None else normalisation
        lengths = np.array([len(part.features) for part in parts], np.int64)
        stops = np.cumsum(lengths)
        starts, assets = stops - lengths, tuple(part.asset for part in parts)
        features = scratch.zeros((int(lengths.sum()), schema.n_features), np.float32)
        for part, start, stop in zip(parts, starts, stops, strict=True):
            features[start:stop] = shared.apply(part.features)
        marks = marks_of(Markup() if markup is None else markup, assets, starts, stops, schema.rate, end_s)
        slices = tuple(schema.slices.values())
        return cls(
            Layout.of(features, starts, stops, weights_of_features(slices, schema.weights)),
            starts,
            stops,
            assets,
            np.array([part.mirrored for part in parts], np.bool_),
            tuple(schema.slices),
            slices,
            schema.weights,
            shared,
            marks,
            biases,
            scratch.joined([part.root for part in parts], np.zeros((0, 3), np.float32)),
            schema,
        )

    @classmethod
    def from_features(cls, features: ArrayLike, starts: ArrayLike, stops: ArrayLike, assets: Sequence[str]) -> MotionDatabase:
        """Take features as they are: already normalised and weighted, as the query then is.

        Parameters
        ----------
        features : float32 array, shape (N, F)
            Finite within the ranges. Other number types are converted to float32.
        starts, stops : integer arrays, shape (R,)
            Range i is the frames from starts[i] up to, not including, stops[i]. Ranges do not overlap; their order is free.
        assets : sequence of str, length R
            The asset of each range; an asset may have several.

        Raises
        ------
        MotionError
            Shapes or ranges that do not fit, or a feature that is not finite.
        """
        array = as_features(features)
        first, last, names = check_ranges(starts, stops, assets, len(array))
        check_finite(array, first, last, names)
        n_features = array.shape[1]
        return cls(
            Layout.of(array, first, last, np.ones(n_features)),
            first,
            last,
            names,
            np.zeros(len(names), np.bool_),
            ("features",),
            (slice(0, n_features),),
            np.ones(1),
            Normalisation.none(n_features),
            Marks.none(len(array), len(names)),
        )

    def search(
        self,
        query: ArrayLike,
        valid: Valid | None = None,
        tags: Tags | None = None,
        current: int | None = None,
        bias: ArrayLike | None = None,
        *,
        skip: Sequence[Skip] = (),
        in_match_range: bool = False,
        penalties: Penalties | None = None,
    ) -> Hit:
        """Find the frame of lowest cost among those that may play now.

        Exact: equal to scanning every frame. On a tie the current frame wins, then the lowest.

        Parameters
        ----------
        query : float array, shape (F,)
            One pose and trajectory: in the schema's units (m, m/s, unit vectors) for a database built from clips; as the features
            are for one made from features.
        valid : Matches or bool array, shape (R,), optional
            Matches: the assets of those rows; names that the database lacks are passed over. Ranges that are played mirrored go by
            `Matches.mirrored`, the answer with mirrored facts. An array: which ranges may play. Default: all may.
        tags : TagFilter or bool array, shape (N,), optional
            A filter: which tags frames must, must not or should have. An array: exactly these frames. Marks such as DoNotChoose
            always count.
        current : int, optional
            The frame that would play next anyway; -1 for none. It is scored first and wins ties. Tags, marks and skips do not keep
            it from playing on; a mask does, and the mark Excluded.
        bias : float array, shape (N,), optional
            Added to each frame's cost; negative favours a frame, positive infinity forbids it.
        skip : sequence of Skip
            Frames that this search leaves out.
        in_match_range : bool
            Whether only frames of a match range may be chosen.
        penalties : mapping of asset to float, or float array, shape (R,), optional
            Added to the cost of all frames of an asset, or of each range. Matches of a table with soft cells bring their own.

        Returns
        -------
        Hit
            False, with an infinite cost, when nothing may play.

        Raises
        ------
        QueryError
            A query, mask, tag, frame or bias that does not fit the database, or is not a number; the message names the feature.

        Notes
        -----
        A box is skipped when its lower bound plus its least bias is above the best total so far; see `contextdb/core/search.h`.
        """
        return self.search_filtered(query, self._filters.make(valid, tags, current, bias, skip, in_match_range, penalties))

    def search_filtered(self, query: ArrayLike, chosen: Filter) -> Hit:
        """The frame that a search chooses from what a filter lets pass; see `search` and `filter`."""
        range_number, totals, frames = self._searcher.least(query, chosen, math.inf, 1)
        return self._hit(range_number, int(frames[0]), float(totals[0]))

    def best_of_ranges(
        self, query: ArrayLike, within: float, valid: Valid | None = None, **options: Unpack[SearchOptions]
    ) -> list[Hit]:
        """The best frame of each range that costs at most `within` more than the best of all, cheapest first.

        The other parameters are those of `search`, and so is what it raises; QueryError too where `within` is no number from 0 up.
        """
        if not isinstance(within, Real) or not within >= 0.0:
            raise QueryError(Fault(f"the costs may differ by {within!r}.", "a number, 0 or more"))
        chosen = self.filter(valid, **options)
        best = float(self._searcher.least(query, chosen, math.inf, 1)[1][0])
        if best == math.inf:
            return []
        _, totals, frames = self._searcher.least(query, chosen, best + within, len(self.assets))
        ranges = np.flatnonzero(frames >= 0)
        is_other = frames[ranges] != chosen.current
        order = ranges[np.lexsort((frames[ranges], is_other, totals[ranges]))]
        return [self._hit(i, int(frames[i]), float(totals[i])) for i in order.tolist()]

    def search_many(
        self,
        queries: ArrayLike,
        valid: ValidForMany | None = None,
        current: Currents | None = None,
        tags: Tags | None = None,
    ) -> list[Hit]:
        """Search for many characters at once: one `Hit` for each query, in order, the same as `search` gives for each alone.

        The frames are read once for many queries, and on all cores that this process may use.

        Parameters
        ----------
        queries : float array, shape (Q, F)
        valid : optional
            As for `search`, one for all; or one for each query: a list of Q Matches, arrays or None, what `query_many` answers for
            Q contexts, or a bool array (Q, R).
        current : sequence of Q frames, optional
            None or -1 for a character that plays none.
        tags : TagFilter or bool array, shape (N,), optional
            As for `search`, one for all.

        Raises
        ------
        QueryError
            As `search`; there are not as many masks or current frames as queries.
        """
        wanted = arguments.numbers_of(queries, "the queries")
        if wanted.ndim != 2:
            raise QueryError(Fault(f"the queries have shape {wanted.shape}.", f"queries x {self.n_features} features"))
        filters = self._filters.make_many(len(wanted), valid, current, tags)
        return self._hits(*self._searcher.least_of_many(wanted, filters))

    def search_each(self, queries: Floats, options: Sequence[Mapping[str, Any]]) -> list[Hit]:
        """Search for many characters at once, each with parameters of `search` of its own; queries [Q, F]. Exact, as `search_many`.

        Those that share tags, and give no biases of frames, are searched together.
        """
        filters = [self._filters.make(**each) for each in options]
        best: list[Hit] = [NOTHING] * len(filters)
        for numbers in together(filters):
            many = ManyFilters.of([filters[i] for i in numbers])
            hits = self._hits(*self._searcher.least_of_many(queries[numbers], many))
            for i, hit in zip(numbers, hits, strict=True):
                best[i] = hit
        return best

    def candidates(
        self, query: ArrayLike, k: int = 10, valid: Valid | None = None, *, left_out: bool = False, **options: Unpack[SearchOptions]
    ) -> Candidates:
        """The k frames of lowest cost, with what each channel and bias adds, and why the other frames were left out.

        The first is the one that `search` chooses, at the same cost.

        Parameters
        ----------
        k : int
        left_out : bool
            Whether frames that may not be chosen are among the k too, each with its reason.
        query, valid, **options
            As for `search`.

        Raises
        ------
        QueryError
            As `search`; `k` is no whole number from 0 up.
        """
        chosen = self.filter(valid, **options)
        return candidates.of(self, self._searcher.normalised(query), chosen, k, left_out)

    def channel_costs(self, frame: Hit | int, query: ArrayLike) -> dict[str, float]:
        """What each channel adds to the cost of one frame. Their sum, in order, is the frame's cost without its
        biases. Raises QueryError for a frame that is in no range, or a query that does not fit."""
        frames = np.array([self._number(frame)])
        costs = cost.channel_costs(self.layout, frames, self._searcher.normalised(query), self.slices, self.cost_weights)
        return dict(zip(self.channel_names, costs[:, 0].tolist(), strict=True))

    def normalised(self, query: ArrayLike) -> Floats:
        """A query [F] in the schema's units, checked, as costs are computed with it: float64. Raises QueryError for another."""
        return self._searcher.normalised(query)

    def with_weights(self, weights: Mapping[str, float]) -> MotionDatabase:
        """The same database with some channels weighed otherwise; nothing is rebuilt, the features are shared.

        Costs stay on their scale: see `cost_weights`. Raises MotionError for a channel that there is not, or a weight below 0.
        """
        changed = self.weights.copy()
        for name, weight in require_mapping(weights, "weights", "a mapping of channels to weights").items():
            require_kind(weight, Real, "one of weights", "a number, 0 or more")
            if require_text(name, "one of weights") not in self.channel_names:
                raise MotionError(no_such("channel", name, self.channel_names))
            if not math.isfinite(weight) or weight < 0.0:
                raise MotionError(Fault(f"the weight of channel {in_quotes(name)} is {weight!r}.", "a finite number, 0 or more"))
            changed[self.channel_names.index(name)] = weight
        if not changed.any():
            raise MotionError(Fault("the weight of every channel is 0.", "at least one above 0, else all frames are alike"))
        return replace(self, weights=changed)

    def __getstate__(self) -> dict[str, object]:
        """The fields alone: what a search has prepared is prepared again where the database is unpickled."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def __repr__(self) -> str:
        sizes = plural(len(self.assets), "range"), plural(self.n_frames, "frame"), plural(self.n_features, "feature")
        return f"<MotionDatabase: {', '.join(sizes)}>"

    def filter(self, valid: Valid | None = None, **options: Unpack[SearchOptions]) -> Filter:
        """What a search with these arguments may choose from, and what it adds to each frame's cost; see `search`, and what
        that raises."""
        return self._filters.make(valid, **options)

    def ranges_of(self, valid: Valid | None) -> Flags:
        """Which ranges a search may choose from that is given nothing else: bool [R]. Raises QueryError for an answer that does
        not fit."""
        return self._filters.ranges_of(valid)

    def ranges_of_many(self, valid: ValidForMany | None, n: int) -> tuple[Flags, Floats | None]:
        """Which ranges may play in each of n searches, bool [n or 1, R], and their biases, float64 [n or 1, R], None for the
        database's own."""
        return self._filters.ranges_of_many(valid, n)

    def range_penalties(self, penalties: Penalties) -> Floats:
        """What penalties add to the cost of each range: float64 [R]."""
        return self._filters.range_penalties(penalties)

    @property
    def frames(self) -> Frames:
        """What the core searches."""
        return self._searcher.frames

    @property
    def frame_parts(self) -> tuple[Any, ...]:
        """The arrays and numbers of which the core makes that."""
        return self._searcher.frame_parts

    def valid_of_each(self, valid: ValidForMany | None, n: int) -> list[ValidRanges]:
        """What the masks of n characters mean to this database, see `search_many`: each serves as `valid` of `search`."""
        return self._filters.valid_of_each(valid, n)

    @cached_property
    def _filters(self) -> FilterMaker:
        return FilterMaker(self.n_frames, self.assets, self.mirrored, self.marks, self.biases)

    @cached_property
    def _searcher(self) -> Searcher:
        return Searcher(self.layout, self.marks.kinds, self.normalisation, self.slices, self.cost_weights, self.feature_names)

    def _hit(self, range_number: int, frame: int, total: float) -> Hit:
        """The answer for a range, or for -1, none."""
        return Hit(self.assets[range_number], range_number, frame, total) if range_number >= 0 else NOTHING

    def _hits(self, ranges: Ints, frames: Ints, totals: Floats) -> list[Hit]:
        assets = self.assets
        each = zip(ranges.tolist(), frames.tolist(), totals.tolist(), strict=True)
        return [Hit(assets[i], i, frame, total) if i >= 0 else NOTHING for i, frame, total in each]


def build_databases(sets: Mapping[str, Iterable[Clip]], schema: FeatureSchema) -> dict[str, MotionDatabase]:
    """Several databases that share one normalisation, fitted to the frames of all, so that a selector can compare their costs.

    Raises MotionError where clips do not have what the schema asks for, and ContextError for what are no clips.
    """
    given = require_mapping(sets, "sets", "a mapping of names to lists of Clip")
    parts = {name: parts_of(clips, schema) for name, clips in given.items()}
    shared = Normalisation.of([part.features for each in parts.values() for part in each], schema)
    return {name: MotionDatabase.from_parts(each, schema, normalisation=shared) for name, each in parts.items()}
