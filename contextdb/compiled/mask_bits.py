"""Of one column's masks: the rows for a fact, sets of values and missing facts too, and what the masks weigh."""

from __future__ import annotations

from contextdb.cells.facts import Fact
from contextdb.cells.intervals import EVERYTHING
from contextdb.cells.sets import Cell, NumberSet, TagSet, ValueSet
from contextdb.compiled.classes import ColumnMasks, TagMasks, ValueMasks, WideMasks


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
