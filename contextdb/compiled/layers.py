"""What the tables of a way say in one column, brought together.

D = depth, n = flat rows. Only combinations of texts that come up are brought together, each once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.domains import Domain
from contextdb.cells.facts import Fact
from contextdb.cells.grammar import parse_cell
from contextdb.cells.intervals import EVERYTHING
from contextdb.cells.sets import Cell, NumberSet, TagSet, ValueSet, meet
from contextdb.columns import TextColumn
from contextdb.compiled.classes import ColumnMasks, TagMasks, ValueMasks, WideMasks

Numbers = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Layers:
    """What each depth of the ways says in one column. `codes` is int32 [D, n]; `texts[0]` is "", for nothing said."""

    texts: tuple[str, ...]
    codes: Numbers

    @cached_property
    def combined(self) -> tuple[Numbers, Numbers]:
        """The combinations of texts that come up, int32 [D, combinations], and which of them each row has, int32 [n]."""
        which = np.zeros(self.codes.shape[1], np.int64)
        first = np.zeros(0, np.int64)
        for codes in self.codes:
            _, first, which = np.unique(which * len(self.texts) + codes, return_index=True, return_inverse=True)
        return self.codes[:, first], which.astype(np.int32)

    def said(self, row: int) -> list[tuple[int, str]]:
        """What a row's way says: the depth and the text."""
        return [(depth, self.texts[code]) for depth, code in enumerate(self.codes[:, row].tolist()) if code]

    def cells(self, domain: Domain) -> tuple[Cell, ...]:
        """What each combination accepts, in the order of `combined`."""
        read: dict[int, Cell] = {c: parse_cell(self.texts[c], domain) for c in np.unique(self.codes).tolist() if c}
        return tuple(meet([read[c] for c in codes if c]) for codes in self.combined[0].T.tolist())

    def joined(self, name: str, join: Callable[[list[str]], str]) -> TextColumn:
        """One text for each row out of those that its way says, outermost first; texts of blanks alone are not said."""
        combinations, which = self.combined
        texts = [join([t for c in codes if (t := self.texts[c]).strip()]) for codes in combinations.T.tolist()]
        known: dict[str, int] = {}
        places = np.array([known.setdefault(text, len(known)) for text in texts], np.int32)
        return TextColumn(name, tuple(known), places[which])


# ---- of one column's masks: the rows for a fact, sets of values and missing facts too, and what the masks weigh


def nbytes(masks: ColumnMasks) -> int:
    """Bytes that a column's masks take."""
    if isinstance(masks, WideMasks):
        return masks.low.nbytes + masks.high.nbytes + masks.any_mask.nbytes + masks.bounds.nbytes
    return masks.masks.nbytes


def bits_of(masks: ColumnMasks, fact: Fact) -> tuple[int, int]:
    """Rows whose cell accepts some, and rows whose cell accepts every, value of a fact in canonical form, as integers."""
    if isinstance(fact, Cell):
        return _every_value(masks) if fact.accepts is None else masks.set_bits(fact.accepts)
    if isinstance(masks, WideMasks):
        bits = masks.bits(masks.codes(fact)[0])  # type: ignore[arg-type]
    else:
        bits = (1 << masks.n_rows) - 1
        for code in masks.codes(fact):  # type: ignore[arg-type]
            bits &= masks.ints[code]
    return bits, bits


def _every_value(masks: ColumnMasks) -> tuple[int, int]:
    if isinstance(masks, TagMasks):
        return masks.set_bits(TagSet(frozenset()))
    return masks.set_bits(ValueSet(frozenset(), True)) if isinstance(masks, ValueMasks) else masks.set_bits(NumberSet(EVERYTHING))
