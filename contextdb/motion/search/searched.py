"""What a motion database holds, and what is known of each frame. `MotionDatabase` says what each part is, and searches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_kind, require_many, require_real, require_whole
from contextdb.errors import Fault, QueryError
from contextdb.motion import arguments
from contextdb.motion.arguments import Flags
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.markup.marks import Marks
from contextdb.motion.search import cost
from contextdb.motion.search.filters import NO_BIAS, Biases
from contextdb.motion.search.hit import Hit
from contextdb.motion.search.layout import Features, Layout


@dataclass(frozen=True, eq=False)
class Searched:
    """The parts of a motion database."""

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
    biases: Biases = NO_BIAS
    root: Features | None = None
    schema: FeatureSchema | None = None

    @cached_property
    def n_permutations(self) -> int:
        """How many ranges each clip has, as it is and as many mirrored; they follow one another."""
        return 1 if self.schema is None else len(self.schema.permutation_s)

    def permutation_s(self, range_number: int) -> float | None:
        """How many seconds ahead the permuted channels of a range look; None for a database without permutations."""
        if self.schema is None or self.schema.permutations is None:
            return None
        return self.schema.permutation_s[range_number % self.n_permutations]

    @cached_property
    def cost_weights(self) -> Floats:
        """What each channel's squared differences are multiplied by in a cost: float64 [C].

        The weights divided by the sum of weight x features over all channels, so that a cost is a weighted mean and means the same
        for every schema. Of a database made from features the weights themselves.
        """
        return self.weights if self.schema is None else cost.shares_of(self.slices, self.weights)

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
        """The features as rows: float32 [N, F], gathered again; frames between ranges hold zeros."""
        features = np.zeros((self.n_frames, self.n_features), np.float32)
        features[self.layout.frames] = self.layout.take(self.layout.frames)
        return features

    def raw(self, frame: Hit | int) -> Floats:
        """The features of one frame in the schema's units, as a query has them: float64 [F]. Raises QueryError for a frame
        that is in no range."""
        return self.normalisation.undo(self.layout.take(np.array([self._number(frame)]))[0])

    def raw_many(self, frames: Sequence[int] | NDArray[np.integer]) -> Floats:
        """The features of many frames in the schema's units, the poses of a crowd: float64 [Q, F]. Raises QueryError for a
        frame that is in no range."""
        given = require_many(frames, "frames", "a list of frames")
        numbers = np.array([arguments.frame_of(frame, self.n_frames, "frame") for frame in given], np.int64)
        for frame in numbers[~self.layout.are_in_ranges(numbers)].tolist():
            self._number(frame)
        return self.normalisation.undo(self.layout.take(numbers))

    def time_s(self, hit: Hit) -> float:
        """Seconds from the start of the hit's range to its frame. Raises QueryError for a hit of nothing, and for a database of
        arrays."""
        require_kind(hit, Hit, "hit", "a Hit of this database")
        if self.schema is None or not hit:
            raise QueryError(Fault("there is no time to return.", "a hit of this database, built from clips"))
        return (hit.frame - int(self.starts[hit.range])) / self.schema.rate

    def frame_at(self, range_number: int, time_s: float) -> int:
        """The frame of a range that is nearest to a time since the range's start, inside the range. Raises QueryError where there
        is no such range, or no time, and for a database of arrays."""
        range_number, time_s = require_whole(range_number, "range_number"), require_real(time_s, "time_s")
        if self.schema is None or not 0 <= range_number < len(self.assets) or not math.isfinite(time_s):
            problem = f"there is no frame at {time_s!r} s of range {range_number}."
            raise QueryError(Fault(problem, "a range of this database, built from clips, and seconds"))
        start, stop = int(self.starts[range_number]), int(self.stops[range_number])
        return min(max(start, start + round(time_s * self.schema.rate)), stop - 1)

    def range_of(self, frame: int) -> int:
        """The range that holds a frame, or -1 for a frame between ranges. Raises ContextError for no whole number."""
        return self.layout.range_of(require_whole(frame, "frame"))

    def _number(self, frame: Hit | int) -> int:
        number = arguments.frame_of(frame.frame if isinstance(frame, Hit) else frame, self.n_frames, "frame")
        if self.range_of(number) < 0:
            raise QueryError(Fault(f"frame {number} is in no range: nothing is known of it.", "a frame of a range"))
        return number
