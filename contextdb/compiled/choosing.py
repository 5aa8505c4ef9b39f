"""How the policies choose among the valid rows of many contexts at once.

D = depth of tables inside tables (1 without), n rows, P pairs of a context and a row that is valid in it: context by context, the
rows of each ascending. It is what `contextdb.compiled.pick` says of one context, without a loop over contexts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Rows
from contextdb.compiled.data import CompiledData
from contextdb.compiled.pick import Ranked, not_unique
from contextdb.errors import Place, PolicyError
from contextdb.schema.shapes import CHANCE

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

MOST_PADDED = 1 << 20
"""Weights are summed up for so many rows at once."""

Key = tuple[str, str, int]
"""A row by what stays when the table is edited: the name of its table, its asset, and how many rows before it have that asset."""


@dataclass(frozen=True, eq=False)
class Limits:
    """The rows that rest after they were picked: L of them, each a row of the table or of one inside it."""

    keys: tuple[Key, ...]
    of_row: NDArray[np.int64]
    """Which of them each row takes at each depth, -1 for none: int64 [D, n]."""
    once: Flags
    cooldown_s: Floats
    cooldown_turns: NDArray[np.int64]

    @property
    def needs_time(self) -> bool:
        """Whether some of them rest for seconds."""
        return bool((self.cooldown_s > 0.0).any())


@dataclass(frozen=True, eq=False)
class Choosing:
    """What of a compiled table decides between its rows."""

    compiled: CompiledData
    taken: NDArray[np.int64]
    """The row that each row's way takes at each depth: int64 [D, n]; -1 below its end."""
    groups: NDArray[np.int64]
    """A number for what the way is above each depth: int64 [D, n], ascending."""
    ranks: Floats
    """Higher first, within a group: float64 [D, n]."""
    weights: Floats
    """How often a row is picked among equals: float64 [D, n]; 1 where chance does not decide."""
    is_unique: Flags
    is_cheapest: Flags
    """Under which policy the row is taken: bool [D, n]."""
    pickable: Flags
    """Whether no weight of the way is 0 where chance decides: bool [n]."""
    limits: Limits | None

    @classmethod
    def of(cls, compiled: CompiledData) -> Choosing:
        """That of a table, or of those that are in each other."""
        ways, n = compiled.ways, compiled.n_rows
        tables: Sequence[Ranked] = (compiled,) if ways is None else ways.tables
        numbers = np.zeros((1, n), np.int64) if ways is None else ways.numbers
        taken = np.arange(n)[None] if ways is None else ways.rows.astype(np.int64)
        ranks, weights = np.zeros(taken.shape), np.ones(taken.shape)
        is_unique, is_cheapest = np.zeros(taken.shape, np.bool_), np.zeros(taken.shape, np.bool_)
        for number, table in enumerate(tables):
            here = numbers == number
            rows = taken[here]
            if table.policy in CHANCE:
                ranks[here], weights[here] = table.ranks[rows], table.row_weights[rows]
            elif table.policy == "first":
                ranks[here] = -rows
            is_unique[here] = table.policy == "unique"
            is_cheapest[here] = table.policy == "cheapest"
        pickable = np.logical_and.reduce(weights > 0.0)
        return cls(compiled, taken, _groups(taken), ranks, weights, is_unique, is_cheapest, pickable, _limits(compiled, taken))

    @cached_property
    def remembers(self) -> bool:
        """Whether chance decides anywhere, so that assets that were picked lately are left out."""
        return not self.compiled.policies.isdisjoint(CHANCE)

    @cached_property
    def plain(self) -> tuple[list[float], list[float]]:
        """The ranks and weights of a table without tables inside, for one context at a time."""
        return self.ranks[0].tolist(), self.weights[0].tolist()

    def may_be_picked(self, contexts: Rows, rows: Rows, costs: Floats | None, is_one: bool = False) -> Rows:
        """Of P pairs those that the policies may pick: their places. `costs` [D, P] are needed where `is_cheapest` is True. Raises
        PolicyError for several rows of a table whose policy is "unique"; with the number of the first such context, if not
        `is_one`."""
        kept = np.flatnonzero(self.pickable[rows])
        for depth in range(len(self.taken)):
            at = rows[kept]
            starts = starts_of(contexts[kept], self.groups[depth, at])
            if self.is_unique[depth].any():
                self._refuse_several(depth, contexts[kept], at, starts, is_one)
            kept = kept[highest(self.ranks[depth, at], starts)]
            if costs is not None and self.is_cheapest[depth].any():
                at = rows[kept]
                own = np.where(self.is_cheapest[depth, at], -costs[depth, kept], 0.0)
                kept = kept[highest(own, starts_of(contexts[kept], self.groups[depth, at]))]
        return kept

    def drawn(self, contexts: Rows, rows: Rows, chance: Callable[[int, Rows], Floats]) -> Rows:
        """One pair of each context, by weight: their places. `chance` gives numbers in [0, 1) for a depth and contexts."""
        kept = np.arange(len(rows))
        for depth in range(len(self.taken)):
            taken = self.taken[depth, rows[kept]]
            starts = starts_of(contexts[kept], taken)
            of, at = contexts[kept][starts], rows[kept][starts]
            counts = _lengths(starts_of(of), len(of))
            if len(of) == len(counts):  # nothing to choose
                continue
            hit = np.zeros(len(of), np.bool_)
            hit[_by_weight(self.weights[depth, at], counts, chance(depth, of[starts_of(of)]))] = True
            kept = kept[np.repeat(hit, _lengths(starts, len(kept)))]
        return kept

    def _refuse_several(self, depth: int, contexts: Rows, rows: Rows, starts: Rows, is_one: bool) -> None:
        """Raise PolicyError where several rows of a table whose policy is "unique" are in one group."""
        if not len(rows):
            return
        taken = self.taken[depth, rows]
        several = np.maximum.reduceat(taken, starts) != np.minimum.reduceat(taken, starts)
        wrong = np.flatnonzero(several & self.is_unique[depth, rows[starts]])
        if len(wrong):
            stop = [*starts.tolist(), len(rows)][wrong[0] + 1]
            own = rows[starts[wrong[0]] : stop]
            own = own[np.unique(taken[starts[wrong[0]] : stop], return_index=True)[1]]
            table = self.compiled if self.compiled.ways is None else self.compiled.ways.table_at(int(own[0]), depth)
            assert table is not None
            error = not_unique(table.name, [self.compiled.way(row)[depth].asset for row in own.tolist()])
            context = Place(row=int(contexts[starts[wrong[0]]]))
            raise error if is_one else PolicyError(*(f.at(context) for f in error.faults))


def _groups(taken: NDArray[np.int64]) -> NDArray[np.int64]:
    groups = np.zeros_like(taken)
    for depth in range(1, len(taken)):
        above = groups[depth - 1], taken[depth - 1]
        is_new = np.zeros(taken.shape[1], np.int64)
        is_new[1:] = (np.diff(above[0]) != 0) | (np.diff(above[1]) != 0)
        groups[depth] = np.cumsum(is_new)
    return groups


def _limits(compiled: CompiledData, taken: NDArray[np.int64]) -> Limits | None:
    ways = compiled.ways
    tables: Sequence[Ranked] = (compiled,) if ways is None else ways.tables
    keys: list[Key] = []
    columns: list[tuple[bool, float, int]] = []
    of_row = np.full(taken.shape, -1, np.int64)
    for number, table in enumerate(tables):
        limited = table.picking.limited
        if not len(limited):
            continue
        here = np.ones(taken.shape, np.bool_) if ways is None else ways.numbers == number
        names = _names(compiled, taken, here)
        numbers = np.full(len(table.priorities), -1, np.int64)
        seen: dict[str, int] = {}
        for row, asset in sorted(names.items()):
            nth = seen[asset] = seen.get(asset, -1) + 1
            if row in limited:
                numbers[row] = len(keys)
                keys.append((table.name, asset, nth))
                arrays = table.picking.arrays
                once, seconds, turns = (arrays[k][row] if k in arrays else 0 for k in ("once", "cooldown_s", "cooldown_turns"))
                columns.append((bool(once), float(seconds), int(turns)))
        of_row[here] = numbers[taken[here]]
    if not keys:
        return None
    once, seconds, turns = zip(*columns, strict=True)
    return Limits(tuple(keys), of_row, np.array(once), np.array(seconds, np.float64), np.array(turns, np.int64))


def _names(compiled: CompiledData, taken: NDArray[np.int64], here: Flags) -> dict[int, str]:
    """The asset of each row of a table that some way takes: `here` says where it does."""
    names: dict[int, str] = {}
    for depth, flat in np.argwhere(here).tolist():
        row = int(taken[depth, flat])
        if row not in names:
            names[row] = compiled.way(flat)[depth].asset
    return names


def starts_of(*numbers: Rows) -> Rows:
    """Where a run of equal numbers begins."""
    is_new = np.ones(len(numbers[0]), np.bool_)
    is_new[1:] = np.logical_or.reduce([own[1:] != own[:-1] for own in numbers])
    return np.flatnonzero(is_new)


def highest(numbers: NDArray[Any], starts: Rows) -> Flags:
    """Which of some numbers are the highest of their run."""
    if not len(numbers):
        return np.zeros(0, np.bool_)
    highest = np.maximum.reduceat(numbers, starts)
    return np.asarray(numbers == np.repeat(highest, _lengths(starts, len(numbers))))


def _by_weight(weights: Floats, counts: Rows, chance: Floats) -> Rows:
    """The place that chance hits in each run of so many weights, as a picker finds it for one."""
    firsts = np.cumsum(counts) - counts
    if len(counts) * int(counts.max(initial=0)) <= MOST_PADDED:
        return np.asarray(firsts + _hits(weights, counts, chance))
    found = np.empty(len(counts), np.int64)
    order = np.argsort(counts, kind="stable")
    while len(order):
        most = max(1, MOST_PADDED // int(counts[order[-1]]))
        own, order = order[-most:], order[:-most]
        at = np.repeat(firsts[own] - (np.cumsum(counts[own]) - counts[own]), counts[own])
        found[own] = firsts[own] + _hits(weights[at + np.arange(len(at))], counts[own], chance[own])
    return found


def _hits(weights: Floats, counts: Rows, chance: Floats) -> Rows:
    """The same, counted from the beginning of each run. Sums are those of Python's own additions, one after the other."""
    if not len(counts):
        return counts
    is_there = np.arange(int(counts.max())) < counts[:, None]
    padded = np.zeros(is_there.shape)
    padded[is_there] = weights
    padded /= padded.max(axis=1, keepdims=True)
    sums = np.cumsum(padded, axis=1)
    hits = (sums <= (chance * sums[:, -1])[:, None]).sum(axis=1)
    places: Rows = np.minimum(hits, counts - 1)
    return places


def _lengths(starts: Rows, stop: int) -> Rows:
    """How long each run is, the last one up to `stop`."""
    lengths = np.empty_like(starts)
    lengths[:-1] = starts[1:] - starts[:-1]
    lengths[-1:] = stop - starts[-1:]
    return lengths
