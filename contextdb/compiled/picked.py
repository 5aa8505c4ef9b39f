"""What characters have picked: their turns, their last assets, and when they picked rows that rest.

C characters, k assets that are remembered, r rows that rest at once. Assets and rows are kept by what stays when a table is edited,
never by the number of a row, so that all of it goes on with the next version of a table. A rest that is over is forgotten.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from functools import cache
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Rows
from contextdb.compiled.choosing import Key, Limits, PickedArrays

NEVER = -1
HASH_START, HASH_FACTOR = 0xCBF29CE484222325, 0x100000001B3


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
        self.rests = np.zeros((0, 0), np.int64)
        """The rows that rest, by the numbers of `limits`, in any order; `NEVER` for none: [C, r]."""
        self.rest_turns = np.zeros((0, 0), np.int64)
        """The turn in which each was picked: [C, r]."""
        self.rest_s = np.zeros((0, 0), np.float64)
        """The time at which it was, in seconds: [C, r]."""
        self.assets: dict[str, int] = {}
        self.limits: dict[Key, int] = {}
        """The number of each row that rests."""
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
        return np.array([known.setdefault(key, len(known)) for key in limits.keys], np.int64)

    @property
    def arrays(self) -> PickedArrays:
        return self.turns, self.recent, self.rests, self.rest_turns, self.rest_s

    def make_room(self, n_more: int) -> None:
        """Let characters remember so many more rows that rest."""
        more = ((0, 0), (0, max(n_more, self.rests.shape[1] // 2)))
        self.rests = np.pad(self.rests, more, constant_values=NEVER)
        self.rest_turns, self.rest_s = np.pad(self.rest_turns, more), np.pad(self.rest_s, more)

    def slot(self, who: int) -> int:
        """Where a character is in the arrays."""
        bits = self.slots.get(who)
        if bits is None:
            self._add([who])
            bits = self.slots[who]
        return bits

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
            self.rests = np.pad(self.rests, ((0, more), (0, 0)), constant_values=NEVER)
            self.rest_turns = np.pad(self.rest_turns, ((0, more), (0, 0)))
            self.rest_s = np.pad(self.rest_s, ((0, more), (0, 0)))

    def forget(self, slots: Rows | slice) -> None:
        """What some characters picked counts no more; their chance goes on."""
        self.recent[slots] = NEVER
        self.rests[slots] = NEVER

    def digest(self, seed: int) -> int:
        """The sum over all characters of a hash of the seed, the character, its turns and its last assets."""
        keys = np.array([*map(_asset_key, self.assets), 0], np.uint64)  # the last one for `NEVER`, which is -1
        ids = np.fromiter(self.slots, np.int64, self.n).view(np.uint64)
        columns = [np.full(self.n, seed, np.uint64), ids, self.turns[: self.n].view(np.uint64), *keys[self.recent[: self.n]].T]
        digests = np.full(self.n, HASH_START, np.uint64)
        for column in columns:
            digests = (digests ^ column) * np.uint64(0x9E3779B97F4A7C15)
            digests ^= digests >> np.uint64(32)
        return int(digests.sum(dtype=np.uint64))

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: what characters remember, in as few bytes as it needs."""
        places = np.nonzero(self.rests[: self.n] >= 0)
        times, which = np.unique(self.rest_s[places], return_inverse=True)
        counts = np.bincount(places[0], minlength=self.n)
        rests = [_short(array) for array in (counts, self.rests[places], self.rest_turns[places], which.reshape(-1))]
        return {
            "memory": self.memory,
            "ids": _short(np.fromiter(self.slots, np.int64, self.n)),
            "turns": _short(self.turns[: self.n]),
            "recent": _short(self.recent[: self.n]),
            "rests": (*rests, times),
            "assets": self.assets,
            "limits": self.limits,
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["memory"])  # type: ignore[misc]
        self.assets, self.limits = state["assets"], state["limits"]
        self._add(state["ids"].tolist())
        self.turns[: self.n], self.recent[: self.n] = state["turns"], state["recent"]
        counts, numbers, turns, which, times = state["rests"]
        self.make_room(int(counts.max(initial=0)))
        slots = np.repeat(np.arange(self.n), counts)
        at = np.arange(len(numbers)) - np.repeat(np.cumsum(counts.astype(np.int64)) - counts, counts)
        self.rests[slots, at], self.rest_turns[slots, at], self.rest_s[slots, at] = numbers, turns, times[which]

    def __copy__(self) -> Self:
        new: Self = object.__new__(type(self))
        for name, value in vars(self).items():
            setattr(new, name, copy(value) if isinstance(value, (np.ndarray, dict)) else value)
        return new

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return copy(self)


def _short(numbers: NDArray[np.int64]) -> NDArray[np.signedinteger[Any]]:
    """The same numbers in the shortest type that holds them."""
    least, most = int(numbers.min(initial=0)), int(numbers.max(initial=0))
    fits = (kind for kind in (np.int8, np.int16, np.int32) if np.iinfo(kind).min <= least and most <= np.iinfo(kind).max)
    return numbers.astype(next(fits, np.int64))


@cache
def _asset_key(asset: str) -> int:
    """The hash by which C knows an asset: FNV-1a of its name, never 0."""
    key = HASH_START
    for octet in (*asset.encode("utf-8", "surrogatepass"), 0xFF):
        key = (key ^ octet) * HASH_FACTOR % 2**64
    return key | 1
