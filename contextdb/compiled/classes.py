"""Cut a condition's domain into the classes that its column distinguishes, and keep one mask of rows for each.

A class is a set of values that no cell of the column distinguishes, so a fact matters only through its class. The columns here are
the compiled form of one condition each:

    ValueMasks    bool, enum, text    a class for each value; text has one more, for every value that no cell names
    NumberMasks   int, number, angle  elementary intervals: class k holds the x with bounds[k-1] <= x < bounds[k]
    WideMasks     the same, for columns with very many bounds: two digits of the class number, a few masks for each digit
    TagMasks      tags                two classes (no, yes) for each tag named, and for each cell that begins with "not"

W = ceil(n_rows / 64), R = n_rows, K = number of classes. A mask holds the rows whose cell accepts the class; soft cells accept all.
The last mask of a column (of each tag) is for a missing fact: the rows whose cell is Any.

Source: Lakshman and Stiliadis, "High-speed policy-based packet forwarding using efficient multi-dimensional range matching",
SIGCOMM 1998; the two digits of `WideMasks` are the comparison of two-digit numbers, spelt in masks.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from operator import and_, or_

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Words
from contextdb.cells import sets
from contextdb.cells.domains import Domain
from contextdb.cells.numbers import CellSpans, spans_of
from contextdb.columns import Codes, distinct
from contextdb.core import turn_rows

FLAT_BYTES = 2 << 20
"""A number column whose masks would take more is kept in two digits."""

Pairs = NDArray[np.int64]
Value = bool | str


@dataclass(frozen=True, eq=False)
class ValueMasks:
    """Masks of a bool, enum or text column. `masks` is uint64 [K + 1, W]; `values[v]` is the class of value v."""

    n_rows: int
    values: tuple[Value, ...]
    has_others: bool
    """Whether class K - 1 is every value not in `values` (text)."""
    masks: Words

    @cached_property
    def class_of(self) -> dict[Value, int]:
        return {v: i for i, v in enumerate(self.values)}

    @cached_property
    def ints(self) -> list[int]:
        """Every mask as a Python integer, the missing one last."""
        return [bitmask.to_int(m) for m in self.masks]

    def codes(self, fact: Value | None) -> tuple[int, ...]:
        if fact is None:
            return (len(self.masks) - 1,)
        return (self.class_of.get(fact, len(self.values)),)

    def set_bits(self, accepts: sets.Accepted) -> tuple[int, int]:
        """Rows that accept some, and rows that accept all, of a set of values."""
        assert isinstance(accepts, sets.ValueSet)
        held = [i for i, v in enumerate(self.values) if accepts.holds(v)]
        if self.has_others and (accepts.is_complement or accepts.values - self.class_of.keys()):
            held.append(len(self.values))
        return _some_and_all(self.ints, held)


@dataclass(frozen=True, eq=False)
class NumberMasks:
    """Masks of a number column. `bounds` is float64 [K - 1], ascending; `masks` is uint64 [K + 1, W]."""

    n_rows: int
    bounds: NDArray[np.float64]
    masks: Words

    @cached_property
    def bound_list(self) -> list[float]:
        """The bounds as Python floats, to bisect in."""
        return [float(b) for b in self.bounds]

    @cached_property
    def ints(self) -> list[int]:
        return [bitmask.to_int(m) for m in self.masks]

    def codes(self, fact: float | None) -> tuple[int, ...]:
        return (len(self.masks) - 1 if fact is None else bisect_right(self.bound_list, fact),)

    def set_bits(self, accepts: sets.Accepted) -> tuple[int, int]:
        assert isinstance(accepts, sets.NumberSet)
        return _some_and_all(self.ints, _classes_in(accepts, self.bound_list))


@dataclass(frozen=True, eq=False)
class WideMasks:
    """Masks of a number column with very many bounds, in two digits of the class number: g = class >> `shift`, f = the rest.

    A row whose cell is the classes a up to, not including, b accepts class k when k >= a and k < b. Comparing digits, with a =
    (ag, af):
    k >= a is `ag < g or (ag == g and af <= f)`, which is `after[g] | (at[g] & fine[f])`; the same for b. A cell of several
    intervals has one layer for each. `low` and `high` are uint64 [layers, 2 G + F, W]: G masks `after`, G masks `at`, F masks
    `fine`.
    """

    n_rows: int
    bounds: NDArray[np.float64]
    shift: int
    low: Words
    high: Words
    any_mask: Words

    @cached_property
    def bound_list(self) -> list[float]:
        return [float(b) for b in self.bounds]

    @cached_property
    def layers(self) -> list[tuple[list[int], list[int]]]:
        """For each layer the masks of `low` and of `high` as Python integers."""
        return [
            ([bitmask.to_int(m) for m in low], [bitmask.to_int(m) for m in high])
            for low, high in zip(self.low, self.high, strict=True)
        ]

    @property
    def n_coarse(self) -> int:
        """G: how many values the first digit has."""
        return (int(self.low.shape[1]) - (1 << self.shift)) // 2

    def codes(self, fact: float | None) -> tuple[int, ...]:
        """The fact's class; K for a missing fact."""
        return (len(self.bounds) + 1 if fact is None else bisect_right(self.bound_list, fact),)

    def bits(self, code: int) -> int:
        """The mask of a class; of K, the mask for a missing fact."""
        if code == len(self.bounds) + 1:
            return bitmask.to_int(self.any_mask)
        g, f, n = code >> self.shift, code & ((1 << self.shift) - 1), self.n_coarse
        bits = 0
        for low, high in self.layers:
            bits |= (low[g] | low[n + g] & low[2 * n + f]) & (high[g] | high[n + g] & high[2 * n + f])
        return bits

    def set_bits(self, accepts: sets.Accepted) -> tuple[int, int]:
        assert isinstance(accepts, sets.NumberSet)
        held = [self.bits(k) for k in _classes_in(accepts, self.bound_list)]
        return reduce(or_, held), reduce(and_, held)


@dataclass(frozen=True, eq=False)
class TagMasks:
    """Masks of a tags column: three for each slot (no, yes, missing), uint64 [3 S, W]; a fact has one answer for each slot.

    The first slots ask whether the fact has a tag of `tags`, the others whether a cell that begins with "not", of `negated`, holds.
    """

    n_rows: int
    tags: tuple[str, ...]
    negated: tuple[sets.TagSet, ...]
    masks: Words

    @cached_property
    def ints(self) -> list[int]:
        """Every mask as a Python integer, three for each slot."""
        return [bitmask.to_int(m) for m in self.masks]

    def codes(self, fact: frozenset[str] | None) -> tuple[int, ...]:
        """The number of the mask for each slot; None is a missing fact."""
        n_slots = len(self.tags) + len(self.negated)
        if fact is None:
            return tuple(range(2, 3 * n_slots, 3))
        has = sets.covered_by(fact)
        answers = [tag in has for tag in self.tags] + [cell.holds(fact) for cell in self.negated]
        return tuple(3 * slot + answer for slot, answer in enumerate(answers))

    def set_bits(self, accepts: sets.Accepted) -> tuple[int, int]:
        """Rows that accept some, and rows that accept all, of a set of tag sets."""
        assert isinstance(accepts, sets.TagSet)
        pairs = [self._conjunction_bits(part) for part in sets.plain_parts(accepts)]
        return reduce(or_, (some for some, _ in pairs)), reduce(and_, (all_ for _, all_ in pairs))

    def _conjunction_bits(self, part: sets.TagSet) -> tuple[int, int]:
        some = every = bitmask.to_int(bitmask.full(self.n_rows))
        for slot, (may_not, may) in enumerate(self._possible(part)):
            no, yes = self.ints[3 * slot], self.ints[3 * slot + 1]
            some &= (no if may_not else 0) | (yes if may else 0)
            every &= (no if may_not else -1) & (yes if may else -1)
        return some, every

    def _possible(self, part: sets.TagSet) -> Iterable[tuple[bool, bool]]:
        """For each slot, whether some fact of the part answers no, and whether one answers yes."""
        needed = sets.covered_by(part.needs)
        for tag in self.tags:
            yield tag not in needed, not sets.is_banned(tag, part)
        for cell in self.negated:
            if isinstance(cell, sets.TagMeet):
                yield not cell.holds_all_of(part), cell.meets(part)
                continue
            entails = cell.needs <= needed and all(sets.is_banned(t, part) for t in cell.bans)
            joint = sets.TagSet(part.needs | cell.needs, part.bans | cell.bans)
            yield not joint.is_contradiction, not entails


ColumnMasks = ValueMasks | NumberMasks | WideMasks | TagMasks


def column_masks(cells: Sequence[sets.Cell], codes: Codes, domain: Domain) -> ColumnMasks:
    """Compile one column: row r holds `cells[codes[r]]`. Soft cells accept every value."""
    if domain.type.is_numeric:
        return _number_masks(cells, codes, domain)
    hard = [None if c.is_soft else c.accepts for c in cells]
    return _tag_masks(hard, codes) if domain.type.is_tags else _value_masks(hard, codes, domain)


def _some_and_all(ints: list[int], held: Sequence[int]) -> tuple[int, int]:
    masks = [ints[k] for k in held]
    return reduce(or_, masks, 0), reduce(and_, masks) if masks else 0


def _classes_in(accepts: sets.NumberSet, bounds: list[float]) -> list[int]:
    held = {k for low, high in accepts.spans for k in range(bisect_right(bounds, low), bisect_right(bounds, high) + 1)}
    return sorted(held)


def _any_rows(cells: Sequence[sets.Accepted | None], codes: Codes) -> Words:
    return bitmask.pack(_flags([c is None for c in cells])[codes])


def _flags(values: Sequence[bool]) -> NDArray[np.bool_]:
    return np.array(values, np.bool_)


def _turned(pairs: Sequence[tuple[int, int]], codes: Codes, n_masks: int) -> Words:
    """`_masks_of` of (cell, mask number) pairs."""
    cells, numbers = np.ascontiguousarray(np.array(pairs, np.int64).reshape(-1, 2).T)
    return _masks_of(cells, numbers, codes, n_masks)


def _masks_of(cells: Pairs, numbers: Pairs, codes: Codes, n_masks: int) -> Words:
    """Masks uint64 [n_masks, W] whose bit of a row is turned over once for each mask number of its cell."""
    masks = np.zeros((n_masks, bitmask.n_words(len(codes))), np.uint64)
    turn_rows(np.ascontiguousarray(codes, np.int32), cells, numbers, masks)
    return masks


def _value_masks(cells: Sequence[sets.Accepted | None], codes: Codes, domain: Domain) -> ValueMasks:
    has_others = domain.type.is_open
    values: tuple[Value, ...] = domain.everything or tuple(_named(cells))
    class_of = {v: i for i, v in enumerate(values)}
    n_classes = len(values) + has_others
    pairs = [(i, class_of[v]) for i, c in enumerate(cells) if isinstance(c, sets.ValueSet) for v in c.values if v in class_of]
    masks = _turned(pairs, codes, n_classes + 1)
    accepts_rest = _flags([c is None or (isinstance(c, sets.ValueSet) and c.is_complement) for c in cells])
    masks ^= bitmask.pack(accepts_rest[codes])
    masks[-1] = _any_rows(cells, codes)
    return ValueMasks(len(codes), values, has_others, masks)


def _named(cells: Sequence[sets.Accepted | None]) -> list[Value]:
    """The values that the cells name, in order of appearance."""
    return list(dict.fromkeys(v for c in cells if isinstance(c, sets.ValueSet) for v in sorted(c.values)))


def _number_masks(cells: Sequence[sets.Cell], codes: Codes, domain: Domain) -> NumberMasks | WideMasks:
    spans = spans_of(cells)
    ends = _ends(spans.highs, 1.0 if domain.type.is_whole else 0.0)
    bottom = -180.0 if domain.type.is_circular else -np.inf
    top = 180.0 if domain.type.is_circular else np.inf
    has_end = ends <= top if top == np.inf else ends < top
    has_end &= ~np.isnan(ends)
    bounds = distinct(np.concatenate([spans.lows[spans.lows > bottom], ends[has_end]]))
    first = np.searchsorted(bounds, spans.lows, "right")
    stop = np.where(has_end, np.searchsorted(bounds, ends, "right"), len(bounds) + 1)
    is_flat = (len(bounds) + 2) * bitmask.n_words(len(codes)) * 8 <= FLAT_BYTES
    return (_flat_masks if is_flat else _wide_masks)(bounds, spans, first, stop, codes)


def _ends(highs: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """The first number after each span; NaN where there is none."""
    with np.errstate(over="ignore"):  # the number after the largest double is inf, as it shall be
        ends = np.maximum(np.nextafter(highs, np.inf), highs + step)
    ends[np.isposinf(highs)] = np.nan
    return ends


def _flat_masks(bounds: NDArray[np.float64], spans: CellSpans, first: Pairs, stop: Pairs, codes: Codes) -> NumberMasks:
    n_classes = len(bounds) + 1
    cells, turns = np.concatenate([spans.owners, spans.owners]), np.concatenate([first, stop])
    inner = turns < n_classes
    masks = _masks_of(cells[inner], turns[inner], codes, n_classes + 1)
    np.bitwise_xor.accumulate(masks, axis=0, out=masks)
    any_rows = bitmask.pack(spans.are_any[codes])
    masks |= any_rows
    masks[-1] = any_rows
    return NumberMasks(len(codes), bounds, masks)


def _wide_masks(bounds: NDArray[np.float64], spans: CellSpans, first: Pairs, stop: Pairs, codes: Codes) -> WideMasks:
    n_classes = len(bounds) + 1
    shift = (n_classes.bit_length() + 1) // 2
    any_cells = np.flatnonzero(spans.are_any)
    low_parts, high_parts = [], []
    for layer in range(int(spans.layers.max(initial=0)) + 1):
        here = spans.layers == layer
        cell, start, end = spans.owners[here], first[here], stop[here]
        if layer == 0:
            cell = np.concatenate([cell, any_cells])
            start = np.concatenate([start, np.zeros(len(any_cells), np.int64)])
            end = np.concatenate([end, np.full(len(any_cells), n_classes)])
        low_parts.append(_digit_masks(cell, start, codes, n_classes, shift, is_end=False))
        high_parts.append(_digit_masks(cell, end, codes, n_classes, shift, is_end=True))
    any_rows = bitmask.pack(spans.are_any[codes])
    return WideMasks(len(codes), bounds, shift, np.stack(low_parts), np.stack(high_parts), any_rows)


def _digit_masks(cell: Pairs, number: Pairs, codes: Codes, n_classes: int, shift: int, is_end: bool) -> Words:
    """Masks [2 G + F, W] of the rows whose number is <= k (or, for ends, > k), to be looked up by the two digits of k."""
    n_coarse, n_fine = (n_classes >> shift) + 1, 1 << shift
    at = _masks_of(cell, number >> shift, codes, n_coarse)
    upto = np.bitwise_or.accumulate(at, axis=0)
    fine_upto = np.bitwise_or.accumulate(_masks_of(cell, number & (n_fine - 1), codes, n_fine), axis=0)
    if is_end:
        return np.concatenate([upto[-1] ^ upto, at, fine_upto[-1] ^ fine_upto])
    return np.concatenate([upto ^ at, at, fine_upto])


_EVERY_SET = sets.TagSet(frozenset(("",)), frozenset(("",)), True)


def _tag_masks(cells: Sequence[sets.Accepted | None], codes: Codes) -> TagMasks:
    plain = [(i, c) for i, c in enumerate(cells) if isinstance(c, sets.TagSet) and not c.is_complement]
    negated = [(i, c) for i, c in enumerate(cells) if isinstance(c, sets.TagSet) and c.is_complement]
    # "not not Any" accepts every set of tags and yet is not Any: as a negated contradiction it has a slot to say so.
    negated += [(i, _EVERY_SET) for i, c in plain if not c.needs | c.bans]
    tags = tuple(sorted({t for _, c in plain for t in c.needs | c.bans}))
    slot_of = {t: slot for slot, t in enumerate(tags)}
    needs = [(i, 3 * slot_of[t]) for i, c in plain for t in c.needs]
    bans = [(i, 3 * slot_of[t] + 1) for i, c in plain for t in (c.needs if c.is_contradiction else c.bans)]
    fails = [(i, 3 * (len(tags) + n)) for n, (i, _) in enumerate(negated)]
    n_slots = len(tags) + len(negated)
    masks = _turned(needs + bans + fails, codes, 3 * n_slots)
    masks ^= bitmask.full(len(codes))
    masks[2::3] = _any_rows(cells, codes)
    return TagMasks(len(codes), tags, tuple(c for _, c in negated), masks)


# ---- the class of a number among a column's bounds, without bisection where the bounds lie well apart. The line is cut into
# equal cells, so many that no three bounds share one: a cell "2..3" has a bound at 2, "1..2" one just above. A number's cell
# says how many bounds are below its cell, and two comparisons say the rest: exact, because which cell a number is in never
# falls as the number grows

Doubles = NDArray[np.float64]
MOST_CELLS = 1 << 13


NumberCells = tuple[Doubles, float, float, NDArray[np.int32]]
"""Bounds float64 [K - 1], ascending, and two NaN behind them; the first bound; how many cells a unit has; for each cell int32 how
many bounds lie in earlier ones. Class k holds the x with bounds[k - 1] <= x < bounds[k]."""


def number_cells(bounds: Doubles) -> NumberCells | None:
    """The fewest cells of which none has three bounds; None where bisection is needed."""
    n_cells = 64
    while len(bounds) > 1 and n_cells <= MOST_CELLS:
        with np.errstate(over="ignore"):
            scale = (n_cells - 1) / (bounds[-1] - bounds[0])
        cells = _cells_of(bounds, bounds[0], scale, n_cells)
        if scale > 0.0 and np.isfinite(scale) and (cells[2:] > cells[:-2]).all():
            before = np.searchsorted(cells, np.arange(n_cells)).astype(np.int32)
            return np.append(bounds, [np.nan, np.nan]), float(bounds[0]), float(scale), before
        n_cells *= 2
    return None


def _cells_of(numbers: Doubles, low: float, scale: float, n_cells: int) -> NDArray[np.int32]:
    """The cell of each number, as the core finds it; those beyond the ends are in the first and the last."""
    with np.errstate(all="ignore"):
        cells: NDArray[np.int32] = np.minimum(np.maximum((numbers - low) * scale, 0.0), n_cells - 1.0).astype(np.int32)
    return cells
