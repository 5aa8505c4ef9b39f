"""Why a picker picked a row, in a few words."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from contextdb import bitmask
from contextdb.bitmask import Words
from contextdb.compiled.choosing import Choosing, Ranked
from contextdb.compiled.matches import Matches, layered_penalties
from contextdb.compiled.pick import percent
from contextdb.schema.policies import POLICIES, rank_columns


@dataclass(frozen=True, eq=False)
class Left:
    """What was left of the valid rows, step by step. Rows ascend."""

    choosing: Choosing
    matches: Matches
    stages: Words
    """Masks of those that did not rest, of these that the policies may pick, of these that were picked least lately: uint64 [3,
    W]."""

    @cached_property
    def awake(self) -> list[int]:
        """Those that did not rest."""
        return _rows(self.stages[0])

    @cached_property
    def may(self) -> list[int]:
        """Of these those that the policies may pick."""
        return _rows(self.stages[1])

    @cached_property
    def fresh(self) -> list[int]:
        """Of these those that were picked least lately: chance decided between them."""
        return _rows(self.stages[2])


def _rows(mask: Words) -> list[int]:
    rows: list[int] = bitmask.rows(mask).tolist()
    return rows


def why(left: Left, row: int | None) -> str:
    """Why a row was picked: "chance 40 % of 3", "highest priority 5", "first valid row", "fallback: no row is valid"."""
    if row is None:
        played = left.choosing.compiled.fallback is not None
        return f"{'fallback: ' if played else ''}{_none_left(left)}"
    phrases = [*_preferences(left, row)]
    n_left_out = len(left.may) - len(left.fresh)
    if len(left.fresh) > 1:
        chance = float(left.choosing.chances(np.array(left.fresh, np.int64))[left.fresh.index(row)])
        phrases.append(f"chance {percent(chance)} of {len(left.fresh)}")
    elif n_left_out:
        phrases.append("picked least lately")
    if not phrases:
        rest = " that does not rest" if len(left.awake) == 1 else " that can be picked"
        phrases.append(f"only valid row{rest if len(left.matches) > 1 else ''}")
    return ", ".join(phrases)


def _none_left(left: Left) -> str:
    n_valid = len(left.matches)
    if not n_valid:
        return "no row is valid"
    if len(left.awake) == n_valid:
        return "every valid row has weight 0"
    return "every valid row rests" if not left.awake else "every valid row rests or has weight 0"


def _preferences(left: Left, row: int) -> list[str]:
    """What the policy of each depth, where it had a choice, went by."""
    choosing = left.choosing
    group = np.array([r for r in left.awake if choosing.pickable[r]], np.int64)
    may = np.array(left.may, np.int64)
    phrases = []
    for depth, taken in enumerate(choosing.taken):
        table = choosing.table_at(row, depth)
        if table is None:
            break
        rows, best = np.unique(taken[group]), np.unique(taken[may])
        if len(best) < len(rows):
            words = _preference(table, int(taken[row]), rows, left, row, depth)
            phrases.append(words if depth == 0 else f"{words} of {table.name}")
        group, may = group[taken[group] == taken[row]], may[taken[may] == taken[row]]
    return phrases


def _preference(table: Ranked, own: int, rows: np.ndarray[tuple[int], np.dtype[np.int64]], left: Left, row: int, depth: int) -> str:
    words = ""
    for key, values in rank_columns(table.policy, table.priorities, table.picking.specificities):
        if not words or (values[rows] < values[own]).any():
            words = key.won.format(values[own])
        rows = rows[values[rows] == values[own]]
    if POLICIES[table.policy].by_cost and len(rows) > 1 and left.matches.has_penalties:
        return f"least penalty {layered_penalties(left.matches)[depth, row]:g}"
    return words
