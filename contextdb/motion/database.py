"""A motion database: the features of all frames of some assets, and the exact search for the best frame that may play now.

    cost of a frame = Σ over channels of channel_weight × squared difference of normalised features + its biases

N frames, F features, R ranges. A range is the frames [start, stop) of one asset; frames between ranges belong to none and are never
chosen. Which assets may play now comes as a mask beside the cost, so that it can change with every search and rebuilds nothing.
Nothing here reads a file or knows a table.

Source: Büttner and Clavet, "Motion Matching", 2015; orangeduck/Motion-Matching; the filter is the context database's (EA, GDC); the
biases are those of Unreal's PoseSearch.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.errors import Fault, MotionError, QueryError, in_quotes, nearest, plural, some
from contextdb.motion import arguments, candidates, cost, scan
from contextdb.motion.arguments import Flags, Valid
from contextdb.motion.candidates import Candidates
from contextdb.motion.clips import Clip
from contextdb.motion.extraction import ClipFeatures, clip_features
from contextdb.motion.features import FeatureSchema
from contextdb.motion.filters import NO_FLAGS, Filter, Kinds
from contextdb.motion.layout import Features, Layout
from contextdb.motion.left_out import LeftOut, Skip
from contextdb.motion.marks import ANY_TAGS, Marks, TagFilter
from contextdb.motion.markup import Markup
from contextdb.motion.normalisation import Normalisation
from contextdb.motion.quaternions import Floats
from contextdb.motion.ranges import check_ranges
from contextdb.motion.skeleton import Ints

Tags = TagFilter | ArrayLike
Penalties = Mapping[str, float] | NDArray[np.floating]


@dataclass(frozen=True, slots=True)
class Hit:
    """The frame that a search chose. False when nothing may play; its cost is then infinite, its asset None, range and frame -1.

    Attributes
    ----------
    asset : str or None
    range : int
        The range that holds the frame, 0…R-1.
    frame : int
        Counted over the whole database, 0…N-1.
    cost : float
        Without a unit; the biases are in it.
    """

    asset: str | None
    range: int
    frame: int
    cost: float

    def __bool__(self) -> bool:
        return self.frame >= 0


NOTHING = Hit(None, -1, -1, math.inf)


@dataclass(frozen=True, slots=True)
class Biases:
    """What is added to the cost of frames, whatever the query; negative favours them.

    Attributes
    ----------
    base : float
        For every frame of the database.
    looping : float
        For frames of looping ranges.
    continuing : float
        For the frame that would play on, so that a character does not jump for a trifle.
    """

    base: float = 0.0
    looping: float = 0.0
    continuing: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class MotionDatabase:
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

    layout: Layout
    starts: Ints
    stops: Ints
    assets: tuple[str, ...]
    mirrored: Flags
    channel_names: tuple[str, ...]
    slices: tuple[slice, ...]
    weights: Floats
    normalisation: Normalisation
    marks: Marks
    biases: Biases = Biases()
    root: Features | None = None
    schema: FeatureSchema | None = None
    _filters: dict[tuple[TagFilter, bool], Kinds] = field(default_factory=dict, init=False, repr=False)
    _rows: dict[int, tuple[Sequence[str], Ints, Ints]] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def build(
        cls,
        clips: Iterable[Clip],
        schema: FeatureSchema,
        *,
        normalisation: Normalisation | None = None,
        markup: Markup | None = None,
        mirror: bool | Collection[str] = False,
        biases: Biases = Biases(),
        end_s: float = 0.0,
    ) -> MotionDatabase:
        """Compute the features of some clips; each clip is one range, named like it.

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
        parts = parts_of(clips, schema, mirror)
        return cls.from_parts(parts, schema, normalisation=normalisation, markup=markup, biases=biases, end_s=end_s)

    @classmethod
    def from_parts(
        cls,
        parts: Sequence[ClipFeatures],
        schema: FeatureSchema,
        *,
        normalisation: Normalisation | None = None,
        markup: Markup | None = None,
        biases: Biases = Biases(),
        end_s: float = 0.0,
    ) -> MotionDatabase:
        """The database of some clips whose features are known, one range each."""
        shared = Normalisation.of([part.features for part in parts], schema) if normalisation is None else normalisation
        lengths = np.array([len(part.features) for part in parts], np.int64)
        stops = np.cumsum(lengths)
        starts, assets = stops - lengths, tuple(part.asset for part in parts)
        features = np.zeros((int(lengths.sum()), schema.n_features), np.float32)
        for part, start, stop in zip(parts, starts, stops, strict=True):
            features[start:stop] = shared.apply(part.features)
        marks = Marks.of(Markup() if markup is None else markup, assets, starts, stops, schema.rate, end_s)
        slices = tuple(schema.slices.values())
        return cls(
            Layout.of(features, starts, stops, _feature_weights(slices, schema.weights).astype(np.float64)),
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
            np.concatenate([np.zeros((0, 3), np.float32), *(part.root for part in parts)]),
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
        array = _as_features(features)
        first, last, names = check_ranges(starts, stops, assets, len(array))
        _check_finite(array, first, last, names)
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

    @property
    def n_frames(self) -> int:
        """How many frames there are, those between ranges included."""
        return self.layout.n_frames

    @property
    def n_features(self) -> int:
        """How many features a frame has."""
        return self.layout.n_features

    @property
    def feature_names(self) -> tuple[str, ...]:
        """The name of each feature."""
        return tuple(f"feature {i}" for i in range(self.n_features)) if self.schema is None else self.schema.feature_names

    @property
    def features(self) -> Features:
        """The features as rows: float32 [N, F], gathered anew; frames between ranges hold zeros."""
        found = np.zeros((self.n_frames, self.n_features), np.float32)
        found[self.layout.frames] = self.layout.take(self.layout.frames)
        return found

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
            Matches: the assets of those rows; names that the database lacks are passed over. An array: which ranges may play.
            Default: all may.
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
        A box is skipped when its lower bound plus its least bias is above the best total so far; see `contextdb.motion.kernels`.
        """
        chosen = self.filter(valid, tags, current, bias, skip=skip, in_match_range=in_match_range, penalties=penalties)
        found, totals, frames = self._least(query, chosen, math.inf, 1)
        return Hit(self.assets[found], found, int(frames[0]), float(totals[0])) if found >= 0 else NOTHING

    def best_of_ranges(
        self,
        query: ArrayLike,
        within: float,
        valid: Valid | None = None,
        tags: Tags | None = None,
        current: int | None = None,
        bias: ArrayLike | None = None,
        *,
        skip: Sequence[Skip] = (),
        in_match_range: bool = False,
        penalties: Penalties | None = None,
    ) -> list[Hit]:
        """The best frame of each range that costs at most `within` more than the best of all, cheapest first.

        The other parameters are those of `search`.
        """
        if not within >= 0.0:
            raise QueryError(Fault(f"the costs may differ by {within!r}.", "a number, 0 or more"))
        chosen = self.filter(valid, tags, current, bias, skip=skip, in_match_range=in_match_range, penalties=penalties)
        best = float(self._least(query, chosen, math.inf, 1)[1][0])
        if best == math.inf:
            return []
        _, totals, frames = self._least(query, chosen, best + within, len(self.assets))
        ranges = np.flatnonzero(frames >= 0)
        is_other = frames[ranges] != chosen.current
        order = ranges[np.lexsort((frames[ranges], is_other, totals[ranges]))]
        return [Hit(self.assets[i], int(i), int(frames[i]), float(totals[i])) for i in order]

    def search_many(
        self,
        queries: ArrayLike,
        valid: Valid | Sequence[Valid | None] | None = None,
        current: Sequence[int | None] | NDArray[np.integer] | None = None,
        tags: Tags | None = None,
    ) -> list[Hit]:
        """Search for many characters at once: one `Hit` for each query, in order.

        Parameters
        ----------
        queries : float array, shape (Q, F)
        valid : optional
            As for `search`, one for all; or one for each query: a list of Q Matches, arrays or None, or a bool array (Q, R).
        current : sequence of Q frames, optional
            None or -1 for a character that plays none.
        tags : TagFilter or bool array, shape (N,), optional
            As for `search`, one for all.
        """
        wanted = arguments.numbers_of(queries, "the queries")
        if wanted.ndim != 2:
            raise QueryError(Fault(f"the queries have shape {wanted.shape}.", f"queries x {self.n_features} features"))
        masks = arguments.for_each(valid, len(wanted))
        playing: Sequence[int | None] = [None] * len(wanted) if current is None else list(current)
        if len(playing) != len(wanted):
            raise QueryError(Fault(f"{plural(len(playing), 'current frame')} for {len(wanted)} queries.", "one for each query"))
        if self._pack is None or any(getattr(mask, "has_penalties", False) for mask in masks):
            return [self.search(query, mask, tags, frame) for query, mask, frame in zip(wanted, masks, playing, strict=True)]
        return self._search_each(wanted, masks, playing, tags)

    def candidates(
        self,
        query: ArrayLike,
        k: int = 10,
        valid: Valid | None = None,
        tags: Tags | None = None,
        current: int | None = None,
        bias: ArrayLike | None = None,
        *,
        skip: Sequence[Skip] = (),
        in_match_range: bool = False,
        penalties: Penalties | None = None,
        left_out: bool = False,
    ) -> Candidates:
        """The k frames of lowest cost, with what each channel and bias adds, and why the other frames were left out.

        The first is the one that `search` chooses, at the same cost.

        Parameters
        ----------
        k : int
        left_out : bool
            Whether frames that may not be chosen stand among the k too, each with its reason.
        query, valid, tags, current, bias, skip, in_match_range, penalties
            As for `search`.
        """
        chosen = self.filter(valid, tags, current, bias, skip=skip, in_match_range=in_match_range, penalties=penalties)
        return candidates.of(self, self._normalised(query), chosen, k, left_out)

    def channel_costs(self, frame: Hit | int, query: ArrayLike) -> dict[str, float]:
        """What each channel adds to the cost of one frame. Their sum, in order, is the frame's cost without its biases."""
        frames = np.array([self._number(frame)])
        found = cost.channel_costs(self.layout, frames, self._normalised(query), self.slices, self.weights)
        return dict(zip(self.channel_names, found[:, 0].tolist(), strict=True))

    def raw(self, frame: Hit | int) -> Floats:
        """The features of one frame in the schema's units, as a query has them: float64 [F]."""
        return self.normalisation.undo(self.layout.take(np.array([self._number(frame)]))[0])

    def time_s(self, hit: Hit) -> float:
        """Seconds from the start of the hit's range to its frame."""
        if self.schema is None or not hit:
            raise QueryError(Fault("there is no time to tell.", "a hit of this database, built from clips"))
        return (hit.frame - int(self.starts[hit.range])) / self.schema.rate

    def frame_at(self, range_number: int, time_s: float) -> int:
        """The frame of a range that is nearest to a time since the range's start, inside the range."""
        if self.schema is None or not 0 <= range_number < len(self.assets) or not math.isfinite(time_s):
            found = f"there is no frame at {time_s!r} s of range {range_number}."
            raise QueryError(Fault(found, "a range of this database, built from clips, and seconds"))
        start, stop = int(self.starts[range_number]), int(self.stops[range_number])
        return min(max(start, start + round(time_s * self.schema.rate)), stop - 1)

    def range_of(self, frame: int) -> int:
        """The range that holds a frame, or -1 for a frame between ranges."""
        return self.layout.range_of(frame)

    def with_weights(self, weights: Mapping[str, float]) -> MotionDatabase:
        """The same database with some channels weighed otherwise; nothing is rebuilt, the features are shared."""
        changed = self.weights.copy()
        for name, weight in weights.items():
            if name not in self.channel_names:
                near = nearest(name, self.channel_names)
                found = f"there is no channel {in_quotes(name)}."
                raise MotionError(Fault(found, some(self.channel_names), in_quotes(near) if near else ""))
            if not math.isfinite(weight) or weight < 0.0:
                raise MotionError(Fault(f"the weight of channel {in_quotes(name)} is {weight!r}.", "a finite number, 0 or more"))
            changed[self.channel_names.index(name)] = weight
        return replace(self, weights=changed)

    def __repr__(self) -> str:
        sizes = plural(len(self.assets), "range"), plural(self.n_frames, "frame"), plural(self.n_features, "feature")
        return f"<MotionDatabase: {', '.join(sizes)}>"

    # ---- what may play

    def filter(
        self,
        valid: Valid | None = None,
        tags: Tags | None = None,
        current: int | None = None,
        bias: ArrayLike | None = None,
        *,
        skip: Sequence[Skip] = (),
        in_match_range: bool = False,
        penalties: Penalties | None = None,
    ) -> Filter:
        """What a search with these arguments may choose from, and what it adds to each frame's cost; see `search`."""
        ranges, range_biases = self._valid_ranges(valid)
        if penalties is not None:
            range_biases = range_biases + self._range_penalties(penalties)
        filtered, frames = (tags, NO_FLAGS) if isinstance(tags, TagFilter) else (ANY_TAGS, NO_FLAGS)
        if tags is not None and filtered is not tags:
            frames = arguments.flags_of(tags, self.n_frames, "tags", "frame")
        return Filter(
            ranges,
            ranges is self._all_ranges,
            range_biases,
            self._kinds_of(filtered, in_match_range),
            frames,
            arguments.bias_of(bias, self.n_frames),
            tuple(skip),
            arguments.current_of(current, self.n_frames),
            self.biases.continuing,
        )

    @cached_property
    def kinds(self) -> NDArray[np.integer]:
        """The kind of each frame: integers [N]."""
        return self.marks.kinds

    def _valid_ranges(self, valid: Valid | None) -> tuple[Flags, Floats]:
        """Which ranges may play, bool [R], and the biases of ranges, float64 [R]."""
        if valid is None:
            return self._all_ranges, self._range_biases
        if type(valid) is np.ndarray and valid.dtype == np.bool_ and valid.shape == self.starts.shape:
            return valid, self._range_biases
        if hasattr(valid, "table_assets"):
            return self._of_matches(valid)
        names = getattr(valid, "assets", None)
        if names is None:
            return arguments.flags_of(valid, len(self.assets), "valid", "range"), self._range_biases
        flags = np.zeros(len(self.assets), np.bool_)
        for name in set(names):
            flags[self._ranges_of_asset.get(name, [])] = True
        return flags, self._range_biases

    def _of_matches(self, matches: Any) -> tuple[Flags, Floats]:
        """The same for a table's answer; which rows belong to which range is looked up once for each table."""
        rows, ranges = self._rows_of_table(matches.table_assets)
        valid = matches.flags[rows]
        flags = np.zeros(len(self.assets), np.bool_)
        flags[ranges[valid]] = True
        if not getattr(matches, "has_penalties", False):
            return flags, self._range_biases
        least = np.full(len(self.assets), np.inf)
        np.minimum.at(least, ranges[valid], matches.penalties[rows[valid]])
        return flags, self._range_biases + np.where(flags, least, 0.0)

    def _rows_of_table(self, table_assets: Sequence[str]) -> tuple[Ints, Ints]:
        """The pairs of a table's rows and the ranges of their assets: two int64 arrays."""
        known = self._rows.get(id(table_assets))
        if known is None or known[0] is not table_assets:
            pairs = [(row, i) for row, asset in enumerate(table_assets) for i in self._ranges_of_asset.get(asset, ())]
            rows, ranges = np.array(pairs, np.int64).reshape(-1, 2).T.copy()
            if len(self._rows) >= MOST_TABLES:
                self._rows.clear()
            known = self._rows[id(table_assets)] = (table_assets, rows, ranges)
        return known[1], known[2]

    def _range_penalties(self, penalties: Penalties) -> Floats:
        if isinstance(penalties, Mapping):
            found = np.zeros(len(self.assets))
            for asset, penalty in penalties.items():
                found[self._ranges_of_asset.get(asset, [])] = penalty
        else:
            found = arguments.numbers_of(penalties, "the penalties")
        if found.shape != self.starts.shape or np.isnan(found).any() or np.isneginf(found).any():
            accepted = (
                f"a number for each of {plural(len(self.assets), 'range')}, or for some assets; positive infinity forbids one"
            )
            raise QueryError(Fault(f"the penalties have shape {found.shape}, or one is no number.", accepted))
        return found

    def _kinds_of(self, tags: TagFilter, in_match_range: bool) -> Kinds:
        """What a tag filter says of each kind; kept, for a game asks with the same few filters."""
        known = self._filters.get((tags, in_match_range))
        if known is None:
            left_out = self.marks.left_out(tags, in_match_range=in_match_range)
            biases = self.marks.kind_biases + self.marks.tag_biases(tags)
            if len(self._filters) >= MOST_FILTERS:
                self._filters.clear()
            known = Kinds(left_out == LeftOut.NO, biases, self.marks.playable(), left_out)
            self._filters[tags, in_match_range] = known
        return known

    @cached_property
    def _all_ranges(self) -> Flags:
        return np.ones(len(self.assets), np.bool_)

    @cached_property
    def _range_biases(self) -> Floats:
        return np.where(self.marks.looping, self.biases.base + self.biases.looping, self.biases.base)

    @cached_property
    def _ranges_of_asset(self) -> dict[str, list[int]]:
        found: dict[str, list[int]] = {}
        for i, asset in enumerate(self.assets):
            found.setdefault(asset, []).append(i)
        return found

    # ---- the search itself

    def _least(self, query: ArrayLike, chosen: Filter, within: float, n: int) -> tuple[int, Floats, Ints]:
        """The lowest totals not above `within` and their frames: one of all frames (n = 1), or one for each range (n = R).

        Gives the range of the best frame too, -1 for none; 0 where there is one for each range.
        """
        totals, frames = np.empty(n), np.empty(n, np.int64)
        if self._pack is None:
            wanted = self._normalised(query)
            scan.least(self.layout, wanted, self.slices, self.weights, chosen, self.kinds, within, totals, frames)
            return self.range_of(int(frames[0])) if n == 1 else 0, totals, frames
        kernels, pack = self._pack
        raw = query if type(query) is np.ndarray and query.dtype == np.float64 else arguments.numbers_of(query, "the query")
        found = kernels.REFUSED
        if raw.shape == self._shape:
            kinds = chosen.kinds
            found = kernels.search(
                pack.numbers,
                raw,
                chosen.ranges,
                chosen.is_whole,
                chosen.range_biases,
                kinds.allowed,
                kinds.biases,
                kinds.playable,
                chosen.frames,
                chosen.frame_biases,
                chosen.skip_spans,
                chosen.current,
                chosen.continuing,
                within,
                totals,
                frames,
            )
        if found == kernels.REFUSED:
            self._normalised(query)  # says what is wrong
        return found, totals, frames

    def _search_each(
        self, queries: Floats, masks: Sequence[Valid | None], playing: Sequence[int | None], tags: Tags | None
    ) -> list[Hit]:
        assert self._pack is not None, "the caller has looked"
        kernels, pack = self._pack
        different = {id(mask): mask for mask in masks}
        places = {number: i for i, number in enumerate(different)}
        flags = np.array([self._valid_ranges(mask)[0] for mask in different.values()], np.bool_).reshape(
            len(different), len(self.assets)
        )
        which = np.array([places[id(mask)] for mask in masks], np.int64)
        currents = np.array([arguments.current_of(frame, self.n_frames) for frame in playing], np.int64)
        chosen = self.filter(None, tags)
        kinds = chosen.kinds
        totals, frames, ranges = np.empty(len(queries)), np.empty(len(queries), np.int64), np.empty(len(queries), np.int64)
        wrong = 0
        if queries.shape[1] == self.n_features:
            wrong = kernels.search_each(
                pack.numbers,
                queries,
                flags,
                which,
                chosen.range_biases,
                kinds.allowed,
                kinds.biases,
                kinds.playable,
                chosen.frames,
                chosen.frame_biases,
                chosen.skip_spans,
                currents,
                chosen.continuing,
                totals,
                frames,
                ranges,
            )
        if len(queries) and wrong >= 0:
            self._normalised(queries[wrong])  # says what is wrong
        answers = zip(ranges.tolist(), frames.tolist(), totals.tolist(), strict=True)
        return [Hit(self.assets[i], i, frame, total) if i >= 0 else NOTHING for i, frame, total in answers]

    @cached_property
    def _shape(self) -> tuple[int]:
        return (self.n_features,)

    @cached_property
    def _pack(self) -> tuple[ModuleType, Any] | None:
        """The kernels and what they take of the database; None where numba is not there, or the kinds of frames are too many."""
        kernels = load_kernels()
        if kernels is None or self.marks.n_kinds > MOST_KINDS:
            return None
        normalisation = (self.normalisation.offset, self.normalisation.scale)
        return kernels, kernels.pack(
            self.layout, self.kinds.astype(np.uint16, copy=False), *normalisation, self.slices, self.weights
        )

    def _number(self, frame: Hit | int) -> int:
        number = arguments.frame_of(frame.frame if isinstance(frame, Hit) else frame, self.n_frames, "frame")
        if self.range_of(number) < 0:
            raise QueryError(Fault(f"frame {number} is in no range: nothing is known of it.", "a frame of a range"))
        return number

    def _normalised(self, query: ArrayLike) -> Floats:
        """A query [F], checked and normalised: float64."""
        raw = arguments.query_of(query, self.feature_names)
        wanted = self.normalisation.apply(raw)
        arguments.refuse_infinite(wanted, raw, self.feature_names)
        return wanted


MOST_KINDS = 65536
MOST_FILTERS, MOST_TABLES = 64, 16
"""What a database keeps of filters and tables that it was asked with; past that it forgets them all and begins again."""


@cache
def load_kernels() -> ModuleType | None:
    """The compiled search; None where numba is not there."""
    try:
        from contextdb.motion import kernels
    except ImportError:
        return None
    return kernels


def build_databases(sets: Mapping[str, Iterable[Clip]], schema: FeatureSchema) -> dict[str, MotionDatabase]:
    """Several databases that share one normalisation, fitted to the frames of all, so that a selector can compare their costs."""
    parts = {name: parts_of(clips, schema) for name, clips in sets.items()}
    shared = Normalisation.of([part.features for each in parts.values() for part in each], schema)
    return {name: MotionDatabase.from_parts(each, schema, normalisation=shared) for name, each in parts.items()}


def parts_of(clips: Iterable[Clip], schema: FeatureSchema, mirror: bool | Collection[str] = False) -> list[ClipFeatures]:
    """The features of each clip, and of those to be mirrored once more mirrored; the faults of all clips together."""
    parts = []
    faults: list[Fault] = []
    seen: set[str] = set()
    for clip in clips:
        if clip.name in seen:
            faults.append(
                Fault(f"two clips are named {in_quotes(clip.name)}.", "a different name for each asset", rule="duplicate")
            )
        seen.add(clip.name)
        is_mirrored = mirror if isinstance(mirror, bool) else clip.name in mirror
        try:
            parts += [clip_features(clip, schema, mirrored=way) for way in ((False, True) if is_mirrored else (False,))]
        except MotionError as error:
            faults.extend(error.faults)
    if faults:
        raise MotionError(*faults)
    return parts


def _feature_weights(slices: Sequence[slice], weights: Floats) -> Features:
    """The weight of each feature: float32 [F]."""
    found = np.zeros(slices[-1].stop if slices else 0, np.float32)
    for columns, weight in zip(slices, weights, strict=True):
        found[columns] = weight
    return found


# ---- checks


def _as_features(features: ArrayLike) -> Features:
    array = arguments.array_of(features, "the features", MotionError)
    if array.ndim != 2:
        raise MotionError(Fault(f"the features have shape {array.shape}.", "frames x features"))
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(array, np.float32)


def _check_finite(features: Features, starts: Ints, stops: Ints, assets: Sequence[str]) -> None:
    """Refuse features that are not finite inside a range; what lies between ranges is never looked at."""
    is_wrong: Flags = np.logical_not(np.isfinite(features).all(axis=1))
    for i, (start, stop) in enumerate(zip(starts.tolist(), stops.tolist(), strict=True)):
        if is_wrong[start:stop].any():
            frame = start + int(np.argmax(is_wrong[start:stop]))
            feature = int(np.argmin(np.isfinite(features[frame])))
            found = f"feature {feature} of frame {frame} is {features[frame, feature]} (range {i}, asset {in_quotes(assets[i])})."
            raise MotionError(Fault(found, "finite numbers within every range"))
