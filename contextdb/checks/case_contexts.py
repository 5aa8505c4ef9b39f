"""The fewest contexts that reach what can be reached of a table: every row, every winner, every slip (`contextdb.checks.slips`).

A small space is gone through whole, class by class. In a larger one a context grows: out of a target's box, which becomes smaller
for each target that it meets and that some context still reaches. Where only draws tell what can happen, contexts are drawn, at
random and in the boxes of targets. Of these the fewest are taken that reach the same; each is put to the compiled table.

A part of a target is a box and rows that must not be valid there: of a row its own box; of a row that is picked the same, without
those that the policy prefers; of a slip what the row holds only before, or only after it, without other rows of the asset.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from operator import and_

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Flags
from contextdb.checks.slips import Slips, flags_of
from contextdb.covering.assumed import Opened, opened
from contextdb.covering.fewest import fewest
from contextdb.covering.moments import Moment, Moments, Preferred
from contextdb.covering.points import PointFinder
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.sample import CHUNK, Sampler
from contextdb.covering.space import Box
from contextdb.covering.witness import BoxSet, Point
from contextdb.errors import ContextDBError

MOST_FLAGS = 40_000_000
"""A space is gone through whole where its classes times the targets are no more."""
SAMPLES = 20_000
MOST_KNOWN = 4_000
"""So many random contexts are kept, and then those that reach something new."""
MOST_SEARCHED = 400
"""So many targets that no random context reaches are drawn in their own boxes."""


@dataclass(frozen=True, slots=True)
class Reaching:
    """A context, and the targets that it reaches, as bits."""

    moment: Moment
    targets: int


@dataclass(frozen=True, slots=True)
class Reach:
    """What can be reached, and by which contexts."""

    reachable: int
    """The targets that some context reaches, as bits."""
    contexts: tuple[Reaching, ...]
    """A few that reach all of them but for those that are reached already."""
    is_fewest: bool
    """Whether no fewer would do."""
    is_whole: bool
    """Whether all that can be reached is known."""


def contexts_for(slips: Slips, reached: int, seed: int = 0, progress: Progress = SILENT) -> Reach:
    """Contexts that reach every target, besides those that are reached already, as bits."""
    search = _Search(slips, opened(slips.slipped, progress=progress), np.random.default_rng(seed), progress)
    candidates = list(search.candidates())
    numbers, is_fewest = fewest([one.targets & ~reached for one in candidates])
    chosen = tuple(candidates[i] for i in numbers)
    return Reach(search.reached | reached, chosen, is_fewest and search.is_exhaustive, search.is_whole)


@dataclass(eq=False)
class _Search:
    """Looks for contexts."""

    slips: Slips
    ready: Opened
    """The table with its slips."""
    rng: np.random.Generator
    progress: Progress
    known: dict[int, Reaching] = field(default_factory=dict)
    """Contexts by what they reach."""
    reached: int = 0
    """What any of them reaches."""
    is_exhaustive: bool = False
    """Whether every class of contexts was looked at."""
    is_whole: bool = True

    @cached_property
    def _rows(self) -> NDArray[np.int64]:
        return np.array(self.ready.space.rows, np.int64)

    @cached_property
    def sampler(self) -> Sampler:
        return Sampler(self.ready.space, self.progress, self.ready.drawer)

    @cached_property
    def moments(self) -> Moments:
        assert self.ready.table is not None
        return Moments(self.ready.space, self.ready.table, self.ready.drawer)

    @cached_property
    def parts(self) -> Parts:
        return Parts.of(self.slips, self.ready, self.progress)

    def candidates(self) -> Iterable[Reaching]:
        """Contexts that reach different things, and together all that can be reached."""
        n_classes = math.prod(len(factor.weights) for factor in self.ready.space.factors)
        every = self.sampler.every_context() if n_classes * self.slips.n_targets <= MOST_FLAGS else None
        if self.ready.drawer is not None:
            self._draw()
        elif every is not None:
            self.is_exhaustive = True
            for codes, _ in every:
                self._add_points(codes)
        else:
            self._grow()
        return self.known.values()

    def _add_points(self, codes: NDArray[np.int32]) -> None:
        codes = codes[self.sampler.is_possible(codes)]
        for i, targets in self._new(self._hits(codes)):
            self._add(self.moments.of_point(tuple(codes[i].tolist())), targets)

    def _hits(self, codes: NDArray[np.int32]) -> Flags:
        valid = np.zeros((len(codes), self.slips.slipped.n_rows), np.bool_)
        valid[:, self._rows] = self.sampler.held(codes)
        return self.slips.hits(valid)

    def _new(self, hits: Flags) -> Iterator[tuple[int, int]]:
        """Of contexts with some targets, by number, those that reach something else than each known one; and what they reach."""
        packed = np.packbits(hits, axis=1, bitorder="little")
        firsts: dict[bytes, int] = {}
        for i, row in enumerate(packed):
            firsts.setdefault(row.tobytes(), i)
        for raw, i in firsts.items():
            targets = int.from_bytes(raw, "little")
            if targets and targets not in self.known:
                yield i, targets

    def _add(self, moment: Moment, targets: int) -> None:
        """Keep a context, as the compiled table answers it."""
        confirmed = self._targets_at(moment) if self.moments.can_happen(moment) else 0
        self.is_whole &= confirmed == targets
        if confirmed:
            self.known[confirmed] = Reaching(moment, confirmed)
            self.reached |= confirmed

    def _targets_at(self, moment: Moment) -> int:
        try:
            bits = self.slips.compiled.query(moment).bits
        except ContextDBError:  # a rule or a derived fact has no value there
            return 0
        return bitmask.to_int(bitmask.pack(self.slips.hits(flags_of([bits], self.slips.slipped.n_rows))[0]))

    def _draw(self) -> None:
        """Contexts that can happen, at random, then in the boxes of what none of these reaches."""
        drawer = self.ready.drawer
        assert drawer is not None
        for _ in range(0, SAMPLES, CHUNK):
            self.progress.check()
            codes, columns = drawer.moments(CHUNK, self.rng)
            for i, targets in self._new(self._hits(codes)):
                if len(self.known) < MOST_KNOWN or targets & ~self.reached:
                    self._add(self.moments.drawn(codes[i], columns, i), targets)
        left = [target for target in range(self.slips.n_targets) if not self.reached >> target & 1]
        for target in left[:MOST_SEARCHED]:
            self._add_drawn(target)
        self.is_whole = False

    def _add_drawn(self, target: int) -> None:
        for box, _ in self.parts.of_target(target) if not self.reached >> target & 1 else ():
            for moment in self.moments.of_box(box, (), self.rng):
                if (targets := self._targets_at(moment)) >> target & 1:
                    self._add(moment, targets)
                    return

    def _grow(self) -> None:
        n_targets = self.slips.n_targets
        growing = Growing.of(self.parts, n_targets, self.progress)
        left = (1 << len(growing.listed)) - 1
        for target in range(n_targets - 1, -1, -1):
            self.progress.at(1.0 - target / n_targets)
            if self.reached >> target & 1:
                continue
            growing.finder.is_cut = False
            point = growing.grown(target, left)
            left &= ~growing.of_target[target]
            self.is_whole &= not growing.finder.is_cut
            if point is not None:
                before = self.reached
                self._add_points(np.array([point], np.int32))
                for other in bitmask.rows_of(self.reached & ~before):
                    left &= ~growing.of_target[other]


# ---- the boxes of contexts that reach the targets of saved contexts (`contextdb.checks.slips`), and contexts that grow in
# them


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
