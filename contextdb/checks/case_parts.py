"""The boxes of contexts that reach the targets of saved contexts (`contextdb.checks.slips`), and contexts that grow in them.

A part of a target is a box and rows that must not be valid there: of a row its own box; of a row that is picked the same, without
those that the policy prefers; of a slip what the row holds only before, or only after it, without other rows of the asset.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from operator import and_

import numpy as np

from contextdb import bitmask
from contextdb.checks.slips import Slips
from contextdb.covering.assumed import Opened
from contextdb.covering.points import PointFinder
from contextdb.covering.preferred import Preferred
from contextdb.covering.progress import Progress
from contextdb.covering.space import Box
from contextdb.covering.witness import BoxSet, Point

Part = tuple[Box, int]
"""A box, and boxes, as bits, that must not hold a context of it."""
WORK = 40_000_000
MOST_TRIES = 64
"""A growing context is tried with so many parts that it cannot reach."""


@dataclass(eq=False)
class Parts:
    """The parts of all targets."""

    slips: Slips
    boxes: dict[int, Box]
    """The box of each row that accepts something, rows after slips too."""
    bits: dict[int, int]
    """The bit of each row of the table."""
    finder: PointFinder
    preferred: Preferred

    @classmethod
    def of(cls, slips: Slips, ready: Opened, progress: Progress) -> Parts:
        rows, n_own = ready.space.rows, int(np.searchsorted(ready.space.rows, slips.n_rows))
        preferred = Preferred(slips.choosing.compiled, rows[:n_own])
        bits = {row: 1 << i for i, row in enumerate(rows[:n_own])}
        finder = PointFinder(ready.space.first(n_own), WORK, progress)
        return cls(slips, dict(zip(rows, ready.space.boxes, strict=True)), bits, finder, preferred)

    def of_target(self, target: int) -> Iterator[Part]:
        n, row = self.slips.n_rows, self.slips.row_of(target)
        own, impossible = self.boxes.get(row), self.finder.impossible
        others = impossible | self._of_asset(row)
        if target >= 3 * n:
            after = self.boxes.get(n + target - 3 * n)
            yield from ((box, others) for box in _differences(own, after))
        elif own is None:
            return
        elif target < n:
            yield own, impossible
        elif target >= 2 * n:
            yield own, others
        elif self.preferred.pickable & self.bits[row]:
            yield own, impossible | self.preferred.to(self.bits[row].bit_length() - 1)

    def _of_asset(self, row: int) -> int:
        """The other rows of a row's asset."""
        if row not in self._known:
            bits = 0
            for other in self.slips.rows_of_asset(row):
                bits |= self.bits.get(other, 0)
            self._known[row] = bits
        return self._known[row]

    @cached_property
    def _known(self) -> dict[int, int]:
        return {}


def _differences(one: Box | None, other: Box | None) -> Iterator[Box]:
    """Boxes that together hold what one of two boxes holds and the other does not."""
    if one is None or other is None:
        yield from (box for box in (one, other) if box is not None)
        return
    for f, (a, b) in enumerate(zip(one, other, strict=True)):
        if a & ~b:
            yield (*one[:f], a & ~b, *one[f + 1 :])
        if b & ~a:
            yield (*other[:f], b & ~a, *other[f + 1 :])


@dataclass(eq=False)
class Growing:
    """Parts of targets, in which contexts grow."""

    parts: Parts
    box_set: BoxSet
    listed: list[Part] = field(default_factory=list)
    of_target: list[int] = field(default_factory=list)
    """The parts of each target, as bits."""

    @classmethod
    def of(cls, parts: Parts, n_targets: int, progress: Progress) -> Growing:
        listed: list[Part] = []
        of_target = []
        for target in range(n_targets):
            own = list(parts.of_target(target))
            of_target.append((1 << len(listed) + len(own)) - (1 << len(listed)))
            listed += own
        box_set = BoxSet.of(parts.finder.space.full, [box for box, _ in listed], progress)
        return cls(parts, box_set, listed, of_target)

    @property
    def finder(self) -> PointFinder:
        return self.parts.finder

    def grown(self, target: int, left: int) -> Point | None:
        """A context that reaches a target, and as many of the parts in `left` as can be met one after the other; None where there
        is none, or none was met."""
        for i in bitmask.rows_of(self.of_target[target]):
            box, avoided = self.listed[i]
            point = self.finder.point(box, avoided)
            if point is not None:
                return self._grown(box, avoided, point, left & ~self.of_target[target])
        return None

    def _grown(self, box: Box, avoided: int, point: Point, near: int) -> Point:
        for f, side in enumerate(box):
            near &= self.box_set.meeting(f, side)
        n_tries = 0
        while near and n_tries < MOST_TRIES:
            i = (near & -near).bit_length() - 1
            near &= near - 1
            other, more = self.listed[i]
            joint = tuple(map(and_, box, other))
            further = self.finder.point(joint, avoided | more)
            if further is None:
                n_tries += 1
                continue
            for f in (f for f, (a, b) in enumerate(zip(box, joint, strict=True)) if a != b):
                near &= self.box_set.meeting(f, joint[f])
            box, avoided, point = joint, avoided | more, further
        return point
