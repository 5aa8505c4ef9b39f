"""Contexts that lie in a box and in none of some others: whether there is one, and which.

A search decides few boxes, and what it does not finish in a few hundred steps the core decides. Exact, single points too, within a
budget; what it leaves undecided is marked by `is_cut`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.core import Boxes
from contextdb.covering.count import table_of
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import BoxSet, OutOfSteps, Point, Steps

QUICK = 300
"""So many steps of a search are tried before the core decides."""
MOST_STEPS = 20_000
"""So many steps all searches take together, where the work allows more."""


@dataclass(eq=False)
class PointFinder:
    """Boxes by number, the rows of a space first, then its impossible contexts; more can be added."""

    space: Space
    work: int
    """Steps of the core that are left; those of searches are in proportion."""
    progress: Progress = SILENT
    boxes: list[Box] = field(init=False)
    steps: Steps = field(init=False)
    is_cut: bool = False
    """Whether something was left undecided."""
    _questions: Questions | None = None

    def __post_init__(self) -> None:
        self.boxes = [*self.space.boxes, *self.space.impossible]
        self.steps = Steps(min(MOST_STEPS, self.work // 200), self.progress)

    @cached_property
    def box_set(self) -> BoxSet:
        """The same boxes for a search."""
        return BoxSet.of(self.space.full, self.boxes, self.progress)

    @property
    def rows(self) -> int:
        """The boxes that are rows, as bits."""
        return (1 << len(self.space.boxes)) - 1

    @cached_property
    def impossible(self) -> int:
        """The boxes that are impossible contexts."""
        return (1 << len(self.space.boxes) + len(self.space.impossible)) - 1 & ~self.rows

    def add(self, box: Box) -> int:
        """One more box, and its bit."""
        bit = 1 << self.box_set.n_boxes
        self.box_set.add(box)
        self.boxes.append(box)
        return bit

    def chosen(self, bits: int) -> list[Box]:
        return [self.boxes[i] for i in bitmask.rows_of(bits)]

    def point(self, within: Box, avoided: int) -> Point | None:
        """A context of a box in none of some others; None where there is none, or, and then `is_cut`, none was met."""
        few = Steps(min(QUICK, max(1, self.steps.left)), self.progress)
        try:
            return self.box_set.outside(avoided, within, few)
        except OutOfSteps:
            pass
        finally:
            self.steps.left -= QUICK - few.left
        try:
            return self._point_by_core(within, avoided)
        except OutOfSteps:
            self.is_cut = True
            return None

    def _point_by_core(self, within: Box, avoided: int) -> Point | None:
        """The same by the core. Raises OutOfSteps where its work ended before."""
        if self._are_held(within, avoided):
            return None
        box = within
        while (f := next((f for f, side in enumerate(box) if side & (side - 1)), None)) is not None:
            half = _lower_half(box[f])  # halve one side after the other: one of the halves holds a context
            first = (*box[:f], half, *box[f + 1 :])
            box = (*box[:f], box[f] & ~half, *box[f + 1 :]) if self._are_held(first, avoided) else first
        return tuple(side.bit_length() - 1 for side in box)

    def _are_held(self, box: Box, by: int) -> bool:
        if self._questions is None or len(self._questions.boxes) < len(self.boxes):
            self._questions = Questions(tuple(self.boxes), self.space.full, self.progress)
        are_held, is_certain, work = self._questions.are_held(box, by, self.work)
        self.work -= min(work, self.work)
        if not is_certain:
            raise OutOfSteps
        return are_held


def slabs(within: Box, full: Box) -> Sequence[Box]:
    """What is outside of a box: one for each side that it restricts."""
    return [(*full[:f], full[f] & ~side, *full[f + 1 :]) for f, side in enumerate(within) if side != full[f]]


def _lower_half(side: int) -> int:
    """Of the classes of a side the lower ones, half of them."""
    numbers = bitmask.rows_of(side)
    return bitmask.int_of(numbers[: len(numbers) // 2])


# ---- questions about many boxes, answered by the core: whether some hold all of another, and which lies within which
#
# The answers are those of `witness`, which is quicker where boxes are few. Single points count.


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
