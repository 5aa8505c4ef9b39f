"""Which rows and columns of one table are which of another.

Rows are known by their asset. Where several have one name the most alike are taken together: rows that are the same and stand
between the same rows first, then by how many cells are equal. A row whose name is gone is the one with a new name when its cells
say so: the same cells nowhere else, or in the same gap between known rows at least half of what either says. Columns are known by
their names, a renamed one by its cells. Near-linear in rows: only what is left in one gap is compared pair by pair, on a budget.
"""

from __future__ import annotations

import difflib
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.tables.changes import CameFrom
from contextdb.tables.data import TableData
from contextdb.tables.merging.conflicts import Places, Shared

LEAST_ALIKE = 0.5
"""Share of the cells that say something, in either row or column, that must be equal for a rename."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """For each row and column of a table the one it was before, or -1 for a new one: int64 [n_rows] and [n_columns]."""

    rows: CameFrom
    columns: CameFrom


def align(before: TableData, after: TableData) -> Alignment:
    """Find what became of each row and column."""
    names = {c.name: at for at, c in enumerate(before.columns)}
    by_name = [names.get(c.name, -1) for c in after.columns]
    pairs = [(b, a) for a, b in enumerate(by_name) if b >= 0]
    cells = {(b, a): Shared.of((before.columns[b], after.columns[a])) for b, a in pairs}
    rows = _align_rows(before, after, cells)
    return Alignment(rows, _align_columns(before, after, rows, np.array(by_name, np.int64)))


def inverse(came_from: CameFrom, n_before: int) -> CameFrom:
    """Where each of before is now, -1 where it is gone; each is taken once at most."""
    places = np.full(n_before, -1, np.int64)
    retained = np.flatnonzero(came_from >= 0)
    places[came_from[retained]] = retained
    return places


def moved(came_from: CameFrom) -> NDArray[np.bool_]:
    """Which rows changed their order: all known ones but the most that still are in the order of before: bool [n_rows]."""
    known = np.flatnonzero(came_from >= 0)
    flags = np.zeros(len(came_from), np.bool_)
    places = came_from[known]
    if len(known) < 2 or bool((places[1:] > places[:-1]).all()):
        return flags
    flags[known] = True
    flags[known[_longest_increasing(places.tolist())]] = False
    return flags


def _longest_increasing(places: list[int]) -> list[int]:
    """The positions of a longest increasing run of numbers, patience sorting."""
    tops: list[int] = []
    top_at: list[int] = []
    below = [-1] * len(places)
    for at, place in enumerate(places):
        pile = bisect_left(tops, place)
        below[at] = top_at[pile - 1] if pile else -1
        if pile == len(tops):
            tops.append(place)
            top_at.append(at)
        else:
            tops[pile], top_at[pile] = place, at
    chain, at = [], top_at[-1]
    while at >= 0:
        chain.append(at)
        at = below[at]
    return chain[::-1]


# ---- rows


def _align_rows(before: TableData, after: TableData, by_place: Mapping[tuple[int, int], Shared]) -> CameFrom:
    names = Shared.of((before.text_column(before.asset_column), after.text_column(after.asset_column)))
    if np.array_equal(names.codes[0], names.codes[1]) and len(np.unique(names.codes[0])) == before.n_rows:
        return np.arange(before.n_rows)
    matching = Matching(before.n_rows, after.n_rows)
    matching.pair_by(names.pair, is_unique=True)
    if matching.is_done:
        return matching.of_after
    cells = list(by_place.values())
    whole = signatures(cells, (before.n_rows, after.n_rows))
    for keys in with_neighbours(names.pair, whole):
        matching.pair_by(keys)
    matching.pair_alike(names.pair, cells, least=0.0)
    matching.pair_by(names.pair)
    assets = _asset_place(before), _asset_place(after)
    _pair_renamed(matching, names, [shared for (b, a), shared in by_place.items() if b != assets[0] and a != assets[1]])
    return matching.of_after


def _pair_renamed(matching: Matching, names: Shared, others: Sequence[Shared]) -> None:
    """Take rows together whose names are gone; `others` are the columns that name no asset."""
    if matching.is_done:
        return
    if others:
        specified, rest = says_something(others), signatures(others, [len(codes) for codes in names.codes])
        matching.pair_by(rest, is_unique=True, among=specified)
        gaps = matching.gaps()
        matching.pair_by((mixed(rest[0], gaps[0]), mixed(rest[1], gaps[1])), among=specified)
    gaps = matching.gaps()
    matching.pair_alike(gaps, others, LEAST_ALIKE)
    matching.pair_alike_names(gaps, names)


# ---- two sides of a merge


def row_twins(ours: TableData, theirs: TableData, new_ours: Places, new_theirs: Places) -> CameFrom:
    """For each row of theirs the row of ours that both sides inserted: of the same asset, or without one the same in every cell."""
    twins = np.full(theirs.n_rows, -1, np.int64)
    if not len(new_ours) or not len(new_theirs):
        return twins
    matching = Matching(ours.n_rows, theirs.n_rows)
    is_new = [np.isin(np.arange(n), new) for n, new in ((ours.n_rows, new_ours), (theirs.n_rows, new_theirs))]
    places = {c.name: at for at, c in enumerate(ours.columns)}
    pairs = [(places[c.name], at) for at, c in enumerate(theirs.columns) if c.name in places]
    names = Shared.of((ours.text_column(ours.asset_column), theirs.text_column(theirs.asset_column)))
    whole = signatures([Shared.of((ours.columns[o], theirs.columns[t])) for o, t in pairs] or [names], (ours.n_rows, theirs.n_rows))
    same = mixed(whole[0], names.codes[0]), mixed(whole[1], names.codes[1])
    matching.pair_by(same, among=(is_new[0], is_new[1]))
    is_named = [new & ~names.is_any[codes] for new, codes in zip(is_new, names.codes, strict=True)]
    matching.pair_by(names.pair, among=(is_named[0], is_named[1]))
    return matching.of_after


# ---- columns


def _align_columns(before: TableData, after: TableData, rows: CameFrom, by_name: CameFrom) -> CameFrom:
    pairs = by_name.copy()
    assets = _asset_place(before), _asset_place(after)
    if pairs[assets[1]] < 0 and assets[0] not in pairs:
        pairs[assets[1]] = assets[0]
    new = np.flatnonzero(pairs < 0)
    gone = np.setdiff1d(np.arange(len(before.columns)), pairs)
    if len(new) and len(gone) and len(new) * len(gone) <= MOST_PAIRS:
        retained = np.flatnonzero(rows >= 0)
        likeness = np.array(
            [[_column_likeness(before, after, b, a, rows[retained], retained) for a in new.tolist()] for b in gone.tolist()]
        )
        for i, j in best_pairs(likeness, LEAST_ALIKE):
            pairs[new[j]] = gone[i]
    return pairs


def _column_likeness(before: TableData, after: TableData, b: int, a: int, rows_before: Places, rows_after: Places) -> float:
    shared = Shared.of((before.columns[b], after.columns[a]))
    old, now = shared.at(0, rows_before), shared.at(1, rows_after)
    specified = ~(shared.is_any[old] & shared.is_any[now])
    if specified.any():
        return float((old == now)[specified].mean())
    likeness = name_likeness(before.columns[b].name, after.columns[a].name)
    return likeness if likeness >= LEAST_NAME_ALIKE else 0.0


def _asset_place(table: TableData) -> int:
    return [c.name for c in table.columns].index(table.asset_column)


# ---- pairs of rows of two tables, found step by step: by equal keys, and in small groups by how many cells are equal


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
