"""Questions about many boxes, answered by the core: whether some hold all of another, and which lies within which.

The answers are those of `witness`, which is quicker where boxes are few. Single points count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.core import Boxes
from contextdb.covering.count import table_of
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.space import Box

MANY = 1000
"""From so many boxes on the core is quicker."""


@dataclass(frozen=True, eq=False)
class Questions:
    """Boxes to be queried, by number."""

    boxes: Sequence[Box]
    full: Box
    progress: Progress = SILENT
    """Whom to ask whether to stop."""

    @cached_property
    def _edges(self) -> NDArray[np.int64]:
        """Where the classes of each factor begin."""
        return np.cumsum([0, *(side.bit_length() for side in self.full)]).astype(np.int64)

    @cached_property
    def _boxes(self) -> Boxes:
        return Boxes(*table_of(self.boxes, self.full, [side.bit_length() for side in self.full], self.progress))

    def are_held(self, box: Box, by: int, most: int) -> tuple[bool, bool, int]:
        """Whether the boxes whose bits are in `by` hold all of a box, whether that is certain, and the steps it took."""
        chosen = np.flatnonzero(bitmask.flags_of(by, len(self.boxes))).astype(np.int32)
        done = len(chosen) * len(self.full) >> 3
        is_open, is_cut, work = self._boxes.leaves_open(chosen, self._inside(box), done, most, self._check)
        return not (is_open or is_cut), not is_cut, work

    def _check(self, _: int) -> None:
        self.progress.check()

    def _inside(self, box: Box) -> NDArray[np.float64]:
        """1 for each class that a box holds, else 0."""
        bits = 0
        for side, first in zip(box, self._edges.tolist(), strict=False):
            bits |= side << first
        return bitmask.flags_of(bits, int(self._edges[-1])).astype(np.float64)

    def holders(self, n: int, progress: Progress = SILENT) -> NDArray[np.int64]:
        """For each of the first n boxes the first of them that holds it whole and is not equal to it; -1: there is none."""
        known: dict[Box, int] = {}
        alike = np.array([known.setdefault(box, i) for i, box in enumerate(self.boxes[:n])], np.int64)
        holders = np.full(n, -1, np.int64)
        everything = np.ones(int(self._edges[-1]))
        progress.at(0.0)
        self._boxes.first_holders(np.arange(n, dtype=np.int32), everything, alike, holders, lambda done: progress.at(done / n))
        return holders
