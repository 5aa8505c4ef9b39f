"""Pairs of rows of two tables, found step by step: by equal keys, and in small groups by how many cells are equal."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from contextdb.tables.merging.shared import Places, Shared

LEAST_NAME_ALIKE = 0.6
"""Likeness of the names themselves, where no cell says anything."""
MOST_PAIRS = 4096
"""Pairs of rows of one group that are compared; in a larger one rows are taken in their order."""
MOST_PAIRS_IN_ALL = 400_000

Signatures = NDArray[np.uint64]
Likeness = NDArray[np.float64]
Keys = tuple[NDArray[np.integer], NDArray[np.integer]]
"""A number for each row of before, and for each of after: rows of equal numbers belong together."""
Among = tuple[NDArray[np.bool_], NDArray[np.bool_]]
"""Which rows of before and of after are meant."""


class Matching:
    """Pairs of rows found so far."""

    def __init__(self, n_before: int, n_after: int) -> None:
        self.of_before = np.full(n_before, -1, np.int64)
        self.of_after = np.full(n_after, -1, np.int64)
        self._pairs_left = MOST_PAIRS_IN_ALL

    @property
    def is_done(self) -> bool:
        """Whether every row of one side has its partner."""
        return bool((self.of_before >= 0).all() or (self.of_after >= 0).all())

    def pair(self, before: Places, after: Places) -> None:
        self.of_before[before], self.of_after[after] = after, before

    def pair_by(
        self,
        keys: Keys,
        is_unique: bool = False,
        among: Among | None = None,
    ) -> None:
        """Take free rows of equal keys together, the first with the first; `is_unique`: only keys that stand once on both sides."""
        free = [np.flatnonzero(taken < 0) for taken in (self.of_before, self.of_after)]
        if among is not None:
            free = [rows[flags[rows]] for rows, flags in zip(free, among, strict=True)]
        left, right = _equal_positions(keys[0][free[0]], keys[1][free[1]], is_unique)
        self.pair(free[0][left], free[1][right])

    def gaps(self) -> tuple[Places, Places]:
        """For each row the last row of after before it that has a partner, -1 at the start: rows of one gap have one number."""
        of_before = _last_known(self.of_before)
        return of_before, _last_known(np.where(self.of_after >= 0, np.arange(len(self.of_after)), -1))

    def pair_alike(self, keys: Keys, cells: Sequence[Shared], least: float) -> None:
        """Take free rows of one group together, the most alike first."""
        for left, right in self._groups(keys):
            for i, j in best_pairs(_likeness(left, right, cells), least):
                self.pair(left[i : i + 1], right[j : j + 1])

    def pair_alike_names(self, keys: Keys, names: Shared) -> None:
        """The same for rows without a cell that says something, by their names."""
        for left, right in self._groups(keys):
            if len(left) * len(right) > MOST_PAIRS // 16:
                continue
            texts = [[names.texts[c] for c in codes[rows].tolist()] for codes, rows in zip(names.codes, (left, right), strict=True)]
            likeness = np.array([[name_likeness(a, b) for b in texts[1]] for a in texts[0]])
            for i, j in best_pairs(likeness, LEAST_NAME_ALIKE):
                self.pair(left[i : i + 1], right[j : j + 1])

    def _groups(self, keys: Keys) -> Iterator[tuple[Places, Places]]:
        """Free rows of equal keys, group by group; groups too large to be compared are left out."""
        free = [np.flatnonzero(taken < 0) for taken in (self.of_before, self.of_after)]
        lefts, rights = (_by_key(side, rows) for side, rows in zip(keys, free, strict=True))
        for key in sorted(lefts.keys() & rights.keys()):
            n_pairs = len(lefts[key]) * len(rights[key])
            if n_pairs <= min(MOST_PAIRS, self._pairs_left):
                self._pairs_left -= n_pairs
                yield lefts[key], rights[key]


def _by_key(keys: NDArray[np.integer], rows: Places) -> dict[int, Places]:
    if not len(rows):
        return {}
    order = rows[np.argsort(keys[rows], kind="stable")]
    distinct, starts = np.unique(keys[order], return_index=True)
    return dict(zip(distinct.tolist(), np.split(order, starts[1:]), strict=True))


def _equal_positions(before: NDArray[np.integer], after: NDArray[np.integer], is_unique: bool) -> tuple[Places, Places]:
    """Positions of equal keys: the nth of before with the nth of after."""
    distinct, ids = np.unique(np.concatenate([before, after]), return_inverse=True)
    left, right = ids[: len(before)], ids[len(before) :]
    if is_unique:
        counts = [np.bincount(side, minlength=len(distinct)) for side in (left, right)]
        is_once = (counts[0] == 1) & (counts[1] == 1)
        lefts, rights = np.flatnonzero(is_once[left]), np.flatnonzero(is_once[right])
        return lefts[np.argsort(left[lefts])], rights[np.argsort(right[rights])]
    keys = [side * (len(ids) + 1) + _nth(side) for side in (left, right)]
    _, lefts, rights = np.intersect1d(keys[0], keys[1], assume_unique=True, return_indices=True)
    return lefts, rights


def _nth(ids: Places) -> Places:
    """For each id how many of the same are before it."""
    order = np.argsort(ids, kind="stable")
    ordered = ids[order]
    starts = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1])) if len(ids) else np.empty(0, np.int64)
    nth = np.empty(len(ids), np.int64)
    nth[order] = np.arange(len(ids)) - np.repeat(starts, np.diff(np.append(starts, len(ids))))
    return nth


def _last_known(rows: Places) -> Places:
    at = np.maximum.accumulate(np.where(rows >= 0, np.arange(1, len(rows) + 1), 0))
    return np.append(-1, rows)[at]


# ---- what tells rows apart


def signatures(cells: Sequence[Shared], sizes: Sequence[int]) -> tuple[Signatures, Signatures]:
    """A number for each row that is equal where all cells are; `sizes` are the rows of before and of after."""
    sides = []
    for side, n_rows in enumerate(sizes):
        hashes = np.zeros(n_rows, np.uint64)
        for shared in cells:
            hashes = mixed(hashes, shared.codes[side])
        sides.append(hashes)
    return sides[0], sides[1]


def mixed(signature: Signatures, more: NDArray[np.integer]) -> Signatures:
    """Numbers that are equal where both are."""
    mix = (signature ^ (more.astype(np.uint64) + np.uint64(1))) * np.uint64(0x9E3779B97F4A7C15)
    return mix ^ (mix >> np.uint64(29))


def with_neighbours(names: Sequence[Places], whole: tuple[Signatures, Signatures]) -> Iterator[Keys]:
    """Keys of rows that are the same, from those that are between the same rows to those that are anywhere."""
    same = [mixed(w, n) for w, n in zip(whole, names, strict=True)]
    earlier = [np.append(-1, n)[: len(n)] for n in names]
    later = [np.append(n, -1)[1:] for n in names]
    between = [mixed(mixed(s, e), n) for s, e, n in zip(same, earlier, later, strict=True)]
    behind = [mixed(s, e) for s, e in zip(same, earlier, strict=True)]
    before = [mixed(s, n) for s, n in zip(same, later, strict=True)]
    for keys in (between, behind, before, same):
        yield keys[0], keys[1]


def says_something(cells: Sequence[Shared]) -> Among:
    """Whether any cell of each row is no Any; at least one column is given."""
    sides = [np.logical_or.reduce([~c.is_any[c.codes[side]] for c in cells]) for side in (0, 1)]
    return sides[0], sides[1]


def _likeness(left: Places, right: Places, cells: Sequence[Shared]) -> Likeness:
    """The share of equal cells among those that say something in either row: float64 [left, right], 0 where none does."""
    equal, specified = np.zeros((len(left), len(right))), np.zeros((len(left), len(right)))
    for shared in cells:
        before, after = shared.codes[0][left][:, None], shared.codes[1][right][None, :]
        counts = ~(shared.is_any[before] & shared.is_any[after])
        equal += counts & (before == after)
        specified += counts
    return equal / np.maximum(specified, 1)


def best_pairs(likeness: Likeness, least: float) -> Iterator[tuple[int, int]]:
    """Pairs of rows, the most alike first; each row once."""
    free = [np.ones(n, np.bool_) for n in likeness.shape]
    order = np.argsort(-likeness, axis=None, kind="stable")
    for i, j in zip(*(part.tolist() for part in np.unravel_index(order, likeness.shape)), strict=True):
        if likeness[i, j] < least:
            return
        if free[0][i] and free[1][j]:
            free[0][i] = free[1][j] = False
            yield i, j


def name_likeness(one: str, other: str) -> float:
    """How alike two names are, 0 to 1."""
    return difflib.SequenceMatcher(None, one.casefold()[:100], other.casefold()[:100], autojunk=False).ratio()
