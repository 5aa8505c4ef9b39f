"""What a contract demands of contexts: the boxes of those that break it, and whether it is broken where some rows are valid.

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
from operator import and_

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.covering.points import PointFinder
from contextdb.covering.preferred import Preferred
from contextdb.covering.space import Box, Space
from contextdb.schema.contracts import Contract

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
