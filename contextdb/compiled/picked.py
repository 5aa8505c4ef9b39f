"""What characters have picked: their turns, their last assets, and when they picked rows that rest.

C characters, k assets that are remembered, L rows that rest. Assets and rows are kept by what stays when a table is edited, never
by the number of a row, so that all of it goes on with the next version of a table.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Rows
from contextdb.compiled.choosing import Key, Limits

NEVER = -1


class Picked:
    """The picks of many characters, each known by a number of its own."""

    def __init__(self, memory: int) -> None:
        self.memory = memory
        self.n = 0
        """How many characters there are: C. The arrays have room for more."""
        self.slots: dict[int, int] = {}
        """Where each character is in the arrays."""
        self.turns = np.zeros(0, np.int64)
        """How often each has picked, with and without success."""
        self.recent = np.zeros((0, memory), np.int64)
        """The numbers of the last assets, the latest first, `NEVER` for none: [C, k]."""
        self.last_turn = np.zeros((0, 0), np.int64)
        """The turn in which a row was picked, `NEVER` for none: [C, L]."""
        self.last_s = np.zeros((0, 0), np.float64)
        """The time at which it was, in seconds: [C, L]."""
        self.assets: dict[str, int] = {}
        self.limits: dict[Key, int] = {}
        """The column of each row that rests."""
        self._n_ordered = 0
        """So many characters are 0, 1, 2 … in the order of the arrays."""
        self._sorted: tuple[NDArray[np.int64], NDArray[np.int64]] | None = None

    def asset_numbers(self, assets: Sequence[str]) -> Rows:
        """The numbers of some assets, new ones where they are not known."""
        known = self.assets
        return np.array([known.setdefault(asset, len(known)) for asset in assets], np.int64)

    def limit_columns(self, limits: Limits) -> Rows:
        """The columns of rows that rest, new ones where they are not known."""
        known = self.limits
        columns = np.array([known.setdefault(key, len(known)) for key in limits.keys], np.int64)
        n_more = len(known) - self.last_turn.shape[1]
        self.last_turn = np.pad(self.last_turn, ((0, 0), (0, n_more)), constant_values=NEVER)
        self.last_s = np.pad(self.last_s, ((0, 0), (0, n_more)))
        return columns

    def slot(self, who: int) -> int:
        """Where a character is in the arrays."""
        found = self.slots.get(who)
        if found is None:
            self._add([who])
            found = self.slots[who]
        return found

    def slots_of(self, who: NDArray[np.int64]) -> Rows:
        n = len(who)
        if n and who[0] == 0 and who[-1] == n - 1 and np.array_equal(who, np.arange(n)):
            if self._n_ordered == self.n < n:
                self._add(range(self.n, n))
            if n <= self._n_ordered:
                return who
        ids, slots = self._by_number
        at = np.minimum(np.searchsorted(ids, who), max(len(ids) - 1, 0))
        is_new = np.ones(n, np.bool_) if not len(ids) else ids[at] != who
        if is_new.any():
            self._add(who[is_new].tolist())
            return self.slots_of(who)
        return slots[at]

    @property
    def _by_number(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """All characters, ascending, and where they are."""
        if self._sorted is None:
            ids = np.fromiter(self.slots, np.int64, self.n)
            order = np.argsort(ids)
            self._sorted = ids[order], order
        return self._sorted

    def _add(self, who: Iterable[int]) -> None:
        for one in who:
            if one == self.n == self._n_ordered:
                self._n_ordered += 1
            self.slots[one] = self.n
            self.n += 1
        self._sorted = None
        if self.n > len(self.turns):
            more = max(self.n, 2 * len(self.turns)) - len(self.turns)
            self.turns = np.pad(self.turns, (0, more))
            self.recent = np.pad(self.recent, ((0, more), (0, 0)), constant_values=NEVER)
            self.last_turn = np.pad(self.last_turn, ((0, more), (0, 0)), constant_values=NEVER)
            self.last_s = np.pad(self.last_s, ((0, more), (0, 0)))

    def forget(self, slots: Rows | slice) -> None:
        """What some characters picked counts no more; their chance goes on."""
        self.recent[slots] = NEVER
        self.last_turn[slots] = NEVER

    def ages(self, slots: Rows, assets: Rows) -> Rows:
        """How many picks ago each character picked an asset, from 0; k where that is not remembered."""
        found = np.full(len(slots), self.memory, np.int64)
        for place in reversed(range(self.memory)):
            found[self.recent[slots, place] == assets] = place
        return found

    def rests(self, limits: Limits, columns: Rows, slots: Rows, rows: Rows, time_s: float) -> NDArray[np.bool_]:
        found = np.zeros(len(rows), np.bool_)
        for of_row in limits.of_row:
            of = of_row[rows]
            (here,) = np.nonzero(of >= 0)
            limit, slot, column = of[here], slots[here], columns[of[here]]
            turn, time = self.last_turn[slot, column], self.last_s[slot, column]
            seconds = limits.cooldown_s[limit]
            is_early = (self.turns[slot] - turn <= limits.cooldown_turns[limit]) | ((seconds > 0.0) & (time_s < time + seconds))
            found[here] |= (turn != NEVER) & (limits.once[limit] | is_early)
        return found

    def remember(self, slots: Rows, assets: Rows) -> None:
        """Keep which assets some characters picked."""
        if self.memory:
            self.recent[slots, 1:] = self.recent[slots, :-1]
            self.recent[slots, 0] = assets

    def remember_one(self, slot: int, asset: int | None) -> None:
        """Keep which asset one character picked, if it did, in a turn of its own."""
        self.turns[slot] += 1
        if asset is not None and self.memory:
            recent = self.recent[slot]
            if self.memory > 1:
                recent[1:] = recent[:-1].copy()
            recent[0] = asset

    def rest(self, limits: Limits, columns: Rows, slots: Rows, rows: Rows, time_s: float) -> None:
        """Let rows rest that some characters picked in this turn, each once."""
        for of_row in limits.of_row:
            of = of_row[rows]
            (here,) = np.nonzero(of >= 0)
            self.last_turn[slots[here], columns[of[here]]] = self.turns[slots[here]]
            self.last_s[slots[here], columns[of[here]]] = time_s

    def __copy__(self) -> Self:
        new: Self = object.__new__(type(self))
        for name, value in vars(self).items():
            setattr(new, name, copy(value) if isinstance(value, (np.ndarray, dict)) else value)
        return new

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return copy(self)
