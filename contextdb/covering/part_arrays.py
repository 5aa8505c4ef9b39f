"""Parts of a count by numpy, for where numba is not installed: the same arrays as `part_kernels.part_of` gives, bit for bit."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.covering.kernels import ALL

MOST_KEPT = 4096
"""Parts of a count have many factors in common: the groups of so many are kept."""

Array = NDArray[Any]
Part = tuple[Array, ...]


def part_of(boxes: Array, factors: Array, weights: Array, salts: Array, table: Part) -> Part:
    """The part of some boxes over some factors; see `part_kernels`."""
    cells, _, _, hashes, edges = table
    n_words = (len(boxes) + 63) >> 6
    free: list[int] = []
    starts = [0]
    limits, groups, masses, sides, wider, sizes, marks = ([] for _ in range(7))
    n_sides = 0
    own_cells = cells[boxes][:, factors]
    for x in np.flatnonzero((own_cells >= 0).any(axis=0)).tolist():
        factor, own = int(factors[x]), own_cells[:, x]
        known, code = np.unique(own, return_inverse=True)
        accepted, shares = _groups(known, weights[edges[factor] : edges[factor + 1]], table)
        is_limited: Array = np.asarray(~accepted.all(axis=0))
        if not is_limited.any():
            continue
        held = bitmask.pack(accepted[:, code])
        numbers = _in_order_of_appearance(code, is_limited)
        free.append(factor)
        starts.append(starts[-1] + len(held))
        limits.append(bitmask.pack(is_limited[code]))
        groups.append(held)
        masses.append(shares)
        ordered = np.argsort(numbers, kind="stable")[(~is_limited).sum() :]
        sides.append(np.where(is_limited[code], numbers[code] + n_sides, -1).astype(np.int32))
        wider.append(_held_by_all(accepted[:, ordered], held))
        sizes.append(_summed(accepted[:, ordered], shares) / np.cumsum(shares)[-1])
        own_hashes = hashes[known[ordered]]
        marks.append(np.stack([own_hashes[:, 0] ^ salts[factor], own_hashes[:, 1] + salts[factor]], axis=1))
        n_sides += len(ordered)
    return (
        np.array(free, np.int64),
        np.array(limits, np.uint64).reshape(-1, n_words),
        _joined(groups, np.zeros((0, n_words), np.uint64)),
        _joined(masses, np.zeros(0)),
        np.array(starts, np.int64),
        np.array(sides, np.int32).reshape(-1, len(boxes)),
        _joined(wider, np.zeros((0, n_words), np.uint64)),
        _joined(sizes, np.zeros(0)),
        _mixed(_joined(marks, np.zeros((0, 2), np.uint64))),
        boxes,
    )


def _joined(parts: list[Array], nothing: Array) -> Array:
    return np.concatenate(parts) if parts else nothing


def _groups(known: Array, weights: Array, table: Part) -> tuple[Array, Array]:
    """For each group of classes that the cells cannot distinguish which cells accept it, bool [G, cells], and what it weighs."""
    _, runs, first, _, _ = table
    has_any = bool(known[0] < 0)
    limited = known[int(has_any) :]
    begin, end = first[limited], first[limited + 1]
    n_runs = end - begin
    own_runs = runs[np.arange(n_runs.sum()) + np.repeat(begin - (np.cumsum(n_runs) - n_runs), n_runs)]
    return _groups_of(own_runs.astype(np.int64).tobytes(), n_runs.astype(np.int64).tobytes(), has_any, weights.tobytes())


@lru_cache(MOST_KEPT)
def _groups_of(own_runs: bytes, own_counts: bytes, has_any: bool, own_weights: bytes) -> tuple[Array, Array]:
    """The same from the runs of each cell, as bytes: int64 [runs, 2], and how many each has, int64 [cells]. Before them comes, with
    `has_any`, a cell that accepts everything."""
    runs, n_runs = np.frombuffer(own_runs, np.int64).reshape(-1, 2), np.frombuffer(own_counts, np.int64)
    weights = np.frombuffer(own_weights, np.float64)
    turns = np.zeros((len(weights) + 1, len(n_runs) + has_any), np.int8)
    column = np.repeat(np.arange(len(n_runs)) + has_any, n_runs)
    turns[runs[:, 0], column] += 1
    turns[runs[:, 1], column] -= 1
    turns[0, : int(has_any)] = 1
    accepted = np.cumsum(turns[:-1], axis=0, dtype=np.int8)[weights != 0.0] != 0
    own = weights[weights != 0.0]
    if not len(own):
        return accepted, own
    packed = np.packbits(accepted, axis=1)
    is_head = np.ones(len(packed), np.bool_)  # of a run of classes that the same cells accept
    is_head[1:] = (packed[1:] != packed[:-1]).any(axis=1)
    heads = np.flatnonzero(is_head)
    place: dict[bytes, int] = {}
    group_of_run = np.array([place.setdefault(row.tobytes(), len(place)) for row in packed[heads]])
    shares = np.bincount(group_of_run[np.cumsum(is_head) - 1], own)
    chosen = heads[_first_places(group_of_run, len(place))]
    return bitmask.read_only(accepted[chosen]), bitmask.read_only(shares)


def _first_places(numbers: Array, n: int) -> Array:
    """Where each of the numbers 0 … n - 1 comes first; all of them come."""
    first = np.empty(n, np.int64)
    first[numbers[::-1]] = np.arange(len(numbers) - 1, -1, -1)
    return first


def _in_order_of_appearance(code: Array, is_limited: Array) -> Array:
    """A number for each cell that limits its box, in the order of the boxes; -1 for the others."""
    numbers = np.full(len(is_limited), -1, np.int64)
    ordered = np.argsort(_first_places(code, len(is_limited)), kind="stable")
    kept = ordered[is_limited[ordered]]
    numbers[kept] = np.arange(len(kept))
    return numbers


def _held_by_all(accepted: Array, groups: Array) -> Array:
    """For each cell the boxes that hold every group that it accepts."""
    found = np.full((accepted.shape[1], groups.shape[1]), ALL, np.uint64)
    for flags, group in zip(accepted, groups, strict=True):
        found[flags] &= group
    return found


def _summed(accepted: Array, shares: Array) -> Array:
    """What each cell weighs, summed in the order of the groups."""
    found = np.zeros(accepted.shape[1])
    for flags, share in zip(accepted, shares.tolist(), strict=True):
        found[flags] += share
    return found


def _mixed(x: Array) -> Array:
    """As `kernels.mixed`, for many numbers."""
    shift = np.uint64(33)
    x = (x ^ (x >> shift)) * np.uint64(0xFF51AFD7ED558CCD)
    x = (x ^ (x >> shift)) * np.uint64(0xC4CEB9FE1A85EC53)
    return np.asarray(x ^ (x >> shift))


def first_holders(part: Part, alike: Array, found: Array, start: int, stop: int) -> None:
    """Write for boxes from `start` to `stop` the first one that holds each whole and is not like it; see `search_kernels`."""
    limits, sides, wider, n_boxes = part[1], part[5], part[6], len(part[9])
    around = np.repeat(bitmask.full(n_boxes)[None], stop - start, axis=0)
    for factor in range(len(limits)):
        side = sides[factor, start:stop]
        around &= np.where((side < 0)[:, None], ~limits[factor], wider[side])
    for box, others in enumerate(around, start):
        holders = bitmask.rows(others)
        unlike = holders[alike[holders] != alike[box]]
        found[box] = unlike[0] if len(unlike) else -1
