"""Questions about many boxes by compiled loops: whether some hold all of another, and which lies within which.

The answers are those of `witness`, which needs no loading and is quicker where boxes are few. Single points count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.console import was_compiled
from contextdb.covering.count import depth_of, scratch_of, table_of
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.space import Box, runs_of

Arrays = tuple[NDArray[Any], ...]
MANY = 1000
"""From so many boxes on the loops are worth loading."""
AT_ONCE = 10_000_000
"""So many words of boxes are compared between two looks at whether to stop."""


def is_prepared() -> bool:
    """Whether the loops that answer were compiled on this machine already, or run as they stand."""
    from contextdb.covering.kernels import IS_COMPILED
    from contextdb.covering.search_kernels import first_holders, leaves_open

    return not IS_COMPILED or (was_compiled(leaves_open) and was_compiled(first_holders))


@dataclass(frozen=True, eq=False)
class Questions:
    """Boxes to be asked about, by number."""

    boxes: Sequence[Box]
    full: Box
    progress: Progress = SILENT
    """Whom to ask whether to stop."""

    @cached_property
    def _table(self) -> Arrays:
        return table_of(self.boxes, self.full, [side.bit_length() for side in self.full], self.progress)

    def are_held(self, box: Box, by: int, most: int) -> tuple[bool, bool, int]:
        """Whether the boxes whose bits are in `by` hold all of a box, whether that is certain, and the steps it took."""
        from contextdb.covering.kernels import IS_COMPILED
        from contextdb.covering.part_kernels import part_of

        table, n_factors = self._table, len(self.full)
        chosen = np.flatnonzero(bitmask.unpack(bitmask.from_int(by, len(self.boxes)), len(self.boxes)))
        inside = self._inside(box)
        work = len(chosen) * n_factors >> 3
        with np.errstate(over="ignore"):
            part = part_of(chosen, np.arange(n_factors), inside, np.zeros(n_factors, np.uint64), table)
            if not len(part[0]):
                return bool(len(chosen)), True, work
            is_open, is_cut, work = (self._by_loops if IS_COMPILED else self._by_integers)(part, work, most, inside)
        return not (is_open or is_cut), not is_cut, work

    def _by_loops(self, part: Arrays, work: int, most: int, inside: NDArray[np.float64]) -> tuple[bool, bool, int]:
        from contextdb.covering.count_kernels import CUT, LIMIT, WORK
        from contextdb.covering.search_kernels import leaves_open

        state = np.zeros(5, np.int64)
        state[LIMIT], state[WORK] = most, work
        scratch = scratch_of(part, int(np.diff(self._table[4]).max()))
        salts = np.zeros(len(self.full), np.uint64)
        is_open = bool(leaves_open(part, 0, len(part[0]), inside, salts, self._table, scratch, state))
        return is_open, bool(state[CUT]), int(state[WORK])

    def _by_integers(self, part: Arrays, work: int, most: int, _: NDArray[np.float64]) -> tuple[bool, bool, int]:
        from contextdb.covering.search_ints import Search

        search = Search(part, *self._lists, depth_of(part))
        return search.leaves_open(work, most), bool(search.cut), search.work

    @cached_property
    def _lists(self) -> tuple[list[list[int]], list[list[int]]]:
        """The cells of each factor and the hashes of cells, as `count_ints` wants them."""
        return self._table[0].T.tolist(), self._table[3].tolist()

    def _inside(self, box: Box) -> NDArray[np.float64]:
        """1 for each class that a box holds, else 0."""
        inside, edges = np.ones(int(self._table[4][-1])), self._table[4]
        for f, side in enumerate(box):
            if side != self.full[f]:
                inside[edges[f] : edges[f + 1]] = 0.0
                for first, stop in runs_of(side):
                    inside[edges[f] + first : edges[f] + stop] = 1.0
        return inside

    def holders(self, n: int, progress: Progress = SILENT) -> NDArray[np.int64]:
        """For each of the first n boxes the first of them that holds it whole and is not equal to it; -1: there is none."""
        from contextdb.covering.part_kernels import part_of
        from contextdb.covering.search_kernels import first_holders

        n_factors = len(self.full)
        everything = np.ones(int(self._table[4][-1]))
        known: dict[Box, int] = {}
        alike = np.array([known.setdefault(box, i) for i, box in enumerate(self.boxes[:n])], np.int64)
        found = np.full(n, -1, np.int64)
        with np.errstate(over="ignore"):
            part = part_of(np.arange(n), np.arange(n_factors), everything, np.zeros(n_factors, np.uint64), self._table)
            step = max(1, AT_ONCE // part[1].shape[1])
            for start in range(0, n, step):
                progress.at(start / n)
                first_holders(part, alike, found, start, min(n, start + step))
        return found
