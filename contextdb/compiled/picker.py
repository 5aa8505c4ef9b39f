"""A picker: picks of one character or of many, which it remembers.

It holds a seed and what was picked, by the names of assets and not by rows; of the table it holds the name alone. So it is small in
a pickle, and goes on with any version of its table. Each character has its own memory and its own chance, which depends on the
seed, on the character's number and on how often it has picked: characters that are asked together get what each would get alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, Words, read_only
from contextdb.cells.arguments import require_kind, require_real, require_whole
from contextdb.compiled.batch_columns import CostsOfPairs
from contextdb.compiled.casting.stage import CastMatches
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.data import CompiledData
from contextdb.compiled.many import ManyMatches
from contextdb.compiled.matches import Matches, answering_of
from contextdb.compiled.pick import Left, why
from contextdb.compiled.picked import Picked
from contextdb.core import Choices
from contextdb.errors import ContextError, Fault, Place, PolicyError, in_quotes, plural

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
        state = {name: getattr(self, name) for name in ("row", "asset", "casting", "outputs", "why")}
        return state | {"_left": None}


def left_of(pick: Pick) -> Left | None:
    """What was left of the valid rows when a row was picked, step by step; None of one out of a pickle."""
    return pick._left


@dataclass(frozen=True, eq=False)
class _Known:
    """A version of the table, as a picker knows it: its assets and rows that rest have the picker's numbers."""

    choosing: Choosing
    choices: Choices


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
        self._time_s = -MOST_S
        """The time of the last pick in a table whose rows rest for seconds."""
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
            The time of the game in seconds, which does not go back; for tables in which rows rest for seconds.
        who : int
            The character: its number in `pick_many`.

        Raises
        ------
        ContextError
            The answer is of another table, or out of a pickle; the time is missing, or before that of the last pick.
        PolicyError
            The policy is "unique" and several rows are valid. The turn does not count then.
        """
        require_kind(matches, Matches, "matches", "an answer of the table, from query or live")
        known = self._version(self._compiled_of(matches))
        time = self._time(known, time_s)
        compiled, choosing = known.choosing.compiled, known.choosing
        ids, slots = np.array([_character(who)]), np.array([self._picked.slot(_character(who))])
        rows, stages = np.empty(1, np.int64), np.empty((3, bitmask.n_words(compiled.n_rows)), np.uint64)
        refusal = known.choices.pick(
            matches.mask[None], ids, slots, self._chance_seed, time, self._picked.arrays, choosing.costs_of(matches), rows, stages
        )
        if refusal is not None:
            raise choosing.refused(refusal)
        self._keep(known, slots, rows, time)
        row = None if rows[0] < 0 else int(rows[0])
        asset = compiled.fallback if row is None else compiled.assets[row]
        if (watcher := compiled._watcher) is not None and watcher.feed.is_open:
            watcher.picked(matches, row, asset)
        return Pick(row, asset, Left(choosing, matches, stages))

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
        time = self._time(known, time_s)
        ids = _characters(who, len(many))
        slots = self._picked.slots_of(ids)
        rows = np.empty(len(many), np.int64)
        costs = many._costs_of_pairs() if known.choosing.wants_costs and compiled.is_soft else None
        block = max(1, MOST_PAIRS // max(1, compiled.n_rows))
        for start in range(0, len(many), block):
            part = slice(start, start + block)
            masks = many.mask[part]
            own = None if costs is None else _costs_in(costs, masks, start)
            refusal = known.choices.pick(
                masks, ids[part], slots[part], self._chance_seed, time, self._picked.arrays, own, rows[part], None
            )
            if refusal is not None:
                context = Place(row=start + refusal[0])
                raise PolicyError(*(fault.at(context) for fault in known.choosing.refused(refusal).faults))
        self._keep(known, slots, rows, time)
        return read_only(rows)

    def forget(self, who: int | Sequence[int] | NDArray[np.integer[Any]] | None = None) -> None:
        """Forget what all characters picked, or some: nothing rests, and nothing was picked lately. Their chance goes on.

        Raises ContextError for what is no number of a character.
        """
        if who is None:
            self._picked.forget(slice(None))
            self._time_s = -MOST_S
            return
        ids = [_character(who)] if isinstance(who, (int, np.integer)) else _characters(who, None).tolist()
        known = self._picked.slots
        self._picked.forget(np.array([known[one] for one in ids if one in known], np.int64))

    def digest(self) -> int:
        """A number of 64 bits that is the same for pickers whose characters picked the same.

        Two machines that play in step compare it each frame. It is the sum of `cdb_digest` of C over the characters.
        """
        return self._picked.digest(self._seed % 2**64)

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
        compiled = table.asked_of
        if not isinstance(compiled, CompiledData):
            raise ContextError(Fault("the answer comes out of a pickle, without its table.", "an answer of query or live here"))
        return compiled

    def _require(self, name: str) -> None:
        if name != self._table:
            problem = f"the answer is of the table {in_quotes(name)}, and this picker is of {in_quotes(self._table)}."
            raise ContextError(Fault(problem, "an answer of its table, in any version"))

    def _version(self, compiled: CompiledData) -> _Known:
        """The table as the picker knows it."""
        known = self._known
        if known is None or known.choosing.compiled is not compiled:
            choosing, picked = compiled.once(Choosing.of), self._picked
            columns = np.empty(0, np.int64) if choosing.limits is None else picked.limit_columns(choosing.limits)
            choices = choosing.choices(picked.asset_numbers(compiled.assets), columns, len(picked.limits))
            known = self._known = _Known(choosing, choices)
        return known

    def _time(self, known: _Known, time_s: float | None) -> float:
        """The time of the game, where rows rest for seconds."""
        limits, name = known.choosing.limits, known.choosing.compiled.name
        needs_time = limits is not None and limits.needs_time
        if time_s is None:
            if needs_time:
                problem = f"rows of the table {in_quotes(name)} rest for seconds after they were picked, and time_s is not given."
                raise ContextError(Fault(problem, "the time of the game in seconds, such as pick(matches, time_s=12.5)"))
            return 0.0
        time = require_real(time_s, "time_s", -MOST_S, MOST_S)
        if needs_time and time < self._time_s:
            problem = f"time_s is {time}, and this picker last picked at {self._time_s}: rows would rest until the later time."
            accepted = "a time that does not go back; after a rollback the copy of the picker from then, or forget()"
            raise ContextError(Fault(problem, accepted))
        return time

    def _keep(self, known: _Known, slots: Rows, rows: Rows, time_s: float) -> None:
        """Remember the picks of characters, each of which is there once: a row, or -1."""
        limits = known.choosing.limits
        while n_more := known.choices.remember(slots, rows, time_s, self._picked.arrays):
            self._picked.make_room(n_more)
        self._time_s = time_s if limits is not None and limits.needs_time else self._time_s

    @property
    def _chance_seed(self) -> int:
        """The lowest 64 bits of the seed, with a sign."""
        return (self._seed + 2**63) % 2**64 - 2**63


def _costs_in(costs: CostsOfPairs, masks: Words, first: int) -> NDArray[np.float64]:
    """What the soft cells of the valid rows of some contexts cost, from number `first` on: float64 [D, pairs]."""
    contexts, rows = bitmask.places(masks)
    return np.ascontiguousarray(costs(contexts + first, rows))


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
