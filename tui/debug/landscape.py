"""What every frame of every asset cost in a search, as rows of bars: a row a range, the taller a bar the cheaper.

R ranges of all databases that were searched. Costs are those of `contextdb.motion.trace.other_filters`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.trace.other_filters import ReaskedSearch

ORDERS = ("best", "name", "use")
LEVELS = 8
"""How high a bar is, in steps."""


@dataclass(frozen=True, slots=True)
class Row:
    """A range of a database: an asset, as it is or mirrored, with its best frame."""

    database: str
    range: int
    asset: str
    mirrored: bool
    frame: int
    cost: float
    left_out: LeftOut
    """Why its best frame may not be chosen."""
    is_searched: bool
    """Whether its database was searched, and none before it won outright."""
    permutation_s: float | None = None
    """How many seconds ahead its permutation looks."""

    @property
    def name(self) -> str:
        """As it is displayed."""
        return f"{self.asset}{' ~' if self.mirrored else ''}{'' if self.permutation_s is None else f' +{self.permutation_s:g} s'}"

    @property
    def may_play(self) -> bool:
        """Whether any of its frames may be chosen."""
        return self.left_out is LeftOut.NO and self.is_searched

    @property
    def reason(self) -> str:
        """Why none may; "" where one may."""
        return self.left_out.text or ("" if self.is_searched else "another database won before it was searched")


class Landscape:
    """The costs of all frames that were, or could have been, searched; `searched` are the databases that were."""

    def __init__(self, searches: Mapping[str, ReaskedSearch], searched: Collection[str] = ()) -> None:
        self.searches = dict(searches)
        self.rows: tuple[Row, ...] = tuple(
            row for name, search in self.searches.items() for row in _rows(name, search, name in searched)
        )

    def ordered(self, order: str, text: str = "", uses: Mapping[tuple[str, bool], int] | None = None) -> list[Row]:
        """The rows whose asset's name holds a text, by "best" cost, by "name", or by "use" in the session."""
        rows = [row for row in self.rows if text.casefold() in row.asset.casefold()]
        if order == "name":
            return sorted(rows, key=lambda row: (row.asset, row.mirrored, row.database))
        if order == "use":
            counts = uses or {}
            return sorted(rows, key=lambda row: (-counts.get((row.asset, row.mirrored), 0), row.asset))
        return sorted(rows, key=lambda row: (not row.may_play, row.cost))

    @cached_property
    def reach(self) -> tuple[float, float]:
        """The least cost of all, and a large one: the median over assets of their best."""
        best = np.array([row.cost for row in self.rows if np.isfinite(row.cost)])
        if not len(best):
            return 0.0, 1.0
        return float(best.min()), float(max(np.median(best) * 2.0, best.min() + 1e-9))

    def bars(self, row: Row, width: int) -> tuple[Ints, NDArray[np.bool_], tuple[int, int]]:
        """How high each of `width` bars is, 0 to `LEVELS`, whether its best frame may be chosen, and the frames that it draws.

        A bar is the cheapest of its frames, one that may be chosen before all others.
        """
        search = self.searches[row.database]
        start, stop = int(search.database.starts[row.range]), int(search.database.stops[row.range])
        n = stop - start
        width = min(width, n)
        if width <= 0:
            return np.zeros(0, np.int64), np.zeros(0, np.bool_), (start, stop)
        edges = (np.arange(width) * n) // width
        costs, is_free = search.costs[start:stop], search.left_out[start:stop] == LeftOut.NO
        of_free = np.minimum.reduceat(np.where(is_free, costs, np.inf), edges)
        of_all = np.minimum.reduceat(costs, edges)
        is_valid = np.isfinite(of_free) & row.is_searched
        return self._levels(np.where(np.isfinite(of_free), of_free, of_all)), is_valid, (start, stop)

    def _levels(self, costs: Floats) -> Ints:
        least, most = self.reach
        shares = 1.0 - np.clip((costs - least) / (most - least), 0.0, 1.0)
        return np.where(np.isfinite(costs), 1 + np.round(shares * (LEVELS - 1)), 0).astype(np.int64)


def _rows(name: str, search: ReaskedSearch, is_searched: bool) -> Sequence[Row]:
    database = search.database
    starts, stops = np.asarray(database.starts, np.int64), np.asarray(database.stops, np.int64)
    rows = []
    for i, (start, stop) in enumerate(zip(starts.tolist(), stops.tolist(), strict=True)):
        if stop <= start:
            continue
        costs, why = search.costs[start:stop], search.left_out[start:stop]
        free = np.where(why == LeftOut.NO, costs, np.inf)
        at = int(free.argmin()) if np.isfinite(free).any() else int(costs.argmin())
        mirrored, left_out, ahead_s = bool(database.mirrored[i]), LeftOut(int(why[at])), database.permutation_s(i)
        rows.append(Row(name, i, database.assets[i], mirrored, start + at, float(costs[at]), left_out, is_searched, ahead_s))
    return rows
