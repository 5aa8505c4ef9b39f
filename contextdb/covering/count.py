"""How much of a space some boxes leave uncovered: exactly where the work budget allows, else sound bounds.

The share that no box holds is summed from products and sums of numbers from 0 up, so it is 0 exactly when nothing is left that has
a measure. Equal parts are recognised by 128-bit hashes. The budget counts row visits, never time: the same input gives the same
numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Thread
from typing import Any

import numpy as np

from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.space import Box, Space, used_factors

SLACKS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 0.0)
"""Bounds are first worked out coarsely, then finer and finer, so that they are even when the budget ends."""
ROUNDING = 1e-12
"""Bounds that are not equal are moved apart by so much, which is more than all roundings."""
LOG2_KNOWN = 20
"""How many parts are remembered, as a power of two; 32 bytes each."""
POLL_S = 0.02
"""How often a long count is looked at."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """The share lies between the two; they are equal when it is exact."""

    lower: float
    upper: float
    work: int = 0

    @property
    def is_exact(self) -> bool:
        """Whether the share is known."""
        return self.lower == self.upper


def uncovered_share(
    space: Space, boxes: Sequence[Box], work: int, within: Box | None = None, progress: Progress = SILENT
) -> Bounds:
    """The share of the space, or of the box `within`, that none of the boxes holds."""
    weights = [_within(f.weights, None if within is None else within[i]) for i, f in enumerate(space.factors)]
    if within is not None:
        boxes = [tuple(a & b for a, b in zip(box, within, strict=True)) for box in boxes]
        boxes = [box for box in boxes if 0 not in box]
    full = space.full if within is None else within
    used = used_factors(boxes, full)
    boxes = list(dict.fromkeys(boxes))
    if not boxes:
        return Bounds(1.0, 1.0)
    if full in boxes:
        return Bounds(0.0, 0.0)
    sides = [[box[f] for f in used] for box in boxes]
    return _count(sides, [full[f] for f in used], [weights[f] for f in used], work, progress)


def _within(
    weights: np.ndarray[tuple[int], np.dtype[np.float64]], side: int | None
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    if side is None:
        return weights
    flags = np.array([side >> k & 1 for k in range(len(weights))], np.bool_)
    inside = np.where(flags, weights, 0.0)
    total = inside.sum()
    return inside / total if total > 0.0 else np.where(flags, 1.0 / flags.sum(), 0.0)


def runs_of(side: int) -> list[tuple[int, int]]:
    """A set of classes as runs: first class, and the one after the last."""
    runs, at = [], 0
    while side:
        skip = (side & -side).bit_length() - 1
        side >>= skip
        length = (~side & (side + 1)).bit_length() - 1
        runs.append((at + skip, at + skip + length))
        side >>= length
        at += skip + length
    return runs


def _count(
    boxes: list[list[int]],
    full: list[int],
    weights: list[np.ndarray[tuple[int], np.dtype[np.float64]]],
    work: int,
    progress: Progress,
) -> Bounds:
    from contextdb.covering.kernels import CUT, WORK, uncovered

    rng = np.random.default_rng(0)
    n_boxes, n_factors = len(boxes), len(full)
    number: dict[tuple[int, int], int] = {}
    cells = np.full((n_boxes, n_factors), -1, np.int32)
    for i, box in enumerate(boxes):
        for f, side in enumerate(box):
            if side != full[f]:
                cells[i, f] = number.setdefault((f, side), len(number))
    runs = [runs_of(side) for _, side in number]
    first = np.cumsum([0, *map(len, runs)]).astype(np.int64)
    sizes = np.array([sum(float(weights[f][a:b].sum()) for a, b in own) for (f, _), own in zip(number, runs, strict=True)])
    hashes = rng.integers(1, 2**63, (len(number), 2), np.uint64)
    is_used = cells >= 0
    volumes = np.prod(np.where(is_used, sizes[cells], 1.0), axis=1)
    has_volume = volumes > 0.0
    cells, is_used, volumes = cells[has_volume], is_used[has_volume], volumes[has_volume]
    masks = np.zeros((len(cells), (n_factors + 63) // 64), np.uint64)
    for f in range(n_factors):
        masks[:, f >> 6] |= is_used[:, f].astype(np.uint64) << np.uint64(f & 63)
    box_hashes = np.bitwise_xor.reduce(np.where(is_used[:, :, None], hashes[cells], np.uint64(0)), axis=1)
    edges = np.cumsum([0, *map(len, weights)]).astype(np.int64)
    flat = np.array([r for own in runs for r in own], np.int32).reshape(-1, 2)
    marks = rng.integers(1, 2**63, len(cells), np.uint64)
    tables = (cells, flat, first, sizes, hashes, np.concatenate(weights), edges, marks)
    known = np.zeros((1 << LOG2_KNOWN, 2), np.uint64), np.zeros((1 << LOG2_KNOWN, 2))
    lower, upper, done = 0.0, 1.0, 0
    for slack in SLACKS if len(cells) > 200 else SLACKS[-1:]:
        state = np.array([done, work, 0, 0], np.int64)
        with np.errstate(over="ignore"):
            arguments = (np.arange(len(cells), dtype=np.int32), box_hashes, masks, volumes, 1.0, slack, tables, known, state)
            low, high = uncovered(*arguments) if progress.is_silent else _watched(uncovered, arguments, state, progress)
        done = int(state[WORK])
        if state[CUT] == 0 or low == high:
            return Bounds(float(high), float(high), done)
        lower, upper = max(lower, float(low) - ROUNDING), min(upper, float(high) + ROUNDING)
        if done >= work:
            break
    return Bounds(max(0.0, lower), min(1.0, upper), done)


def _watched(
    loop: Callable[..., Any], arguments: tuple[Any, ...], state: np.ndarray[tuple[int], np.dtype[np.int64]], progress: Progress
) -> Any:
    """Run the loop on a thread of its own, so that it can be told of and stopped: a limit below 0 ends it."""
    from contextdb.covering.kernels import LIMIT, WORK

    answer: list[Any] = []
    limit = max(1, int(state[LIMIT]))
    thread = Thread(target=lambda: answer.append(loop(*arguments)), daemon=True)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(POLL_S)
            progress.at(int(state[WORK]) / limit)
    finally:
        if thread.is_alive():
            state[LIMIT] = -1
            thread.join()
    return answer[0]
