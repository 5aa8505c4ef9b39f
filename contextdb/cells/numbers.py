"""The cells of a column of numbers, read all at once.

A large table has some hundred thousand different number cells, and nearly all are plain: `5`, `<=5`, `10..30`, `20, 9.99`. A
pattern over all texts finds those, and their ends become arrays; `contextdb.cells.grammar.parse_cell` reads the others. Both ways
give the same doubles and so the same cells. All that happens when somebody first asks for a cell or a mask; before, texts are only
tested for being readable. A `Cell` is made on access: to compile, the ends are enough.

n = number of distinct texts. A cell has at most two spans here (an angle through 180), and ends are closed, as in `intervals`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.domains import Domain
from contextdb.cells.grammar import parse_cell
from contextdb.cells.intervals import CIRCLE, Spans, wrap_angle, wrap_angles
from contextdb.cells.sets import Cell, NumberSet
from contextdb.columns import polars as pl

FEW = 500
"""So many texts are read one by one: it takes no longer than to load polars."""

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Numbers = NDArray[np.int64]

_DIGITS = r"[0-9]{1,15}(?:\.[0-9]{1,15})?"
_NUMBER = rf"[+-]?{_DIGITS}"
_PAIR = rf"^ *([\[(]?) *({_NUMBER}) *(\.\.|,|±|\+-) *({_NUMBER}) *([\])]?) *$"
_SINGLE = rf"^ *(<=|>=|<|>|=|\.\.)? *({_NUMBER}) *(\.\.)? *$"
_SURE = (
    rf"^ *(?:[\[(]? *{_NUMBER} *\.\. *{_NUMBER} *[\])]?|{_NUMBER} *(?:,|±|\+-) *\+?{_DIGITS}"
    rf"|(?:<=|>=|<|>|=|\.\.)? *{_NUMBER}|{_NUMBER} *\.\.) *$"
)
_TRUTH = r"^ *[01] *$"


@dataclass(frozen=True, eq=False)
class Ends:
    """The ends of cells: span i of cell c is `lows[i, c]` to `highs[i, c]`, NaN where there is none. float64 [layers, n]."""

    lows: Floats
    highs: Floats
    others: Mapping[int, Cell]
    """The cells that were read one by one."""


@dataclass(frozen=True, eq=False)
class NumberCells(Sequence[Cell]):
    """Cells of an int, number or angle column. Texts that are sure to be read are read on the first access."""

    texts: tuple[str, ...]
    domain: Domain
    read: Mapping[int, Cell]
    """The cells that were read already: those of all texts that may not be read at all."""

    def __len__(self) -> int:
        return len(self.texts)

    @overload
    def __getitem__(self, at: int) -> Cell: ...

    @overload
    def __getitem__(self, at: slice) -> tuple[Cell, ...]: ...

    def __getitem__(self, at: int | slice) -> Cell | tuple[Cell, ...]:
        if isinstance(at, slice):
            return self._all[at]
        at = range(len(self))[at]
        ends = self.ends
        return ends.others[at] if at in ends.others else self._cell(ends.lows[:, at].tolist(), ends.highs[:, at].tolist())

    def __iter__(self) -> Iterator[Cell]:
        return iter(self._all)

    @cached_property
    def ends(self) -> Ends:
        lows, highs, rest = _plain_ends(pl.Series(self.texts, dtype=pl.String), self.domain)
        others = {i: self.read[i] if i in self.read else parse_cell(self.texts[i], self.domain) for i in rest.tolist()}
        return Ends(lows, highs, others)

    @cached_property
    def _all(self) -> tuple[Cell, ...]:
        ends = self.ends
        pairs = zip(ends.lows.T.tolist(), ends.highs.T.tolist(), strict=True)
        return tuple(ends.others[i] if i in ends.others else self._cell(*pair) for i, pair in enumerate(pairs))

    def _cell(self, lows: list[float], highs: list[float]) -> Cell:
        spans: Spans = tuple((low, high) for low, high in zip(lows, highs, strict=True) if low == low)
        return Cell(NumberSet(spans, self.domain.type.is_circular))

    def followed_by(self, texts: Sequence[str], cells: Sequence[Cell]) -> NumberCells:
        """These cells and, behind them, some more; of few the ends of these are taken as they are."""
        first = len(self)
        more = {first + i: cell for i, cell in enumerate(cells)}
        both = NumberCells((*self.texts, *texts), self.domain, {**self.read, **more})
        if "ends" in self.__dict__ and len(texts) <= FEW:
            known, room = self.ends, np.full((len(self.ends.lows), len(texts)), np.nan)
            lows, highs = np.hstack((known.lows, room)), np.hstack((known.highs, room))
            both.__dict__["ends"] = Ends(lows, highs, {**known.others, **more})
        return both


@dataclass(frozen=True, eq=False)
class CellSpans:
    """The spans of n cells, soft ones taken for Any: `lows[k]` to `highs[k]` is span number `layers[k]` of cell `owners[k]`."""

    owners: Numbers
    layers: Numbers
    lows: Floats
    highs: Floats
    are_any: Flags
    """Which cells accept every number. bool [n]."""


def spans_of(cells: Sequence[Cell]) -> CellSpans:
    """The spans of the cells of one column, in no order."""
    others = cells.ends.others if isinstance(cells, NumberCells) else dict(enumerate(cells))
    are_any = np.zeros(len(cells), np.bool_)
    are_any[[i for i, c in others.items() if c.is_soft or c.accepts is None]] = True
    read = [
        (i, layer, low, high)
        for i, c in others.items()
        if not c.is_soft and isinstance(c.accepts, NumberSet)
        for layer, (low, high) in enumerate(c.accepts.spans)
    ]
    owners, layers, lows, highs = np.array(read, np.float64).reshape(-1, 4).T
    if isinstance(cells, NumberCells):
        ends = cells.ends
        layer, owner = np.nonzero(~np.isnan(ends.lows))
        owners, layers = np.append(owners, owner), np.append(layers, layer)
        lows, highs = np.append(lows, ends.lows[layer, owner]), np.append(highs, ends.highs[layer, owner])
    return CellSpans(owners.astype(np.int64), layers.astype(np.int64), lows, highs, are_any)


def holding(cells: NumberCells, value: float) -> Flags:
    """Which cells accept a number, soft ones taken for Any: bool [n]."""
    ends, number = cells.ends, wrap_angle(value) if cells.domain.type.is_circular else value
    flags: Flags = np.logical_or.reduce((ends.lows <= number) & (number <= ends.highs))
    for at, cell in ends.others.items():
        flags[at] = cell.is_soft or cell.holds(value)
    return flags


ColumnCells = tuple[Cell, ...] | NumberCells
"""The cells of the distinct texts of one column."""


def has_soft(cells: ColumnCells) -> bool:
    """Whether a distinct cell of a column is soft."""
    return any(c.is_soft for c in (cells.read.values() if isinstance(cells, NumberCells) else cells))


def are_plain(texts: Sequence[str]) -> Flags | None:
    """Which texts are plain number cells that no bool could be (`0`, `1`); None where there are few texts."""
    series = _series(texts)
    return None if series is None else (series.str.contains(_SURE) & ~series.str.contains(_TRUTH)).to_numpy()


def doubtful(texts: Sequence[str], domain: Domain) -> Numbers | None:
    """The texts that may not be read as a domain of numbers: int64. None where they are few, or the domain is another."""
    series = _series(texts) if domain.type.is_decimal else None
    if series is None:
        return None
    if domain.type.is_circular:  # an end that is left away may be refused
        return _plain_ends(series, domain)[2]
    return np.flatnonzero(~series.str.contains(_SURE).to_numpy())


def _plain_ends(series: pl.Series, domain: Domain) -> tuple[Floats, Floats, Numbers]:
    """The ends of plain cells, and the texts that are none."""
    lows, highs = np.full((2, 2, len(series)), np.nan)
    rest = _read_pairs(series, domain, np.arange(len(series)), lows, highs)
    rest = _read_singles(series.gather(rest), domain, rest, lows, highs)
    n_layers = 2 if domain.type.is_circular else 1
    return lows[:n_layers], highs[:n_layers], rest


def _series(texts: Sequence[str]) -> pl.Series | None:
    if len(texts) <= FEW:
        return None
    try:
        return pl.Series(texts, dtype=pl.String)
    except UnicodeEncodeError:  # half a surrogate pair: no file holds one, a caller's list may
        return None


def _parts(series: pl.Series, pattern: str, n_groups: int) -> tuple[Numbers, list[pl.Series]]:
    """The texts that a pattern matches, and its groups for each."""
    groups = series.str.extract_groups(pattern).struct.unnest()
    places = np.flatnonzero(groups.to_series(1).is_not_null().to_numpy())
    matched = groups[places]
    return places, [matched.to_series(i) for i in range(n_groups)]


def _floats(series: pl.Series) -> Floats:
    return series.cast(pl.Float64).to_numpy() + 0.0


def _read_pairs(series: pl.Series, domain: Domain, at: Numbers, lows: Floats, highs: Floats) -> Numbers:
    """Read `a..b` in all its brackets, and `centre, tolerance`; gives what is left."""
    places, (left, first, between, second, right) = _parts(series, _PAIR, 5)
    a, b = _floats(first), _floats(second)
    is_interval = (between == "..").to_numpy()
    is_bare = ((left == "") & (right == "")).to_numpy()
    low, high = np.where(is_interval, a, a - b), np.where(is_interval, b, a + b)
    is_read = is_interval | (is_bare & (b >= 0.0))
    if domain.type.is_circular:
        is_whole = ~is_interval & (b >= 180.0)
        is_read = is_read & is_bare & _set_arcs(lows, highs, at[places], low, high, is_whole)
    else:
        low = np.where((left == "(").to_numpy(), np.nextafter(low, np.inf), low)
        high = np.where((right == ")").to_numpy(), np.nextafter(high, -np.inf), high)
        is_read = is_read & _set_spans(lows, highs, at[places], low, high, domain)
    return _left_over(at, places, is_read, lows, highs)


def _read_singles(series: pl.Series, domain: Domain, at: Numbers, lows: Floats, highs: Floats) -> Numbers:
    """Read numbers, comparisons and intervals without an end; gives what is left."""
    places, (before, number, after) = _parts(series, _SINGLE, 3)
    value = _floats(number)
    sign, is_from = before.fill_null(""), after.is_not_null().to_numpy()
    has_low = is_from | sign.is_in(["", "=", ">", ">="]).to_numpy()
    has_high = ~is_from & sign.is_in(["", "=", "<", "<=", ".."]).to_numpy()
    is_read = ~is_from | (sign == "").to_numpy()
    if domain.type.is_circular:  # without an end an angle may be refused
        is_read &= has_low & has_high & _set_arcs(lows, highs, at[places], value, value, np.zeros(len(value), np.bool_))
    else:
        low = np.where(has_low, np.where((sign == ">").to_numpy(), np.nextafter(value, np.inf), value), -np.inf)
        high = np.where(has_high, np.where((sign == "<").to_numpy(), np.nextafter(value, -np.inf), value), np.inf)
        is_read &= _set_spans(lows, highs, at[places], low, high, domain)
    return _left_over(at, places, is_read, lows, highs)


def _left_over(at: Numbers, matched: Numbers, is_read: Flags, lows: Floats, highs: Floats) -> Numbers:
    """The texts that are still to be read; what was set for them too soon is taken back."""
    is_left = np.ones(len(at), np.bool_)
    is_left[matched[is_read]] = False
    rest = at[is_left]
    lows[:, rest] = highs[:, rest] = np.nan
    return rest


def _set_spans(lows: Floats, highs: Floats, at: Numbers, low: Floats, high: Floats, domain: Domain) -> Flags:
    """Keep spans of the line; gives which of them hold anything."""
    if domain.type.is_whole:
        low, high = np.ceil(low), np.floor(high)
    lows[0, at], highs[0, at] = low + 0.0, high + 0.0
    return low <= high


def _set_arcs(lows: Floats, highs: Floats, at: Numbers, low: Floats, high: Floats, is_whole: Flags) -> Flags:
    """Keep arcs of the circle, both ends inside; gives which of them doubles tell without doubt."""
    turn = high - low
    first, last = wrap_angles(low) + 0.0, wrap_angles(high) + 0.0
    is_whole = is_whole | (turn > 360.0)
    is_split = (first > last) & ~is_whole
    lows[0, at] = np.where(is_whole | is_split, CIRCLE[0], first)
    highs[0, at] = np.where(is_whole, CIRCLE[1], last)
    lows[1, at], highs[1, at] = np.where(is_split, first, np.nan), np.where(is_split, CIRCLE[1], np.nan)
    return (np.abs(turn - 360.0) >= 1.0) & ~(is_split & (first <= np.nextafter(last, np.inf)))
