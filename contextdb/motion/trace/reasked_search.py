"""One database in a recorded search, repeated: what every frame costs, channel by channel, and why it may not be chosen.

N frames of the database, C channels. The sums of each channel are stored, so that another weight only weighs them again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search import cost
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Filter
from contextdb.motion.search.hit import Hit


@dataclass(frozen=True, eq=False)
class ReaskedSearch:
    """One database in a search repeated."""

    name: str
    database: MotionDatabase
    query: Floats
    """In the schema's units: float64 [F]."""
    chosen: Filter
    """What could be chosen from."""
    _sums: dict[str, Floats] = field(default_factory=dict, repr=False)

    @cached_property
    def hit(self) -> Hit:
        """What the search chooses."""
        return self.database.search_filtered(self.query, self.chosen)

    @property
    def sums(self) -> Floats:
        """The squared differences of each channel, not weighed: float64 [C, N]; 0 for frames between ranges."""
        if "sums" not in self._sums:
            lay, database = self.database.layout, self.database
            wanted, ones = database.normalised(self.query), np.ones(len(database.slices))
            sums, frames = np.zeros((len(ones), lay.n_frames)), lay.frames
            for start in range(0, len(frames), cost.FRAMES_AT_ONCE):
                block = frames[start : start + cost.FRAMES_AT_ONCE]
                sums[:, block] = cost.channel_costs(lay, block, wanted, database.slices, ones)
            self._sums["sums"] = sums
        return self._sums["sums"]

    @property
    def channels(self) -> Floats:
        """What each channel adds to the cost of each frame: float64 [N, C]."""
        return np.asarray((self.database.cost_weights[:, None] * self.sums).T)

    @cached_property
    def biases(self) -> Floats:
        """What else is added: float64 [N]."""
        return self.chosen.biases(self.database.layout.frame_ranges, self.database.marks.kinds)

    @cached_property
    def costs(self) -> Floats:
        """The cost of each frame, its biases in it, to the last bit the search's: float64 [N]; infinite between ranges."""
        total = np.zeros(self.database.n_frames)
        for weight, added in zip(self.database.cost_weights, self.sums, strict=True):
            total += weight * added
        return np.asarray(np.where(self.database.layout.frame_ranges >= 0, total + self.biases, np.inf))

    @cached_property
    def left_out(self) -> NDArray[np.uint8]:
        """Why each frame may not be chosen, as `LeftOut`: uint8 [N]."""
        return self.chosen.why(self.database.layout.frame_ranges, self.database.marks.kinds)

    def best_of_range(self, at: int) -> int:
        """The best frame of a range, one that may be chosen before all that may not; -1 for a range without frames."""
        own = np.arange(int(self.database.starts[at]), int(self.database.stops[at]))
        if not len(own):
            return -1
        return int(own[np.lexsort((own, self.costs[own], self.left_out[own] != LeftOut.NO))[0]])

    def with_weights(self, weights: Mapping[str, float]) -> ReaskedSearch:
        """The same with other weights; the sums of the channels are shared."""
        return ReaskedSearch(self.name, self.database.with_weights(weights), self.query, self.chosen, self._sums)

    def with_filter(self, chosen: Filter) -> ReaskedSearch:
        """The same with something else to choose from."""
        return ReaskedSearch(self.name, self.database, self.query, chosen, self._sums)
