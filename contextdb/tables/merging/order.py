"""The order that two sides agree on: which rows, or columns, are in a merge, and where.

The order of ours is kept. What only theirs moved goes where theirs has it, behind what is before it there; what both moved
stays where ours has it. New ones of theirs follow what is before them in theirs, after those that ours put there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.tables.changes import CameFrom
from contextdb.tables.merging.alignment import inverse, moved

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Origins:
    """For each row, or column, of a merge its place in base, ours and theirs, or -1: int64."""

    base: CameFrom
    ours: CameFrom
    theirs: CameFrom

    def __len__(self) -> int:
        return len(self.ours)


@dataclass(frozen=True, eq=False)
class Sides:
    """What became of base's rows, or columns, on two sides, and which new ones of both are the same."""

    n_base: int
    ours: CameFrom
    theirs: CameFrom
    twins: CameFrom
    """For each of theirs the new one of ours that is the same, or -1."""

    @property
    def in_ours(self) -> CameFrom:
        """For each of theirs its place in ours, or -1."""
        places = np.append(inverse(self.ours, self.n_base), -1)
        return np.where(self.theirs >= 0, places[self.theirs], self.twins)

    @property
    def gone_from_theirs(self) -> Flags:
        """Those of ours that theirs took away."""
        places = np.append(inverse(self.theirs, self.n_base), -1)
        return np.asarray((self.ours >= 0) & (places[self.ours] < 0), np.bool_)

    @property
    def gone_from_ours(self) -> Flags:
        """Those of theirs that ours took away."""
        places = np.append(inverse(self.ours, self.n_base), -1)
        return np.asarray((self.theirs >= 0) & (places[self.theirs] < 0), np.bool_)


def merged_order(sides: Sides, dropped: Flags, revived: Flags) -> Origins:
    """Put both sides into one order.

    `dropped` are those of ours that do not stay, because theirs took them away; `revived` those of theirs that come back, though
    ours took them away.
    """
    in_ours = sides.in_ours
    stays = np.append(~dropped, False)
    is_shared = (in_ours >= 0) & stays[in_ours]
    is_new = ((in_ours < 0) & (sides.theirs < 0)) | revived
    is_moved = is_shared & moved(sides.theirs) & ~np.append(moved(sides.ours), False)[in_ours]
    order = _woven(stays[:-1], in_ours, is_shared & ~is_moved, is_new | is_moved)
    theirs_of_ours = inverse(np.where(is_shared, in_ours, -1), len(dropped))
    ours = np.where(order >= 0, order, -1)
    theirs = np.where(order >= 0, np.append(theirs_of_ours, -1)[ours], -1 - order)
    ours = np.where(order >= 0, ours, np.where(is_shared[theirs], in_ours[theirs], -1) if len(in_ours) else -1)
    base = np.where(ours >= 0, np.append(sides.ours, -1)[ours], np.append(sides.theirs, -1)[theirs])
    return Origins(base, ours, theirs)


def _woven(stays: Flags, in_ours: CameFrom, is_anchor: Flags, is_placed: Flags) -> CameFrom:
    """The order of ours, as places of ours, with what theirs places between, as -1 - its place of theirs."""
    if not is_placed.any():
        return np.flatnonzero(stays)
    runs, anchor = _runs(in_ours, is_anchor, is_placed)
    taken = set(in_ours[is_placed & (in_ours >= 0)].tolist())
    order: list[int] = []
    waiting = runs.get(-1, [])
    for place in np.flatnonzero(stays).tolist():
        if place in taken:
            continue
        if place in anchor:
            order += waiting
            waiting = runs.get(place, [])
        order.append(place)
    return np.array(order + waiting, np.int64)


def _runs(in_ours: CameFrom, is_anchor: Flags, is_placed: Flags) -> tuple[dict[int, list[int]], set[int]]:
    """What theirs places behind each anchor, a place of ours (-1: the start), and all anchors."""
    runs: dict[int, list[int]] = {}
    before = np.flatnonzero(is_anchor)
    at = np.searchsorted(before, np.flatnonzero(is_placed)) - 1
    anchors = np.append(in_ours[before], -1)[at]  # at -1 is the last: the start
    for place, anchor in zip(np.flatnonzero(is_placed).tolist(), anchors.tolist(), strict=True):
        runs.setdefault(anchor, []).append(-1 - place)
    return runs, set(in_ours[before].tolist())
