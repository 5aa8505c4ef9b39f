"""What the soft cells of one condition cost: masks of the rows that they match, the penalty of each row, and how penalties grow.

    cost of a row = 0 where its cell matches the fact, else penalty x steps
    steps         = 1, or for a cell such as `20..30 ~2.5/10` the distance from the fact to the cell over 10

n is the rows of each depth of tables inside tables, one after the other. K cells of a column are distinct, with S spans together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.domains import Domain
from contextdb.cells.facts import Fact
from contextdb.cells.intervals import EVERYTHING, Spans
from contextdb.cells.sets import Cell, NumberSet
from contextdb.compiled.classes import ColumnMasks, column_masks
from contextdb.compiled.layers import bits_of

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
        """As the core takes them."""
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
