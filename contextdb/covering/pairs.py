"""Pairs of conditions: which share of the contexts with two given values has a valid row, and whether any row names the two.

Each condition's domain is cut into a few parts: a value, a span of numbers, a tag that is there or not. A slice is a part of one
condition with a part of another. Its *conditional* coverage is the share of its possible contexts that have a valid row; it is
*named* when some row restricts both conditions and accepts some of both parts. (That some row accepts both is worth little: rows
that say Any accept everything.)

G is the number of parts of all conditions; part p belongs to one condition. A condition with itself has slices too: those of one
part with itself are that part's own coverage.

A value of a bool, enum or text is a part, of many values those that most rows name, then all others; numbers are cut into eighths
by weight; a tag is there or not.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.grammar import format_cell
from contextdb.cells.sets import Cell, TagSet
from contextdb.compiled.table import CompiledTable
from contextdb.covering.assumed import opened
from contextdb.covering.factors import TagFactor, ValueFactor
from contextdb.covering.progress import Progress, Stops, Tell
from contextdb.covering.report import wilson
from contextdb.covering.sample import Codes, Sampler, samples_of
from contextdb.covering.space import CellBox, Sides, Space, WeightsOf, require_counts
from contextdb.errors import plural
from contextdb.tables.table import EitherTable

SAMPLES = 50_000
MOST_CONDITIONS = 120
"""A report compares no more conditions than so many with each other: pairs, and what they take, grow with their square."""
DIGITS = 12
"""Shares that are equal to so many decimals are sorted as equal."""


@dataclass(frozen=True, slots=True)
class Slice:
    """Two parts, and what is known of the contexts that lie in both."""

    cells: dict[str, str]
    share: float
    """Of the possible contexts; 0 where none is possible, or single points only."""
    covered: float | None
    """The share of them that has a valid row; None where nothing could be measured."""
    lower: float
    upper: float
    """Both equal `covered` where it is exact; else its 99 % interval (Wilson)."""
    n_samples: int
    """Contexts that the estimate rests on; 0 where it is exact."""
    n_rows: int
    """Rows that are valid in some of them, or would be if they were possible."""
    is_named: bool

    @property
    def is_exact(self) -> bool:
        """Whether `covered` is no estimate."""
        return self.covered is not None and self.lower == self.upper

    @property
    def rank(self) -> tuple[float, float]:
        """What slices are sorted by: the least covered first, then the largest. Roundings, which no two processors share, do not
        count."""
        return round(self.covered or 0.0, DIGITS), -round(self.share, DIGITS)

    def to_json(self) -> dict[str, object]:
        return {
            "cells": self.cells,
            "share": self.share,
            "covered": self.covered,
            "lower": self.lower,
            "upper": self.upper,
            "samples": self.n_samples,
            "rows": self.n_rows,
            "named": self.is_named,
        }


@dataclass(frozen=True, eq=False)
class PairTable:
    """Conditional and explicit coverage of all pairs of conditions."""

    table: str
    method: Literal["exact", "estimate"]
    seed: int
    n_samples: int
    """Contexts tried; 0 where all were gone through."""
    conditions: tuple[str, ...]
    parts: tuple[tuple[str, ...], ...]
    """For each condition its parts as cells."""
    shares: NDArray[np.float64]
    """float64 [G, G]: the share of the possible contexts in both parts, as measured."""
    covered: NDArray[np.float64]
    """float64 [G, G]: the share of the possible contexts that is in both parts and has a valid row."""
    counts: NDArray[np.int64]
    """int64 [G, G]: samples in both parts; 0 where all contexts were gone through."""
    meeting: NDArray[np.int64]
    """int64 [G, G]: rows that accept some of both parts."""
    naming: NDArray[np.int64]
    """int64 [G, G]: rows that restrict both conditions too."""

    def first(self, condition: int) -> int:
        """The number of a condition's first part."""
        return self._firsts[condition]

    @cached_property
    def _firsts(self) -> list[int]:
        return list(accumulate((len(parts) for parts in self.parts), initial=0))

    def slice(self, one: int, other: int, i: int, j: int) -> Slice:
        """Part `i` of condition number `one` with part `j` of condition number `other`; the same part where they are the same."""
        p, q = self.first(one) + i, self.first(other) + j
        cells = {self.conditions[one]: self.parts[one][i]} | {self.conditions[other]: self.parts[other][j]}
        covered, lower, upper = self._measured(p, q)
        n_samples = int(self.counts[p, q])
        share = float(self.shares[p, q])
        return Slice(cells, share, covered, lower, upper, n_samples, int(self.meeting[p, q]), bool(self.naming[p, q]))

    def slices(self, one: int, other: int) -> list[Slice]:
        """All slices of two conditions, by the parts of the first, then of the second; of a condition with itself, one a part."""
        if one == other:
            return [self.slice(one, one, i, i) for i in range(len(self.parts[one]))]
        return [self.slice(one, other, i, j) for i in range(len(self.parts[one])) for j in range(len(self.parts[other]))]

    def worst(self, one: int, other: int) -> Slice | None:
        """The slice of two conditions that is covered least, the largest of equals; None where none has a measure."""
        measured = [s for s in self.slices(one, other) if s.covered is not None]
        return min(measured, key=lambda s: s.rank) if measured else None

    def explicit(self, one: int, other: int) -> float:
        """The share of the slices of two conditions that some row names."""
        slices = self.slices(one, other)
        return sum(s.is_named for s in slices) / len(slices) if slices else 1.0

    def pairs(self) -> Iterator[tuple[int, int]]:
        return ((i, j) for i in range(len(self.conditions)) for j in range(i + 1, len(self.conditions)))

    def to_json(self) -> dict[str, object]:
        items = [
            {
                "conditions": [self.conditions[i], self.conditions[j]],
                "explicit": self.explicit(i, j),
                "slices": [s.to_json() for s in self.slices(i, j)],
            }
            for i, j in self.pairs()
        ]
        parts = dict(zip(self.conditions, map(list, self.parts), strict=True))
        how: dict[str, object] = {"method": self.method, "seed": self.seed, "samples": self.n_samples}
        return {**how, "parts": parts, "items": items}

    def _measured(self, p: int, q: int) -> tuple[float | None, float, float]:
        if self.method == "estimate" and not self.meeting[p, q]:
            return 0.0, 0.0, 0.0  # no row accepts both, whatever the samples say
        if self.method == "exact":
            share = float(self.shares[p, q])
            ratio = min(1.0, float(self.covered[p, q]) / share) if share > 0.0 else None
            return ratio, ratio or 0.0, 1.0 if ratio is None else ratio
        n = int(self.counts[p, q])
        n_covered = round(float(self.covered[p, q]) * self.n_samples)
        return (None, 0.0, 1.0) if not n else (n_covered / n, *wilson(n_covered, n))


def left_out(n_conditions: int) -> str:
    """That a report compares no pairs of so many conditions, as a sentence; "" where it compares them."""
    if n_conditions <= MOST_CONDITIONS:
        return ""
    problem = f"the table has {plural(n_conditions, 'condition')}, and at most {MOST_CONDITIONS} are"
    return f"Pairs of conditions are not compared: {problem}."


def pairs(
    table: EitherTable | CompiledTable,
    *,
    seed: int = 0,
    samples: int | None = None,
    impossible: Sequence[CellBox] = (),
    weights: WeightsOf | None = None,
    assume: bool = True,
    progress: Tell | None = None,
    should_stop: Stops | None = None,
) -> PairTable:
    """Work out the coverage of pairs of conditions.

    Exact where the contexts that cells distinguish are few enough to go through; else out of random contexts. That no row accepts
    two parts is certain in either case. Rows' own rules count, and are in no pair themselves. The arguments, and what is raised,
    are those of `coverage`.
    """
    require_counts(samples=SAMPLES if samples is None else samples, seed=seed)
    watcher = Progress(progress, should_stop).within("Comparing conditions", 0.0, 1.0)
    drawn = opened(table, impossible, weights, assume, watcher, "any")
    space = drawn.space
    samples = samples_of(samples, SAMPLES, space)
    rules = () if drawn.ruled is None else drawn.ruled.rules
    visible = [at for at, condition in enumerate(space.conditions) if condition.name not in rules]
    parts = [parts_of(space, at) for at in visible]
    sides = [sides for own in parts for _, sides in own]
    sampler = Sampler(space, watcher, drawn.drawer)
    every = sampler.every_context()
    is_exact = every is not None
    tally = _Tally(space, sides)
    for codes, weights_of in sampler.gathered(every or sampler.random_contexts(samples, np.random.default_rng(seed))):
        watcher.at(tally.n_contexts / max(1, samples))
        is_possible = sampler.is_possible(codes)
        counts = sampler.holders(codes[is_possible]).counts
        tally.add(codes[is_possible], None if weights_of is None else weights_of[is_possible], counts)
    meets = _meeting(sampler, sides, watcher)
    of_part = [at for at, own in zip(visible, parts, strict=True) for _ in own]
    return PairTable(
        table=drawn.compiled.name,
        method="exact" if is_exact else "estimate",
        seed=int(seed),
        n_samples=0 if is_exact else tally.n_contexts,
        conditions=tuple(space.conditions[at].name for at in visible),
        parts=tuple(tuple(text for text, _ in own) for own in parts),
        shares=tally.inside / tally.total if tally.total else tally.inside,
        covered=tally.valid / tally.total if tally.total else tally.valid,
        counts=np.zeros_like(tally.inside, np.int64) if is_exact else np.rint(tally.inside).astype(np.int64),
        meeting=_rows_in_both(meets),
        naming=_rows_in_both(meets & _restricted(sampler, of_part)),
    )


MOST_AT_ONCE = 1 << 16
"""So many rows are compared at once."""


class _Tally:
    """Sums over contexts: for each two parts the weight of the contexts in both, and of those with a valid row."""

    def __init__(self, space: Space, sides: Sequence[Sides]) -> None:
        self.inside, self.valid = np.zeros((len(sides), len(sides))), np.zeros((len(sides), len(sides)))
        self.total, self.n_contexts = 0.0, 0
        self._members = [[(f, bitmask.flags_of(side, len(space.factors[f].weights))) for f, side in part.items()] for part in sides]

    def add(self, codes: Codes, weights: NDArray[np.float64] | None, counts: NDArray[np.int64]) -> None:
        """More contexts: the classes of each, its weight, and how many rows are valid in it."""
        columns = np.ascontiguousarray(codes.T)
        flags = np.ones((len(self._members), len(codes)), np.bool_)
        for p, part in enumerate(self._members):
            for f, members in part:
                flags[p] &= members[columns[f]]
        self.n_contexts += len(codes)
        has_row = counts > 0
        for steps in [None] if weights is None else _in_steps(weights):
            self.total += float(len(codes) if steps is None else steps.sum())
            self.inside += _weight_in_both(flags, steps)
            self.valid += _weight_in_both(flags[:, has_row], None if steps is None else steps[has_row])


def _in_steps(weights: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Weights as sums of two, multiples of 2**-26 and of 2**-60: each of them adds up without rounding.

    Processors add the products of a matrix in different orders, so sums that round would differ in their last digits.
    """
    coarse = np.rint(weights * 2.0**26) / 2.0**26
    return [coarse, np.rint((weights - coarse) * 2.0**60) / 2.0**60]


def _weight_in_both(flags: NDArray[np.bool_], weights: NDArray[np.float64] | None) -> NDArray[np.float64]:
    """For each two parts the weight of the columns that both hold; how many they are, where no weights are given."""
    if weights is not None:
        return np.asarray((flags * weights) @ flags.T.astype(np.float64))
    assert flags.shape[1] < 1 << 24  # whole numbers below that are exact in 32 bits
    singles = flags.astype(np.float32)
    return (singles @ singles.T).astype(np.float64)


def _meeting(sampler: Sampler, sides: Sequence[Sides], progress: Progress) -> NDArray[np.bool_]:
    """Which boxes accept some of each part: bool [parts, boxes]."""
    flags = np.ones((len(sides), len(sampler.space.boxes)), np.bool_)
    for p, part in enumerate(sides):
        progress.check()
        for f, side in part.items():
            flags[p] &= sampler.space.numbered.meeting(f, side)
    return flags


def _restricted(sampler: Sampler, of_part: Sequence[int]) -> NDArray[np.bool_]:
    """Which boxes restrict the condition of each part: bool [parts, boxes]."""
    space, known = sampler.space, dict[int, NDArray[np.bool_]]()
    for at in dict.fromkeys(of_part):
        known[at] = np.zeros(len(space.boxes), np.bool_)
        for f in space.of_condition[at]:
            known[at] |= ~space.numbered.holding(f, space.full[f])
    return np.array([known[at] for at in of_part], np.bool_).reshape(len(of_part), len(space.boxes))


def _rows_in_both(flags: NDArray[np.bool_]) -> NDArray[np.int64]:
    """How many columns each two rows of flags have in common."""
    parts = (flags[:, at : at + MOST_AT_ONCE] for at in range(0, max(1, flags.shape[1]), MOST_AT_ONCE))
    return np.rint(sum(_weight_in_both(part, None) for part in parts)).astype(np.int64)


# ---- the parts of conditions: each condition's domain cut into a few sets of values, to compare conditions with each other


MOST_PARTS = 8
"""A condition has so many parts at most."""


def parts_of(space: Space, at: int) -> list[tuple[str, Sides]]:
    """The parts of a condition: each as a cell, and as classes of its factors."""
    numbers = space.of_condition[at]
    if space.conditions[at].domain.type.is_tags:
        return _tag_parts(space, at)
    f = numbers[0]
    factor = space.factors[f]
    sides = _value_sides(space, f) if isinstance(factor, ValueFactor) else _span_sides(factor.weights)
    return [(space.written(at, factor.accepts(side), is_label=True), {f: side}) for side in sides]


def _value_sides(space: Space, f: int) -> list[int]:
    """Each value; of many those that most rows name, then all others."""
    n = len(space.factors[f].weights)
    if n <= MOST_PARTS:
        return [1 << k for k in range(n)]
    named = np.zeros(n, np.int64)
    for side, n_boxes in Counter(box[f] for box in space.boxes).items():
        if side != space.full[f]:
            named += n_boxes * bitmask.flags_of(side, n)
    chosen = sorted(np.argsort(-named, kind="stable")[: MOST_PARTS - 1].tolist())
    sides = [1 << k for k in chosen]
    return [*sides, space.full[f] & ~sum(sides)]


def _span_sides(weights: NDArray[np.float64]) -> list[int]:
    """Neighbouring spans of numbers; single points go to the span below them, or to the first."""
    wide = np.flatnonzero(weights > 0.0)
    starts = [0, *wide[1:].tolist()]
    if len(wide) > MOST_PARTS:
        middle = np.cumsum(weights)[wide] - weights[wide] / 2.0
        eighth = np.minimum((middle * MOST_PARTS).astype(np.int64), MOST_PARTS - 1)
        starts = [0, *wide[1:][eighth[1:] != eighth[:-1]].tolist()]
    stops = [*starts[1:], len(weights)]
    return [(1 << stop) - (1 << start) for start, stop in zip(starts, stops, strict=True)]


def _tag_parts(space: Space, at: int) -> list[tuple[str, Sides]]:
    """With and without each tag that cells name; of many those that most rows restrict."""
    placed: list[tuple[int, str, Sides, Sides]] = []
    for f in space.of_condition[at]:
        factor = space.factors[f]
        assert isinstance(factor, TagFactor)
        for tag in factor.tags:
            side = factor.classes(TagSet(frozenset((tag,)), frozenset()))
            n_rows = sum(not (box[f] & side and box[f] & ~side) for box in space.boxes)
            placed.append((n_rows, tag, {f: side}, {f: space.full[f] & ~side}))
    placed.sort(key=lambda item: -item[0])
    domain = space.conditions[at].domain
    parts: list[tuple[str, Sides]] = []
    for _, tag, with_it, without in placed[: MOST_PARTS // 2]:
        parts.append((format_cell(Cell(TagSet(frozenset((tag,)), frozenset())), domain), with_it))
        parts.append((format_cell(Cell(TagSet(frozenset(), frozenset((tag,)))), domain), without))
    return [(text, sides) for text, sides in parts if all(sides.values())]
