"""A picker: picks of one character or of many, which it remembers.

It holds a seed and what was picked, by the names of assets and not by rows; of the table it holds the name alone. So it is small in
a pickle, and goes on with any version of its table. Each character has its own memory and its own chance, which depends on the
seed, on the character's number and on how often it has picked: characters that are asked together get what each would get alone.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, read_only
from contextdb.cells.arguments import require_kind, require_real, require_whole
from contextdb.compiled.batch_costs import CostsOfPairs
from contextdb.compiled.casting.stage import CastMatches
from contextdb.compiled.chance import uniform, uniforms
from contextdb.compiled.choosing import Choosing, highest, starts_of
from contextdb.compiled.choosing_masks import EvenChoosing
from contextdb.compiled.data import CompiledData
from contextdb.compiled.many import ManyMatches
from contextdb.compiled.matches import Matches, answering_of, layered_penalties
from contextdb.compiled.pick import not_unique
from contextdb.compiled.picked import Picked
from contextdb.compiled.why_picked import Left, why
from contextdb.errors import ContextError, Fault, in_quotes, plural
from contextdb.schema.shapes import CHANCE

MOST_PAIRS = 1 << 20
"""So many rows of many answers are looked at together."""
MOST_MEMORY = 1000
MOST_S = 1e15
"""The latest time of a game, in seconds; the time of the day since 1970 is among them."""


@dataclass(frozen=True)
class Pick:
    """What was picked. False when there is no asset.

    Attributes
    ----------
    row : int or None
        The row of the table; None where no row could be picked, and the asset is the fallback.
    asset : str or None
        The asset, with its path where tables are inside tables; the table's fallback, or None.
    casting : mapping of str to actor
        Who plays which role; empty for an answer without actors.
    outputs : mapping of str to value
        The outputs of the row, or those of the fallback.
    why : str
        Why this row, in a few words: "chance 40 % of 3".
    """

    row: int | None
    asset: str | None
    _left: Left | None = field(repr=False, compare=False)
    """What the rest is worked out from when it is asked for; None out of a pickle, which holds all of it."""

    @cached_property
    def casting(self) -> Mapping[str, Mapping[str, Any]]:
        """Who plays which role."""
        matches = None if self._left is None else self._left.matches
        return matches.casting(self.row) if self.row is not None and isinstance(matches, CastMatches) else {}

    @cached_property
    def outputs(self) -> Mapping[str, Any]:
        """The outputs of the row, or those of the fallback."""
        if self._left is None:
            return {}
        outputs = self._left.choosing.compiled.outputs
        return outputs.fallback if self.row is None else outputs.of_row(self.row)

    @cached_property
    def why(self) -> str:
        """Why this row, in a few words."""
        return "" if self._left is None else why(self._left, self.row)

    def __bool__(self) -> bool:
        return self.asset is not None

    def __repr__(self) -> str:
        return f"<Pick: {self.asset if self.row is None else f'row {self.row}, {self.asset}'}; {self.why}>"

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: what it tells, without the answer that it was picked from."""
        told = {name: getattr(self, name) for name in ("row", "asset", "casting", "outputs", "why")}
        return told | {"_left": None}


@dataclass(frozen=True, eq=False)
class _Known:
    """A version of the table, as a picker knows it: its assets and rows under the picker's numbers."""

    choosing: Choosing
    assets: Rows
    """The number of each row's asset: int64 [n]."""
    limits: Rows
    """The column of each row that rests: int64 [L]."""
    even: EvenChoosing | None
    """What decides on masks; None where pairs of contexts and rows are to."""

    @cached_property
    def asset_list(self) -> list[int]:
        """The same, for one context at a time."""
        numbers: list[int] = self.assets.tolist()
        return numbers


class Picker:
    """Picks for one character or for many, by the table's policy. Get one from `CompiledTable.picker()`.

    It is the caller's own, for one thread at a time. It can be pickled and copied: the copy goes on alone, with the same picks. It
    takes the answers of any version of its table; assets and rows that the next version has too stay known.
    """

    def __init__(self, table: str, seed: int = 0, memory: int = 1) -> None:
        self._table = table
        self._seed = require_whole(seed, "seed")
        self._memory = require_whole(memory, "memory")
        if not 0 <= self._memory <= MOST_MEMORY:
            raise ContextError(Fault(f"memory is {self._memory}.", f"a number of picks, from 0 to {MOST_MEMORY}"))
        self._picked = Picked(self._memory)
        self._known: _Known | None = None

    @property
    def table(self) -> str:
        """The name of the table."""
        return self._table

    @property
    def seed(self) -> int:
        """The same seed gives the same picks."""
        return self._seed

    @property
    def memory(self) -> int:
        """How many of the last assets are not picked again while there is another choice."""
        return self._memory

    def pick(self, matches: Matches, *, time_s: float | None = None, who: int = 0) -> Pick:
        """Pick one of the valid rows.

        Rows that rest count as not valid. Of the others the policy prefers some; of those, assets that were picked lately are left
        out, the latest first; chance decides by weight. Each call is one turn of the character, with and without a row.

        Parameters
        ----------
        matches : Matches
            An answer of the table, in any version.
        time_s : float, optional
            The time of the game in seconds; for tables in which rows rest for seconds.
        who : int
            The character: its number in `pick_many`.

        Raises
        ------
        ContextError
            The answer is of another table, or out of a pickle; the time is missing.
        PolicyError
            The policy is "unique" and several rows are valid. The turn does not count then.
        """
        require_kind(matches, Matches, "matches", "an answer of the table, from query or live")
        known = self._version(self._compiled_of(matches))
        time = _time(known, time_s)
        slot = self._picked.slot(_character(who))
        compiled = known.choosing.compiled
        if compiled.ways is None and known.choosing.limits is None:
            left = self._one(known, matches, slot, who)
            self._picked.remember_one(slot, None if left.picked is None else known.asset_list[left.picked])
        else:
            left = self._as_many(known, matches, slot, who, time)
            self._keep(known, np.array([slot]), np.array([-1 if left.picked is None else left.picked]), time)
        row = left.picked
        asset = compiled.fallback if row is None else compiled.assets[row]
        if compiled.heard is not None:
            compiled.heard.picked(matches, row, asset)
        return Pick(row, asset, left)

    def pick_many(
        self, many: ManyMatches, *, time_s: float | None = None, who: Sequence[int] | NDArray[np.integer[Any]] | None = None
    ) -> Rows:
        """Pick for many characters at once: what `pick` would give each of them alone.

        Parameters
        ----------
        many : ManyMatches
            What `query_many` of the table gave, in any version; one context for each character.
        time_s : float, optional
            The time of the game in seconds; for tables in which rows rest for seconds.
        who : sequence of int, optional
            The characters, each once. Default: 0, 1, 2 …

        Returns
        -------
        int64 array, shape (N,)
            The row of each; -1 where no row could be picked.

        Raises
        ------
        ContextError
            As `pick`; or a character is given twice.
        PolicyError
            As `pick`, with the first context concerned. No turn counts then.
        """
        require_kind(many, ManyMatches, "many", "the answers of query_many")
        compiled: CompiledData = many.compiled
        self._require(compiled.name)
        known = self._version(compiled)
        time = _time(known, time_s)
        ids = _characters(who, len(many))
        slots = self._picked.slots_of(ids)
        if known.even is not None:
            fresh = known.even.fresh(many.mask, self._picked.recent[slots])
            rows = known.even.drawn(fresh, uniforms(self._seed, ids, self._picked.turns[slots], 0))
        else:
            rows = self._drawn_by_pairs(known, many, ids, slots, time)
        self._keep(known, slots, rows, time)
        return read_only(rows)

    def _drawn_by_pairs(self, known: _Known, many: ManyMatches, ids: Rows, slots: Rows, time_s: float) -> Rows:
        """The row of each of many characters, -1 for none, by the pairs of a context and a row that is valid in it."""
        compiled, masks = many.compiled, many.mask
        rows = np.full(len(many), -1, np.int64)
        costs = many._costs_of_pairs() if compiled.is_soft and "cheapest" in compiled.policies else None
        block = max(1, MOST_PAIRS // max(1, compiled.n_rows))
        for start in range(0, len(many), block):
            contexts, valid = bitmask.places(masks[start : start + block])
            contexts += start
            *_, kept = self._left(known, contexts, valid, slots, costs, time_s)
            of, at = contexts[kept], valid[kept]
            drawn = known.choosing.drawn(of, at, lambda d, c: uniforms(self._seed, ids[c], self._picked.turns[slots[c]], d))
            rows[of[drawn]] = at[drawn]
        return rows

    def forget(self, who: int | Sequence[int] | NDArray[np.integer[Any]] | None = None) -> None:
        """Forget what all characters picked, or some: nothing rests, and nothing was picked lately. Their chance goes on.

        Raises ContextError for what is no number of a character.
        """
        if who is None:
            self._picked.forget(slice(None))
            return
        ids = [_character(who)] if isinstance(who, (int, np.integer)) else _characters(who, None).tolist()
        known = self._picked.slots
        self._picked.forget(np.array([known[one] for one in ids if one in known], np.int64))

    def copy(self) -> Self:
        """A picker that goes on from here on its own."""
        new: Self = object.__new__(type(self))
        new.__dict__.update(vars(self))
        new._picked = copy(self._picked)
        new._known = None
        return new

    __copy__ = copy

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self.copy()

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: not the table."""
        return vars(self) | {"_known": None}

    def __repr__(self) -> str:
        own = f"seed {self._seed}, memory {self._memory}, {plural(self._picked.n, 'character')}"
        return f"<Picker of {in_quotes(self._table)}: {own}>"

    # ---- the version of the table

    def _compiled_of(self, matches: Matches) -> CompiledData:
        table = answering_of(matches)
        self._require(table.name)
        found = table.asked_of
        if not isinstance(found, CompiledData):
            raise ContextError(Fault("the answer comes out of a pickle, without its table.", "an answer of query or live here"))
        return found

    def _require(self, name: str) -> None:
        if name != self._table:
            found = f"the answer is of the table {in_quotes(name)}, and this picker is of {in_quotes(self._table)}."
            raise ContextError(Fault(found, "an answer of its table, in any version"))

    def _version(self, compiled: CompiledData) -> _Known:
        """The table as the picker knows it."""
        known = self._known
        if known is None or known.choosing.compiled is not compiled:
            choosing = compiled.once(Choosing.of)
            limits = np.empty(0, np.int64) if choosing.limits is None else self._picked.limit_columns(choosing.limits)
            assets = self._picked.asset_numbers(compiled.assets)
            known = self._known = _Known(choosing, assets, limits, EvenChoosing.of(choosing, assets, self._memory))
        return known

    # ---- one pick, and many

    def _one(self, known: _Known, matches: Matches, slot: int, who: int) -> Left:
        """A pick in a table without tables inside and without rows that rest, row by row."""
        choosing = known.choosing
        compiled, valid = choosing.compiled, matches.indices.tolist()
        if compiled.policy not in CHANCE:
            if compiled.policy == "unique" and len(valid) > 1:
                raise not_unique(compiled.name, matches.assets)
            return Left(choosing, matches, valid, valid[:1], valid[:1], valid[0] if valid else None)
        ranks, weights = choosing.plain
        may = [row for row in valid if weights[row] > 0.0]
        if len(may) > 1:
            best = max(ranks[row] for row in may)
            may = [row for row in may if ranks[row] == best]
        if len(may) > 1 and compiled.policy == "cheapest" and matches.has_penalties:
            costs = matches.penalties
            least = costs[may].min()
            may = [row for row in may if costs[row] == least]
        fresh = may
        if len(may) > 1 and self._memory:
            recent, assets = self._picked.recent[slot].tolist(), known.asset_list
            ages = [recent.index(assets[row]) if assets[row] in recent else self._memory for row in may]
            oldest = max(ages)
            fresh = [row for row, age in zip(may, ages, strict=True) if age == oldest]
        picked = fresh[0] if fresh else None
        if len(fresh) > 1:
            picked = fresh[_hit([weights[r] for r in fresh], uniform(self._seed, who, int(self._picked.turns[slot]), 0))]
        return Left(choosing, matches, valid, may, fresh, picked)

    def _as_many(self, known: _Known, matches: Matches, slot: int, who: int, time_s: float) -> Left:
        """A pick as one of many."""
        valid = matches.indices
        contexts, slots = np.zeros(len(valid), np.int64), np.array([slot])
        costs = None if not matches.has_penalties else lambda _, rows: layered_penalties(matches)[:, rows]
        awake, may, fresh = self._left(known, contexts, valid, slots, costs, time_s, is_one=True)
        turns = self._picked.turns[slots]
        drawn = known.choosing.drawn(contexts[fresh], valid[fresh], lambda d, _: uniforms(self._seed, np.array([who]), turns, d))
        rows = (valid[places].tolist() for places in (awake, may, fresh))
        awake_rows, may_rows, fresh_rows = rows
        picked = fresh_rows[drawn[0]] if len(drawn) else None
        return Left(known.choosing, matches, awake_rows, may_rows, fresh_rows, picked)

    def _left(
        self,
        known: _Known,
        contexts: Rows,
        rows: Rows,
        slots: Rows,
        costs: CostsOfPairs | None,
        time_s: float,
        is_one: bool = False,
    ) -> tuple[Rows, Rows, Rows]:
        """The places of pairs of a context and a valid row that are left: those that do not rest; of these, those that the policies
        may pick; of these, those that were picked least lately."""
        choosing, limits = known.choosing, known.choosing.limits
        awake = np.arange(len(rows))
        if limits is not None:
            awake = np.flatnonzero(~self._picked.rests(limits, known.limits, slots[contexts], rows, time_s))
        of, at = contexts[awake], rows[awake]
        own = costs(of, at) if costs is not None and choosing.is_cheapest.any() else None
        may = awake[choosing.may_be_picked(of, at, own, is_one)]
        if not (self._memory and choosing.remembers):
            return awake, may, may
        ages = self._picked.ages(slots[contexts[may]], known.assets[rows[may]])
        return awake, may, may[highest(ages, starts_of(contexts[may]))]

    def _keep(self, known: _Known, slots: Rows, rows: Rows, time_s: float) -> None:
        """Remember the picks of characters, each of which is there once: a row, or -1."""
        (found,) = np.nonzero(rows >= 0)
        own, picked, limits = slots[found], rows[found], known.choosing.limits
        self._picked.remember(own, known.assets[picked])
        if limits is not None:
            self._picked.rest(limits, known.limits, own, picked, time_s)
        self._picked.turns[slots] += 1


def _hit(weights: Sequence[float], chance: float) -> int:
    """Which of some weights chance hits."""
    most = max(weights)
    sums = list(accumulate(weight / most for weight in weights))
    return min(bisect_right(sums, chance * sums[-1]), len(weights) - 1)


def _time(known: _Known, time_s: float | None) -> float:
    """The time of the game, where rows rest for seconds."""
    limits = known.choosing.limits
    if time_s is None:
        if limits is not None and limits.needs_time:
            name = known.choosing.compiled.name
            found = f"rows of the table {in_quotes(name)} rest for seconds after they were picked, and time_s is not given."
            raise ContextError(Fault(found, "the time of the game in seconds, such as pick(matches, time_s=12.5)"))
        return 0.0
    return require_real(time_s, "time_s", -MOST_S, MOST_S)


def _character(who: object) -> int:
    number = require_whole(who, "who")
    if not -(2**63) <= number < 2**63:
        raise ContextError(Fault(f"who is {number}.", "a whole number of 64 bits"))
    return number


def _characters(who: object, n: int | None) -> NDArray[np.int64]:
    """The numbers of characters, each once; of as many as there are contexts."""
    if who is None:
        return np.arange(n or 0)
    accepted = "whole numbers, one for each context, each once"
    given = np.asarray(who)
    if given.ndim != 1 or (given.dtype.kind not in "iu" and len(given)):
        raise ContextError(Fault(f"who has shape {given.shape} and type {given.dtype}.", accepted))
    if n is not None and len(given) != n:
        raise ContextError(Fault(f"who names {plural(len(given), 'character')}, for {plural(n, 'context')}.", accepted))
    if given.dtype.kind == "u" and len(given) and int(given.max()) >= 2**63:
        raise ContextError(Fault(f"who holds {given.max()}.", "whole numbers of 64 bits"))
    ids = given.astype(np.int64)
    numbers, counts = np.unique(ids, return_counts=True)
    if len(numbers) < len(ids):
        raise ContextError(Fault(f"who names the character {numbers[counts > 1][0]} more than once.", accepted))
    return ids
