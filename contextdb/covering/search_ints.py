"""The search of `search_kernels.leaves_open` for where numba is not installed: the same steps, a set of boxes in one integer."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from contextdb.covering.count_ints import (
    Factor,
    Part,
    chosen_groups,
    factors_of,
    hanging_together,
    numbers_of,
    renumbered,
    without_inner,
)
from contextdb.covering.count_kernels import DENSE, ROOM
from contextdb.covering.search_kernels import FIRST


class Search:
    """A search for a context that none of some boxes holds; `work` steps are done, and some parts may be `cut` short."""

    def __init__(self, part: tuple[NDArray[Any], ...], cells: list[list[int]], hashes: list[list[int]], depth: int) -> None:
        self.boxes, self.factors = factors_of(part, cells, hashes)
        self.depth = depth
        self.work = self.limit = self.cut = 0

    def leaves_open(self, work: int, limit: int) -> bool:
        """Whether some context is in none of the boxes, with so many steps done, of so many; "no" where that was cut short."""
        self.work, self.limit = work, limit
        return self._leaves(Part(self.boxes), 0, self.boxes, self.factors)

    def _leaves(self, part: Part, depth: int, opened: int, listed: list[Factor]) -> bool:
        """As `search_kernels.leaves_open`: of the open boxes, of which some of the listed factors are restricted."""
        self.work += 2 + (len(listed) * part.n_words >> 4)
        own = [factor for factor in listed if factor.limits & opened]
        once = 0
        for factor in own:
            once |= factor.limits
        if opened & ~once:
            return False
        m = opened.bit_count()
        if m <= 1:
            return True
        if self.work >= self.limit or depth >= self.depth - ROOM:
            self.cut += 1
            return False
        if part.n_words > 1 and m <= DENSE * part.n_words:
            self.work += m * len(own) >> 3
            less, factors = renumbered(part, opened, own)
            return self._leaves(less, depth + 2, less.boxes, factors)
        if part.n_words <= 2:
            self.work += m * part.n_words >> 2
            opened = without_inner(opened, numbers_of(opened), own)
            own = [factor for factor in own if factor.limits & opened]
        limits = [factor.limits & opened for factor in own]
        kept = hanging_together(limits)
        if kept != opened:
            return self._leaves(part, depth + 1, kept, own) and self._leaves(part, depth + 1, opened & ~kept, own)
        return self._fixed(part, depth + 1, opened, own, limits)

    def _fixed(self, part: Part, depth: int, opened: int, own: list[Factor], limits: list[int]) -> bool:
        """The same when one factor is fixed, to each group of classes in turn."""
        best, chosen = chosen_groups(part, opened, own, limits, FIRST)
        listed = [*own[:best], *own[best + 1 :]]
        self.work += len(chosen) * part.n_words >> 2
        tried: list[int] = []
        for group, _ in chosen:
            if any(not other & ~group for other in tried):
                continue
            if self._leaves(part, depth, group, listed):
                return True
            if self.cut:
                return False
            tried.append(group)
        return False
