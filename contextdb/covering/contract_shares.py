"""The share of the contexts in which a contract holds: counted by the core, or bounded by random contexts.

Counting adds up boxes, so it is exact where it is finished. Where only draws tell what can happen, contexts are drawn, and the
bounds hold with a chance of 99 %.

A part of what breaks a contract is a box and others that must not hold a context of it:

    some      all contexts, in no row of the kind
    every     a row of another kind
    none      a row of the kind
    at_most   what n + 1 rows share
    winner    all contexts, in no row; and a row of another kind, in no row that the policy prefers to it

and of all these contexts those that `when` or `assume` excludes are taken out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from operator import and_

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.covering.count import Bounds, uncovered_share
from contextdb.covering.moments import Moment, Moments, Preferred
from contextdb.covering.points import PointFinder
from contextdb.covering.report import wilson
from contextdb.covering.sample import CHUNK, Sampler
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import OutOfSteps, Point
from contextdb.schema.contracts import Contract

MOST_SHARED = 2_000
"""So many boxes that too many rows share are counted."""

MOST_RUN_BOXES = 10_000
"""So many boxes, those of all runs of rows that alternate in kind together, are counted."""

Drawn = tuple[Point, Moment]
"""A context that was drawn: its classes, and its facts."""


@dataclass(eq=False)
class Shares:
    """Measures a contract."""

    demand: Demand
    moments: Moments

    @property
    def space(self) -> Space:
        return self.demand.space

    def share(self, samples: int, rng: np.random.Generator) -> tuple[float, float]:
        """Bounds of the share of contexts in which the contract holds, where boxes tell what can happen."""
        bounds = self._counted()
        if bounds is not None and bounds.is_exact:
            return bounds.lower, bounds.upper
        lower, upper = self._sampled(samples, rng)
        return (lower, upper) if bounds is None else (max(lower, bounds.lower), max(lower, min(upper, bounds.upper)))

    def _counted(self) -> Bounds | None:
        """The share by counting boxes; None where it is of another form."""
        possible = self._open(self._impossible)
        if possible.upper == 0.0:
            return Bounds(0.0, 0.0)
        verb = self.demand.contract.verb
        if verb == "some":
            return _less(_over(self._open(self._impossible | self.demand.kind), possible))
        if verb in ("every", "none"):
            return _over(
                self._open(
                    self._impossible | (self.demand.kind if verb == "none" else self.demand.finder.rows & ~self.demand.kind)
                ),
                possible,
            )
        if verb == "at_most":
            return self._not_shared(possible)
        return self._won(possible)

    def _open(self, avoided: int, parts: int = 1) -> Bounds:
        """The share that some boxes leave open, by one of so many equal parts of the work."""
        return uncovered_share(
            self.space, self.demand.finder.chosen(avoided), self.demand.finder.work // parts, self.demand.finder.progress
        )

    def _not_shared(self, possible: Bounds) -> Bounds | None:
        shared: dict[Box, None] = {}
        try:
            for box in self.demand.shared(self.space.full, 0, self.demand.kind):
                shared[box] = None
                if len(shared) > MOST_SHARED:
                    return None
        except OutOfSteps:
            return None
        left = uncovered_share(self.space, [*shared, *self.space.impossible], self.demand.finder.work, self.demand.finder.progress)
        return _over(left, possible)

    def _won(self, possible: Bounds) -> Bounds | None:
        """The share in which the first of the valid rows, those of the kind behind others of their rank, is of the kind."""
        if len(self.demand.picks.choosing.ranks) > 1:
            return None
        pickable = bitmask.flags_of(self.demand.picks.pickable, len(self.space.boxes))
        rows = np.array(self.space.rows, np.int64)
        is_kind, ranks = bitmask.flags_of(self.demand.kind, len(rows)), self.demand.picks.choosing.ranks[0][rows]
        counted = pickable & (~is_kind | self.demand.picks.always[rows])
        order = sorted(np.flatnonzero(counted).tolist(), key=lambda i: (-ranks[i], is_kind[i]))
        n_runs = 2 + 2 * sum(not is_kind[i] for i, j in zip_longest(order, order[1:]) if j is None or is_kind[j])
        if n_runs * len(order) > MOST_RUN_BOXES:
            return None
        left = self._open(self._impossible | self.demand.finder.rows, n_runs)  # no row is valid
        low, high, before, own = left.lower, left.upper, self._impossible, 0
        for i in [*order, None]:
            if i is not None and not is_kind[i]:
                own |= 1 << i
                continue
            if own:
                here, there = self._open(before, n_runs), self._open(before | own, n_runs)
                low, high = low + max(0.0, here.lower - there.upper), high + here.upper - there.lower
                before, own = before | own, 0
            if i is not None:
                before |= 1 << i
        broken = Bounds(low, high)
        return _less(_over(broken, possible))

    def _sampled(self, samples: int, rng: np.random.Generator) -> tuple[float, float]:
        """The share by random contexts, with a chance of 99 %."""
        n_contexts = n_broken = 0
        for codes, _ in self._sampler.random_contexts(samples, rng):
            broken = self._broken_at(codes[self._sampler.is_possible(codes)])
            n_contexts += len(broken)
            n_broken += int(broken.sum())
        return wilson(n_contexts - n_broken, n_contexts)

    def drawn(self, samples: int, rng: np.random.Generator, most: int) -> tuple[tuple[float, float], list[Drawn]]:
        """The same by draws of what can happen, and at most so many of those that break the contract."""
        assert self.moments.drawer is not None
        n_contexts, drawn, n_broken = 0, list[Drawn](), 0
        for at in range(0, samples, CHUNK):
            codes, columns = self.moments.drawer.moments(min(CHUNK, samples - at), rng)
            broken = self._broken_at(codes) & self._sampler.is_possible(codes)
            n_contexts += int(self._sampler.is_possible(codes).sum())
            n_broken += int(broken.sum())
            for i in np.flatnonzero(broken)[: max(0, most - len(drawn))].tolist():
                drawn.append((tuple(codes[i].tolist()), self.moments.drawn(codes[i], columns, i)))
        return wilson(n_contexts - n_broken, n_contexts), drawn

    def _broken_at(self, codes: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Whether contexts, as classes of the factors, break the contract."""
        self.demand.finder.progress.check()
        return self.demand.broken(self._sampler.held(codes))

    @cached_property
    def _sampler(self) -> Sampler:
        return Sampler(self.space, self.demand.finder.progress, self.moments.drawer)

    @property
    def _impossible(self) -> int:
        return self.demand.finder.impossible


def _over(part: Bounds, whole: Bounds) -> Bounds:
    if part.is_exact and whole.is_exact:
        share = min(1.0, part.lower / whole.lower)
        return Bounds(share, share)
    return Bounds(min(1.0, part.lower / whole.upper), min(1.0, part.upper / whole.lower) if whole.lower > 0.0 else 1.0)


def _less(share: Bounds) -> Bounds:
    return Bounds(1.0 - share.upper, 1.0 - share.lower)


# ---- what a contract demands of contexts: the boxes of those that break it, and whether it is broken where some rows are
# valid


Part = tuple[Box, int]
"""A box, and the boxes of a table, as bits, that must not hold a context of it."""


@dataclass(eq=False)
class Demand:
    """A contract, and the rows of a table by what it says of them."""

    contract: Contract
    finder: PointFinder
    picks: Preferred
    kind: int
    """Which boxes are rows of the kind, as bits."""

    @property
    def space(self) -> Space:
        return self.finder.space

    def parts(self) -> Iterator[Part]:
        """What breaks the contract, part by part."""
        verb, full = self.contract.verb, self.space.full
        if verb in ("some", "winner"):
            yield full, self.finder.impossible | (self.kind if verb == "some" else self.finder.rows)
        if verb in ("every", "none"):
            for i in bitmask.rows_of(self.kind if verb == "none" else self.finder.rows & ~self.kind):
                yield self.space.boxes[i], self.finder.impossible
        if verb == "winner":
            for i in bitmask.rows_of(self.finder.rows & ~self.kind & self.picks.pickable):
                yield self.space.boxes[i], self.finder.impossible | self.picks.to(i)
        if verb == "at_most":
            for box in self.shared(full, 0, self.kind):
                yield box, self.finder.impossible

    def shared(self, box: Box, n: int, others: int) -> Iterator[Box]:
        """What n of some rows more than are allowed share with a box."""
        if n > self.contract.most:
            yield box
            return
        while n + others.bit_count() > self.contract.most:
            self.finder.steps.take()
            i = (others & -others).bit_length() - 1
            others &= others - 1
            own = self.space.boxes[i]
            joint = tuple(map(and_, box, own))
            meeting = others
            for f in (f for f, (a, b) in enumerate(zip(joint, box, strict=True)) if a != b):
                meeting &= self.finder.box_set.meeting(f, joint[f])
            yield from self.shared(joint, n + 1, meeting) if 0 not in joint else ()

    def breaks(self, rows: NDArray[np.int64]) -> bool:
        """Whether a contract is broken where these rows are valid."""
        valid = np.zeros((1, self.picks.compiled.n_rows), np.bool_)
        valid[0, rows] = True
        return bool(self.broken(valid[:, list(self.space.rows)])[0])

    def broken(self, valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whether the contract is broken in contexts, bool [N], by the boxes that hold each, bool [N, boxes]."""
        is_kind = bitmask.flags_of(self.kind, len(self.space.boxes))
        of_kind = valid & is_kind
        verb = self.contract.verb
        if verb == "some":
            return np.asarray(~of_kind.any(axis=1))
        if verb == "none":
            return np.asarray(of_kind.any(axis=1))
        if verb == "every":
            return np.asarray((valid & ~is_kind).any(axis=1))
        if verb == "at_most":
            return np.asarray(of_kind.sum(axis=1) > self.contract.most)
        others = bitmask.flags_of(self.finder.rows & ~self.kind & self.picks.pickable, len(self.space.boxes))
        won_by_others = (valid & others & ~self.picks.beaten(valid)).any(axis=1)
        return np.asarray(~valid.any(axis=1) | won_by_others)
