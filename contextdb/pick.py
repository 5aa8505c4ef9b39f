"""Pick one asset out of the valid ones, by the table's policy.

    first               the first valid row of the file
    unique              the only valid row; two at once break the table's promise and raise PolicyError
    collect, priority   of the rows with the highest priority one at random, by row weight, and not the asset picked last

Rows of weight 0 are never picked at random, and hold no others back. When no row is left, the table's fallback is the answer.
"""

from __future__ import annotations

import random
from collections import OrderedDict
from typing import TYPE_CHECKING, Protocol
from weakref import WeakKeyDictionary

import numpy as np

from contextdb.bitmask import Rows
from contextdb.errors import Fault, PolicyError, in_quotes, some
from contextdb.matches import Matches

if TYPE_CHECKING:
    from contextdb.compiled import CompiledTable


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
        The asset not to repeat; default: what this generator picked last in this table.

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
    if compiled.policy == "unique" and len(rows) > 1:
        raise PolicyError(
            Fault(
                f"{len(rows)} rows of {in_quotes(compiled.name)} are valid at once: {some(matches.assets)}.",
                'one: the table\'s policy is "unique"',
                rule="not-unique",
            )
        )
    if compiled.policy in ("first", "unique"):
        return int(rows[0])
    return _weighted(compiled, rows, rng, last)


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
    weights = compiled.row_weights[candidates]
    sums = np.cumsum(weights / weights.max())
    at = int(np.searchsorted(sums, source.random() * sums[-1], "right"))
    row: int = candidates[min(at, len(candidates) - 1)]
    memory.remember(source, compiled.assets[row])
    return row
