"""A recorded decision repeated: what its databases choose, and where any asset stands."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from contextdb.cells.arguments import require_text
from contextdb.motion.arguments import query_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search import candidates
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Filter
from contextdb.motion.search.hit import Hit
from contextdb.motion.selection.choice import Choice, Status
from contextdb.motion.selection.decision import Decision
from contextdb.motion.selection.selector import Entry, choice_of
from contextdb.motion.trace.cost_views import Ranked
from contextdb.motion.trace.other_filters import ReaskedSearch
from contextdb.motion.trace.stock import Stock
from contextdb.motion.trace.views import role_of

Chosen = tuple[str, str | None, int] | None
"""A database, an asset of it and a frame, counted from the start of the asset's range; None for nothing."""


@dataclass(frozen=True, eq=False)
class ReaskedDecision:
    """A recorded decision repeated."""

    decision: Decision
    """As it was recorded."""
    entries: tuple[Entry, ...]
    """The databases in order, with their thresholds."""
    searches: Mapping[str, ReaskedSearch]
    """All that could be searched, in order; empty for an update without a search."""
    stock: Stock
    """Where the tables are."""
    was: Chosen = None
    """The recorded choice."""

    @cached_property
    def choice(self) -> Choice | None:
        """What the selector chooses; None for an update without a search."""
        recorded = self.decision.choice
        if recorded is None:
            return None
        among = frozenset(search.database for search in recorded.searches if search.status is not Status.NOT_AMONG)
        hits: dict[str, Hit] = {}
        for entry in self.entries:
            if entry.name in self.searches:
                hits[entry.name] = hit = self.searches[entry.name].hit
                if entry.threshold is not None and hit.cost < entry.threshold:
                    return choice_of(self.entries, hits, among, entry.name)
        return choice_of(self.entries, hits, among, None)

    @property
    def searched(self) -> dict[str, ReaskedSearch]:
        """The searches that the choice needed."""
        needed = () if self.choice is None else (each.database for each in self.choice.searches if each.hit is not None)
        return {name: self.searches[name] for name in needed}

    @property
    def continuing_cost(self) -> float | None:
        """What playing on costs; None where nothing may play on."""
        before = self.decision.before
        if before is None or before.database not in self.searches:
            return None
        search = self.searches[before.database]
        return continuing_cost(search.database, query_of(search.query, search.database.feature_names), search.chosen)

    @property
    def is_changed(self) -> bool:
        """Whether another frame is chosen than the recorded choice."""
        starts = {name: search.database.starts.tolist() for name, search in self.searched.items()}
        return chosen_of(self.choice, starts) != self.was

    @property
    def is_other_asset(self) -> bool:
        """Whether another asset is chosen than the recorded choice."""
        return self.is_changed and asset_of(self.choice) != asset_of(self.decision.choice)

    def best_of_assets(self, text: str = "") -> list[Ranked]:
        """Of each range whose asset's name holds a text, in any case, the best frame, cheapest first, chosen or not.

        A frame that may be chosen comes before one that may not. Ranges that may not play come with their cost all the same, and
        with the reason. The rank counts the frames of all databases that were searched which may be chosen and cost less.
        Raises ContextError for what is no text.
        """
        require_text(text, "text")
        best: list[Ranked] = []
        for name, search in self.searched.items():
            ranges = [i for i, asset in enumerate(search.database.assets) if text.casefold() in asset.casefold()]
            frames = np.array([frame for i in ranges if (frame := search.best_of_range(i)) >= 0], np.int64)
            wanted = search.database.normalised(search.query)
            rows = candidates.of_frames(search.database, wanted, search.chosen, frames, search.costs[frames], search.left_out)
            best += [Ranked(self._rank(row.cost), name, row, role_of(self.decision, name, row.frame)) for row in rows]
        return sorted(best, key=lambda each: each.row.cost)

    def rank(self, asset: str) -> int | None:
        """How many frames that may be chosen cost less than the asset's best, and one; None where no database searched has it.

        Raises ContextError for what is no text.
        """
        require_text(asset, "asset")
        return min((each.rank for each in self.best_of_assets(asset) if each.row.asset == asset), default=None)

    def with_weights(self, weights: Mapping[str, float]) -> ReaskedDecision:
        """The same with other weights; nothing but the weighing is done again. Raises what `MotionDatabase.with_weights` raises."""
        return self.with_searches({name: search.with_weights(weights) for name, search in self.searches.items()})

    def with_searches(self, searches: Mapping[str, ReaskedSearch]) -> ReaskedDecision:
        return replace(self, searches=searches)

    def with_threshold(self, database: str, threshold: float | None) -> ReaskedDecision:
        entries = tuple(replace(each, threshold=threshold) if each.name == database else each for each in self.entries)
        return replace(self, entries=entries)

    @cached_property
    def _free(self) -> Floats:
        """The costs of all frames that may be chosen, ascending."""
        free = [search.costs[search.left_out == LeftOut.NO] for search in self.searched.values()]
        return np.sort(np.concatenate(free)) if free else np.empty(0)

    def _rank(self, total: float) -> int:
        return int(np.searchsorted(self._free, total, side="left")) + 1


def chosen_of(choice: Choice | None, starts: Mapping[str, Sequence[int]]) -> Chosen:
    """Which frame a choice means, counted from the start of its range, so that other ranges before it are no change."""
    if choice is None or choice.database is None:
        return None
    hit = choice.hit
    return choice.database, hit.asset, hit.frame - starts[choice.database][hit.range]


def asset_of(choice: Choice | None) -> str | None:
    """The asset that was chosen, if one was."""
    return None if choice is None else choice.hit.asset


# ---- what it would cost to play on


def continuing_cost(database: MotionDatabase, query: Floats, chosen: Filter) -> float | None:
    """The cost of the current frame of a filter that `database.filter` made with it, the continuing bias in it; None when there is
    none or it may not play on. `query` float64 [F] is checked, and in the schema's units."""
    frame = chosen.current
    at = database.range_of(frame) if frame >= 0 else -1
    if at < 0 or not chosen.ranges[at] or (len(chosen.frames) and not chosen.frames[frame]):
        return None
    kind = int(database.marks.kinds[frame])
    if not chosen.kinds.playable[kind]:
        return None
    bias = float(chosen.range_biases[at] + chosen.kinds.biases[kind])
    if len(chosen.frame_biases):
        bias += float(chosen.frame_biases[frame])
    wanted = database.normalisation.apply(query)
    total = _cost(database, frame, wanted) + (bias + chosen.continuing)
    return total if total < math.inf else None


def _cost(database: MotionDatabase, frame: int, query: Floats) -> float:
    """The cost of one frame for a normalised query: the sums of `search.cost`, in their order, without their arrays."""
    values, wanted = database.layout.take(np.array([frame]))[0].tolist(), query.tolist()
    squares = [(value - want) * (value - want) for value, want in zip(values, wanted, strict=True)]
    return _sum(
        weight * _sum(squares[columns]) for columns, weight in zip(database.slices, database.cost_weights.tolist(), strict=True)
    )


def _sum(values: Iterable[float]) -> float:
    """A sum added one by one, each step rounded: Python's own keeps what is rounded away, from 3.12 on."""
    total = 0.0
    for value in values:
        total += value
    return total
