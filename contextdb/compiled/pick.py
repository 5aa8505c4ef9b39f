"""Pick one asset out of the valid ones, by the table's policy.

    first               the first valid row of the file
    unique              the only valid row; two at once break the table's promise and raise PolicyError
    collect, priority   of the rows with the highest priority one at random, by row weight, and not the asset picked last
    specific            the same, between those of the highest priority that are the most specific: with the most cells that are
                        neither Any nor soft, each counting the `weight` of its condition
    cheapest            the same, between those of the highest priority whose soft cells cost least

Rows of weight 0 are never picked, and never prevent another row from being picked. When no row is left, the answer is the table's
fallback.

A row that refers to a table is one candidate, with its own priority and weight, as long as that table has a row to give; which of
its rows is played is then picked by that table's own policy, priorities and weights. Its fallback is not asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, Words
from contextdb.compiled.choosing import Choosing, Ranked
from contextdb.compiled.data import CompiledData
from contextdb.compiled.matches import Matches, layered_penalties
from contextdb.compiled.memory import Rng
from contextdb.errors import ContextError, Fault, PolicyError
from contextdb.schema.policies import POLICIES, rank_columns

Costs = NDArray[np.float64]
"""What the soft cells of each depth cost: [D, n]."""


def pick(compiled: CompiledData, matches: Matches, rng: Rng | int | None = None, last: str | None = None) -> str | None:
    """One asset of the valid rows.

    Parameters
    ----------
    matches : Matches
        An answer of this table in this version.
    rng : random.Random, numpy.random.Generator or int, optional
        Where chance comes from; one generator a character, so that each has its own memory. A number seeds a new one, which
        remembers nothing: the same number, the same pick. Default: the table's own. All who give none are one character to it: two
        that ask in turn where two assets are valid get one each, again and again.
    last : str, optional
        The asset not to repeat, with its path where it has one; "" for none. Default: what this generator picked last in this
        table.

    Returns
    -------
    str or None
        The asset; the table's fallback when no row is valid, None when it has none.

    Raises
    ------
    ContextError
        The answer is of another table, or of another version of it, which is named; `rng` or `last` is none.
    PolicyError
        The policy is "unique" and several rows are valid.

    Notes
    -----
    What a generator picked last is remembered next to this table, by the identity of the generator, and goes over to the next
    version of a watched table. It is neither in the generator's state nor in a pickle: a generator that was copied or came out of a
    pickle has picked nothing yet, and one that was set back (`setstate`) still knows its later pick. Where a replay or a rollback
    must pick the same again, keep the asset next to the state of the generator and give it as `last`: the pick then depends on the
    answer, that state and `last` alone.
    """
    row = pick_row(compiled, matches, rng, last)
    asset = compiled.fallback if row is None else compiled.assets[row]
    if (watcher := compiled._watcher) is not None and watcher.feed.is_open:
        watcher.picked(matches, row, asset)
    return asset


def pick_row(compiled: CompiledData, matches: Matches, rng: Rng | int | None = None, last: str | None = None) -> int | None:
    """The row that `pick` picks; None where it gives the fallback."""
    compiled.answering.require_own(matches)
    source = compiled.memory.rng(rng)
    if last is not None and not isinstance(last, str):
        raise ContextError(Fault(f"last is of type {type(last).__name__}.", "the name of an asset, or None"))
    if not matches:
        return None
    choosing, memory = compiled.once(Choosing.of), compiled.memory
    possible = choosing.candidates(matches)
    if not choosing.remembers or not len(possible):
        return int(possible[0]) if len(possible) else None
    with memory.lock:
        last = memory.last(source) if last is None else last
        fresh = [r for r in possible.tolist() if compiled.assets[r] != last]
        row = _drawn(choosing, np.array(fresh) if 0 < len(fresh) < len(possible) else possible, source)
        memory.remember(source, compiled.assets[row])
    return row


def _drawn(choosing: Choosing, rows: Rows, source: Rng) -> int:
    """One of the rows that may be picked: at each depth by the weights of that table's rows."""
    last = len(choosing.taken) - 1
    for depth, weights in enumerate(choosing.weights):
        table = choosing.table_at(int(rows[0]), depth)
        if table is None or POLICIES[table.policy].choose != "chance":
            continue
        firsts = rows if depth == last else rows[np.unique(choosing.taken[depth, rows], return_index=True)[1]]
        shares = weights[firsts]
        sums = np.cumsum(shares / shares.max())
        picked = firsts[min(int(sums.searchsorted(source.random() * sums[-1], "right")), len(sums) - 1)]
        if depth == last:
            return int(picked)
        rows = rows[choosing.taken[depth, rows] == choosing.taken[depth, picked]]
    return int(rows[0])


# ---- what a pick may give, and why not the others


class Outcome:
    """What the policy makes of some valid rows: which of them `pick` may give, how often, and why it passes over the others.

    A chance is that of a character that has picked nothing yet; what it picked last is left out of its next pick.
    """

    def __init__(self, compiled: CompiledData, matches: Matches) -> None:
        """Raises ContextError where the answer is of another table, or of another version of it."""
        compiled.answering.require_own(matches)
        self.compiled, self._choosing = compiled, compiled.once(Choosing.of)
        self._matches = matches
        self.rows = matches.indices
        self.refusal: PolicyError | None = None
        """Why `pick` refuses: the policy is "unique", here or in a table inside, and several rows are valid."""
        self.candidates: Rows = self.rows[:0]
        """The rows that may be picked, ascending: int64 [count]."""
        try:
            self.candidates = self._choosing.candidates(matches)
        except PolicyError as error:
            self.refusal = error

    @cached_property
    def chances(self) -> dict[int, float]:
        """The chance of each of `candidates`, 0...1."""
        return dict(zip(self.candidates.tolist(), self._shares.tolist(), strict=True))

    @cached_property
    def _shares(self) -> NDArray[np.float64]:
        return self._choosing.chances(self.candidates)

    @property
    def prefers_some(self) -> bool:
        """Whether the valid rows are not all picked alike."""
        shares = self._shares
        return len(self.candidates) < len(self.rows) or bool(len(shares) and shares.min() < shares.max())

    def picks_one_of(self, rows: Iterable[int]) -> bool:
        """Whether one of some rows may be picked."""
        return any(self._place(row) is not None for row in rows)

    def chance(self, rows: Iterable[int]) -> float:
        """The chance that one of some rows is picked, 0...1; 0 for rows that are not valid."""
        places = [place for row in rows if (place := self._place(row)) is not None]
        return min(sum(float(self._shares[place]) for place in places), 1.0)

    def _place(self, row: int) -> int | None:
        """Where a row stands among the candidates."""
        at = int(np.searchsorted(self.candidates, row))
        return at if at < len(self.candidates) and self.candidates[at] == row else None

    def said_of(self, rows: Sequence[int]) -> str:
        """How valid rows that are one row of a table, one or those behind it, stand: "picked", "picked, chance 40 %",
        "outranked by B (priority 5)"."""
        if self.picks_one_of(rows):
            chance = self.chance(rows)
            return "picked" if chance >= 1.0 else f"picked, chance {percent(chance)}"
        return self.why_not(rows[0])

    def why_not(self, row: int) -> str:
        """Why a valid row is not picked."""
        if self.refusal is not None:
            return f"none is picked: {self.refusal.faults[0].found.rstrip('.')}"
        choosing, steps = self._choosing, self.compiled.way(row)
        if not choosing.pickable[row]:
            lost = steps[int(np.argmin(choosing.weights[:, row] > 0.0))]
            return f"weight 0{f' of {lost.asset}' if len(steps) > 1 else ''}: never picked"
        rivals = self.candidates
        for depth, taken in enumerate(choosing.taken[: len(steps)]):
            if not (taken[rivals] == taken[row]).any():
                return self._outranked(row, rivals, depth)
            rivals = rivals[taken[rivals] == taken[row]]
        raise AssertionError("the row can be picked")

    def _outranked(self, row: int, rivals: Rows, depth: int) -> str:
        """Who is preferred to a row where its way parts from theirs."""
        first, taken = int(rivals[0]), self._choosing.taken[depth]
        table, n_winners = self._choosing.table_at(row, depth), len(np.unique(taken[rivals]))
        assert table is not None
        why = preferred(table, int(taken[first]), int(taken[row]), first, None if self._costs is None else self._costs[depth])
        more = f" and {n_winners - 1:,} more" if n_winners > 1 else ""
        return f"outranked by {self.compiled.way(first)[depth].asset}{more} ({why})"

    @cached_property
    def _costs(self) -> Costs | None:
        wants_costs = any(POLICIES[policy].by_cost for policy in self.compiled.policies) and self._matches.has_penalties
        return layered_penalties(self._matches) if wants_costs else None


def percent(share: float) -> str:
    """A share as a whole percentage; one that is neither 0 nor 1 never rounds to them."""
    return "<1 %" if share < 0.01 else ">99 %" if share > 0.99 else f"{100.0 * share:.0f} %"


def preferred(table: Ranked, winner: int, other: int, flat: int, costs: NDArray[np.float64] | None) -> str:
    """Why a row of a table is preferred to another; `flat` is a row of the flat table behind it, for `costs` [n]."""
    words = ""
    for key, values in rank_columns(table.policy, table.priorities, table.picking.specificities):
        words = key.winning.format(values[winner])
        if values[winner] != values[other]:
            return words
    return f"penalty {0.0 if costs is None else costs[flat]:g}" if POLICIES[table.policy].by_cost else words


# ---- why a picker picked a row, in a few words


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
