"""Parts of a count by numpy, for where numba is not installed: the same arrays as `part_kernels.part_of` gives, bit for bit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.covering.kernels import ALL

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
        sizes.append(_summed(accepted[:, ordered], shares))
        own_hashes = hashes[known[ordered]]
        marks.append(np.stack([_mixed(own_hashes[:, 0] ^ salts[factor]), _mixed(own_hashes[:, 1] + salts[factor])], axis=1))
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
        _joined(marks, np.zeros((0, 2), np.uint64)),
        boxes,
    )


def _joined(parts: list[Array], nothing: Array) -> Array:
    return np.concatenate(parts) if parts else nothing


def _groups(known: Array, weights: Array, table: Part) -> tuple[Array, Array]:
    """For each group of classes that the cells cannot distinguish which cells accept it, bool [G, cells], and its share."""
    _, runs, first, _, _ = table
    turns = np.zeros((len(weights) + 1, len(known)), np.int8)
    has_cell = np.flatnonzero(known >= 0)
    begin, end = first[known[has_cell]], first[known[has_cell] + 1]
    n_runs = end - begin
    column = np.repeat(has_cell, n_runs)
    run = np.arange(n_runs.sum()) + np.repeat(begin - (np.cumsum(n_runs) - n_runs), n_runs)
    turns[runs[run, 0], column] += 1
    turns[runs[run, 1], column] -= 1
    turns[0, known < 0] = 1
    accepted = np.cumsum(turns[:-1], axis=0, dtype=np.int8)[weights != 0.0] != 0
    own = weights[weights != 0.0].tolist()
    place: dict[bytes, int] = {}
    packed = np.packbits(accepted, axis=1)
    group = [place.setdefault(row.tobytes(), len(place)) for row in packed]
    shares = [0.0] * len(place)
    for g, weight in zip(group, own, strict=True):
        shares[g] += weight
    total = 0.0
    for weight in own:
        total += weight
    _, chosen = np.unique(group, return_index=True)
    return accepted[chosen], np.array(shares) / total if total else np.array(shares)


def _in_order_of_appearance(code: Array, is_limited: Array) -> Array:
    """A number for each cell that limits its box, in the order of the boxes; -1 for the others."""
    numbers = np.full(len(is_limited), -1, np.int64)
    _, first = np.unique(code, return_index=True)
    ordered = np.argsort(first, kind="stable")
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
    """The share of each cell, summed in the order of the groups."""
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
