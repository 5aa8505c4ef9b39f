"""Codes: a context as one whole number for each fact, the class of the fact among those that its column tells apart.

A code is the number of a mask, counted through all columns from 1 on: one for each condition (for tags one for each slot), in the
order of the conditions. 0 is a fact that is ignored. A wide column's code is the fact's class instead, -1 for one that is ignored,
and stands behind all others.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Words
from contextdb.compiled.classes import ColumnMasks, NumberMasks, TagMasks, WideMasks
from contextdb.core import Batch

Codes = NDArray[np.int32]


class CodeSlots:
    """Which codes the columns of a table have. P slots; W words a mask."""

    def __init__(self, columns: Sequence[ColumnMasks], enabled: Words, n_rows: int) -> None:
        self.columns = columns
        self._enabled = enabled
        self._n_rows = n_rows
        self.starts: list[int] = []
        """The first code of each column, for wide ones 0."""
        self.slots: list[range] = []
        """The places of each column's codes among those of a context."""
        at, plain = 1, 0
        for column in columns:
            n_slots = len(column.masks) // 3 if isinstance(column, TagMasks) else 1
            is_wide = isinstance(column, WideMasks)
            self.starts.append(0 if is_wide else at)
            self.slots.append(range(plain, plain) if is_wide else range(plain, plain + n_slots))
            at += _n_masks(column)
            plain += 0 if is_wide else n_slots
        self.n_codes = plain
        """P: how many codes a context has."""
        for number, column in enumerate(columns):
            if isinstance(column, WideMasks):
                self.slots[number] = range(self.n_codes, self.n_codes + 1)
                self.n_codes += 1

    @cached_property
    def batch(self) -> Batch:
        """What answers many contexts by their codes."""
        plain: list[tuple[Any, ...]] = []
        for column, start in zip(self.columns, self.starts, strict=True):
            if isinstance(column, TagMasks):
                plain += [(start + i, True, _words(column.masks[i : i + 3])) for i in range(0, len(column.masks), 3)]
            elif not isinstance(column, WideMasks):
                plain.append((start, not isinstance(column, NumberMasks), _words(column.masks)))
        wide = [
            (len(column.bounds), column.shift, _words(column.low), _words(column.high), _words(column.any_mask))
            for column in self.columns
            if isinstance(column, WideMasks)
        ]
        return Batch(self._n_rows, _words(self._enabled), tuple(plain), tuple(wide))

    def ignored(self, at: int) -> int:
        return -1 if isinstance(self.columns[at], WideMasks) else 0


def _n_masks(column: ColumnMasks) -> int:
    return 2 * len(column.low) * column.low.shape[1] + 1 if isinstance(column, WideMasks) else len(column.masks)


def _words(masks: Words) -> Words:
    return np.require(masks, np.uint64, ["C", "A"])
