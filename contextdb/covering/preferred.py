"""Which rows of a table its policy prefers to which, whatever was picked before, what rests, and what a search costs."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.data import CompiledData

Ranks = tuple[tuple[int, float], ...]
"""Group and rank of a row at each depth of tables inside tables."""


@dataclass(eq=False)
class Preferred:
    """The rows of a compiled table that are boxes of a space; sets of them are bits, a bit for each box."""

    compiled: CompiledData
    rows: tuple[int, ...]
    """The row of each box."""
    _above: dict[Ranks, int] = field(default_factory=dict)

    @cached_property
    def choosing(self) -> Choosing:
        return self.compiled.once(Choosing.of)

    @cached_property
    def pickable(self) -> int:
        """The rows that can be picked at all."""
        return self._bits(self.choosing.pickable)

    @cached_property
    def always(self) -> NDArray[np.bool_]:
        """The rows that are picked from whenever they are valid: those that never rest and have some weight. bool [n_rows]."""
        limits = self.choosing.limits
        rests = np.zeros(self.compiled.n_rows, np.bool_) if limits is None else (limits.of_row >= 0).any(axis=0)
        return self.choosing.pickable & ~rests

    def to(self, i: int) -> int:
        """The rows that keep box number `i` from being picked where they are valid: of a higher rank at some depth of one way."""
        row, ranks, groups = self.rows[i], self.choosing.ranks, self.choosing.groups
        key = tuple((int(g), float(r)) for g, r in zip(groups[:, row], ranks[:, row], strict=True))
        if key not in self._above:
            above = np.zeros(self.compiled.n_rows, np.bool_)
            for depth in range(len(ranks)):
                above |= (groups[depth] == groups[depth, row]) & (ranks[depth] > ranks[depth, row])
            self._above[key] = self._bits(above & self.always)
        return self._above[key]

    def beaten(self, valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which boxes are kept from being picked by others that hold a context, bool [N, boxes], where these hold it, bool [N,
        boxes]: those that meet one of `to`."""
        rows, beaten = np.array(self.rows, np.int64), np.zeros(valid.shape, np.bool_)
        counted = valid & self.always[rows]
        for groups, ranks in zip(self.choosing.groups[:, rows], self.choosing.ranks[:, rows], strict=True):
            names, of_box = np.unique(groups, return_inverse=True)
            best = np.full((len(valid), len(names)), -np.inf)
            for at in range(len(names)):
                own = np.flatnonzero(of_box == at)
                own = own[np.argsort(-ranks[own], kind="stable")]
                here = counted[:, own]
                best[:, at] = np.where(here.any(axis=1), ranks[own[here.argmax(axis=1)]], -np.inf)
            beaten |= ranks < (best[:, of_box] if len(names) > 1 else best)
        return beaten

    def _bits(self, flags: NDArray[np.bool_]) -> int:
        return bitmask.int_of([i for i, row in enumerate(self.rows) if flags[row]])
