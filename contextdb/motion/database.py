"""A motion database: the features of all frames of some assets, and the exact search for the best frame that may play now.

    cost of a frame = Σ over channels of channel_weight × squared difference of normalised features + its bias

N frames, F features, R ranges. A range is the frames [start, stop) of one asset; frames between ranges belong to none and are never
chosen. Which assets may play now comes as a mask beside the cost, so that it can change with every search and rebuilds nothing.
Nothing here reads a file or knows a table.

Source: Büttner and Clavet, "Motion Matching", 2015; orangeduck/Motion-Matching; the filter is the context database's (EA, GDC).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.errors import Fault, MotionError, QueryError, in_quotes, nearest, plural, some
from contextdb.motion import arguments, cost
from contextdb.motion.arguments import Flags, Valid
from contextdb.motion.clips import Clip
from contextdb.motion.extraction import Features, features_of
from contextdb.motion.features import FeatureSchema
from contextdb.motion.normalisation import Normalisation
from contextdb.motion.quaternions import Floats
from contextdb.motion.ranges import check_ranges, frames_between
from contextdb.motion.skeleton import Ints


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
        Without a unit; the bias is in it.
    """

    asset: str | None
    range: int
    frame: int
    cost: float

    def __bool__(self) -> bool:
        return self.frame >= 0


NOTHING = Hit(None, -1, -1, math.inf)


@dataclass(frozen=True, eq=False)
class MotionDatabase:
    """Frames to search. Make one with `build` from clips, or with `from_features` from arrays.

    Attributes
    ----------
    features : float32 array, shape (N, F)
        Normalised, not weighted.
    starts, stops : int64 arrays, shape (R,)
        Range i is the frames from starts[i] up to, not including, stops[i].
    assets : tuple of str, length R
        The asset of each range.
    channel_names : tuple of str, length C
    slices : tuple of slice, length C
        Each channel's features.
    weights : float64 array, shape (C,)
    normalisation : Normalisation
        How a query in the schema's units becomes comparable with `features`.
    schema : FeatureSchema or None
        None for a database made from features.
    """

    features: Features
    starts: Ints
    stops: Ints
    assets: tuple[str, ...]
    channel_names: tuple[str, ...]
    slices: tuple[slice, ...]
    weights: Floats
    normalisation: Normalisation
    schema: FeatureSchema | None = None

    @classmethod
    def build(cls, clips: Iterable[Clip], schema: FeatureSchema, *, normalisation: Normalisation | None = None) -> MotionDatabase:
        """Compute the features of some clips; each clip is one range, named like it.

        Parameters
        ----------
        clips : iterable of Clip
            With different names. They may have different skeletons, as long as each has the schema's bones.
        schema : FeatureSchema
        normalisation : Normalisation, optional
            Another database's, so that the costs of both can be compared. Default: the one that fits these clips.

        Raises
        ------
        MotionError
            A bone that a skeleton lacks, two clips of one name, or numbers too large to be a body; all faults together.
        """
        listed = list(clips)
        blocks = _extract(listed, schema)
        return cls._of(listed, blocks, schema, Normalisation.of(blocks, schema) if normalisation is None else normalisation)

    @classmethod
    def _of(
        cls, clips: Sequence[Clip], blocks: Sequence[Features], schema: FeatureSchema, normalisation: Normalisation
    ) -> MotionDatabase:
        """The database of some clips whose features are known."""
        raw = np.concatenate([np.zeros((0, schema.n_features), np.float32), *blocks])
        lengths = np.array([len(block) for block in blocks], np.int64)
        stops = np.cumsum(lengths)
        names = tuple(clip.name for clip in clips)
        channels, slices = tuple(schema.slices), tuple(schema.slices.values())
        features = normalisation.apply(raw).astype(np.float32)
        return cls(features, stops - lengths, stops, names, channels, slices, schema.weights, normalisation, schema)

    @classmethod
    def from_features(cls, features: ArrayLike, starts: ArrayLike, stops: ArrayLike, assets: Sequence[str]) -> MotionDatabase:
        """Take features as they are: already normalised and weighted, as the query then is.

        Parameters
        ----------
        features : float32 array, shape (N, F)
            Finite within the ranges. Not copied, so leave it as it is; other number types are converted to float32.
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
        none = Normalisation.none(n_features)
        return cls(array, first, last, names, ("features",), (slice(0, n_features),), np.ones(1), none)

    @property
    def n_frames(self) -> int:
        """How many frames there are, those between ranges included."""
        return len(self.features)

    @property
    def n_features(self) -> int:
        """How many features a frame has."""
        return int(self.features.shape[1])

    @property
    def feature_names(self) -> tuple[str, ...]:
        """The name of each feature."""
        return tuple(f"feature {i}" for i in range(self.n_features)) if self.schema is None else self.schema.feature_names

    def search(
        self,
        query: ArrayLike,
        valid: Valid | None = None,
        tags: ArrayLike | None = None,
        current: int | None = None,
        bias: ArrayLike | None = None,
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
        tags : bool array, shape (N,), optional
            Which frames may be chosen. Default: all of the valid ranges.
        current : int, optional
            The frame that would play next anyway; -1 for none. It wins ties if it may be chosen.
        bias : float array, shape (N,), optional
            Added to each frame's cost; negative favours a frame, positive infinity forbids it.

        Returns
        -------
        Hit
            False, with an infinite cost, when nothing may play.

        Raises
        ------
        QueryError
            A query, mask, frame or bias that does not fit the database, or is not a number; the message names the feature.
        """
        wanted = self._normalised(query)
        frames = self._allowed_frames(valid, tags)
        playing = arguments.current_of(current, self.n_frames)
        added = arguments.bias_of(bias, self.n_frames)
        if not len(frames):
            return NOTHING
        totals = cost.costs(self.features, frames, wanted, self.slices, self.weights)
        if added is not None:
            totals += added[frames]
        return self._hit(frames, totals, playing)

    def search_many(
        self,
        queries: ArrayLike,
        valid: Valid | Sequence[Valid | None] | None = None,
        current: Sequence[int | None] | NDArray[np.integer] | None = None,
    ) -> list[Hit]:
        """Search for many characters at once: one `Hit` for each query, in order.

        Parameters
        ----------
        queries : float array, shape (Q, F)
        valid : optional
            As for `search`, one for all; or one for each query: a list of Q Matches, arrays or None, or a bool array (Q, R).
        current : sequence of Q frames, optional
            None or -1 for a character that plays none.
        """
        wanted = arguments.numbers_of(queries, "the queries")
        if wanted.ndim != 2:
            raise QueryError(Fault(f"the queries have shape {wanted.shape}.", f"queries x {self.n_features} features"))
        masks = arguments.for_each(valid, len(wanted))
        playing: Sequence[int | None] = [None] * len(wanted) if current is None else list(current)
        if len(playing) != len(wanted):
            raise QueryError(Fault(f"{plural(len(playing), 'current frame')} for {len(wanted)} queries.", "one for each query"))
        return [self.search(query, mask, None, frame) for query, mask, frame in zip(wanted, masks, playing, strict=True)]

    def channel_costs(self, frame: Hit | int, query: ArrayLike) -> dict[str, float]:
        """What each channel adds to the cost of one frame. Their sum, in order, is the frame's cost without its bias."""
        number = self._number(frame)
        found = cost.channel_costs(self.features, np.array([number]), self._normalised(query), self.slices, self.weights)
        return dict(zip(self.channel_names, found[:, 0].tolist(), strict=True))

    def raw(self, frame: Hit | int) -> Floats:
        """The features of one frame in the schema's units, as a query has them: float64 [F]."""
        return self.normalisation.undo(self.features[self._number(frame)])

    def time_s(self, hit: Hit) -> float:
        """Seconds from the start of the hit's range to its frame."""
        if self.schema is None or not hit:
            raise QueryError(Fault("there is no time to tell.", "a hit of this database, built from clips"))
        return (hit.frame - int(self.starts[hit.range])) / self.schema.rate

    def range_of(self, frame: int) -> int:
        """The range that holds a frame, or -1 for a frame between ranges."""
        filled = self._filled
        place = int(np.searchsorted(self.starts[filled], frame, side="right")) - 1
        found = int(filled[place]) if place >= 0 else -1
        return found if found >= 0 and frame < self.stops[found] else -1

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

    # ---- what may play

    @cached_property
    def _ranges_of_asset(self) -> dict[str, list[int]]:
        found: dict[str, list[int]] = {}
        for i, asset in enumerate(self.assets):
            found.setdefault(asset, []).append(i)
        return found

    @cached_property
    def _filled(self) -> Ints:
        """The ranges that have frames, in the order of their frames."""
        filled = np.flatnonzero(self.stops > self.starts)
        return filled[np.argsort(self.starts[filled], kind="stable")]

    def _number(self, frame: Hit | int) -> int:
        return arguments.frame_of(frame.frame if isinstance(frame, Hit) else frame, self.n_frames, "frame")

    def _valid_ranges(self, valid: Valid | None) -> Flags:
        """Which ranges may play: bool [R]."""
        n_ranges = len(self.assets)
        if valid is None:
            return np.ones(n_ranges, np.bool_)
        names = getattr(valid, "assets", None)
        if names is not None:
            flags = np.zeros(n_ranges, np.bool_)
            for name in set(names):
                flags[self._ranges_of_asset.get(name, [])] = True
            return flags
        return arguments.flags_of(valid, n_ranges, "valid", "range")

    def _allowed_frames(self, valid: Valid | None, tags: ArrayLike | None) -> Ints:
        """The frames that may be chosen, ascending: int64."""
        chosen = self._filled[self._valid_ranges(valid)[self._filled]]
        frames = frames_between(self.starts[chosen], self.stops[chosen])
        return frames if tags is None else frames[arguments.flags_of(tags, self.n_frames, "tags", "frame")[frames]]

    def _hit(self, frames: Ints, totals: Floats, playing: int | None) -> Hit:
        best = int(np.argmin(totals))
        if playing is not None:
            place = int(np.searchsorted(frames, playing))
            if place < len(frames) and frames[place] == playing and totals[place] == totals[best]:
                best = place
        if totals[best] == math.inf:
            return NOTHING
        frame = int(frames[best])
        found = self.range_of(frame)
        return Hit(self.assets[found], found, frame, float(totals[best]))

    def _normalised(self, query: ArrayLike) -> Floats:
        """A query [F], checked and normalised: float64."""
        raw = arguments.query_of(query, self.feature_names)
        wanted = self.normalisation.apply(raw)
        arguments.refuse_infinite(wanted, raw, self.feature_names)
        return wanted


def build_databases(sets: Mapping[str, Iterable[Clip]], schema: FeatureSchema) -> dict[str, MotionDatabase]:
    """Several databases that share one normalisation, fitted to the frames of all, so that a selector can compare their costs."""
    listed = {name: list(clips) for name, clips in sets.items()}
    blocks = {name: _extract(clips, schema) for name, clips in listed.items()}
    shared = Normalisation.of([block for each in blocks.values() for block in each], schema)
    return {name: MotionDatabase._of(clips, blocks[name], schema, shared) for name, clips in listed.items()}


# ---- checks


def _extract(clips: Sequence[Clip], schema: FeatureSchema) -> list[Features]:
    """The features of each clip; the faults of all clips together."""
    blocks = []
    faults: list[Fault] = []
    seen: set[str] = set()
    for clip in clips:
        if clip.name in seen:
            faults.append(
                Fault(f"two clips are named {in_quotes(clip.name)}.", "a different name for each asset", rule="duplicate")
            )
        seen.add(clip.name)
        try:
            blocks.append(features_of(clip, schema))
        except MotionError as error:
            faults.extend(error.faults)
    if faults:
        raise MotionError(*faults)
    return blocks


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
