"""What of a compiled table decides between its valid rows: the core chooses by it, for one character or for many.

D = depth of tables inside tables (1 without), n rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, Words
from contextdb.columns import distinct
from contextdb.compiled.data import CompiledData
from contextdb.compiled.matches import Matches, layered_penalties
from contextdb.compiled.pick_columns import PickColumns
from contextdb.core import Choices
from contextdb.errors import Fault, PolicyError, in_quotes, some
from contextdb.schema.policies import POLICIES, Policy, decided_by

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

PickedArrays = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], Floats]
"""What characters have picked, as `contextdb.compiled.picked` keeps it: turns [C], recent [C, k], rests, rest_turns, rest_s [C,
r]."""
MOST_RANKS = 16
"""Of more ranks the highest is looked for row by row."""

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


class Ranked(Protocol):
    """What of a table says which of its rows is preferred: the table itself, or one of those in it."""

    @property
    def name(self) -> str: ...

    @property
    def policy(self) -> Policy: ...

    @property
    def row_weights(self) -> NDArray[np.float64]: ...

    @property
    def ranks(self) -> NDArray[np.float64]: ...

    @property
    def priorities(self) -> NDArray[np.int64]: ...

    @property
    def picking(self) -> PickColumns: ...


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
            here = (numbers == number) if ways is not None else np.s_[:]
            rows = taken[here]
            policy = POLICIES[table.policy]
            ranks[here] = table.ranks[rows]
            if policy.choose == "chance":
                weights[here] = table.row_weights[rows]
            is_unique[here] = policy.choose == "refuse"
            is_cheapest[here] = policy.by_cost
        pickable = np.logical_and.reduce(weights > 0.0)
        return cls(compiled, taken, _groups(taken), ranks, weights, is_unique, is_cheapest, pickable, _limits(compiled, taken))

    def table_at(self, row: int, depth: int) -> Ranked | None:
        """The table that the way of a row passes at a depth; None below its end."""
        ways = self.compiled.ways
        return ways.table_at(row, depth) if ways is not None else self.compiled

    def chances(self, rows: Rows) -> Floats:
        """The chance of each of some rows, which ascend, where one of them is drawn depth by depth: float64 [count], 1 in sum."""
        totals = np.ones(len(rows))
        for groups, taken, weights in zip(self.groups, self.taken, self.weights, strict=True) if len(rows) else ():
            is_next = (np.diff(groups[rows]) != 0) | (np.diff(taken[rows]) != 0)
            firsts = np.append(0, np.flatnonzero(is_next) + 1)
            starts = np.append(0, np.flatnonzero(np.diff(groups[rows[firsts]])) + 1)
            sizes = np.diff(starts, append=len(firsts))
            own = weights[rows[firsts]]
            own = own / np.repeat(np.maximum.reduceat(own, starts), sizes)
            own /= np.repeat(np.add.reduceat(own, starts), sizes)
            totals *= np.repeat(own, np.diff(firsts, append=len(rows)))
        return totals

    @property
    def remembers(self) -> bool:
        """Whether chance decides anywhere, so that assets that were picked lately are left out."""
        return decided_by("chance", self.compiled.policies)

    def pickable_of(self, valid: Flags) -> Flags:
        """Of valid rows those that may be picked, whatever was picked before and whatever soft cells cost: both bool [M, n]."""
        left = valid & self.pickable
        for groups, ranks in zip(self.groups, self.ranks, strict=True):
            if not len(groups):
                break
            order = np.argsort(groups, kind="stable")
            starts = np.flatnonzero(np.diff(groups[order], prepend=groups[order][0] - 1))
            standing = np.where(left, ranks, -np.inf)
            best = np.maximum.reduceat(standing[:, order], starts, axis=1)
            of_row = np.empty(len(groups), np.int64)
            of_row[order] = np.repeat(np.arange(len(starts)), np.diff([*starts, len(groups)]))
            left &= standing == best[:, of_row]
        return left

    @property
    def wants_costs(self) -> bool:
        """Whether a policy looks at what soft cells cost."""
        return bool(self.is_cheapest.any())

    @cached_property
    def _deciding(self) -> tuple[bool, tuple[NDArray[Any], ...]]:
        """Whether all rows have one weight, and the first arrays that `Choices` are made of."""
        n, able = self.compiled.n_rows, self.pickable
        ranks = distinct(self.ranks[0, able])[::-1] if len(self.taken) == 1 else np.zeros(0)
        levels = [bitmask.pack(able & (self.ranks[0] == rank)) for rank in ranks] if len(ranks) <= MOST_RANKS else []
        if self.is_unique.any():
            levels = []  # several rows are refused, which ranks do not tell
        own = self.taken, self.groups, self.ranks, self.weights, self.is_unique, self.is_cheapest, bitmask.pack(self.pickable)
        weights = self.weights[0, able]
        is_even = len(self.taken) == 1 and (weights == weights[:1]).all()
        return bool(is_even), (*own, np.array(levels, np.uint64).reshape(len(levels), bitmask.n_words(n)))

    def choices(self, assets: Rows, columns: Rows, n_columns: int) -> Choices:
        """What the core picks with: `assets` are the numbers of the rows' assets, `columns` those of `limits` among so many."""
        is_even, own = self._deciding
        n_assets = int(assets.max(initial=-1)) + 1
        starts = np.searchsorted(np.sort(assets), np.arange(n_assets + 1)).astype(np.int64)
        of_asset = assets, np.argsort(assets, kind="stable"), starts
        limits = self.limits
        if limits is None or not len(columns):
            none = np.zeros(0, np.int64)
            rests = np.full(self.taken.shape, -1), none, np.zeros(1, np.int64), none.astype(np.bool_), none.astype(np.float64), none
        else:
            of, rows = limits.of_row[limits.of_row >= 0], np.nonzero(limits.of_row >= 0)[1]
            order = np.argsort(of, kind="stable")
            limit_starts = np.searchsorted(of[order], np.arange(len(limits.keys) + 1)).astype(np.int64)
            rests = limits.of_row, rows[order], limit_starts, limits.once, limits.cooldown_s, limits.cooldown_turns
        limit_of_column = np.full(n_columns, -1)
        limit_of_column[columns] = np.arange(len(columns))
        arrays = (*own, *of_asset, *rests, columns, limit_of_column, *self._shares)
        return Choices(self.compiled.n_rows, self.remembers, is_even, tuple(map(np.ascontiguousarray, arrays)))

    @cached_property
    def _shares(self) -> tuple[Floats, Words]:
        """Each weight over the highest, and the rows that have it; nothing for tables inside tables."""
        if len(self.taken) > 1 or not self.pickable.any():
            return np.zeros(0), np.zeros(bitmask.n_words(self.compiled.n_rows), np.uint64)
        highest = self.weights[0].max()
        return self.weights[0] / highest, bitmask.pack(self.weights[0] == highest)

    @cached_property
    def _without_memory(self) -> Choices:
        return self.choices(np.zeros(self.compiled.n_rows, np.int64), np.zeros(0, np.int64), 0)

    def candidates(self, matches: Matches) -> Rows:
        """The valid rows that may be picked, whatever was picked before: int64 [count]. Raises PolicyError for several rows of a
        table whose policy is "unique"."""
        stages = np.zeros((3, bitmask.n_words(self.compiled.n_rows)), np.uint64)
        none = np.zeros(1, np.int64)
        refusal = self._without_memory.pick(
            matches.mask[None], none, none, 0, 0.0, nothing_picked(), self.costs_of(matches), none.copy(), stages
        )
        if refusal is not None:
            raise self.refused(refusal)
        return bitmask.rows(stages[1])

    def costs_of(self, matches: Matches) -> Floats | None:
        """What the soft cells of the valid rows cost, where a policy asks for it: float64 [D, count]."""
        if not (self.wants_costs and matches.has_penalties):
            return None
        return np.ascontiguousarray(layered_penalties(matches)[:, matches.indices])

    def refused(self, refusal: tuple[int, ...]) -> PolicyError:
        """The error of rows that a policy refuses, as `Choices.pick` gives them: a context, a depth, and the rows of one table."""
        _, depth, *rows = refusal
        own = [rows[i] for i in np.unique(self.taken[depth, rows], return_index=True)[1].tolist()]
        table = self.table_at(own[0], depth)
        assert table is not None
        return _not_unique(table, [self.compiled.way(row)[depth].asset for row in own])


def choose_as(compiled: CompiledData, older: CompiledData) -> None:
    """Take over what decides between the rows of an older version of a table, where nothing of that has changed."""
    parts = ("policy", "ways", "assets", "priorities", "row_weights", "picking")
    if all(getattr(compiled, name) is getattr(older, name) for name in parts):
        choosing = copy(older.once(Choosing.of))
        object.__setattr__(choosing, "compiled", compiled)
        compiled.__dict__.setdefault("_made", {})[Choosing.of] = choosing


def nothing_picked() -> PickedArrays:
    """The memory of one character that has picked nothing, and that remembers nothing."""
    none = np.zeros((1, 0), np.int64)
    return np.zeros(1, np.int64), none, none, none, np.zeros((1, 0))


def _not_unique(table: Ranked, assets: list[str]) -> PolicyError:
    """The error of several rows of a table that are valid at once and must not."""
    problem = f"{len(assets)} rows of {in_quotes(table.name)} are valid at once: {some(assets)}."
    return PolicyError(Fault(problem, f'one: the table\'s policy is "{table.policy}"', rule="not-unique"))


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
