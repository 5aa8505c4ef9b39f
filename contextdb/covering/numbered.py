"""Boxes by the numbers of their sides: of each factor the different sides, and which of them each box has.

Memory grows with boxes × factors, not with the classes, so that tables of any size can be gone through. `witness.BoxSet`, a bit for
each box and class, is what searches need. B boxes; sets of boxes are bool [B].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Flags

Box = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class NumberedBoxes:
    """Boxes, to be asked which of them hold or meet something."""

    full: Box
    n_boxes: int
    numbers: tuple[NDArray[np.intp], ...]
    """For each factor the number of each box's side, intp [B]."""
    sides: tuple[tuple[int, ...], ...]
    """For each factor the different sides."""

    @classmethod
    def of(cls, full: Box, boxes: Sequence[Box]) -> NumberedBoxes:
        numbers, sides = [], []
        for f in range(len(full)):
            known: dict[int, int] = {}
            numbers.append(np.array([known.setdefault(box[f], len(known)) for box in boxes], np.intp))
            sides.append(tuple(known))
        return cls(full, len(boxes), tuple(numbers), tuple(sides))

    def holding(self, f: int, side: int) -> Flags:
        """The boxes that accept every class of a side of the factor."""
        return self._where(f, lambda own: not side & ~own)

    def meeting(self, f: int, side: int) -> Flags:
        """The boxes that share a class of the factor with a side."""
        return self._where(f, lambda own: own & side != 0)

    def behind(self, point: Sequence[int], order: Sequence[int]) -> list[Flags]:
        """The boxes that accept a point's classes of all factors in an order from each place on; the last are all boxes."""
        flags = [np.ones(self.n_boxes, np.bool_)]
        for f in reversed(order):
            flags.append(flags[-1] & self.meeting(f, 1 << point[f]))
        return flags[::-1]

    def accepted_by(self, f: int, boxes: Flags) -> int:
        """The classes that some of these boxes accept."""
        classes = 0
        for number in np.unique(self.numbers[f][boxes]).tolist():
            classes |= self.sides[f][number]
        return classes

    def bits_at(self, point: Sequence[int]) -> int:
        """The boxes that hold a point, as bits."""
        return bitmask.int_of(np.flatnonzero(self.behind(point, range(len(point)))[0]).tolist())

    @cached_property
    def order(self) -> list[int]:
        """The factors, those that fewest boxes restrict first."""
        n_holding = [int(self.holding(f, side).sum()) for f, side in enumerate(self.full)]
        return sorted(range(len(self.full)), key=lambda f: (self.n_boxes - n_holding[f], -f))

    def _where(self, f: int, holds: Callable[[int], bool]) -> Flags:
        flags: Flags = np.array(list(map(holds, self.sides[f])), np.bool_)[self.numbers[f]]
        return flags
