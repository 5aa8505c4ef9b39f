"""Which rows and columns of one table are which of another.

Rows are known by their asset. Where several have one name the most alike are taken together: rows that are the same and stand
between the same rows first, then by how many cells are equal. A row whose name is gone is the one with a new name when its cells
say so: the same cells nowhere else, or in the same gap between known rows at least half of what either says. Columns are known by
their names, a renamed one by its cells. Near-linear in rows: only what is left in one gap is compared pair by pair, on a budget.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.tables.changes import CameFrom
from contextdb.tables.data import TableData
from contextdb.tables.merging.matching import (
    LEAST_NAME_ALIKE,
    MOST_PAIRS,
    Matching,
    best_pairs,
    mixed,
    name_likeness,
    says_something,
    signatures,
    with_neighbours,
)
from contextdb.tables.merging.shared import Places, Shared

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
