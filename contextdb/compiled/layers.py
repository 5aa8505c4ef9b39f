"""What the tables of a way say in one column, brought together.

D = depth, n = flat rows. Only combinations of texts that come up are brought together, each once.

    cost of a row = 0 where its cell matches the fact, else penalty x steps
    steps         = 1, or for a cell such as `20..30 ~2.5/10` the distance from the fact to the cell over 10

n is the rows of each depth of tables inside tables, one after the other. K cells of a column are distinct, with S spans together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.domains import Domain
from contextdb.cells.facts import Fact
from contextdb.cells.grammar import parse_cell
from contextdb.cells.intervals import EVERYTHING, Spans
from contextdb.cells.sets import Cell, NumberSet, TagSet, ValueSet, meet
from contextdb.columns import TextColumn
from contextdb.compiled.classes import ColumnMasks, TagMasks, ValueMasks, WideMasks, column_masks

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


# ---- what the soft cells of one condition cost: masks of the rows that they match, the penalty of each row, and how
# penalties grow


Floats = NDArray[np.float64]
GROWTH = ("per", "starts", "ends", "which")
"""The arrays of a growth in a compiled file."""
ROUND = (0.0, -360.0, 360.0)
"""On a circle a fact is there again, a turn before and behind."""


@dataclass(frozen=True, eq=False)
class Growth:
    """How the penalties of some cells grow: `per` [K] is the distance of one penalty, NaN where a cell costs the same everywhere;
    the spans of cell k are `ends[starts[k]:starts[k + 1]]` [S, 2]; `which` int32 [n] is the cell of each row."""

    per: Floats
    starts: NDArray[np.int64]
    ends: Floats
    which: NDArray[np.int32]
    is_circular: bool

    @classmethod
    def of(cls, cells: Sequence[Cell], which: NDArray[np.int32], is_circular: bool) -> Growth | None:
        """That of distinct cells; None where none grows."""
        if all(cell.per is None for cell in cells):
            return None
        spans: list[Spans] = [() if cell.per is None else _spans_of(cell) for cell in cells]
        per = np.array([np.nan if cell.per is None or not own else cell.per for cell, own in zip(cells, spans, strict=True)])
        ends = np.array([span for own in spans for span in own], np.float64).reshape(-1, 2)
        return cls(per, np.cumsum([0, *map(len, spans)], dtype=np.int64), ends, np.ascontiguousarray(which, np.int32), is_circular)

    def check(self, n_rows: int) -> None:
        """Raise ValueError unless the parts go together."""
        n, n_spans = len(self.per), len(self.ends)
        is_sound = self.starts.shape == (n + 1,) and self.ends.shape == (n_spans, 2) and self.which.shape == (n_rows,)
        if not (is_sound and (np.diff(self.starts) >= 0).all() and self.starts[0] == 0 and self.starts[-1] == n_spans):
            raise ValueError("growth")
        if n_rows and not 0 <= self.which.min() <= self.which.max() < n:
            raise ValueError("growth")

    @property
    def arrays(self) -> tuple[NDArray[Any], ...]:
        return self.per, self.starts, self.ends, self.which

    def steps(self, fact: Fact) -> Floats:
        """How many penalties each row costs with a fact in canonical form, where its cell does not match: float64 [n]."""
        if fact is None:
            return np.ones(len(self.which))
        spans = (EVERYTHING if fact.accepts is None else _spans_of(fact)) if isinstance(fact, Cell) else ((fact, fact),)
        apart = np.full(len(self.per), np.inf)
        owners = np.repeat(np.arange(len(self.per)), np.diff(self.starts))
        with np.errstate(invalid="ignore", over="ignore"):  # beyond the largest number is infinitely far
            for low, high in spans:
                for turn in ROUND if self.is_circular else ROUND[:1]:
                    np.minimum.at(apart, owners, _gaps(float(low) + turn, float(high) + turn, self.ends))  # type: ignore[arg-type]
            steps = np.where(np.isnan(self.per), 1.0, apart / self.per)
        return np.asarray(steps[self.which])


def _spans_of(cell: Cell) -> Spans:
    assert isinstance(cell.accepts, NumberSet | None), "only numbers have a distance"
    return EVERYTHING if cell.accepts is None else cell.accepts.spans


def _gaps(low: float, high: float, ends: Floats) -> Floats:
    """How far each span is from a span of facts."""
    return np.where(ends[:, 0] > high, ends[:, 0] - high, np.where(low > ends[:, 1], low - ends[:, 1], 0.0))


class SoftMasks(NamedTuple):
    """Masks of a column's soft cells, the penalty of each row float64 [n], and how penalties grow, None where none does."""

    masks: ColumnMasks
    penalties: Floats
    growth: Growth | None = None

    @classmethod
    def of(cls, cells: Sequence[Cell], which: NDArray[np.int32], domain: Domain) -> SoftMasks:
        """Those of distinct cells, Any where they are not soft; `which` is the cell of each row."""
        penalties = np.array([cell.penalty or 0.0 for cell in cells])
        growth = Growth.of(cells, which, domain.type.is_circular)
        return cls(column_masks([Cell(cell.accepts) for cell in cells], which, domain), penalties[which], growth)

    def costs(self, fact: Fact) -> Floats:
        """What the rows cost with a fact in canonical form: float64 [n]."""
        n = len(self.penalties)
        fails = ~bitmask.unpack(bitmask.from_int(bits_of(self.masks, fact)[0], n), n)
        return np.where(fails, self.grown(fact), 0.0)

    def grown(self, fact: Fact) -> Floats:
        """The same for rows whose cells do not match."""
        if self.growth is None:
            return self.penalties
        with np.errstate(invalid="ignore", over="ignore"):
            return np.where(self.penalties > 0.0, self.penalties * self.growth.steps(fact), 0.0)
