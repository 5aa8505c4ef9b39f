"""Pick one asset out of the valid ones, by the table's policy.

    first               the first valid row of the file
    unique              the only valid row; two at once break the table's promise and raise PolicyError
    collect, priority   of the rows with the highest priority one at random, by row weight, and not the asset picked last

Rows of weight 0 are never picked at random, and hold no others back. When no row is left, the table's fallback is the answer.

A row that stands for a table is one candidate, with its own priority and weight, as long as that table has a row to give; which of
its rows is played is then picked by that table's own policy, priorities and weights. Its fallback is not asked for.
"""

from __future__ import annotations

import random
from collections import OrderedDict
from typing import TYPE_CHECKING, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Rows
from contextdb.errors import Fault, PolicyError, in_quotes, some
from contextdb.matches import Matches

if TYPE_CHECKING:
    from contextdb.compiled import CompiledTable
    from contextdb.nesting.ways import Ways


MOST_KEPT = 1024
"""How many generators of a kind that cannot be forgotten by itself are remembered."""


class Rng(Protocol):
    """What the pick needs of a random generator: `random.Random` and `numpy.random.Generator` both have it."""

    def random(self) -> float:
        """A number in [0, 1)."""
        ...


class Memory:
    """Which asset each random generator picked last, so that no character repeats itself. Forgets generators that are gone."""

    def __init__(self) -> None:
        self._own = random.Random()
        self._last: WeakKeyDictionary[Rng, str] = WeakKeyDictionary()
        self._kept: OrderedDict[int, tuple[Rng, str]] = OrderedDict()
        """Generators that cannot be referred to weakly, as numpy's, by their id; the last used ones."""

    def __len__(self) -> int:
        return len(self._last) + len(self._kept)

    def rng(self, given: Rng | int | None) -> Rng:
        """The generator to use: the given one, one seeded with the given number, or the table's own."""
        if given is None:
            return self._own
        return random.Random(int(given)) if isinstance(given, (int, np.integer)) else given

    def last(self, rng: Rng) -> str | None:
        """The asset that this generator picked last."""
        if id(rng) in self._kept:
            return self._kept[id(rng)][1]
        try:
            return self._last.get(rng)
        except TypeError:
            return None

    def remember(self, rng: Rng, asset: str) -> None:
        """Keep what this generator picked."""
        try:
            self._last[rng] = asset
        except TypeError:
            self._kept[id(rng)] = rng, asset
            self._kept.move_to_end(id(rng))
            if len(self._kept) > MOST_KEPT:
                self._kept.popitem(last=False)


def pick(compiled: CompiledTable, matches: Matches, rng: Rng | int | None = None, last: str | None = None) -> str | None:
    """One asset of the valid rows.

    Parameters
    ----------
    rng : random.Random, numpy.random.Generator or int, optional
        Where chance comes from; one generator a character, so that each has its own memory. A number seeds a new one: the same
        number, the same pick. Default: the table's own.
    last : str, optional
        The asset not to repeat, with its path where it has one; default: what this generator picked last in this table.

    Returns
    -------
    str or None
        The asset; the table's fallback when no row is valid, None when it has none.

    Raises
    ------
    PolicyError
        The policy is "unique" and several rows are valid.
    """
    row = pick_row(compiled, matches, rng, last)
    return compiled.fallback if row is None else compiled.assets[row]


def pick_row(compiled: CompiledTable, matches: Matches, rng: Rng | int | None = None, last: str | None = None) -> int | None:
    """The row that `pick` picks, or None."""
    rows = matches.indices
    if not len(rows):
        return None
    if compiled.ways is not None:
        return _through_tables(compiled, compiled.ways, rows, rng, last)
    if compiled.policy == "unique" and len(rows) > 1:
        raise _not_unique(compiled.name, matches.assets)
    if compiled.policy in ("first", "unique"):
        return int(rows[0])
    return _weighted(compiled, rows, rng, last)


def _through_tables(compiled: CompiledTable, ways: Ways, rows: Rows, rng: Rng | int | None, last: str | None) -> int | None:
    """The row that is picked where tables stand in tables."""
    possible = _possible(ways, rows[ways.pickable[rows]], 0)
    if not len(possible):
        return None
    memory = compiled.memory
    source = memory.rng(rng)
    last = memory.last(source) if last is None else last
    fresh = possible[[compiled.assets[r] != last for r in possible.tolist()]]
    has_chance = any(table.is_weighted for table in ways.tables)
    row = _drawn(ways, fresh if len(fresh) and has_chance else possible, 0, source)
    if has_chance:
        memory.remember(source, compiled.assets[row])
    return row


def _possible(ways: Ways, rows: Rows, depth: int) -> Rows:
    """Of rows whose ways are the same above a depth, those that the policies may pick."""
    table = ways.table_at(int(rows[0]), depth) if len(rows) else None
    if table is None:
        return rows
    parts = ways.parts(rows, depth)
    if table.policy == "unique" and len(parts) > 1:
        raise _not_unique(table.name, [ways.steps(int(part[0]))[depth].asset for part in parts])
    if table.is_weighted:
        priorities = [int(table.priorities[ways.rows[depth, part[0]]]) for part in parts]
        parts = [part for part, priority in zip(parts, priorities, strict=True) if priority == max(priorities)]
    else:
        parts = parts[:1]
    return np.concatenate([_possible(ways, part, depth + 1) for part in parts])


def _drawn(ways: Ways, rows: Rows, depth: int, source: Rng) -> int:
    """One of the rows that may be picked: at each depth by the weights of that table's rows."""
    table = ways.table_at(int(rows[0]), depth)
    if table is None:
        return int(rows[0])
    parts = ways.parts(rows, depth)
    if len(parts) == 1 and not table.is_weighted:
        return _drawn(ways, parts[0], depth + 1, source)
    weights = table.row_weights[[ways.rows[depth, part[0]] for part in parts]]
    return _drawn(ways, parts[_by_weight(weights, source)], depth + 1, source)


def _by_weight(weights: NDArray[np.float64], source: Rng) -> int:
    """Which of some weights chance hits."""
    sums = np.cumsum(weights / weights.max())
    return min(int(np.searchsorted(sums, source.random() * sums[-1], "right")), len(weights) - 1)


def _not_unique(name: str, assets: list[str]) -> PolicyError:
    found = f"{len(assets)} rows of {in_quotes(name)} are valid at once: {some(assets)}."
    return PolicyError(Fault(found, 'one: the table\'s policy is "unique"', rule="not-unique"))


def _weighted(compiled: CompiledTable, rows: Rows, rng: Rng | int | None, last: str | None) -> int | None:
    rows = rows[compiled.row_weights[rows] > 0.0]
    if not len(rows):
        return None
    priorities = compiled.priorities[rows]
    top = rows[priorities == priorities.max()].tolist()
    memory = compiled.memory
    source = memory.rng(rng)
    last = memory.last(source) if last is None else last
    candidates = [r for r in top if compiled.assets[r] != last] or top
    row: int = candidates[_by_weight(compiled.row_weights[candidates], source)]
    memory.remember(source, compiled.assets[row])
    return row
