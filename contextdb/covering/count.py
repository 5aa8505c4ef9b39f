"""How much of a space some boxes leave uncovered: exactly where the work budget allows, else sound bounds.

Equal parts are recognised by 128-bit hashes. A share that is so small that roundings could hide it is 0 only where a search proves
that no context of any measure is left. The budget counts steps, never time: the same input gives the same numbers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import and_
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.core import Boxes
from contextdb.covering.factors import heads
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.space import Box, Sides, Space
from contextdb.covering.witness import BoxSet, OutOfSteps, Steps

ROUNDING = 1e-12
"""Bounds that are not equal are moved apart by so much, which is more than all roundings."""
EXACT = 1e-10
"""Bounds that nothing but roundings keeps apart by less are one number."""
TINY = 1e-9
"""Below this a search tells whether anything is left at all."""
LEAST_STEPS = 200
STEP = 2000
"""A step of that search costs as much as so many of the count; it may take a few in any case."""
EXACT_FIRST = 6
"""So many eighths of the work go to the exact share; when they do not do, the rest goes to better bounds."""
MOST_DEPTH = 1000
"""The count goes so deep at most."""
WHOLE = 2.0**52
"""What all classes of a factor weigh together, nearly: whole numbers, whose sums are exact."""
MANY_FACTORS = 100
"""Above so many factors boxes that share none are counted apart from the start."""
MOST_BYTES = 4 << 30
"""So much memory the first part may take."""
WORDS_A_STEP = 512
"""So many words of bits, joined one after the other, take as long as a step of work, or less."""
BOXES_A_CHECK = 10_000
"""How many boxes are read between two looks whether to stop."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """The share lies between the two; they are equal when it is exact."""

    lower: float
    upper: float
    work: int = 0

    @property
    def is_exact(self) -> bool:
        return self.lower == self.upper


def uncovered_share(space: Space, boxes: Sequence[Box], work: int, progress: Progress = SILENT) -> Bounds:
    """The share of the space that none of the boxes holds."""
    return uncovered_within(space, [space.sides_of(box) for box in boxes], {}, work, progress)


def left_open(space: Space, work: int, progress: Progress = SILENT) -> Bounds:
    """The share of the space that neither a row nor an impossible context holds; of boxes that do not fit into memory only by their
    measures."""
    if space.is_fitting:
        return uncovered_share(space, space.boxes + space.impossible, work, progress)
    volumes = [*space.volumes.tolist(), *(space.volume(space.sides_of(box)) for box in space.impossible)]
    return Bounds(max(0.0, 1.0 - math.fsum(volumes) - ROUNDING), min(1.0, 1.0 - max(volumes) + ROUNDING))


def uncovered_within(space: Space, boxes: Sequence[Sides], within: Sides, work: int, progress: Progress = SILENT) -> Bounds:
    """The share of the box `within` that none of the others holds."""
    inside = (_inside(space, box, within) for box in boxes)
    distinct = [dict(items) for items in dict.fromkeys(tuple(box.items()) for box in inside if box is not None)]
    if not distinct:
        return Bounds(1.0, 1.0)
    if {} in distinct:
        return Bounds(0.0, 0.0)
    used = sorted({f for box in distinct for f in box})
    full = {f: within.get(f, space.full[f]) for f in used}
    weights = {f: _within(space.factors[f].weights, full[f]) if within else space.factors[f].weights for f in used}
    if len(used) <= MANY_FACTORS:
        return _count(*_of_factors(used, distinct, full, weights), work, progress)
    return _product(distinct, full, weights, work, progress)


def _inside(space: Space, box: Sides, within: Sides) -> Sides | None:
    """What a box is within another, by the factors of which it does not hold all there; None where it holds nothing."""
    sides = {f: side & within.get(f, side) for f, side in box.items()}
    return None if 0 in sides.values() else {f: side for f, side in sides.items() if side != within.get(f, space.full[f])}


def _of_factors(
    factors: Sequence[int], boxes: Sequence[Sides], full: Sides, weights: Mapping[int, NDArray[np.float64]]
) -> tuple[list[Box], Box, list[NDArray[np.float64]]]:
    """Boxes, the whole and weights with a place for each of some factors."""
    whole = tuple(full[f] for f in factors)
    place = {f: i for i, f in enumerate(factors)}
    sides = []
    for box in boxes:
        own = list(whole)
        for f, side in box.items():
            own[place[f]] = side
        sides.append(tuple(own))
    return sides, whole, [weights[f] for f in factors]


def _product(
    boxes: Sequence[Sides], full: Sides, weights: Mapping[int, NDArray[np.float64]], work: int, progress: Progress
) -> Bounds:
    """The count of each group of boxes that share no factor with the others; their shares multiply."""
    lower = upper = 1.0
    done = 0
    for factors, own in _independent(boxes):
        progress.check()
        if len(own) == 1:
            share = 1.0 - math.prod(_share(own[0][f], weights[f]) for f in factors)
            bounds = Bounds(share, share, 1)
        else:
            bounds = _count(*_of_factors(factors, own, full, weights), max(0, work - done), progress)
        lower, upper, done = lower * bounds.lower, upper * bounds.upper, done + bounds.work
    return Bounds(lower, upper, done)


def _independent(boxes: Sequence[Sides]) -> list[tuple[list[int], list[Sides]]]:
    """The boxes in groups that share no factor, each with its factors, ascending."""
    head_of = heads(sorted({f for box in boxes for f in box}), boxes)
    factors: dict[int, list[int]] = {}
    for f, head in head_of.items():
        factors.setdefault(head, []).append(f)
    members: dict[int, list[Sides]] = {}
    for box in boxes:
        members.setdefault(head_of[next(iter(box))], []).append(box)
    return [(factors[one], members_of) for one, members_of in members.items()]


def _within(weights: NDArray[np.float64], side: int) -> NDArray[np.float64]:
    flags = bitmask.flags_of(side, len(weights))
    inside = np.where(flags, weights, 0.0)
    total = inside.sum()
    return inside / total if total > 0.0 else np.where(flags, 1.0 / flags.sum(), 0.0)


def _count(boxes: list[Box], full: Box, weights: list[NDArray[np.float64]], work: int, progress: Progress) -> Bounds:
    boxes = [box for box, has_measure in zip(boxes, _has_measure(boxes, weights), strict=True) if has_measure]
    if not boxes:
        return Bounds(1.0, 1.0)
    table = table_of(boxes, full, [len(own) for own in weights], progress)
    whole = np.concatenate([_whole(own) for own in weights])
    if _is_countable(table, work):
        low, high, done, is_cut = _run(table, whole, work, progress)
    else:
        low, high, done, is_cut = *_by_measure(table, whole), 0, True
    if is_cut or high - low > EXACT:
        return Bounds(max(0.0, low - ROUNDING), min(1.0, high + ROUNDING), done)
    if high < TINY and high > 0.0:
        return _tiny(boxes, full, weights, max(0, work - done), low, high, done, progress)
    share = (low + high) / 2.0
    return Bounds(share, share, done)


def _is_countable(table: tuple[NDArray[Any], ...], work: int) -> bool:
    """Whether the first part, all boxes as bits, fits into memory, and is built, and boxes within others found, within the work. In
    whole numbers: the same on every machine."""
    cells, runs, _, hashes, edges = table
    n_words, n_classes = (len(cells) + 63) // 64, [int(n) for n in np.diff(edges)]
    n_masks = 2 * len(hashes) + sum(n_classes) + max(n_classes) + 2 * MOST_DEPTH
    n_classes_of_sides = int((runs[:, 1] - runs[:, 0]).sum(dtype=np.int64)) if len(runs) else 0
    n_joined = n_words * max(n_classes_of_sides, cells.size)
    return 8 * n_words * n_masks + 4 * cells.size <= MOST_BYTES and n_joined <= work * WORDS_A_STEP


def _by_measure(table: tuple[NDArray[Any], ...], weights: NDArray[np.float64]) -> tuple[float, float]:
    """Bounds of the share that is left open, by the sum of the boxes' measures and the largest of them."""
    cells, runs, first, _, edges = table
    volumes = np.ones(len(cells))
    for f in range(cells.shape[1]):
        sums = np.cumsum([0.0, *weights[edges[f] : edges[f + 1]]])
        numbers, of_box = np.unique(cells[:, f], return_inverse=True)
        shares = np.ones(len(numbers))
        for at, number in enumerate(numbers.tolist()):
            if number >= 0:
                own = runs[first[number] : first[number + 1]]
                shares[at] = (sums[own[:, 1]] - sums[own[:, 0]]).sum() / sums[-1]
        volumes *= shares[of_box]
    return max(0.0, 1.0 - math.fsum(volumes)), 1.0 - float(volumes.max())


def _tiny(
    boxes: list[Box],
    full: Box,
    weights: list[NDArray[np.float64]],
    work: int,
    low: float,
    high: float,
    done: int,
    progress: Progress,
) -> Bounds:
    """Whether a share that may come from roundings is 0: an open context of some measure shows that it is not."""
    within = tuple(_weighing(own) for own in weights)
    rows = BoxSet.of(full, boxes, progress)
    try:
        point = rows.outside(rows.all, within, Steps(LEAST_STEPS + work // STEP, progress))
    except OutOfSteps:
        return Bounds(max(0.0, low - ROUNDING), high + ROUNDING, done)
    if point is None:
        return Bounds(0.0, 0.0, done)
    least = float(np.prod([own[k] for own, k in zip(weights, point, strict=True)]))
    share = max(least, (low + high) / 2.0)
    return Bounds(share, share, done)


def _share(side: int, weights: NDArray[np.float64]) -> float:
    inside = weights[bitmask.flags_of(side, len(weights))]
    return float(np.cumsum(inside)[-1]) if len(inside) else 0.0  # one after the other: `sum` rounds otherwise from Python 3.12 on


def table_of(boxes: Sequence[Box], full: Box, n_classes: Sequence[int], progress: Progress = SILENT) -> tuple[NDArray[Any], ...]:
    """The boxes as the core takes them; `n_classes` are those of each factor. It can be stopped."""
    rng = np.random.default_rng(0)
    number: dict[tuple[int, int], int] = {}
    cells = np.full((len(boxes), len(full)), -1, np.int32)
    for i, box in enumerate(boxes):
        if i % BOXES_A_CHECK == 0:
            progress.check()
        for f, side in enumerate(box):
            if side != full[f]:
                cells[i, f] = number.setdefault((f, side), len(number))
    runs = [bitmask.runs_of(side) for _, side in number]
    first = np.cumsum([0, *map(len, runs)]).astype(np.int64)
    hashes = rng.integers(1, 2**63, (len(number), 2), np.uint64)
    flat = np.array([r for own in runs for r in own], np.int32).reshape(-1, 2)
    edges = np.cumsum([0, *n_classes]).astype(np.int64)
    return cells, flat, first, hashes, edges


def _whole(weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights as whole numbers whose sums are exact, in whatever order; what weighs anything weighs 1 at least."""
    return np.where(weights > 0.0, np.maximum(np.rint(weights * (WHOLE / weights.sum())), 1.0), 0.0)


def _has_measure(boxes: Sequence[Box], weights: Sequence[NDArray[np.float64]]) -> list[bool]:
    """Whether each box holds a class of some weight of every factor."""
    some = [_weighing(own) for own in weights]
    return [all(map(and_, box, some)) for box in boxes]


def _weighing(weights: NDArray[np.float64]) -> int:
    return bitmask.int_of(np.flatnonzero(weights > 0.0).tolist())


def _run(
    table: tuple[NDArray[Any], ...], weights: NDArray[np.float64], work: int, progress: Progress
) -> tuple[float, float, int, bool]:
    """Bounds of the share, the work done, and whether it was cut short."""
    counted = Boxes(*table).uncovered(weights, work * EXACT_FIRST // 8, work, lambda done: progress.at(done / max(1, work)))
    low, high, done, is_cut = counted
    return low, high, done, bool(is_cut)
