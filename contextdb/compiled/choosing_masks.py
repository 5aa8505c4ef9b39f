"""The choice among the valid rows of many contexts where chance decides evenly: on masks, without a pair for each valid row.

It is what `contextdb.compiled.choosing` does of tables without tables inside, without rows that rest, and with one weight.
N contexts, W words a mask, L ranks, k assets that are remembered.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, Words
from contextdb.compiled.choosing import Choosing
from contextdb.schema.shapes import CHANCE

MOST_RANKS = 16
MOST_ROWS = 4096
MOST_MEMORY = 8
"""Of more ranks, rows or remembered assets, the pairs of contexts and rows are the faster way."""

_HALVES = [np.uint64(bits) for bits in (32, 16, 8, 4, 2, 1)]


@dataclass(frozen=True, eq=False)
class EvenChoosing:
    """The rows that chance may pick, by rank, and those of each asset, as masks."""

    levels: Words
    """The rows of each rank, the highest first: uint64 [L, W]."""
    of_asset: Words
    """The rows of each asset by the picker's numbers, and behind them none: uint64 [A + 1, W]."""

    @classmethod
    def of(cls, choosing: Choosing, assets: Rows, memory: int) -> Self | None:
        """That of a table whose rows have these numbers of assets; None where pairs are to decide."""
        n_rows, may = len(assets), np.flatnonzero(choosing.pickable)
        ranks = np.unique(choosing.ranks[0, may])[::-1]
        is_even = len(choosing.taken) == 1 and choosing.limits is None and len(np.unique(choosing.weights[0, may])) == 1
        policy = choosing.compiled.policy
        is_by_chance = policy in CHANCE and not (policy == "cheapest" and choosing.compiled.is_soft)
        if not (is_even and is_by_chance) or len(ranks) > MOST_RANKS or n_rows > MOST_ROWS or memory > MOST_MEMORY:
            return None
        levels = [bitmask.from_rows(may[choosing.ranks[0, may] == rank], n_rows) for rank in ranks]
        of_asset = np.zeros((int(assets.max()) + 2 if memory else 1, bitmask.n_words(n_rows)), np.uint64)
        if memory:
            rows = np.arange(n_rows)
            np.bitwise_or.at(of_asset, (assets, rows >> 6), np.uint64(1) << (rows & 63).astype(np.uint64))
        return cls(np.array(levels), of_asset)

    def fresh(self, valid: Words, recent: NDArray[np.int64]) -> Words:
        """Of valid rows [N, W] those of the highest rank, and of these those whose asset was picked least lately.

        recent : int64 [N, k], the numbers of assets, the latest first, -1 for none.
        """
        left: Words = valid & self.levels[0]
        for level in self.levels[1:]:
            left = _unless_empty(left, valid & level)
        n_assets = len(self.of_asset) - 1
        for numbers in recent.T:
            own = self.of_asset.take(np.minimum(numbers, n_assets), axis=0)  # -1 is the last one: none
            left = _unless_empty(left & ~own, left)
        return left

    @staticmethod
    def drawn(rows: Words, chance: NDArray[np.float64]) -> Rows:
        """One of the rows of each mask [N, W], all alike likely, by numbers in [0, 1): int64 [N], -1 for an empty mask."""
        counts = bitmask.count(rows)
        wanted = np.minimum((chance * counts).astype(np.int64), counts - 1)
        word, skipped = np.zeros(len(rows), np.int64), np.zeros(len(rows), np.int64)
        for at in range(rows.shape[1] - 1):  # word by word: a mask has few, and there are many masks
            n_before = skipped + np.bitwise_count(rows[:, at])
            is_beyond = (word == at) & (wanted >= n_before)
            word += is_beyond
            skipped = np.where(is_beyond, n_before, skipped)
        held = rows[:, 0] if rows.shape[1] == 1 else rows[np.arange(len(rows)), word]
        return np.where(counts > 0, 64 * word + _places(held, wanted - skipped), -1)


def _unless_empty(masks: Words, others: Words) -> Words:
    """Masks [N, W], and where one is empty the other one."""
    held = masks[:, 0]
    for at in range(1, masks.shape[1]):
        held = held | masks[:, at]
    return np.asarray(np.where((held == 0)[:, None], others, masks))


def _places(words: Words, nth: NDArray[np.int64]) -> NDArray[np.int64]:
    """Which bit of each word is the nth that is set, from 0: halves are counted, and the one that holds it is gone into."""
    found, left = np.zeros(len(words), np.uint8), nth.astype(np.uint8)  # small: they stay in the fastest cache
    for half in _HALVES:
        n_low = np.bitwise_count(words & ((np.uint64(1) << half) - np.uint64(1)))
        is_above = np.asarray(left >= n_low)
        left -= n_low * is_above
        step = np.uint8(half) * is_above
        found += step
        words = words >> step  # what is above the half that was gone into stays: no count looks there again
    return found.astype(np.int64)
